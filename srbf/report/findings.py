"""What a report measures beyond the evaluation: unseen light, methods by bytes, spectrum and motion, each once."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.capture import Role
from srbf.errors import InputError, MissingLibraryError
from srbf.flip import Flip
from srbf.methods import directional_responses
from srbf.motion import Motion, dense_reference, sweep
from srbf.quality import Method, Score, TexelSample, contest, planes_bound, score_asset, spectrum, texel_sample
from srbf.report.subject import Subject, farthest_points
from srbf.shadow_sampling import ShadowSampling, shadow_sampling
from srbf.unseen import LIGHTS, Negative, UnseenError, negative, unseen_error

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
    progress(1, 4)
    with texel_sample(subject.capture) as sample:
        peak = subject.evaluation[subject.role]["peak"]
        asset = subject.asset.at(sample.texels)
        own = score_asset(asset, sample.capture, subject.role, peak)
        scores: tuple[Score, ...] = ()
        found: Spectrum | None = None
        motion: Motion | None = None
        sampling: ShadowSampling | None = None
        missing = ""
        try:
            sampling = shadow_sampling(sample.capture, np.arange(len(sample.texels)))
            scores = compare(sample, methods, subject.role, peak)
            progress(2, 4)
            found = spectrum_of(sample, score_asset(asset, sample.capture, "train", peak).relative_rmse, peak)
            progress(3, 4)
            texels = np.arange(len(sample.texels))
            motion = sweep(asset, dense_reference(sample.capture, texels), texels)
        except InputError as error:
            missing = f"Not measured: {error}."
        progress(4, 4)
        return Findings(unseen, len(sample.texels), scores, own, found, motion, sampling, missing)


def compare(sample: TexelSample, methods: Sequence[Method], role: Role, peak: float) -> tuple[Score, ...]:
    """The contest of the methods that this capture has enough lights for; what their settings warn of is not this asset's."""
    able = [method for method in methods if getattr(method, "k", 0) <= len(sample.capture.indices("train"))]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return tuple(contest(sample, able, role, peak))


def spectrum_of(sample: TexelSample, relative_rmse: float, peak: float) -> Spectrum:
    """The spectrum, and the asset's own pooled PSNR from its relative error on the same answers."""
    train = sample.capture.indices("train")
    values = spectrum(sample)
    answers = len(sample.texels) * 3 * len(train)
    power = sum(float((np.maximum(block, 0) ** 2).sum(dtype=np.float64)) for _, block in sample.capture.blocks(train))
    own = 20 * np.log10(max(peak, 1e-30) / max(relative_rmse * np.sqrt(power / answers), 1e-10 * peak))
    return Spectrum(values, planes_bound(values, answers, peak), float(own))


def look_at_unseen(subject: Subject) -> Unseen:
    """Read and relight the lights of the least seen role there is: all, or the worst and others far apart where they are large."""
    asset, capture = subject.asset, subject.capture
    indices = sorted(capture.indices(subject.role), key=subject.psnr_of)
    most = max(FEWEST, HELD_BYTES // (asset.width * asset.height * 12))
    if len(indices) > most:
        spread = [indices[i] for i in farthest_points(capture.directions(indices), most - WORST)]
        indices = indices[:WORST] + [i for i in spread if i not in indices[:WORST]]
    indices.sort()
    references = np.stack([capture.image(i) for i in indices])
    relit = directional_responses(asset, capture.directions(indices))
    judge = Flip(float(np.log2(subject.gain)))
    peak = subject.evaluation[subject.role]["peak"]
    errors = tuple(unseen_error(references, relit, subject.covered, n, peak, judge) for n in LIGHTS)
    worst = tuple(sorted(range(len(indices)), key=lambda i: subject.psnr_of(indices[i]))[:WORST])
    try:
        flips = tuple(judge.error_map(references[i], relit[i], subject.covered) for i in worst)
    except MissingLibraryError:
        flips = ()
    return Unseen(tuple(indices), references, relit, errors, negative(relit, subject.covered), worst, judge, flips)
