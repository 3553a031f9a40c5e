"""Error of an asset against the reference images of a capture, by role and by light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.asset import Asset
from srbf.capture import COVERED, ROLES, Capture, Role
from srbf.direct.choice import Added, Direct
from srbf.errors import InputError
from srbf.methods import directional_responses

PEAK_QUANTILE = 0.999


@dataclass(frozen=True)
class RoleError:
    """Error over all lights of one role: texels of coverage >= 0.5, ambient excluded, both images clamped at 0.

    `rmse` pools images, texels and channels; `relative_rmse` = rmse / rms of the reference; `psnr` is the mean over images of
    20 log10(peak / rmse_image), `psnr_pooled` that of the pooled rmse.
    """

    rmse: float
    relative_rmse: float
    psnr: float
    psnr_pooled: float
    peak: float


class PeakHistogram:
    """Quantiles of non-negative values from a histogram over their float32 bits: exact on half floats, 2^-11 relative on others."""

    SHIFT = 13  # mantissa bits dropped: ten are left, as many as a half float has

    def __init__(self) -> None:
        self._counts: Int[ndarray, " bins"] = np.zeros(1 << (31 - self.SHIFT), np.int64)

    def add(self, values: Float32[ndarray, "*shape"]) -> None:
        """Count `values`, clamped at 0 and rounded to the nearest bin."""
        bits = np.maximum(values, 0).ravel().view(np.uint32)
        self._counts += np.bincount((bits + (1 << (self.SHIFT - 1))) >> self.SHIFT, minlength=len(self._counts))

    def quantile(self, q: float) -> float:
        """Linear interpolation between order statistics, as numpy.quantile has it."""
        cumulative = np.cumsum(self._counts)
        rank = q * (cumulative[-1] - 1)
        bins = [int(np.searchsorted(cumulative, r, side="right")) for r in (np.floor(rank), np.ceil(rank))]
        low, high = (np.array(bins, np.uint32) << self.SHIFT).view(np.float32).astype(np.float64)
        return float(low + (high - low) * (rank - np.floor(rank)))


def evaluate(
    asset: Asset,
    capture: Capture,
    progress: Callable[[int, int], None] = lambda done, total: None,
    direct: Direct = "none",
    roles: Sequence[Role] = ROLES,
) -> dict[str, Any]:
    """Relight every light of `capture` and compare: {role: RoleError as a dict} and `lights`, one {file, role, rmse} each.

    The peak is the 99.9 % quantile of the combined train references (1 for 8-bit sources). A role without lights is left out,
    and all but `roles`. An indirect asset without `direct` light is compared with an indirect capture, unclamped, since the clamp
    comes after the direct light; with it, against the combined answer. InputError where asset and capture cannot be compared.
    """
    reference, peak_source = _references(asset, capture, direct)
    if (asset.width, asset.height) != (capture.width, capture.height):
        raise InputError(f"expected a capture of the asset's {asset.width}x{asset.height} texels, found {capture.width}x{capture.height}")
    covered = capture.coverage().ravel() >= COVERED
    if not covered.any():
        raise InputError(f"expected covered texels in {capture.folder}, found coverage below {COVERED} everywhere")
    samples = int(covered.sum()) * 3
    floor = -np.inf if reference.transport == "indirect" else 0.0
    peaks = PeakHistogram()
    if peak_source is not reference or "train" not in roles:
        for _, block in peak_source.blocks(peak_source.indices("train")):
            peaks.add(block[:, covered])
    squares: dict[int, float] = {}  # sum of squared differences a light
    powers: dict[int, float] = {}  # sum of squared references a light
    total = sum(len(capture.indices(role)) for role in roles)
    with Added(asset, direct) as added:
        for role in roles:
            indices = capture.indices(role)
            for first, block in reference.blocks(indices):
                chosen = indices[first : first + len(block)]
                directions = capture.directions(chosen)
                relit = directional_responses(asset, directions).reshape(block.shape)
                for index, direction, answer, true in zip(chosen, directions, relit, block, strict=True):
                    lit = added.directional(direction[None])
                    if not isinstance(lit, float):
                        answer = answer + lit.reshape(answer.shape)
                    true = np.maximum(true[covered], floor)
                    if role == "train" and peak_source is reference:
                        peaks.add(true)
                    difference = np.maximum(answer[covered], floor) - true
                    squares[index] = float(np.einsum("pc,pc->", difference, difference, dtype=np.float64))
                    powers[index] = float(np.einsum("pc,pc->", true, true, dtype=np.float64))
                    progress(len(squares), total)
    has_train = bool(capture.indices("train"))
    peak = 1.0 if capture.source_bits == 8 or not has_train else peaks.quantile(PEAK_QUANTILE)
    result: dict[str, Any] = {}
    for role in roles:
        indices = capture.indices(role)
        if indices:
            error = _role_error(np.array([squares[i] for i in indices]), np.array([powers[i] for i in indices]), samples, peak)
            result[role] = asdict(error)
    result["lights"] = [
        {"file": light.file, "role": light.role, "rmse": float(np.sqrt(squares[i] / samples))}
        for i, light in enumerate(capture.lights)
        if i in squares
    ]
    return result


def _references(asset: Asset, capture: Capture, direct: Direct) -> tuple[Capture, Capture]:
    """(what the relit images are compared with, what the peak is taken of)."""
    whole = capture.combined() if capture.transport == "combined" or capture.has_direct else capture
    if asset.transport == "combined":
        if direct != "none":
            raise InputError(f"expected an indirect asset for --direct {direct}, found a combined one: it holds the direct light already")
        return capture.combined(), whole
    if direct == "none":
        if capture.transport == "combined":
            raise InputError(
                f"expected an indirect capture for an indirect asset alone, found a combined one at {capture.folder}; "
                "add its direct light: --direct ray or shadow-map"
            )
        return capture, whole
    return capture.combined(), whole


def _role_error(squares: np.ndarray, powers: np.ndarray, samples: int, peak: float) -> RoleError:
    per_image = np.sqrt(squares / samples)
    rmse = float(np.sqrt(squares.sum() / (samples * len(squares))))
    reference = float(np.sqrt(powers.sum() / (samples * len(powers))))
    return RoleError(
        rmse=rmse,
        relative_rmse=rmse / reference if reference > 0 else 0.0,
        psnr=float(np.mean([psnr(peak, e) for e in per_image])),
        psnr_pooled=psnr(peak, rmse),
        peak=peak,
    )


MAX_PSNR = 200.0  # dB: stands for "no difference", where the formula has infinity and JSON has none


def psnr(peak: float, rmse: float) -> float:
    """20 log10(peak / rmse), at most MAX_PSNR."""
    return float(min(MAX_PSNR, 20 * np.log10(max(peak, 1e-30) / max(rmse, 1e-30))))
