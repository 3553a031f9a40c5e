"""What a report measures beyond the evaluation: unseen light, methods by bytes, spectrum and motion, each once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError, MissingLibraryError
from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.flip import Flip
from srbf.evaluation.held_out import LIGHTS, Negative, UnseenError, negative, unseen_error
from srbf.evaluation.light_spacing import ShadowSampling, shadow_sampling
from srbf.evaluation.rate_distortion import Score, contest, planes_bound, score_asset, spectrum
from srbf.evaluation.temporal_stability import TEXELS, Motion, dense_reference, sampled_texels, sweep
from srbf.light_domain import domain_of_capture
from srbf.methods import Method
from srbf.methods import responses as asset_responses
from srbf.report.subject import Subject
from srbf.sphere import farthest_points

STEPS = 4  # of `measure`, for progress
WORST = 4  # directions shown side by side
HELD_BYTES = 256 << 20  # references of unseen lights in memory, and as much of relit pictures
FEWEST = 8  # of them, however large they are


@dataclass(frozen=True, eq=False)
class Unseen:
    """References and pictures relit before the clamp under lights of the subject's role, and what they come to.

    `worst` are positions among `lights` by PSNR, lowest first; `flip` their mean FLIP and its maps, empty without flip-evaluator.
    """

    lights: tuple[int, ...]
    references: Float32[ndarray, "S H W 3"]
    relit: Float32[ndarray, "S H W 3"]
    errors: tuple[UnseenError, ...]
    negative: Negative
    worst: tuple[int, ...]
    judge: Flip
    flips: tuple[ndarray, ...]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Singular values of the sampled train answers, and what the best 0, 1, … planes would leave (PSNR, dB, pooled)."""

    values: Float64[ndarray, " r"]
    bound: Float64[ndarray, " r"]
    own: float  # PSNR, pooled, of the asset on the same answers


@dataclass(frozen=True, eq=False)
class Findings:
    """All of it; what a capture does not allow is None, and `missing` says why."""

    unseen: Unseen
    texels: int
    scores: tuple[Score, ...]
    own: Score
    spectrum: Spectrum | None
    motion: Motion | None
    sampling: ShadowSampling | None
    missing: str


def measure(subject: Subject, methods: Sequence[Method], progress: Callable[[int, int], None] = lambda done, total: None) -> Findings:
    """Measure everything; methods are fitted to a sample of texels, which the sweep and the spectrum look at too."""
    unseen = look_at_unseen(subject)
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
    return Findings(unseen, len(picked), scores, own, found, motion, sampling, missing)


def spectrum_of(sample: Capture, asset: Asset, peak: float) -> Spectrum:
    """The spectrum, and the asset's own pooled PSNR on the same answers before any clamp, as the planes' bound has it."""
    train = sample.indices("train")
    values = spectrum(sample)
    responses = sample.width * sample.height * 3 * len(train)
    coordinates = domain_of_capture(sample).captured(sample, train)
    squares = 0.0
    for first, block in sample.blocks(train):
        relit = asset_responses(asset, coordinates[first : first + len(block)]).reshape(block.shape)
        squares += float(((relit - block) ** 2).sum(dtype=np.float64))
    return Spectrum(values, planes_bound(values, responses, peak), psnr(peak, float(np.sqrt(squares / responses))))


def look_at_unseen(subject: Subject) -> Unseen:
    """Read and relight the lights of the least seen role there is: all, or the worst and others far apart where they are large."""
    asset, capture = subject.asset, subject.capture
    indices = sorted(capture.indices(subject.role), key=subject.psnr_of)
    most = max(FEWEST, HELD_BYTES // (asset.width * asset.height * 12))
    if len(indices) > most:
        spread = [indices[i] for i in farthest_points(domain_of_capture(capture).captured(capture, indices), most - WORST)]
        indices = indices[:WORST] + [i for i in spread if i not in indices[:WORST]]
    indices.sort()
    references = np.stack([capture.image(i) for i in indices])
    relit = asset_responses(asset, domain_of_capture(capture).captured(capture, indices))
    judge = Flip(float(np.log2(subject.gain)))
    peak = subject.evaluation[subject.role]["peak"]
    floor = -np.inf if capture.transport == "indirect" else 0.0  # as the evaluation has it
    errors = tuple(unseen_error(references, relit, subject.covered, n, peak, judge, floor=floor) for n in LIGHTS)
    worst = tuple(sorted(range(len(indices)), key=lambda i: subject.psnr_of(indices[i]))[:WORST])
    try:
        flips = tuple(judge.error_map(references[i], relit[i], subject.covered) for i in worst)
    except MissingLibraryError:
        flips = ()
    return Unseen(tuple(indices), references, relit, errors, negative(relit, subject.covered), worst, judge, flips)
