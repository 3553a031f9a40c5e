"""Error by bytes: the error of methods on one capture against their bytes per texel, and the baselines."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import Capture, Role
from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.temporal_stability import Reference, dense_reference
from srbf.methods import directional_responses
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap

IMAGE_BYTES = 8  # per RGBA half texel of one uncompressed image
ALL, NEAREST = "all images interpolated", "nearest image"


@runtime_checkable
class Method(Protocol):
    """A fit with its settings."""

    def encode(self, capture: Capture) -> Asset:
        """The asset of a capture."""
        ...


METHODS: tuple[Method, ...] = (  # compared in a report
    *(RelightingMap(k=k) for k in (9, 25, 49)),
    *(RelightingMap(k=k, basis="spherical-harmonics") for k in (4, 9, 16)),
    *(EigenMap(scalars=s, encoding="uint8") for s in (8, 16, 32)),
    *(ClusteredEigenMap(clusters=64, scalars=s, encoding="uint8") for s in (4, 8, 16)),
)


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
    error = error_of(lambda directions: directional_responses(asset, directions).reshape(len(directions), -1, 3), capture, role, peak)
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
    towards = capture.directions(train).T
    return lambda directions: responses[:, (directions @ towards).argmax(axis=1)].transpose(1, 0, 2)


def error_of(responses: Reference, capture: Capture, role: Role, peak: float) -> tuple[float, float]:
    """(PSNR in dB, mean over images, and relative rmse) of responses to the lights of `role`.

    Both images are clamped at 0, except for indirect captures, whose clamp follows the addition of direct light.
    """
    floor = -np.inf if capture.transport == "indirect" else 0.0
    indices = capture.indices(role)
    squares: list[float] = []
    power = 0.0
    for first, block in capture.blocks(indices):
        relit = np.maximum(responses(capture.directions(indices[first : first + len(block)])), floor)
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


def components_of(asset: Asset) -> int:
    """Numbers per texel of an asset."""
    return 3 * asset.k if asset.method == "relighting-map" else asset.scalars


def texel_bytes(asset: Asset) -> int | float:
    """Bytes per texel that a shader reads under a directional light."""
    return asset.bytes_per_texel()["directional"]


def family_of(asset: Asset) -> str:
    """The name of an asset's curve: its method, or its basis if that is not Gaussian."""
    kind = asset.manifest.get("basis", {}).get("kind", "gaussian")
    method = asset.method.replace("-", " ")
    return method if kind == "gaussian" else kind.replace("-", " ")


def name_of(asset: Asset) -> str:
    """The label of an asset on its curve: its maps or components per texel, clusters, and its encoding unless half."""
    encoding = {"half": "", "float": ", float", "uint8": ", bytes", "bc7": ", BC7", "bc1": ", BC1"}[asset.encoding]
    if asset.method == "relighting-map":
        return f"{asset.k} maps{encoding}"
    return f"{asset.scalars} components" + (f", {asset.clusters} clusters" if asset.clusters > 1 else "") + encoding
