"""Smooth functions of light direction through values at the captured lights: one kernel and one ridge for all functions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.basis.light_functions import LightFunctions
from srbf.basis.light_kernel import LightKernel, kernel_of_spread, mean_variance, narrowest
from srbf.compute.threads import each, one_blas_thread
from srbf.encode.model_selection import MAX_SPREAD, MIN_SPREAD, Rule, TexelSample
from srbf.light_domain import LightDomain
from srbf.solve.kernel_ridge import KernelPath

SPREADS = (0.5, 0.7, 1.0, 1.42, 2.0, 2.8, 4.0)  # light spacings
NARROW, WIDE = (0.5, 0.7, 1.0), (1.42, 2.0, 2.8)  # of kernels of two spreads
WIDE_SHARES = (0.7, 0.9, 0.99, 0.999)
RIDGES = tuple(float(r) for r in 10.0 ** np.arange(-6, 1.1))  # of the kernel's mean variance
USUAL, USUAL_SHARE, USUAL_RIDGE = (0.7, 2.0), 0.99, 3  # narrow and wide, share of the wide, which of RIDGES
MARGIN = 1.5  # times the squared error of the best (geometric mean over lights), up to which the usual pair is kept
FEW_LIGHTS = 8  # validation lights that leave the margin unchanged
MIN_WIDTH_RATIO = 1.3  # of the wide spread over the narrow one
LEAST_CENTERS = 100


@dataclass(frozen=True)
class FunctionModel:
    """The kernel and the ridge of light functions, the rule that chose them, and its mean squared error."""

    kernel: LightKernel
    ridge: float
    rule: Rule
    error: float


def dense_centers(coordinates: Float64[ndarray, "L d"], domain: LightDomain) -> Float64[ndarray, "B d"]:
    """Centers for functions that may follow every light: as dense as the lights, at least LEAST_CENTERS."""
    return domain.dense_centers(coordinates, LEAST_CENTERS)


def choose_functions(
    sample: TexelSample, centers: Float64[ndarray, "B 3"], spread: float | None = None, ridge: float | None = None
) -> FunctionModel:
    """One kernel and one ridge for all light functions of a capture: the usual ones, unless others predict much better.

    The criterion is the error at left-out train lights, single and in bands, and at validation lights (`cross_validation`). There is one
    choice for all functions and texels: separate choices follow noise, and lose several dB where few lights show a highlight.
    Left-out lights are a rough measure of the gaps between lights: a kernel that oscillates there may still predict the lights well.
    The usual pair, good on most sets, is therefore kept unless another has less than 1 / MARGIN of its squared error. With many
    validation lights the margin shrinks. A number for `spread` (rad) or `ridge` (added to K's diagonal) fixes it; the kernel then has
    one spread.
    """
    held_out = sample.held_out()
    rule: Rule = "validation" if held_out.validated else "leave-one-light-out"
    usual = _usual_kernel(sample, centers)
    kernels = list(_candidates(sample, centers, spread, ridge is not None))
    found: list[list[tuple[float, FunctionModel]]] = [[] for _ in kernels]

    def work(i: int) -> None:
        kernel, matrix = kernels[i]
        path = KernelPath.of(matrix[: sample.train])
        scale = float(np.diag(matrix).mean())
        for penalty in [share * scale for share in RIDGES] if ridge is None else [ridge]:
            single, banded = held_out.left_out(path, penalty)
            unseen = held_out.validation(path, penalty, matrix[sample.train :]) if held_out.validated else None
            error = float((single if unseen is None else unseen).mean())
            found[i].append((held_out.score(single, banded, unseen), FunctionModel(kernel, penalty, rule, error)))

    with one_blas_thread():
        each(work, len(kernels))
    best = min((scored for models in found for scored in models), key=lambda scored: scored[0])
    of_usual = [models[USUAL_RIDGE] for (kernel, _), models in zip(kernels, found, strict=True) if kernel == usual and ridge is None]
    margin = np.log(MARGIN) * min(1.0, FEW_LIGHTS / max(1, len(sample.coordinates) - sample.train))
    if of_usual and of_usual[0][0] < best[0] + margin:
        return of_usual[0][1]
    return best[1]


def _usual_kernel(sample: TexelSample, centers: Float64[ndarray, "B 3"]) -> LightKernel:
    spacing, least = sample.domain.spacing(sample.coordinates[: sample.train]), max(MIN_SPREAD, narrowest(centers))
    narrow, wide = (float(np.clip(factor * spacing, least, MAX_SPREAD)) for factor in USUAL)
    return LightKernel(narrow, wide, USUAL_SHARE)


def functions_through(
    sample: TexelSample,
    values: Float64[ndarray, "L F 3"],
    domain: LightDomain,
    spread: Literal["auto"] | float = "auto",
    ridge: Literal["auto"] | float = "auto",
) -> tuple[LightFunctions, dict[str, Any]]:
    """Smooth functions through `values` at the sample's train lights, and the manifest's record of the choice."""
    centers = dense_centers(sample.coordinates[: sample.train], domain)
    model = choose_functions(sample, centers, None if spread == "auto" else spread, None if ridge == "auto" else ridge)
    kernel = {key: value for key, value in asdict(model.kernel).items() if model.kernel.wide is not None or key == "narrow"}
    return fit_functions(sample, values, model, centers, domain), {"chosen_by": model.rule, "kernel": kernel, "ridge": model.ridge}


def fit_functions(
    sample: TexelSample, values: Float64[ndarray, "L F 3"], model: FunctionModel, centers: Float64[ndarray, "B 3"], domain: LightDomain
) -> LightFunctions:
    """Smooth functions through `values` at the train lights."""
    lights = sample.coordinates[: sample.train]
    path = KernelPath.of(model.kernel.between(lights, lights, centers))
    solved = path.solve(model.ridge, values.reshape(len(values), -1))
    return model.kernel.functions(solved, lights, centers, domain.manifest()["domain"])


def _candidates(
    sample: TexelSample, centers: Float64[ndarray, "B 3"], spread: float | None, plain: bool
) -> Iterator[tuple[LightKernel, Float64[ndarray, "M L"]]]:
    """Kernels, with their values between all lights and the train lights; `plain` ones have a single spread."""
    directions, lights = sample.coordinates, sample.coordinates[: sample.train]
    if spread is not None:
        yield LightKernel(spread), kernel_of_spread(spread, directions, lights, centers)
        return
    spacing = sample.domain.spacing(lights)
    least = max(MIN_SPREAD, narrowest(centers))
    computed = {}
    for factor in SPREADS:
        width = float(np.clip(factor * spacing, least, MAX_SPREAD))
        if width not in computed:
            computed[width] = kernel_of_spread(width, directions, lights, centers)
            yield LightKernel(width), computed[width]
    if plain:
        return
    scaled = {width: matrix / mean_variance(width, lights, centers) for width, matrix in computed.items()}
    seen: set[tuple[float, float]] = set()
    for narrow_factor, wide_factor in ((n, w) for n in NARROW for w in WIDE):
        narrow, wide = (float(np.clip(factor * spacing, least, MAX_SPREAD)) for factor in (narrow_factor, wide_factor))
        if (narrow, wide) in seen or wide <= MIN_WIDTH_RATIO * narrow:
            continue
        seen.add((narrow, wide))
        for share in WIDE_SHARES:
            yield LightKernel(narrow, wide, share), (1 - share) * scaled[narrow] + share * scaled[wide]
