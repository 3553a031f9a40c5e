"""Storage of fitted layers as float, half or byte, with one rule: value = stored * scale + bias."""

from __future__ import annotations

import warnings

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.compute.threads import each
from srbf.io.image import HALF_MAX, Encoding

HALF_DIM = 2.0**-6  # of a layer's largest value; below, a hundredth of it is a subnormal half
VALUE_BATCH = 1 << 12
RANGED_VALUES = 1 << 16  # of a layer, sampled to find its range
CLIPPED = (0.0, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2)  # shares of values at either end that may be clipped
MIN_VISIBLE = 1e-4  # of a function's rms, the least weight of a function in sums
BYTE_STEP = 1 / 255
HALF_STEP = 2.0**-11  # relative, half a step either way


def quantize(values: Float32[ndarray, "N H W C"], encoding: Encoding) -> tuple[ndarray, Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """(stored, scale, bias) with values ~ stored * scale + bias; a uint8 counts as byte / 255.

    float and half keep scale 1 and bias 0, unless a half would overflow (then that layer's channel is scaled down, with a warning) or
    is so small that half floats lose precision.
    """
    n, channels = len(values), values.shape[3]
    scale, bias = np.ones((n, channels), np.float32), np.zeros((n, channels), np.float32)
    if encoding == "float":
        return values, scale, bias
    low, high = _extremes(values)
    if encoding == "half":
        largest = np.maximum(-low, high)  # (N, C)
        dim = (largest > 0) & (largest < HALF_DIM)
        scale[dim] = largest[dim]
        too_large = largest > HALF_MAX
        if too_large.any():
            scale[too_large] = (largest[too_large] / (HALF_MAX * 0.999)).astype(np.float32)
            warnings.warn(
                f"coefficients reach {largest.max():.3g}, past half float's {HALF_MAX:.0f}: scaled, but such maps cancel each other "
                "and lose precision in any half or 8-bit file; add a `ridge`, or match the `domain` to the lights",
                stacklevel=2,
            )

        def halves(i: int) -> None:
            stored[i] = values[i] if (scale[i] == 1).all() else values[i] / scale[i]

        stored = np.empty(values.shape, np.float16)
        each(halves, n)
        return stored, scale, bias
    bias = low
    scale = np.where(high > low, high - low, 1).astype(np.float32)
    return round_alone(values, scale, bias), scale, bias


def round_alone(values: Float32[ndarray, "N H W C"], scale: Float32[ndarray, "N C"], bias: Float32[ndarray, "N C"]) -> ndarray:
    """The nearest bytes, (N, H, W, C), in given ranges; 0 where a scale is 0."""
    stored = np.empty(values.shape, np.uint8)

    def bytes_of(i: int) -> None:
        used = np.where(scale[i] != 0, scale[i], 1)
        stored[i] = np.round(np.clip((values[i] - bias[i]) / used, 0, 1) * 255)

    each(bytes_of, len(values))
    return stored


def quantize_together(
    values: Float32[ndarray, "K H W C"], functions: Float64[ndarray, "M K"]
) -> tuple[ndarray, Float32[ndarray, "K C"], Float32[ndarray, "K C"]]:
    """`quantize` to bytes with error feedback, for layers that are visible only through sums weighted by overlapping `functions`.

    The layers still to be rounded compensate for the rounding errors of the others: Babai's nearest plane in the lattice of bytes under
    the metric of the functions [Babai1986]. With functions = Q R, the error of layer k is at most half a step times |R_kk|, instead of
    half a step times its length, which is many times larger for overlapping Gaussians. Cost: K^2 / 2 multiplications per value.
    """
    scale, bias = ranges_together(values, functions)
    return round_together(values, functions, scale, bias), scale, bias


def ranges_together(
    values: Float32[ndarray, "K H W C"], functions: Float64[ndarray, "M K"]
) -> tuple[Float32[ndarray, "K C"], Float32[ndarray, "K C"]]:
    """(scale, bias) of every layer and channel with the least loss under rounding with error feedback."""
    upper = metric(functions)
    low, high = _ranges(values, np.diag(upper) ** 2, (upper**2).sum(axis=0))
    return np.where(high > low, (high - low) / 255, 1).astype(np.float32) * np.float32(255), low


def round_together(
    values: Float32[ndarray, "K H W C"],
    functions: Float64[ndarray, "M K"],
    scale: Float32[ndarray, "K C"],
    bias: Float32[ndarray, "K C"],
) -> ndarray:
    """Bytes of layers in given ranges; each layer compensates for the errors of those after it."""
    k, channels = len(values), values.shape[3]
    upper = metric(functions)
    low, step = bias, scale / np.float32(255)
    passed_on = np.triu(upper / np.diag(upper)[:, None], 1).astype(np.float32)  # (K, K): error of layer j passed to layer k < j
    flat = values.reshape(k, -1, channels)
    stored = np.empty(flat.shape, np.uint8)

    def work(task: int) -> None:
        part = slice(task * VALUE_BATCH, (task + 1) * VALUE_BATCH)
        errors = np.zeros((k, len(flat[0, part]), channels), np.float32)
        for i in reversed(range(k)):
            wanted = flat[i, part] + np.tensordot(passed_on[i, i + 1 :], errors[i + 1 :], 1)
            stored[i, part] = np.clip(np.round((wanted - low[i]) / step[i]), 0, 255)
            errors[i] = flat[i, part] - (stored[i, part] * step[i] + low[i])

    each(work, -(-flat.shape[1] // VALUE_BATCH))
    return stored.reshape(values.shape)


def _ranges(
    values: Float32[ndarray, "K H W C"], rounding: Float64[ndarray, " K"], clipping: Float64[ndarray, " K"]
) -> tuple[Float32[ndarray, "K C"], Float32[ndarray, "K C"]]:
    """The range of every layer and channel with the least loss: clipping a few outliers makes the steps finer.

    `rounding` and `clipping` are the visible shares of squared errors: other layers compensate for rounding, not for clipping.
    """
    k, channels = len(values), values.shape[3]
    low, high = np.empty((k, channels), np.float32), np.empty((k, channels), np.float32)
    every = max(1, values.shape[1] * values.shape[2] // RANGED_VALUES)

    def find(i: int) -> None:
        for c in range(channels):
            some = np.sort(values[i, :, :, c].ravel()[::every])
            least = np.inf
            for share in CLIPPED:
                cut = int(share * len(some))
                bottom, top = some[cut], some[len(some) - 1 - cut]
                lost = np.square(np.clip(some, bottom, top) - some).mean() * clipping[i]
                lost += rounding[i] * ((top - bottom) * BYTE_STEP) ** 2 / 12
                if lost < least:
                    least, low[i, c], high[i, c] = lost, bottom, top

    each(find, k)
    exact = _extremes(values)
    for found, extreme, share in ((low, exact[0], np.minimum), (high, exact[1], np.maximum)):
        unclipped = found == share(found, extreme)  # the sample's extreme represents that of all values
        found[unclipped] = extreme[unclipped]
    return low, high


def metric(functions: Float64[ndarray, "M K"]) -> Float64[ndarray, "K K"]:
    """Upper triangle R with R^T R the functions' mean products, plus a small multiple of the identity that keeps R_kk above 0."""
    k = functions.shape[1]
    faint = MIN_VISIBLE * np.sqrt((functions**2).mean()) * np.eye(k)
    return np.asarray(np.linalg.qr(np.concatenate([functions / np.sqrt(len(functions)), faint]), mode="r"))


def rounding_variance(low: Float64[ndarray, "*shape"], high: Float64[ndarray, "*shape"], encoding: Encoding) -> Float64[ndarray, "*shape"]:
    """Variance of the storage error of values from `low` to `high`: uniform within a byte's step, or that of the largest half."""
    if encoding == "float":
        return np.zeros_like(low)
    step = (high - low) * BYTE_STEP if encoding == "uint8" else 2 * HALF_STEP * np.maximum(np.abs(low), np.abs(high))
    return step**2 / 12


def _extremes(values: Float32[ndarray, "N H W C"]) -> tuple[Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """Least and largest value of every layer and channel; rows first, since memory is contiguous."""
    n, channels = len(values), values.shape[3]
    low, high = np.empty((n, channels), np.float32), np.empty((n, channels), np.float32)

    def find(i: int) -> None:
        rows = values[i].reshape(values.shape[1], -1)
        low[i] = rows.min(axis=0).reshape(-1, channels).min(axis=0)
        high[i] = rows.max(axis=0).reshape(-1, channels).max(axis=0)

    each(find, n)
    return low, high
