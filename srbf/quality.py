"""What a byte buys: the error of methods on one capture against what they keep of a texel, and the baselines that they must beat."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy import ndarray

from srbf import files
from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import COVERED, MANIFEST, Capture, Role
from srbf.evaluation import psnr
from srbf.image import Encoding, write_images
from srbf.methods import directional_responses
from srbf.methods.relighting_map import RelightingMap
from srbf.motion import TEXELS, Reference, dense_reference, sampled_texels

IMAGE_BYTES = 8  # of an RGBA half texel: what one captured image costs where it is shipped as it is
ALL, NEAREST = "all images interpolated", "nearest image"


@runtime_checkable
class Method(Protocol):
    """A fit with its settings."""

    def encode(self, capture: Capture) -> Asset:
        """The asset of a capture."""
        ...


METHODS: tuple[Method, ...] = tuple(RelightingMap(k=k) for k in (9, 16, 25, 36, 49))  # that a report compares


@dataclass(frozen=True)
class Score:
    """Error on the lights of one role at a number of bytes a texel; `seconds` of the fit, None where there was none.

    `family` joins the points of one curve, `name` tells them apart. `psnr` and `relative_rmse` are as `srbf.evaluation.RoleError` has them.
    """

    family: str
    name: str
    bytes_per_texel: float
    psnr: float
    relative_rmse: float
    seconds: float | None = None


@dataclass(frozen=True, eq=False)
class TexelSample:
    """Some covered `texels` (flat) of a capture as a capture of its own, n x 1 texels with every light, for the while of a `with`."""

    capture: Capture
    texels: Int[ndarray, " n"]


@contextmanager
def texel_sample(capture: Capture, count: int = TEXELS, seed: int = 0) -> Iterator[TexelSample]:
    """`count` random covered texels in a temporary folder: fits take a second, and errors are within a few hundredths of a dB.

    Texels that are neighbours in the sample are none in the image. Every image of the capture is read once.
    """
    texels = sampled_texels(capture.coverage() >= COVERED, count, seed)
    answers = capture.sample(range(len(capture.lights)), texels)  # (n, L, 3)
    limit = float(np.finfo(np.float16).max)
    half = bool(np.abs(answers).max(initial=0) <= limit) and np.array_equal(answers.astype(np.float16), answers)
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        folder = Path(name)
        files.make_folder(folder / "lights")
        lights: list[dict[str, Any]] = []
        for i, light in enumerate(capture.lights):
            lights.append({"kind": "directional", "direction": list(light.direction), "role": light.role, "file": f"lights/{i:04d}.exr"})
        encoding: Encoding = "half" if half else "float"
        write_images([(folder / entry["file"], answers[None, :, i], encoding) for i, entry in enumerate(lights)])
        manifest = {
            "format": "srbf-capture",
            "version": 1,
            "quantity": capture.quantity,
            "transport": capture.transport,
            "width": len(texels),
            "height": 1,
            "lights": lights,
            **({"source": capture.manifest["source"]} if "source" in capture.manifest else {}),
        }
        files.write_json(folder / MANIFEST, manifest)
        yield TexelSample(Capture.open(folder), texels)


def contest(
    sample: TexelSample, methods: Sequence[Method], role: Role, peak: float, progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Score]:
    """Each method fitted to the sample's train lights and asked for those of `role`, and the baselines; in the order given."""
    scores = []
    for done, method in enumerate(methods):
        started = time.perf_counter()
        asset = method.encode(sample.capture)
        seconds = time.perf_counter() - started
        scores.append(score_asset(asset, sample.capture, role, peak, seconds))
        progress(done + 1, len(methods))
    return scores + baselines(sample.capture, role, peak)


def score_asset(asset: Asset, capture: Capture, role: Role, peak: float, seconds: float | None = None) -> Score:
    """The score of an asset on a capture of its texels."""
    error = error_of(lambda directions: directional_responses(asset, directions).reshape(len(directions), -1, 3), capture, role, peak)
    return Score(family_of(asset), name_of(asset), float(texel_bytes(asset)), *error, seconds)


