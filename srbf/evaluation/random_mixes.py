"""Errors on random mixes of a scene's own lights: intensities and colors as a user may set them, sums of the captured images the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, PeakHistogram, psnr, squared_errors
from srbf.evaluation.temporal_stability import sampled_texels
from srbf.light_domain import domain_of_asset
from srbf.light_domain.named import Named
from srbf.lights import NamedLight, triple
from srbf.methods import linear_response

HIGHEST = 2.0  # intensity of a light in a mix; 1 is as designed
MIN_COLOR = 0.25  # of a channel
MOST_TEXELS = 1 << 18  # of larger captures a sample
BLOCK_BYTES = 128 << 20  # of responses of all lights, and of mixes, in memory at a time


@dataclass(frozen=True, eq=False)
class MixErrors:
    """Errors of `count` mixes over covered texels: `pictures` their PSNR (dB), `psnr` the mean, `worst` the lowest.

    `peak` is the 99.9 % quantile of the true mixes, `relative_rmse` the pooled rmse over their rms. `colors` (count, N, 3) are those of the
    lights, in the capture's order.
    """

    count: int
    psnr: float
    worst: float
    relative_rmse: float
    peak: float
    pictures: Float64[ndarray, " count"]
    colors: Float64[ndarray, "count N 3"]

    def as_dict(self) -> dict[str, Any]:
        """`count`, `psnr`, `worst`, `relative_rmse` and `peak` as JSON values."""
        return {name: getattr(self, name) for name in ("count", "psnr", "worst", "relative_rmse", "peak")}


def random_colors(lights: int, count: int, seed: int = 0) -> Float64[ndarray, "count N 3"]:
    """Intensities uniform in 0 to HIGHEST, times colors uniform in MIN_COLOR to 1 per channel."""
    rng = np.random.default_rng(seed)
    intensities = rng.uniform(0, HIGHEST, (count, lights, 1))
    return intensities * rng.uniform(MIN_COLOR, 1, (count, lights, 3))


def mix_errors(asset: Asset, capture: Capture, count: int = 100, seed: int = 0) -> MixErrors:
    """Relight `count` random mixes of all lights of a capture and compare each with the sum of the captured images.

    A mix is one frame of the asset, all lights at once, with their names. Images are clamped at 0 after the sum, except for indirect ones,
    whose clamp follows the addition of direct light.

    Parameters
    ----------
    asset
        Of named lights, of the capture's size in texels.
    capture
        Under the same named lights; its train lights are mixed.
    count
        How many mixes, 1 or more.
    seed
        Of their random numbers.

    Returns
    -------
    MixErrors
        Over texels of coverage >= 0.5, or MOST_TEXELS random ones of them; ambient is left out.

    Raises
    ------
    InputError
        On other lights than named ones, on a name that the asset lacks, on sizes that differ, and on a combined capture of an indirect
        asset.
    """
    reference = mixed_reference(asset, capture)
    if count < 1:
        raise InputError(f"expected 1 or more mixes, found {count}")
    colors = random_colors(len(capture.indices("train")), count, seed)
    floor = -np.inf if reference.transport == "indirect" else 0.0
    covered = sampled_texels(capture.coverage() >= COVERED, MOST_TEXELS)
    peaks = PeakHistogram()
    squares, powers = np.zeros(count), np.zeros(count)
    for true, relit in _blocks(asset, reference, colors, covered):
        peaks.add(true)
        for row in range(count):
            square, power = squared_errors(relit[row], true[row], floor)
            squares[row] += square
            powers[row] += power
    peak = peaks.quantile(PEAK_QUANTILE)
    rmse = np.sqrt(squares / (3 * len(covered)))
    pictures = np.array([psnr(peak, error) for error in rmse])
    relative = float(np.sqrt(squares.sum() / powers.sum())) if powers.sum() > 0 else 0.0
    return MixErrors(count, float(pictures.mean()), float(pictures.min()), relative, peak, pictures, colors)


def mixed_reference(asset: Asset, capture: Capture) -> Capture:
    """The capture whose sums are the truth of an asset alone; InputError as of `mix_errors`."""
    if domain_of_asset(asset.manifest).kind != Named.kind or capture.kind not in Named.captured_kinds:
        raise InputError(
            f"expected an asset and a capture of named lights, found {domain_of_asset(asset.manifest).kind} and {capture.kind} lights"
        )
    if (asset.width, asset.height) != (capture.width, capture.height):
        raise InputError(f"expected a capture of the asset's {asset.width}x{asset.height} texels, found {capture.width}x{capture.height}")
    if asset.transport == "combined":
        return capture.combined()
    if capture.transport == "combined":
        raise InputError(f"expected an indirect capture for an indirect asset, found a combined one at {capture.folder}")
    return capture


def mixed_images(
    asset: Asset, capture: Capture, colors: Float64[ndarray, "m N 3"]
) -> tuple[Float32[ndarray, "m H W 3"], Float32[ndarray, "m H W 3"]]:
    """(the true mixes, the relit ones), before the clamp, of all texels; for a few pictures to show."""
    reference = mixed_reference(asset, capture)
    texels = np.arange(capture.width * capture.height)
    shape = (len(colors), capture.height, capture.width, 3)
    parts = list(_blocks(asset, reference, colors, texels))
    true, relit = (np.concatenate([part[k] for part in parts], axis=1).reshape(shape) for k in (0, 1))
    return true, relit


def _blocks(
    asset: Asset, reference: Capture, colors: Float64[ndarray, "m N 3"], texels: Int[ndarray, " n"]
) -> Iterator[tuple[Float32[ndarray, "m b 3"], Float32[ndarray, "m b 3"]]]:
    """(true mixes, relit ones) of blocks of `texels`."""
    train = reference.indices("train")
    names = [str(reference.lights[i].name) for i in train]
    frames = [[NamedLight(name, triple(color)) for name, color in zip(names, mix, strict=True)] for mix in colors]
    size = max(1, BLOCK_BYTES // (12 * (len(train) + 2 * len(colors))))
    weights = colors.astype(np.float32)
    for start in range(0, len(texels), size):
        block = texels[start : start + size]
        responses = reference.sample(train, block)  # (b, N, 3)
        true = np.einsum("bnc,mnc->mbc", responses, weights, optimize=True)
        picked = asset.at(block)
        relit = np.stack([linear_response(picked, frame)[0] for frame in frames])
        yield np.ascontiguousarray(true), relit
