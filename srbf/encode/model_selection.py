"""Choice of one spread and one ridge for a capture, by the errors at validation lights and at left-out lights."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.capture import COVERED, Capture
from srbf.compute.threads import each, one_blas_thread
from srbf.encode.cross_validation import HeldOut
from srbf.errors import InputError
from srbf.light_domain import LightDomain, domain_of_capture
from srbf.light_images import STRIP
from srbf.solve.kernel_ridge import KernelPath

Rule = Literal["validation", "leave-one-light-out"]

RIDGES = tuple(float(r) for r in 10.0 ** np.arange(-5, 1.51, 0.5))
SPREADS = tuple(float(s) for s in np.geomspace(0.6, 2.4, 16))  # of the mean distance between neighboring centers
MAX_SPREAD = 1.0  # rad; beyond, the R table has a cusp
USUAL_SPREAD, USUAL_RIDGE = 0.85, RIDGES[7]  # of the mean distance between neighboring centers; on the diagonal
MIN_SPREAD = 0.05  # rad
SAMPLE_TEXELS = 1 << 13
MARGIN = 2.0  # times the squared error of the best (geometric mean over lights), up to which the usual choice is kept
FULL_MARGIN = 2.0  # lights per function, below which the margin is not reduced


@dataclass(frozen=True)
class Choice:
    """A spread (rad) and a ridge, the rule that chose them, and its mean squared error."""

    spread: float
    ridge: float
    rule: Rule
    error: float


@dataclass(frozen=True, eq=False)
class TexelSample:
    """Rows of T for some covered texels, the train lights first: what every choice is made on.

    `responses` (n, L + V, 3) float32 to L train and V validation lights at `coordinates` (L + V, d) of the light `domain`.
    """

    texels: Int[ndarray, " n"]
    responses: Float32[ndarray, "n M 3"]
    coordinates: Float64[ndarray, "M d"]
    train: int
    domain: LightDomain

    @staticmethod
    def of(capture: Capture, count: int = SAMPLE_TEXELS, share: float = 0.25, seed: int = 0) -> TexelSample:
        """`count` covered texels, or all; of large images only a `share` of the rows is read, in even strips."""
        train, validation = capture.indices("train"), capture.indices("validation")
        texels = sampled_texels(capture, count, share, seed)
        lights = [*train, *validation]
        domain = domain_of_capture(capture)
        return TexelSample(texels, capture.sample(lights, texels), domain.captured(capture, lights), len(train), domain)

    @property
    def validated(self) -> bool:
        """Whether there are validation lights."""
        return len(self.coordinates) > self.train

    @property
    def gram(self) -> Float64[ndarray, "M M"]:
        """Inner products of the lights' images, mean over texels and colors: the error of a linear fit depends on these only."""
        images = self.responses.transpose(1, 0, 2).reshape(self.responses.shape[1], -1)
        return (images @ images.T).astype(np.float64) / images.shape[1]

    def held_out(self) -> HeldOut:
        """Errors at lights left out, singly and in the groups of the light domain, and at validation lights."""
        return HeldOut.of(self.gram, self.domain.left_out_groups(self.coordinates[: self.train]), self.train)


def choose(
    sample: TexelSample,
    candidates: Iterable[tuple[float, Float64[ndarray, "M K"]]],
    ridges: Sequence[float] = RIDGES,
    noise: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    usual: tuple[float, float] | None = None,
) -> Choice:
    """The candidate, (spread, basis functions at the sample's lights), and the ridge > 0 with the least cross-validation error.

    The `usual` (spread, ridge), if it is among them, is kept unless another has less than 1 / MARGIN of its squared error. The margin
    shrinks with the number of lights per function, since more lights give a more reliable score.
    The criterion is the error at left-out train lights, single and in bands, and at validation lights (`cross_validation.HeldOut.score`).
    `noise(operator, weights)` adds a variance per light: the loss of the maps' encoding.
    """
    held_out = sample.held_out()
    middles = np.concatenate([groups[:, 0] for groups in held_out.groups])
    train = sample.train
    rule: Rule = "validation" if held_out.validated else "leave-one-light-out"
    tried = list(candidates)
    found: list[list[tuple[float, Choice]]] = [[] for _ in tried]

    def work(i: int) -> None:
        spread, weights = tried[i]
        path = KernelPath.of_columns(weights[:train])
        for ridge in ridges:
            single, banded = held_out.left_out(path, ridge)
            unseen = held_out.validation(path, ridge, weights[train:] @ weights[:train].T) if held_out.validated else None
            if noise is not None:
                lost = noise(path.solve(ridge, weights[:train]).T, weights)
                single, banded = single + lost[:train], banded + lost[middles]
                unseen = None if unseen is None else unseen + lost[train:]
            error = float((single if unseen is None else unseen).mean())
            found[i].append((held_out.score(single, banded, unseen), Choice(spread, ridge, rule, error)))

    with one_blas_thread():
        each(work, len(tried))
    scored = [one for choices in found for one in choices]
    assert scored, "no spread or no ridge to choose from"
    best = min(scored, key=lambda one: one[0])
    margin = np.log(MARGIN) * min(1.0, FULL_MARGIN * tried[0][1].shape[1] / train) ** 2
    for score, choice in scored:
        if (choice.spread, choice.ridge) == usual and score < best[0] + margin:
            return choice
    return best[1]


def spread_candidates(typical: float, factors: Sequence[float] = SPREADS) -> list[float]:
    """Spreads around `typical` (rad) within the range of the R table."""
    return sorted({float(np.clip(typical * f, MIN_SPREAD, MAX_SPREAD)) for f in factors})


def sampled_texels(capture: Capture, count: int, share: float = 1.0, seed: int = 0) -> Int[ndarray, " n"]:
    """Flat indices of `count` covered texels, one of each of equal runs, or of all; of large images from a `share` of the rows."""
    covered = capture.coverage() >= COVERED
    if not covered.any():
        raise InputError(f"expected covered texels in {capture.folder}, found coverage below {COVERED} everywhere")
    texels = np.flatnonzero(_in_strips(covered, count, share))
    if len(texels) > count:
        runs = np.arange(count + 1) * len(texels) // count
        texels = texels[(runs[:-1] + np.random.default_rng(seed).random(count) * np.diff(runs)).astype(np.int64)]
    return texels


def _in_strips(covered: Bool[ndarray, "H W"], count: int, share: float) -> Bool[ndarray, "H W"]:
    """`covered`, restricted to every few strips of rows in large images, so that the rest is not read."""
    height = len(covered)
    every = max(1, int(share and 1 / share))
    chosen = covered.copy()
    chosen[(np.arange(height) // STRIP) % every != every // 2] = False
    return chosen if np.count_nonzero(chosen) >= 2 * count else covered