def baselines(capture: Capture, role: Role, peak: float) -> list[Score]:
    """What all N train images give without any compression, at the N images' bytes: the nearest one, and all of them interpolated."""
    texels = np.arange(capture.width * capture.height)
    every = IMAGE_BYTES * len(capture.indices("train"))
    answers = ((NEAREST, nearest_image(capture, texels)), (ALL, dense_reference(capture, texels)))
    return [Score(name, name, float(every), *error_of(answer, capture, role, peak)) for name, answer in answers]


def nearest_image(capture: Capture, texels: Int[ndarray, " n"]) -> Reference:
    """Each direction answered by the train image closest to it. Memory: (L, n, 3) float32."""
    train = capture.indices("train")
    answers = capture.sample(train, texels)
    towards = capture.directions(train).T
    return lambda directions: answers[:, (directions @ towards).argmax(axis=1)].transpose(1, 0, 2)


def error_of(answers: Reference, capture: Capture, role: Role, peak: float) -> tuple[float, float]:
    """(PSNR in dB, mean over images, and relative rmse) of answers to the lights of `role`, both clamped at 0."""
    indices = capture.indices(role)
    squares: list[float] = []
    power = 0.0
    for first, block in capture.blocks(indices):
        relit = np.maximum(answers(capture.directions(indices[first : first + len(block)])), 0)
        for answer, reference in zip(relit, np.maximum(block, 0), strict=True):
            squares.append(float(((answer - reference) ** 2).mean(dtype=np.float64)))
            power += float((reference**2).mean(dtype=np.float64))
    return float(np.mean([psnr(peak, np.sqrt(s)) for s in squares])), float(np.sqrt(sum(squares) / max(power, 1e-30)))


def spectrum(sample: TexelSample) -> Float64[ndarray, " r"]:
    """Singular values of the sample's train answers as a (texels, lights x colours) matrix less its mean texel, largest first.

    They are what the best scalar planes could hold, one a plane; all colours share a plane and weigh alike, as all lights do.
    """
    train = sample.capture.indices("train")
    answers = sample.capture.sample(train, np.arange(len(sample.texels))).reshape(len(sample.texels), -1)
    centred: Float32[ndarray, "n 3L"] = answers - answers.mean(axis=0, dtype=np.float64).astype(np.float32)
    smaller = centred.T if len(centred) > centred.shape[1] else centred
    gram = (smaller @ smaller.T).astype(np.float64)
    return np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[::-1], 0))


def planes_bound(values: Float64[ndarray, " r"], answers: int, peak: float) -> Float64[ndarray, " r"]:
    """PSNR (dB, pooled over `answers` values) that the best 0 … r - 1 scalar planes leave on the very answers they come from."""
    left = np.cumsum((values**2)[::-1])[::-1]  # beyond the first s planes
    return np.array([psnr(peak, float(np.sqrt(energy / answers))) for energy in left])


def scalars_of(asset: Asset) -> int:
    """Numbers that an asset keeps of a texel."""
    return asset.manifest["scalars"] if "scalars" in asset.manifest else asset.stored.shape[0] * asset.stored.shape[3]


def texel_bytes(asset: Asset) -> int:
    """Bytes that a shader reads of a texel's own data under a directional light."""
    return asset.map_bytes_per_texel()


def family_of(asset: Asset) -> str:
    """The curve that an asset lies on: its method, or its basis where a method has several."""
    kind = asset.manifest.get("basis", {}).get("kind", "gaussian")
    method = asset.method.replace("-", " ")
    return method if kind == "gaussian" else f"{kind.replace('-', ' ')} lightmap"


def name_of(asset: Asset) -> str:
    """What tells an asset from its siblings: how many numbers a texel."""
    manifest = asset.manifest
    if "scalars" not in manifest:
        return f"{len(asset.stored)} maps"
    clusters = manifest.get("clusters", 1)
    return f"{manifest['scalars']} scalars" + (f", {clusters} clusters" if clusters > 1 else "")
