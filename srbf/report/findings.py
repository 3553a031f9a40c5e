"""The measurements of a report beyond the evaluation: held-out lights, methods by bytes, spectrum, motion and cluster borders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError, MissingLibraryError
from srbf.evaluation.cluster_borders import ClusterBorders, cluster_borders
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, psnr
from srbf.evaluation.flip import Flip
from srbf.evaluation.held_out import LIGHTS, HeldOutError, Negative, held_out_error, negative
from srbf.evaluation.light_spacing import ShadowSampling, shadow_sampling
from srbf.evaluation.rate_distortion import Score, contest, planes_bound, score_asset, spectrum
from srbf.evaluation.temporal_stability import TEXELS, Motion, dense_reference, sampled_texels, sweep
from srbf.methods import Method, captured_responses
from srbf.report.subject import Subject, far_apart

STEPS = 4  # of `measure`, for progress
WORST_LIGHTS = 4  # shown side by side
MEMORY_BYTES = 256 << 20  # of references of held-out lights, and as much of relit images
MIN_LIGHTS = 8  # held in memory at any size


@dataclass(frozen=True, eq=False)
class HeldOut:
    """References and relit images before the clamp under lights of the subject's role, and their errors.

    `worst` are positions in `lights` with the largest errors, largest first; `flips` are their FLIP maps, empty without flip-evaluator.
    """

    lights: tuple[int, ...]
    references: Float32[ndarray, "S H W 3"]
    relit: Float32[ndarray, "S H W 3"]
    errors: tuple[HeldOutError, ...]
    negative: Negative
    worst: tuple[int, ...]
    metric: Flip
    flips: tuple[ndarray, ...]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Singular values of the sampled train responses, and the pooled PSNR (dB) of the best 0, 1, … planes."""

    values: Float64[ndarray, " r"]
    bound: Float64[ndarray, " r"]
    own: float  # pooled PSNR of the asset on the same responses, dB


@dataclass(frozen=True, eq=False)
class Findings:
    """All measurements; None where the capture does not allow one, with the reason in `missing`."""

    held_out: HeldOut
    texels: int
    scores: tuple[Score, ...]
    own: Score
    spectrum: Spectrum | None
    motion: Motion | None
    sampling: ShadowSampling | None
    borders: ClusterBorders | None
    missing: str


def measure(subject: Subject, methods: Sequence[Method], progress: Callable[[int, int], None] = lambda done, total: None) -> Findings:
    """Measure everything; methods, motion and spectrum use one sample of texels."""
    held_out = measure_held_out(subject)
    progress(1, STEPS)
    picked = sampled_texels(subject.covered, TEXELS)
    sample, asset = subject.capture.load(picked), subject.asset.at(picked)
    peak = subject.evaluation[subject.role]["peak"]
    texels = np.arange(len(picked))
    own = score_asset(asset, sample, subject.role, peak)
    scores: tuple[Score, ...] = ()
    found: Spectrum | None = None
    motion: Motion | None = None
    sampling: ShadowSampling | None = None
    missing = ""
    try:
        sampling = shadow_sampling(sample, texels)
        able = [m for m in methods if getattr(m, "k", getattr(m, "components", 0)) <= len(sample.indices("train"))]
        scores = tuple(contest(sample, able, subject.role, peak))
        progress(2, STEPS)
        found = spectrum_of(sample, asset, peak)
        progress(3, STEPS)
        motion = sweep(asset, dense_reference(sample, texels), texels)
    except InputError as error:
        missing = f"Not measured: {error}."
    progress(STEPS, STEPS)
    borders = cluster_borders(subject.asset, subject.capture, subject.role) if "cluster_index" in subject.asset.tables else None
    return Findings(held_out, len(picked), scores, own, found, motion, sampling, borders, missing)


def spectrum_of(sample: Capture, asset: Asset, peak: float) -> Spectrum:
    """The spectrum, and the asset's pooled PSNR on the same responses before any clamp, comparable with the bound."""
    train = sample.indices("train")
    values = spectrum(sample)
    responses = sample.width * sample.height * 3 * len(train)
    squares = 0.0
    for first, block in sample.blocks(train):
        relit = captured_responses(asset, sample, train[first : first + len(block)]).reshape(block.shape)
        squares += float(((relit - block) ** 2).sum(dtype=np.float64))
    return Spectrum(values, planes_bound(values, responses, peak), psnr(peak, float(np.sqrt(squares / responses))))


def measure_held_out(subject: Subject, own_peak: bool = False) -> HeldOut:
    """Read and relight the lights of the subject's role: all, or, where images are large, the worst and others far apart.

    `own_peak`: PSNR is of the peak of these references, where train lights are of another kind.
    """
    asset, capture = subject.asset, subject.capture
    indices = subject.worst_first(capture.indices(subject.role))
    most = max(MIN_LIGHTS, MEMORY_BYTES // (asset.width * asset.height * 12))
    if len(indices) > most:
        spread = far_apart(capture, indices, most - WORST_LIGHTS)
        indices = indices[:WORST_LIGHTS] + [i for i in spread if i not in indices[:WORST_LIGHTS]]
    indices.sort()
    references = np.stack([capture.image(i) for i in indices])
    relit = captured_responses(asset, capture, indices)
    metric = Flip(float(np.log2(subject.gain)))
    peak = subject.evaluation[subject.role]["peak"]
    if own_peak:
        peak = float(np.quantile(np.maximum(references[:, subject.covered], 0), PEAK_QUANTILE))
    floor = -np.inf if capture.transport == "indirect" else 0.0  # as in the evaluation
    errors = tuple(held_out_error(references, relit, subject.covered, n, peak, metric, floor=floor) for n in LIGHTS)
    worst = tuple(indices.index(i) for i in subject.worst_first(indices)[:WORST_LIGHTS])
    try:
        flips = tuple(metric.error_map(references[i], relit[i], subject.covered) for i in worst)
    except MissingLibraryError:
        flips = ()
    return HeldOut(tuple(indices), references, relit, errors, negative(relit, subject.covered), worst, metric, flips)
