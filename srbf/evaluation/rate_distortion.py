"""What a byte buys: the error of methods on one capture against what they keep of a texel, and the baselines that they must beat."""

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

IMAGE_BYTES = 8  # of an RGBA half texel: what one captured image costs where it is shipped as it is
ALL, NEAREST = "all images interpolated", "nearest image"


def compared_methods() -> tuple[Method, ...]:
    """What a report compares: a few settings of every method."""
    return tuple(fit for method in all_methods() for fit in method.compared())


@dataclass(frozen=True)
class Score:
    """Error on the lights of one role at a number of bytes a texel; `seconds` of the fit, None where there was none.

    `family` joins the points of one curve, `name` tells them apart. `psnr` and `relative_rmse` are those of
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
    """Each method fitted to the train lights of a sample and asked for those of `role`, and the baselines; in the order given.

    `sample` is a capture kept in memory, of a few thousand texels. Clusters hold the few texels that a sample leaves them a little better
    than the many of the whole. What settings warn of is passed over.
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
    """What all N train images give without any compression, at the N images' bytes: the nearest one, and all of them interpolated."""
    texels = np.arange(capture.width * capture.height)
    every = IMAGE_BYTES * len(capture.indices("train"))
    responses = ((NEAREST, nearest_image(capture, texels)), (ALL, dense_reference(capture, texels)))
    return [Score(name, name, float(every), *error_of(response, capture, role, peak)) for name, response in responses]


def nearest_image(capture: Capture, texels: Int[ndarray, " n"]) -> Reference:
    """Each direction answered by the train image closest to it. Memory: (L, n, 3) float32."""
    train = capture.indices("train")
    responses = capture.sample(train, texels)
    domain = domain_of_capture(capture)
    among = domain.captured(capture, train)
    return lambda coordinates: responses[:, domain.nearest(coordinates, among)].transpose(1, 0, 2)


def error_of(responses: Reference, capture: Capture, role: Role, peak: float) -> tuple[float, float]:
    """(PSNR in dB, mean over images, and relative rmse) of answers to the lights of `role`.

    Both are clamped at 0, but where the capture is of indirect light: there the clamp comes after the direct light.
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
    """Singular values of all train answers as a (texels, lights x colors) matrix less its mean texel, largest first.

    They are what the best scalar planes could hold, one a plane; all colors share a plane and weigh alike, as all lights do.
    Work: the smaller side squared times the larger.
    """
    texels = sample.width * sample.height
    return singular_values(sample.sample(sample.indices("train"), np.arange(texels)).reshape(texels, -1))


def singular_values(responses: Float32[ndarray, "n m"]) -> Float64[ndarray, " r"]:
    """Singular values of `answers` less their mean row, largest first; by the smaller side's Gram matrix, good to 1e-6 of the first."""
    centerd: Float32[ndarray, "n m"] = responses - responses.mean(axis=0, dtype=np.float64).astype(np.float32)
    smaller = centerd.T if len(centerd) > centerd.shape[1] else centerd
    double = smaller.astype(np.float64)
    gram = double @ double.T
    return np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[::-1], 0))


def planes_bound(values: Float64[ndarray, " r"], responses: int, peak: float) -> Float64[ndarray, " r"]:
    """PSNR (dB, pooled over `answers` values) of the best 0 … r - 1 scalar planes on the very answers they come from, before a clamp."""
    left = np.cumsum((values**2)[::-1])[::-1]  # beyond the first s planes
    return np.array([psnr(peak, float(np.sqrt(energy / responses))) for energy in left])


def texel_bytes(asset: Asset) -> int | float:
    """Bytes that a shader reads of a texel's own data under a directional light."""
    return asset.bytes_per_texel()["directional"]


def family_of(asset: Asset) -> str:
    """The curve that an asset is on: its method, or its basis where a method has several."""
    return method_of(asset).family(asset)


def name_of(asset: Asset) -> str:
    """What tells an asset from others of its family: how many numbers per texel, and its encoding where it is not half floats."""
    encoding = {"half": "", "float": ", float", "uint8": ", bytes", "bc7": ", BC7", "bc1": ", BC1"}[asset.encoding]
    return method_of(asset).label(asset) + encoding
