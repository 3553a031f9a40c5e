"""Choice of method and size for a number of bytes per texel, or of decibels, by the error on held-out lights."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.captured_light import Role
from srbf.encode.light_function_fit import choose_functions, dense_centers
from srbf.encode.model_selection import TexelSample
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.errors_by_role import psnr as psnr_of
from srbf.light_domain import Directions, domain_of_capture
from srbf.methods.protocol import Method
from srbf.registry import all_methods
from srbf.solve.kernel_ridge import KernelPath

DEFAULT_BUDGET = 16  # bytes per texel
LEAST_BUDGET = 4  # one image of four bytes
MOST_SIZE = 68  # bytes per texel that are tried for a number of decibels
TRIED_TEXELS = 1 << 13
LEAST_LIGHTS = 8  # that a choice without validation lights needs
WORTH = 0.2  # dB that more clusters or more bytes must bring to be chosen


def check_budget(budget: int | None, psnr: float | None) -> None:
    """InputError on a budget below LEAST_BUDGET, on a PSNR that is no number, or on both."""
    if budget is not None and psnr is not None:
        raise InputError("expected a `budget` or a `psnr`, found both")
    if budget is not None and budget < LEAST_BUDGET:
        raise InputError(f"expected a `budget` of at least {LEAST_BUDGET} bytes per texel, found {budget}")
    if psnr is not None and not np.isfinite(psnr):
        raise InputError(f"expected `psnr` in dB, found {psnr:g}")


def within_budget(
    capture: Capture,
    budget: int | None = None,
    psnr: float | None = None,
    say: Callable[[str], None] = lambda line: None,
    **settings: Any,
) -> Method:
    """The method that does best on held-out lights of a texel sample: within `budget` bytes per texel, or with the fewest bytes that reach
    `psnr` dB, or its best if none does.

    Error is that of the validation lights. Without them it is estimated at each train light: what the candidate loses there, and what
    every candidate misses between the lights, measured by leaving that light out (`_between_lights`). Of near equals (WORTH) the one with
    fewer light functions is taken.
    With fewer than LEAST_LIGHTS train lights and no validation lights the simplest is taken. `settings` go to the method. InputError on a
    budget below LEAST_BUDGET, or on both budget and psnr.
    """
    check_budget(budget, psnr)
    if capture.kind in ("surfel", "pool"):  # any light is known, and bytes alone decide
        if psnr is not None:
            raise InputError("expected a `budget` for a capture of surfels, found `psnr`: it has no train lights to measure by")
        (chosen,) = _candidates(capture, budget or DEFAULT_BUDGET, int((capture.coverage() >= COVERED).sum()), 0)
        say(f"chose {chosen}")
        return _with(chosen, settings)
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    texels = covered if len(covered) <= TRIED_TEXELS else np.sort(np.random.default_rng(0).choice(covered, TRIED_TEXELS, replace=False))
    trial = capture.load(texels)
    trial = trial.with_roles([None if light.role == "holdout" else light.role for light in trial.lights])
    size, numbers = budget or DEFAULT_BUDGET, 3 * len(trial.indices("train"))
    estimated = not trial.indices("validation") and domain_of_capture(trial).kind == Directions.kind
    if estimated and len(trial.indices("train")) < LEAST_LIGHTS:
        simplest = next(iter(_candidates(trial, size, len(covered), numbers)))
        say(f"fewer than {LEAST_LIGHTS} train lights and no validation lights: too few to compare methods by; taking {simplest}")
        return _with(simplest, settings)
    missed = _between_lights(trial) if estimated else None
    ratio = len(covered) / max(1, len(texels))
    sizes = [size] if psnr is None else range(LEAST_BUDGET, MOST_SIZE + 1, 4)
    best: tuple[float, Method] | None = None
    for tried_size in sizes:
        for method in _candidates(trial, tried_size, len(covered), numbers):
            tried = method.on_sample(ratio)  # as many texels per cluster as there will be
            reached = _reached(_with(tried, settings).encode(trial), trial, missed)
            if best is None or reached > best[0] + WORTH:
                best = (reached, method)
        assert best is not None, "no candidate fits"
        if psnr is not None and best[0] >= psnr:
            break
    assert best is not None, "no candidate fits"
    reached, method = best
    if psnr is not None and reached < psnr:
        say(f"expected {psnr:g} dB on held-out lights of a sample, found {reached:.1f} at most; taking that")
    say(f"chose {method}")
    return _with(method, settings)


def _candidates(capture: Capture, size: int, texels: int, numbers: int) -> Iterable[Method]:
    """What `size` bytes per texel can hold of the capture's lights, fewest light functions first."""
    kind = domain_of_capture(capture).kind
    for method in all_methods():
        if kind in method.domains:
            yield from method.candidates(size, texels, numbers)


def _with(method: Method, settings: dict[str, Any]) -> Method:
    """`method` with `settings`; InputError on one that it does not have."""
    for name in settings:
        if name not in method.settings():
            raise InputError(f"`{name}` applies to other lights than those of this capture, which {method.name} fits; leave it out")
    return replace(method, **settings)  # type: ignore[type-var]


def _between_lights(capture: Capture) -> Float64[ndarray, " L"]:
    """Mean squared error near each train light of all images interpolated, which no method is expected to go below.

    A light that is left out is about twice as far from its neighbors as a direction between the lights is, and the error of shadow edges
    grows with that distance, so its square is divided by four.
    """
    sample = TexelSample.of(capture, share=1.0)
    lights = sample.coordinates
    centers = dense_centers(lights, sample.domain)
    model = choose_functions(sample, centers)
    path = KernelPath(model.kernel.between(lights, lights, centers))
    return sample.held_out().single(path, model.ridge) / 4


def _reached(asset: Asset, capture: Capture, missed: Float64[ndarray, " L"] | None) -> float:
    """PSNR (dB) of a trial on the validation lights, or its estimate from the train lights; named lights are all there are."""
    if missed is None:
        role: Role = "validation" if capture.indices("validation") else "train"
        return float(evaluate(asset, capture, roles=(role,))[role]["psnr"])
    errors = evaluate(asset, capture, roles=("train",))
    squares = np.array([light["rmse"] ** 2 for light in errors["lights"]]) + missed
    return float(np.mean([psnr_of(errors["train"]["peak"], float(np.sqrt(square))) for square in squares]))
