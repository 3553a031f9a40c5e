"""Method, clusters and scalars for a number of bytes a texel, or for a number of decibels, by what they do to lights they did not see."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.encode.cross_validation import HeldOut
from srbf.encode.light_function_fit import choose_functions, dense_centers
from srbf.encode.model_selection import TexelSample
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.errors_by_role import psnr as psnr_of
from srbf.methods.clustered_eigen_map import MOST_CLUSTERS, ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.solve.kernel_ridge import KernelPath
from srbf.sphere import domain_of

Planes = EigenMap | ClusteredEigenMap

DEFAULT_BUDGET = 16  # bytes a texel
LEAST_BUDGET = 4  # one image of four bytes
MOST_COMPONENTS = 64
CLUSTERS = (16, 64, 256)
TEXELS_PER_CLUSTER = 64  # fewer would have functions, not planes, hold the picture
TRIED_TEXELS = 1 << 13
LEAST_LIGHTS = 8  # that a choice without validation lights needs
WORTH = 0.2  # dB that more clusters or more bytes must bring to be chosen


def within_budget(
    capture: Capture,
    budget: int | None = None,
    psnr: float | None = None,
    say: Callable[[str], None] = lambda line: None,
    **settings: Any,
) -> Planes:
    """The eigen map, clustered or not, that does best on unseen lights of a texel sample: within `budget` bytes a texel, or with the
    fewest bytes that reach `psnr` dB, or its best if none does. Planes are bytes.

    Error is that of the validation lights. Without them it is estimated at each train light: what the candidate loses there, and what
    every candidate misses between the lights, told by leaving that light out (`_between_lights`). Of near equals (WORTH) the one of
    fewer clusters is taken.
    `settings` go to the method. InputError on a budget below LEAST_BUDGET, or on both budget and psnr.
    """
    if budget is not None and psnr is not None:
        raise InputError("expected --budget or --psnr, found both")
    if budget is not None and budget < LEAST_BUDGET:
        raise InputError(f"expected a --budget of at least {LEAST_BUDGET} bytes a texel, found {budget}")
    if psnr is not None and not np.isfinite(psnr):
        raise InputError(f"expected --psnr in dB, found {psnr:g}")
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    texels = covered if len(covered) <= TRIED_TEXELS else np.sort(np.random.default_rng(0).choice(covered, TRIED_TEXELS, replace=False))
    trial = _without_holdout(capture.load(texels))
    missed = None if trial.indices("validation") else _between_lights(trial)
    share = len(covered) / max(1, len(texels))
    sizes = [budget or DEFAULT_BUDGET] if psnr is None else range(LEAST_BUDGET, MOST_COMPONENTS + 5, 4)
    best: tuple[float, Planes] | None = None
    for size in sizes:
        for method in _candidates(size, len(covered), 3 * len(trial.indices("train"))):
            tried = method
            if isinstance(method, ClusteredEigenMap):  # as many texels a cluster as there will be
                tried = replace(method, clusters=max(2, int(np.ceil(method.clusters / share))))
            reached = _reached(replace(tried, **settings).encode(trial), trial, missed)
            if best is None or reached > best[0] + WORTH:
                best = (reached, method)
        assert best is not None, "no candidate fits"
        if psnr is not None and best[0] >= psnr:
            break
    assert best is not None, "no candidate fits"
    reached, method = best
    if psnr is not None and reached < psnr:
        say(f"expected {psnr:g} dB on unseen lights of a sample, found {reached:.1f} at most; taking that")
    clusters = f"{method.clusters} clusters of " if isinstance(method, ClusteredEigenMap) else ""
    say(f"chose {clusters}{method.scalars} scalars as bytes")
    return replace(method, **settings)


def _candidates(size: int, texels: int, most: int) -> Iterable[Planes]:
    """What `size` bytes a texel can hold, fewest light functions first."""
    if size >= 4:
        yield EigenMap(scalars=min(size // 4 * 4, MOST_COMPONENTS, most), encoding="uint8")
    scalars = min((size - 1) // 4 * 4, MOST_COMPONENTS, most)
    if scalars >= 1:
        for clusters in CLUSTERS:
            if clusters * TEXELS_PER_CLUSTER <= texels and clusters <= MOST_CLUSTERS:
                yield ClusteredEigenMap(clusters=clusters, scalars=scalars, encoding="uint8")


def _without_holdout(capture: Capture) -> Capture:
    """The capture without what no decision may see. InputError where that leaves too few lights."""
    if not capture.indices("validation") and len(capture.indices("train")) < LEAST_LIGHTS:
        found = len(capture.indices("train"))
        raise InputError(f"expected validation lights, or at least {LEAST_LIGHTS} train lights, to choose a method by; found {found}")
    return capture.with_roles([None if light.role == "holdout" else light.role for light in capture.lights])


def _between_lights(capture: Capture) -> Float64[ndarray, " L"]:
    """Mean squared error near each train light of all images interpolated, which no method is expected to go below.

    A light that is left out is about twice as far from its neighbors as a direction between the lights is, and the error of shadow edges
    grows with that distance, so its square is divided by four.
    """
    sample = TexelSample.of(capture, share=1.0)
    lights = sample.directions
    centers = dense_centers(lights, domain_of(lights))
    model = choose_functions(sample, centers)
    path = KernelPath(model.kernel.between(lights, lights, centers))
    return HeldOut.of(sample.gram, lights, sample.train).single(path, model.ridge) / 4


def _reached(asset: Asset, capture: Capture, missed: Float64[ndarray, " L"] | None) -> float:
    """PSNR (dB) of a trial on the validation lights, or its estimate from the train lights."""
    if missed is None:
        return float(evaluate(asset, capture, roles=("validation",))["validation"]["psnr"])
    errors = evaluate(asset, capture, roles=("train",))
    squares = np.array([light["rmse"] ** 2 for light in errors["lights"]]) + missed
    return float(np.mean([psnr_of(errors["train"]["peak"], float(np.sqrt(square))) for square in squares]))
