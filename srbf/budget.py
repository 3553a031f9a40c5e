"""Method, clusters and scalars for a number of bytes a texel, or for a number of decibels, by what they do to lights they did not see."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from srbf.capture import COVERED, Capture, Role
from srbf.errors import InputError
from srbf.evaluation import evaluate
from srbf.methods.clustered_eigen_map import MOST_CLUSTERS, ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap

Planes = EigenMap | ClusteredEigenMap

DEFAULT_BUDGET = 16  # bytes a texel
LEAST_BUDGET = 4  # one image of four bytes
MOST_SCALARS = 64
CLUSTERS = (16, 64, 256)
TEXELS_A_CLUSTER = 64  # fewer would have functions, not planes, hold the picture
TRIED_TEXELS = 1 << 13
UNSEEN = 8  # every how many-th train light is held back where there are no validation lights
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

    Unseen are the validation lights, or every UNSEEN-th train light held back. Of near equals (WORTH) the one of fewer clusters is taken.
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
    trial = _with_unseen(capture.kept(texels))
    share = len(covered) / max(1, len(texels))
    sizes = [budget or DEFAULT_BUDGET] if psnr is None else range(LEAST_BUDGET, MOST_SCALARS + 5, 4)
    best: tuple[float, Planes] | None = None
    for size in sizes:
        for method in _candidates(size, len(covered), 3 * len(trial.indices("train"))):
            tried = method
            if isinstance(method, ClusteredEigenMap):  # as many texels a cluster as there will be
                tried = replace(method, clusters=max(2, int(np.ceil(method.clusters / share))))
            reached = evaluate(replace(tried, **settings).encode(trial), trial)["validation"]["psnr"]
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
        yield EigenMap(scalars=min(size // 4 * 4, MOST_SCALARS, most), encoding="uint8")
    scalars = min((size - 1) // 4 * 4, MOST_SCALARS, most)
    if scalars >= 1:
        for clusters in CLUSTERS:
            if clusters * TEXELS_A_CLUSTER <= texels and clusters <= MOST_CLUSTERS:
                yield ClusteredEigenMap(clusters=clusters, scalars=scalars, encoding="uint8")


def _with_unseen(capture: Capture) -> Capture:
    """The capture with validation lights: its own, or train lights held back."""
    if capture.indices("validation"):
        return capture.with_roles([None if light.role == "holdout" else light.role for light in capture.lights])
    train = capture.indices("train")
    held = set(train[UNSEEN // 2 :: UNSEEN]) if len(train) > UNSEEN else set()
    if not held:
        raise InputError(f"expected validation lights, or more than {UNSEEN} train lights, to choose a method by; found {len(train)}")
    roles: list[Role | None] = [
        "validation" if i in held else "train" if light.role == "train" else None for i, light in enumerate(capture.lights)
    ]
    return capture.with_roles(roles)
