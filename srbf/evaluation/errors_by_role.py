"""Error of an asset against the reference images of a capture, by role and by light."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from threading import Lock
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import COVERED, Capture, CombinedCapture
from srbf.captured_light import ROLES, Role
from srbf.compute.threads import each, one_blas_thread
from srbf.errors import InputError
from srbf.io.float16 import finite_to_float32
from srbf.light_domain import light_of
from srbf.methods import captured_responses
from srbf.relighting.direct_light import Added, Direct

PEAK_QUANTILE = 0.999
MEMORY_BYTES = 192 << 20  # of half responses of all covered texels to all train lights: 256² under 500 lights
SAMPLE_TEXELS = 1 << 15  # of larger captures, or fewer under very many lights
FLOAT32_SUM = 1 << 14  # values whose squares are summed in float32
LIGHT_BATCH = 16  # lights relit by one thread


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
    """Quantiles of non-negative values from a histogram over their float32 bits: exact on half floats, 2^-11 relative on others.

    With `total`, the number of values to come, and `q`, the requested quantile, it skips values that cannot affect the result: those
    below a bin that enough values have reached. The result is the same, and most of an image is soon skipped.
    """

    SHIFT = 13  # mantissa bits dropped: ten are left, as many as a half float has

    def __init__(self, total: int | None = None, q: float = 0.0) -> None:
        self._counts: Int[ndarray, " bins"] = np.zeros(1 << (31 - self.SHIFT), np.int64)
        self._wanted = None if total is None else total - int(np.floor(q * (total - 1)))  # the rank of the quantile from the top
        self._floor = 0  # the first bin that can affect the result
        self._lock = Lock()

    def add(self, values: Float[ndarray, "*shape"], rows: Bool[ndarray, " P"] | None = None) -> None:
        """Count finite `values`, float32 or float16, of `rows` if given, clamped at 0 and rounded to the nearest bin; from any thread."""
        count = values.size if rows is None else int(np.count_nonzero(rows)) * (values.size // len(rows))
        if self._floor:
            chosen = self._may_matter(values)
            values = values[chosen if rows is None else chosen & rows[:, None]]
        elif rows is not None:
            values = values[rows]
        values = values.ravel()
        if values.dtype == np.float16:
            values = finite_to_float32(values, np.empty(values.shape, np.float32))
        bits = np.maximum(values, 0).view(np.uint32)
        bins = (bits + (1 << (self.SHIFT - 1))) >> self.SHIFT
        first = int(bins.min()) if len(bins) else 0
        counts = np.bincount(bins - np.uint32(first))
        with self._lock:
            self._counts[first : first + len(counts)] += counts
            self._counts[0] += count - len(values)
            if self._wanted is not None:
                above = np.cumsum(self._counts[: self._floor : -1])  # from the last bin down to the floor's next
                if above[-1] >= self._wanted:
                    self._floor = len(self._counts) - 1 - int(np.searchsorted(above, self._wanted))

    def _may_matter(self, values: ndarray) -> ndarray:
        """Mask of the values in or above the floor's bin, or the half float below it."""
        least = np.array([(self._floor - 1) << self.SHIFT], np.uint32).view(np.float32)
        if values.dtype == np.float16:  # positive halves are in the order of their bits, negative ones below
            return values.view(np.int16) >= least.astype(np.float16).view(np.int16)
        return values >= least

    def quantile(self, q: float) -> float:
        """Linear interpolation between order statistics, as in numpy.quantile."""
        cumulative = np.cumsum(self._counts)
        rank = q * (cumulative[-1] - 1)
        bins = [int(np.searchsorted(cumulative, r, side="right")) for r in (np.floor(rank), np.ceil(rank))]
        low, high = (np.array(bins, np.uint32) << self.SHIFT).view(np.float32).astype(np.float64)
        return float(low + (high - low) * (rank - np.floor(rank)))


