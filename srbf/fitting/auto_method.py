"""Choice of method and size for a number of bytes per texel, or of decibels, by the error on held-out lights."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
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
from srbf.methods.clustered_eigen_map import LEAST_TEXELS, TRIED_CLUSTERS, ClusteredEigenMap
from srbf.methods.glossy_eigen_map import GlossyEigenMap
from srbf.methods.protocol import Method, check_error
from srbf.registry import all_methods
from srbf.solve.kernel_ridge import KernelPath

DEFAULT_BUDGET = 16  # bytes per texel
LEAST_BUDGET = 4  # one image of four bytes
MOST_SIZE = 68  # bytes per texel that are tried for a number of decibels
TRIED_TEXELS = 1 << 13
LEAST_LIGHTS = 8  # that a choice without validation lights needs
CUBEMAP_CLUSTERS = 64  # at most: every cluster's functions have a number per direction
WORTH = 0.2  # dB that more clusters or more bytes must bring to be chosen


def check_budget(budget: int | None, psnr: float | None, error: float | None = None) -> None:
    """InputError on a budget below LEAST_BUDGET, on a PSNR or an error that is none, and on a PSNR beside one of the others."""
    if psnr is not None and (budget is not None or error is not None):
        other = "budget" if error is None else "error"
        raise InputError(f"expected a `{other}` or a `psnr`, found both")
    check_error(error)
    if budget is not None and budget < LEAST_BUDGET:
        raise InputError(
            f"expected a `budget` of at least {LEAST_BUDGET} bytes per texel, or megabytes of a deep framebuffer, found {budget}"
        )
    if psnr is not None and not np.isfinite(psnr):
        raise InputError(f"expected `psnr` in dB, found {psnr:g}")


def within_budget(
    capture: Capture,
    budget: int | None = None,
    psnr: float | None = None,
    error: float | None = None,
    say: Callable[[str], None] = lambda line: None,
    **settings: Any,
) -> Method:
    """The method that does best on held-out lights of a texel sample: within `budget` bytes per texel, or with the fewest bytes, within a
    budget if there is one, that reach `psnr` dB, or a relative RMSE of `error`, or its best if none does.

    Error is that of the validation lights. Without them it is estimated at each train light: what the candidate loses there, and what
    every candidate misses between the lights, measured by leaving that light out (`_between_lights`). Of near equals (WORTH) the one with
    fewer light functions is taken.
    Surfels know any light: there `transfer` itself chooses by `error`.
    With fewer than LEAST_LIGHTS train lights and no validation lights the simplest is taken. `settings` go to the method. InputError on a
    budget below LEAST_BUDGET, or on psnr beside budget or error.
    """
    check_budget(budget, psnr, error)
    if capture.is_cubemap:
        chosen = _of_cubemap(capture, budget or DEFAULT_BUDGET, psnr, error)
        say(f"chose {chosen}")
        return _with(chosen, settings)
    if capture.kind in ("surfel", "pool"):  # any light is known, and bytes alone decide
        if psnr is not None:
            raise InputError("expected a `budget` for a capture of surfels, found `psnr`: it has no train lights to measure by")
        (chosen,) = _candidates(capture, budget or DEFAULT_BUDGET, int((capture.coverage() >= COVERED).sum()), 0)
        say(f"chose {chosen}{'' if error is None else ' at most'}")
        return _with(chosen, settings if error is None else {**settings, "error": error})
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
    aimed = psnr is not None or error is not None
    sizes = range(LEAST_BUDGET, (budget or MOST_SIZE) + 1, 4) if aimed else [size]
    best: tuple[Reached, Method] | None = None
    for tried_size in sizes:
        for method in _candidates(trial, tried_size, len(covered), numbers):
            tried = method.on_sample(ratio)  # as many texels per cluster as there will be
            reached = _reached(_with(tried, settings).encode(trial), trial, missed)
            if best is None or reached.psnr > best[0].psnr + WORTH:
                best = (reached, method)
        if best is not None and best[0].meets(psnr, error):
            break
    assert best is not None, "no candidate fits"
    reached, method = best
    if psnr is not None and not reached.meets(psnr, None):
        say(f"expected {psnr:g} dB on held-out lights of a sample, found {reached.psnr:.1f} at most; taking that")
    if error is not None and not reached.meets(None, error):
        say(f"expected an error of {error:.2%} on held-out lights of a sample, found {reached.error:.2%} at least; taking that")
    say(f"chose {method}" if error is None else f"chose {method}: relative RMSE {reached.error:.2%} on held-out lights of a sample")
    return _with(method, settings)


def _of_cubemap(capture: Capture, size: int, psnr: float | None, error: float | None) -> Method:
    """Clusters within a size: with thousands of lights, trials of other methods take hours. InputError on another aim."""
    if psnr is not None or error is not None:
        other = "psnr" if error is None else "error"
        raise InputError(f"expected a `budget` for a capture under a cubemap, found `{other}`; or choose a method and its settings")
    numbers, texels = 3 * len(capture.indices("train")), int((capture.coverage() >= COVERED).sum())
    if capture.gloss_terms is not None:
        return GlossyEigenMap(components=max(1, (size - 1) // 4 * 4), clusters=int(np.clip(texels // LEAST_TEXELS, 1, CUBEMAP_CLUSTERS)))
    many = ClusteredEigenMap.candidates(size, max(texels, LEAST_TEXELS * TRIED_CLUSTERS[0]), numbers)
    clusters = int(np.clip(texels // LEAST_TEXELS, 1, CUBEMAP_CLUSTERS))
    first = next(iter(many), None)
    return next(iter(_candidates(capture, size, texels, numbers))) if first is None else replace(first, clusters=clusters)


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
    path = KernelPath.of(model.kernel.between(lights, lights, centers))
    return sample.held_out().left_out(path, model.ridge)[0] / 4


@dataclass(frozen=True)
class Reached:
    """PSNR (dB) and relative RMSE of a trial."""

    psnr: float
    error: float

    def meets(self, psnr: float | None, error: float | None) -> bool:
        """What is asked, if anything is."""
        return (psnr is not None and self.psnr >= psnr) or (error is not None and self.error <= error)


def _reached(asset: Asset, capture: Capture, missed: Float64[ndarray, " L"] | None) -> Reached:
    """Of a trial on the validation lights, or its estimate from the train lights; named lights are all there are."""
    if missed is None:
        role: Role = "validation" if capture.indices("validation") else "train"
        found = evaluate(asset, capture, roles=(role,))[role]
        return Reached(float(found["psnr"]), float(found["relative_rmse"]))
    errors = evaluate(asset, capture, roles=("train",))
    squares = np.array([light["rmse"] ** 2 for light in errors["lights"]])
    power = (errors["train"]["rmse"] / max(errors["train"]["relative_rmse"], 1e-30)) ** 2  # mean square of the images
    psnr = float(np.mean([psnr_of(errors["train"]["peak"], float(np.sqrt(square))) for square in squares + missed]))
    return Reached(psnr, float(np.sqrt((squares + missed).mean() / max(power, 1e-30))))
