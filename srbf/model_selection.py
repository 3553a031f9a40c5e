"""One spread and one ridge for a capture, chosen by what they predict: its validation lights, or lights left out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.basis.gaussian import weight
from srbf.basis.light_functions import LightFunctions
from srbf.capture import COVERED, STRIP, Capture
from srbf.errors import InputError
from srbf.solve.ridge import RidgePath
from srbf.sphere import Domain, mean_spacing, point_set

Rule = Literal["validation", "leave-one-light-out"]

RIDGES = tuple(float(r) for r in 10.0 ** np.arange(-5, 1.51, 0.25))
SPREADS = tuple(float(s) for s in np.geomspace(0.6, 2.4, 16))  # of the mean distance between neighbouring centers
WIDEST = 1.0  # rad: past it the R table has a cusp
NARROWEST = 0.05  # rad
SAMPLE_TEXELS = 1 << 13
FUNCTION_RIDGES = tuple(float(r) for r in 10.0 ** np.arange(-5, 1.51, 0.5))
FUNCTION_SPREADS = tuple(float(s) for s in np.geomspace(0.7, 5.0, 12))  # of the lights' spacing
DENSE_LEAST = 100  # centers of light functions, where the lights are fewer
BELOW = 3.0  # spacings: how far the centers of light functions go on below the horizon, or the cosine bends there
FUNCTIONS_AT_A_TIME = 1024
UNSEEN = 1e-4  # of the mean power: smaller errors are alike, or lights that leave all black would decide


@dataclass(frozen=True)
class Choice:
    """A spread (rad) and a ridge, the rule that chose them, and the mean squared error that it saw."""

    spread: float
    ridge: float
    rule: Rule
    error: float


@dataclass(frozen=True, eq=False)
class TexelSample:
    """Rows of T for some covered texels, the train lights first: what every choice is made on.

    answers (n, L + V, 3) float32, of L train and V validation lights at `directions` (L + V, 3).
    """

    texels: Int[ndarray, " n"]
    answers: Float32[ndarray, "n M 3"]
    directions: Float64[ndarray, "M 3"]
    train: int

    @staticmethod
    def of(capture: Capture, count: int = SAMPLE_TEXELS, share: float = 0.25, seed: int = 0) -> TexelSample:
        """`count` covered texels, or all; from large images only `share` of the rows is read, in even strips."""
        train, validation = capture.indices("train"), capture.indices("validation")
        covered = capture.coverage() >= COVERED
        if not covered.any():
            raise InputError(f"expected covered texels in {capture.folder}, found coverage below {COVERED} everywhere")
        texels = np.flatnonzero(_in_strips(covered, count, share))
        if len(texels) > count:
            runs = np.arange(count + 1) * len(texels) // count
            texels = texels[(runs[:-1] + np.random.default_rng(seed).random(count) * np.diff(runs)).astype(np.int64)]
        lights = [*train, *validation]
        return TexelSample(texels, capture.sample(lights, texels), capture.directions(lights), len(train))

    @property
    def validated(self) -> bool:
        """Whether there are validation lights to choose by."""
        return len(self.directions) > self.train

    @property
    def gram(self) -> Float64[ndarray, "M M"]:
        """Inner products of the lights' images, mean over texels and colours: all that a linear fit's error depends on."""
        images = self.answers.transpose(1, 0, 2).reshape(self.answers.shape[1], -1)
        return (images @ images.T).astype(np.float64) / images.shape[1]


def choose(
    sample: TexelSample,
    candidates: Iterable[tuple[float, Float64[ndarray, "M K"]]],
    ridges: Sequence[float] = RIDGES,
    noise: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> Choice:
    """The candidate, (spread, basis functions at the sample's lights), and the ridge that predict best what they did not see.

    With validation lights: least mean squared error on them. Without: least mean over train lights of the log of each one's squared
    error when left out, which is the greatest mean PSNR; a border light, extrapolated when left out, must not drown the rest.
    On a lattice of lights leaving one out is pessimistic, its neighbours being twice as far as a random direction's: hence validation.
    `noise(operator, weights)` adds a variance a light: what the maps' encoding loses.
    """
    gram, train = sample.gram, sample.train
    validated = len(gram) > train
    least = UNSEEN * float(np.trace(gram)) / len(gram) + 1e-30
    best: Choice | None = None
    best_score = np.inf
    for spread, weights in candidates:
        path = RidgePath(weights[:train])
        for ridge in ridges:
            operator = path.operator(ridge)
            if validated:
                error = np.concatenate([-weights[train:] @ operator, np.eye(len(gram) - train)], axis=1)
                squares = _quadratic(error, gram)
            else:
                squares = _quadratic(path.left_out(ridge), gram)
            if noise is not None:
                squares = squares + noise(operator, weights[train:] if validated else weights)
            score = float(squares.mean()) if validated else float(np.log(np.maximum(squares, least)).mean())
            if score < best_score or best is None:
                best_score = score
                best = Choice(spread, ridge, "validation" if validated else "leave-one-light-out", float(squares.mean()))
    assert best is not None, "no spread or no ridge to choose from"
    return best


def spread_candidates(typical: float, factors: Sequence[float] = SPREADS) -> list[float]:
    """Spreads around `typical` (rad) within the R table's reach."""
    return sorted({float(np.clip(typical * f, NARROWEST, WIDEST)) for f in factors})


def dense_centers(directions: Float64[ndarray, "L 3"], domain: Domain) -> Float64[ndarray, "B 3"]:
    """Centers for functions that may follow every light: as dense as the lights (at least DENSE_LEAST), Fibonacci.

    On the hemisphere they go on for BELOW spacings under the horizon, where a cosine would otherwise be bent towards zero.
    """
    count = max(len(directions), DENSE_LEAST)
    if domain == "sphere":
        return point_set("fibonacci", count, "sphere")
    spacing = np.sqrt(2 * np.pi / count)
    points = point_set("fibonacci", 2 * count, "sphere")
    return points[points[:, 2] > -np.sin(min(BELOW * spacing, np.pi / 2))]


def choose_dense(sample: TexelSample, centers: Float64[ndarray, "B 3"], spread: float | None = None, ridge: float | None = None) -> Choice:
    """`choose` for light functions on dense centers: one pair for all of them."""
    spacing = mean_spacing(sample.directions[: sample.train]) if sample.train > 1 else 1.0
    spreads = spread_candidates(spacing, FUNCTION_SPREADS) if spread is None else [spread]
    candidates = ((s, weight(sample.directions @ centers.T, s)) for s in spreads)
    return choose(sample, candidates, FUNCTION_RIDGES if ridge is None else [ridge])


def fit_light_functions(
    sample: TexelSample,
    values: Float64[ndarray, "L F 3"],
    validation: Float64[ndarray, "V F 3"],
    centers: Float64[ndarray, "B 3"],
    spread: float | None = None,
    ridge: float | None = None,
) -> LightFunctions:
    """Smooth functions through `values` at the train lights, each with the spread and ridge that predict it best.

    `validation` (V may be 0) holds what the functions ought to be at the validation lights; without it each value is left out in turn. A
    number for `spread` or `ridge` fixes it for all.
    """
    directions = sample.directions
    spacing = mean_spacing(directions[: sample.train]) if sample.train > 1 else 1.0
    spreads = spread_candidates(spacing, FUNCTION_SPREADS) if spread is None else [spread]
    ridges = FUNCTION_RIDGES if ridge is None else [ridge]
    count = values.shape[1]
    flat = values.reshape(len(values), -1)
    best = np.full(count, np.inf)
    chosen_spread = np.empty(count)
    coefficients = np.empty((count, len(centers), 3), np.float32)
    for candidate in spreads:
        weights = weight(directions @ centers.T, candidate)
        path = RidgePath(weights[: sample.train])
        for penalty in ridges:
            operator = path.operator(penalty)
            predict = weights[sample.train :] @ operator if len(validation) else path.left_out(penalty)
            for part in _parts(count):
                columns = flat[:, 3 * part.start : 3 * part.stop]
                residual = (predict @ columns).reshape(len(predict), -1, 3)
                if len(validation):
                    residual = residual - validation[:, part]
                error = np.einsum("lfc,lfc->f", residual, residual)
                better = np.flatnonzero(error < best[part]) + part.start
                best[better] = error[better - part.start]
                chosen_spread[better] = candidate
                if len(better):
                    fitted = operator @ values[:, better].reshape(len(values), -1)
                    coefficients[better] = fitted.reshape(len(centers), -1, 3).transpose(1, 0, 2)
    return LightFunctions(centers, chosen_spread, coefficients)


def _parts(count: int) -> Iterator[slice]:
    for start in range(0, count, FUNCTIONS_AT_A_TIME):
        yield slice(start, min(start + FUNCTIONS_AT_A_TIME, count))


def _quadratic(rows: np.ndarray, gram: np.ndarray) -> np.ndarray:
    """The diagonal of rows gram rows^T."""
    return np.einsum("ij,ij->i", rows @ gram, rows)


def _in_strips(covered: Bool[ndarray, "H W"], count: int, share: float) -> Bool[ndarray, "H W"]:
    """`covered`, of large images in every few strips of rows alone, so that the rest need not be read."""
    height = len(covered)
    every = max(1, int(share and 1 / share))
    chosen = covered.copy()
    chosen[(np.arange(height) // STRIP) % every != every // 2] = False
    return chosen if np.count_nonzero(chosen) >= 2 * count else covered