class TrainErrorAccumulator:
    """Accumulates the error of the train lights while a fit streams their images, so that they are read once.

    `look` is the image callback of a method's `encode`. It counts every covered value for the peak (exact) and keeps the responses of all
    covered texels if they fit MEMORY_BYTES, otherwise of SAMPLE_TEXELS, one at random from each of equal runs of them.
    InputError if nothing is covered.
    """

    def __init__(self, capture: Capture) -> None:
        self.lights = capture.indices("train")
        covered = _covered(capture)
        self._rows = None if covered.all() else covered
        texels = np.flatnonzero(covered)
        held = max(1, MEMORY_BYTES // (6 * max(1, len(self.lights))))
        self.exact = len(texels) <= held
        if not self.exact:
            count = min(held, SAMPLE_TEXELS)
            runs = np.arange(count + 1) * len(texels) // count
            texels = texels[(runs[:-1] + np.random.default_rng(0).random(count) * np.diff(runs)).astype(np.int64)]
        self.texels: Int[ndarray, " n"] = texels
        self.peaks = PeakHistogram(int(covered.sum()) * 3 * len(self.lights), PEAK_QUANTILE)
        self._responses: dict[int, ndarray] = {}
        self._combined = capture.combined() if capture.transport == "indirect" and capture.has_direct else None

    def look(self, row: int, image: Float[ndarray, "P 3"]) -> None:
        """Add the image of train light `row`, as stored."""
        self._responses[row] = image[self.texels]
        whole = image if self._combined is None else self._combined.image(self.lights[row]).reshape(-1, 3)
        self.peaks.add(whole, self._rows)

    def squares(self, asset: Asset, capture: Capture, floor: float = 0.0) -> tuple[Float64[ndarray, " L"], Float64[ndarray, " L"]]:
        """Sums of squared differences and of squared references, per light, over `texels`, both clamped at `floor`."""
        picked = asset.at(self.texels)
        sums = np.empty((2, len(self.lights)))

        def compare(task: int) -> None:
            rows = range(task * LIGHT_BATCH, min((task + 1) * LIGHT_BATCH, len(self.lights)))
            relit = captured_responses(picked, capture, [self.lights[row] for row in rows])[:, 0]  # (b, n, 3)
            for row, response in zip(rows, relit, strict=True):
                reference = self._responses[row]
                if reference.dtype == np.float16:
                    reference = finite_to_float32(reference, np.empty(reference.shape, np.float32))
                sums[:, row] = squared_errors(response, reference, floor)

        with one_blas_thread():
            each(compare, -(-len(self.lights) // LIGHT_BATCH))
        return sums[0], sums[1]


def evaluate(
    asset: Asset,
    capture: Capture,
    progress: Callable[[int, int], None] = lambda done, total: None,
    direct: Direct = "none",
    roles: Sequence[Role] = ROLES,
    watch: TrainErrorAccumulator | None = None,
) -> dict[str, Any]:
    """Relight every light of a capture and compare with its images: the error by role and by light.

    Parameters
    ----------
    asset
        Of the capture's size in texels.
    capture
        The references. A capture under point lights measures the approximation by directional lights; all its lights are held out.
    progress
        Called with (lights done, lights in all).
    direct
        How direct light is added to an indirect asset. With `none` it is compared with an indirect capture, unclamped, since the clamp
        follows the addition of direct light; with `ray` or `shadow-map`, with the combined response.
    roles
        Which of `train`, `validation` and `holdout` to evaluate.
    watch
        Has accumulated the train images during the fit, so that they are not read again. Peak, validation and holdout are the same; the
        train error is that of the texels it kept, whose number is in `texels` if they are not all.

    Returns
    -------
    dict
        By role a `RoleError` as a dict: `rmse` and `peak` in the capture's unit, `psnr` and `psnr_pooled` in dB; with `noise`, the
        relative RMSE that the references have by their few samples, about, where the bake measured it of all of them. `lights` lists a
        {file, role, rmse, relative_rmse} per light. A role without lights is left out, and so are roles not in `roles`. The peak is the
        99.9 % quantile of the combined train references (of patches, of the point lights that test them), 1 for 8-bit sources.

    Raises
    ------
    InputError
        On sizes that differ, on a capture without covered texels, on `direct` light of a combined asset, and on an indirect asset without
        `direct` light beside a combined capture.

    Examples
    --------
    >>> errors = evaluate(asset, capture)
    >>> sorted(errors)
    ['holdout', 'lights', 'train']
    >>> errors["holdout"]["psnr"] > 20  # dB
    True
    """
    if (
        direct != "none" and capture.transport == "indirect" and capture.kind != "directional"
    ):  # train lights inside the scene have no direct images
        roles = [role for role in roles if capture.indices(role) and capture.has_direct_of([role])] or roles
    reference, peak_source = _references(asset, capture, direct, roles)
    if (asset.width, asset.height) != (capture.width, capture.height):
        raise InputError(f"expected a capture of the asset's {asset.width}x{asset.height} texels, found {capture.width}x{capture.height}")
    covered = _covered(capture)
    samples = dict.fromkeys(ROLES, int(covered.sum()) * 3)
    floor = -np.inf if reference.transport == "indirect" else 0.0
    peak_lights = lights_of_peak(peak_source)
    counted = peak_lights == peak_source.indices("train")
    peaks = PeakHistogram() if watch is None or not counted else watch.peaks
    if not counted or (watch is None and (peak_source is not reference or "train" not in roles)):
        for _, block in peak_source.blocks(peak_lights):
            peaks.add(block[:, covered])
    squares: dict[int, float] = {}  # sum of squared differences per light
    powers: dict[int, float] = {}  # sum of squared references per light
    if watch is not None:
        samples["train"] = len(watch.texels) * 3
        for light, square, power in zip(watch.lights, *watch.squares(asset, capture, floor), strict=True):
            squares[light], powers[light] = float(square), float(power)
    total = sum(len(capture.indices(role)) for role in roles)
    with Added(asset, direct) as added:
        for role in roles:
            indices = capture.indices(role) if role != "train" or watch is None else []
            for first, block in reference.blocks(indices):
                chosen = indices[first : first + len(block)]
                for index, response, true in zip(chosen, _relit(asset, capture, chosen, added), block, strict=True):
                    true = true[covered]
                    if role == "train" and counted and peak_source is reference:
                        peaks.add(true)
                    squares[index], powers[index] = squared_errors(response[covered], true, floor)
                    progress(len(squares), total)
    peak = 1.0 if capture.source_bits == 8 or not peak_lights else peaks.quantile(PEAK_QUANTILE)
    result: dict[str, Any] = {}
    for role in roles:
        indices = capture.indices(role)
        if indices:
            error = role_error(np.array([squares[i] for i in indices]), np.array([powers[i] for i in indices]), samples[role], peak)
            result[role] = asdict(error) | noise_of([(capture.lights[i].noise, powers[i]) for i in indices])
    if watch is not None and not watch.exact:
        result["train"]["texels"] = len(watch.texels)
    result["lights"] = [
        {
            "file": light.file,
            "role": light.role,
            "rmse": float(np.sqrt(squares[i] / samples[light.role])),
            "relative_rmse": float(np.sqrt(squares[i] / powers[i])) if powers[i] > 0 else 0.0,
        }
        for i, light in enumerate(capture.lights)
        if i in squares
    ]
    return result


def lights_of_peak(capture: Capture) -> list[int]:
    """The lights whose images define the peak: the train lights. Patches are no lights, and train lights inside a scene have no direct
    images: the point lights that test them stand in."""
    train = capture.indices("train")
    lacking = isinstance(capture, CombinedCapture) and any(capture.lights[i].direct is None for i in train)
    if capture.kind not in ("patch", "surfel", "pool") and not lacking:
        return train
    return [*capture.indices("validation"), *capture.indices("holdout")] or train


def _relit(asset: Asset, capture: Capture, lights: Sequence[int], added: Added) -> Iterator[Float32[ndarray, "P 3"]]:
    """The asset's response to each of a capture's lights, before the clamp, with its direct light.

    A captured point light is relit as a point light, inverse-square and with unit irradiance at 1 m.
    """
    for index, response in zip(lights, captured_responses(asset, capture, lights), strict=True):
        light = light_of(capture.lights[index])
        direct = None if light is None else added.response([light])
        yield (response if direct is None else response + direct).reshape(-1, 3)


def _covered(capture: Capture) -> Bool[ndarray, " P"]:
    covered = capture.coverage().ravel() >= COVERED
    if not covered.any():
        raise InputError(f"expected covered texels in {capture.folder}, found coverage below {COVERED} everywhere")
    return covered


def squared_errors(response: Float32[ndarray, "n 3"], reference: Float32[ndarray, "n 3"], floor: float = 0.0) -> tuple[float, float]:
    """Sums of squared differences and of squared references, both images clamped at `floor`."""
    reference = np.maximum(reference, np.float32(floor))
    difference = np.maximum(response, np.float32(floor)) - reference
    return _energy(difference), _energy(reference)


def _energy(values: Float32[ndarray, "n 3"]) -> float:
    """Sum of squares: float32 within FLOAT32_SUM values, float64 over them."""
    flat = values.ravel()
    return sum(float(np.dot(piece, piece)) for piece in (flat[start : start + FLOAT32_SUM] for start in range(0, len(flat), FLOAT32_SUM)))


def _references(asset: Asset, capture: Capture, direct: Direct, roles: Sequence[Role]) -> tuple[Capture, Capture]:
    """(the capture to compare with, the capture that defines the peak)."""
    if asset.transport == "combined":
        if direct != "none":
            raise InputError(f"expected an indirect asset for `direct={direct}`, found a combined one: it holds the direct light already")
        combined = capture.combined()
        return combined, combined
    whole = capture.combined() if capture.transport == "combined" or capture.has_direct else capture  # patches have no direct light
    if direct == "none":
        if capture.transport == "combined":
            raise InputError(
                f"expected an indirect capture for an indirect asset alone, found a combined one at {capture.folder}; "
                "add its direct light: `direct=ray` or shadow-map"
            )
        return capture, whole
    return capture.combined(roles), whole if capture.has_direct else capture.combined(roles)


def role_error(squares: Float64[ndarray, " L"], powers: Float64[ndarray, " L"], samples: int, peak: float) -> RoleError:
    """RoleError from sums of squared differences and of squared references, per light, each over `samples` values."""
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


def noise_of(lights: Sequence[tuple[float | None, float]]) -> dict[str, float]:
    """{noise}, relative and pooled, of lights whose (relative noise, sum of squares) are known; {} where the noise of one is not."""
    known = [(noise, power) for noise, power in lights if noise is not None]
    total = sum(power for _, power in known)
    if len(known) < len(lights) or not total > 0:
        return {}
    return {"noise": float(np.sqrt(sum(noise**2 * power for noise, power in known) / total))}


MAX_PSNR = 200.0  # dB, of equal images: the formula has infinity, which JSON lacks


def psnr(peak: float, rmse: float) -> float:
    """20 log10(peak / rmse), at most MAX_PSNR."""
    return float(min(MAX_PSNR, 20 * np.log10(max(peak, 1e-30) / max(rmse, 1e-30))))
