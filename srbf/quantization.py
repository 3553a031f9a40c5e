"""Fitted layers as they are stored: float, half or byte, with the one rule value = stored * scale + bias."""

from __future__ import annotations

import warnings

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.image import HALF_MAX, Encoding
from srbf.parallel import each

HALF_DIM = 2.0**-6  # below it a hundredth of a layer's largest value is already a subnormal half
SUFFIX: dict[Encoding, str] = {"half": "exr", "float": "exr", "uint8": "png"}
BYTE_STEP = 1 / 255
HALF_STEP = 2.0**-11  # relative, half a step either way


def quantize(values: Float32[ndarray, "N H W C"], encoding: Encoding) -> tuple[ndarray, Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """(stored, scale, bias) with values ~ stored * scale + bias; a uint8 counts as byte / 255.

    float and half keep scale 1 and bias 0, unless a half would overflow (then that layer's channel is scaled down, with a warning) or
    is so dim that half floats thin out.
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
                "and lose the picture in any half or 8-bit file; add --ridge, or match --domain to the lights",
                stacklevel=2,
            )

        def halves(i: int) -> None:
            stored[i] = values[i] if (scale[i] == 1).all() else values[i] / scale[i]

        stored = np.empty(values.shape, np.float16)
        each(halves, n)
        return stored, scale, bias
    bias = low
    scale = np.where(high > low, high - low, 1).astype(np.float32)
    stored = np.empty(values.shape, np.uint8)

    def bytes_of(i: int) -> None:
        stored[i] = np.round(np.clip((values[i] - bias[i]) / scale[i], 0, 1) * 255)

    each(bytes_of, n)
    return stored, scale, bias


def rounding_variance(low: Float64[ndarray, "*shape"], high: Float64[ndarray, "*shape"], encoding: Encoding) -> Float64[ndarray, "*shape"]:
    """Variance of what storing loses of values between `low` and `high`: uniform in a byte's step, or at most that of the largest half."""
    if encoding == "float":
        return np.zeros_like(low)
    step = (high - low) * BYTE_STEP if encoding == "uint8" else 2 * HALF_STEP * np.maximum(np.abs(low), np.abs(high))
    return step**2 / 12


def layer_entries(stem: str, encoding: Encoding, scale: Float32[ndarray, "N C"], bias: Float32[ndarray, "N C"]) -> list[dict]:
    """The manifest's list of stored layers: file, encoding, scale, bias."""
    return [
        {
            "file": f"{stem}_{i:02d}.{SUFFIX[encoding]}",
            "encoding": encoding,
            "scale": scale[i].astype(float).tolist(),
            "bias": bias[i].astype(float).tolist(),
        }
        for i in range(len(scale))
    ]


def _extremes(values: Float32[ndarray, "N H W C"]) -> tuple[Float32[ndarray, "N C"], Float32[ndarray, "N C"]]:
    """Least and largest value of every layer and channel; down the rows first, where memory is contiguous."""
    n, channels = len(values), values.shape[3]
    low, high = np.empty((n, channels), np.float32), np.empty((n, channels), np.float32)

    def find(i: int) -> None:
        rows = values[i].reshape(values.shape[1], -1)
        low[i] = rows.min(axis=0).reshape(-1, channels).min(axis=0)
        high[i] = rows.max(axis=0).reshape(-1, channels).max(axis=0)

    each(find, n)
    return low, high
