"""Error by bytes: the error of methods on one capture against their bytes per texel, and the baselines."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.captured_light import Role
from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.temporal_stability import Reference, dense_reference
from srbf.light_domain import domain_of_capture
from srbf.methods import Method, method_of
from srbf.methods import responses as asset_responses
from srbf.registry import all_methods

IMAGE_BYTES = 8  # per RGBA half texel of one uncompressed image
ALL, NEAREST = "all images interpolated", "nearest image"


def compared_methods() -> tuple[Method, ...]:
    """The methods that a report compares: a few settings of each."""
    return tuple(fit for method in all_methods() for fit in method.compared())


@dataclass(frozen=True)
class Score:
    """Error on the lights of one role at a number of bytes per texel; `seconds` of the fit, None without a fit.

    `family` names the curve, `name` the point on it. `psnr` and `relative_rmse` are those of
    `srbf.evaluation.errors_by_role.RoleError`.
    """

    family: str
    name: str
    bytes_per_texel: float
    psnr: float
    relative_rmse: float
    seconds: float | None = None


def contest(
    sample: Capture, methods: Sequence[Method], role: Role, peak: float, progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Score]:
    """Scores of each method, fitted to the train lights of a sample and tested on those of `role`, in order; then the baselines.

    `sample` is a capture in memory, of a few thousand texels. Clusters fit the few texels of a sample slightly better than the many of
    the whole image. Warnings of the settings are ignored.
    """
    scores = []
    for done, method in enumerate(methods):
        started = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            asset = method.encode(sample)
        scores.append(score_asset(asset, sample, role, peak, time.perf_counter() - started))
        progress(done + 1, len(methods))
    return scores + baselines(sample, role, peak)


def score_asset(asset: Asset, capture: Capture, role: Role, peak: float, seconds: float | None = None) -> Score:
    """The score of an asset on a capture of its texels."""
    error = error_of(lambda coordinates: asset_responses(asset, coordinates).reshape(len(coordinates), -1, 3), capture, role, peak)
    return Score(family_of(asset), name_of(asset), float(texel_bytes(asset)), *error, seconds)


def baselines(capture: Capture, role: Role, peak: float) -> list[Score]:
    """Scores of the N uncompressed train images, at the bytes of all N: the nearest image, and all interpolated."""
    texels = np.arange(capture.width * capture.height)
    every = IMAGE_BYTES * len(capture.indices("train"))
    responses = ((NEAREST, nearest_image(capture, texels)), (ALL, dense_reference(capture, texels)))
    return [Score(name, name, float(every), *error_of(response, capture, role, peak)) for name, response in responses]


def nearest_image(capture: Capture, texels: Int[ndarray, " n"]) -> Reference:
    """The response of each direction is that of the nearest train image. Memory: (L, n, 3) float32."""
    train = capture.indices("train")
    responses = capture.sample(train, texels)
    domain = domain_of_capture(capture)
    among = domain.captured(capture, train)
    return lambda coordinates: responses[:, domain.nearest(coordinates, among)].transpose(1, 0, 2)


def error_of(responses: Reference, capture: Capture, role: Role, peak: float) -> tuple[float, float]:
    """(PSNR in dB, mean over images, and relative rmse) of responses to the lights of `role`.

    Both images are clamped at 0, except for indirect captures, whose clamp follows the addition of direct light.
    """
    floor = -np.inf if capture.transport == "indirect" else 0.0
    indices = capture.indices(role)
    coordinates = domain_of_capture(capture).captured(capture, indices)
    squares: list[float] = []
    power = 0.0
    for first, block in capture.blocks(indices):
        relit = np.maximum(responses(coordinates[first : first + len(block)]), floor)
        for response, reference in zip(relit, np.maximum(block, floor), strict=True):
            squares.append(float(((response - reference) ** 2).mean(dtype=np.float64)))
            power += float((reference**2).mean(dtype=np.float64))
    return float(np.mean([psnr(peak, np.sqrt(s)) for s in squares])), float(np.sqrt(sum(squares) / max(power, 1e-30)))


def spectrum(sample: Capture) -> Float64[ndarray, " r"]:
    """Singular values of all train responses as a (texels, lights x colors) matrix minus its mean texel, largest first.

    They bound any components shared by the colors; all colors and all lights have equal weight.
    Work: the smaller side squared times the larger.
    """
    texels = sample.width * sample.height
    return singular_values(sample.sample(sample.indices("train"), np.arange(texels)).reshape(texels, -1))


def singular_values(responses: Float32[ndarray, "n m"]) -> Float64[ndarray, " r"]:
    """Singular values of `responses` minus the mean row, largest first; by the smaller side's Gram matrix, within 1e-6 of the first."""
    centered: Float32[ndarray, "n m"] = responses - responses.mean(axis=0, dtype=np.float64).astype(np.float32)
    smaller = centered.T if len(centered) > centered.shape[1] else centered
    double = smaller.astype(np.float64)
    gram = double @ double.T
    return np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[::-1], 0))


def planes_bound(values: Float64[ndarray, " r"], responses: int, peak: float) -> Float64[ndarray, " r"]:
    """PSNR (dB, pooled over `responses` values) of the best 0 … r - 1 components on these responses, before a clamp."""
    left = np.cumsum((values**2)[::-1])[::-1]  # beyond the first s components
    return np.array([psnr(peak, float(np.sqrt(energy / responses))) for energy in left])


def texel_bytes(asset: Asset) -> int | float:
    """Bytes per texel that a shader reads under a directional light."""
    return asset.bytes_per_texel()["directional"]


def family_of(asset: Asset) -> str:
    """The name of an asset's curve: its method, or its basis if that is not Gaussian."""
    return method_of(asset).family(asset)


def name_of(asset: Asset) -> str:
    """The label of an asset on its curve: its numbers per texel, and its encoding unless half."""
    encoding = {"half": "", "float": ", float", "uint8": ", bytes", "bc7": ", BC7", "bc1": ", BC1"}[asset.encoding]
    return method_of(asset).label(asset) + encoding
