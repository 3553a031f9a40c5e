"""Lights inside a scene: what they lay on its patches, what they see, of a capture or of an asset."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.encode.fingerprint import Fingerprints, scales_of
from srbf.encode.model_selection import sampled_texels
from srbf.errors import InputError
from srbf.light_domain.cloud_kernel import CloudKernel
from srbf.lights import Light, PointLight
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.patches import PLACE_WEIGHT, VISIBILITY_WEIGHT, visibility_axes
from srbf.visibility.received import ReceivedLight, occluders_of, patch_means
from srbf.visibility.surface_cells import Cells

SAMPLE_TEXELS = 4096  # by which unseen lights are judged
LEAST_VALIDATION = 4
Interpolation = Literal["auto", "fingerprint", "kernel"]


@dataclass(frozen=True, eq=False)
class CloudLights:
    """Cells of the surfaces in patches, what casts shadows, and free places (F, 3), m."""

    cells: Cells
    occluders: EmbreeTriangles
    free: Float64[ndarray, "F 3"]

    @staticmethod
    def of(capture: Capture) -> CloudLights:
        """InputError where the capture lacks scene.glb, ManifestError where it lacks patches."""
        scene = capture.scene()
        if scene is None:
            raise InputError(
                f"expected scene.glb in {capture.folder}, found none: lights inside need what casts shadows; bake with `transport=indirect`"
            )
        free = np.array(capture.manifest.get("free_places", ()), np.float64).reshape(-1, 3)
        if not len(free):
            raise InputError(f"expected free places in {capture.folder}, found none; bake a `light_set` patches or cloud")
        return CloudLights(Cells.of_image(capture.patches()), occluders_of(scene), free)

    @staticmethod
    def of_asset(asset: Asset) -> CloudLights:
        """Kept from call to call of one asset."""
        return _of_tables(asset.required_scene(), asset.tables["cells"].tobytes())

    def visible(self, origins: Float64[ndarray, "n 3"], targets: Float64[ndarray, "n 3"]) -> ndarray:
        """(n,) whether nothing stands between two places."""
        return ~self.occluders.between(origins, targets)

    def on_patches(self, light: Light) -> Float64[ndarray, "K 3"]:
        """Mean irradiance on every patch."""
        return patch_means(self.cells, self._tracer.irradiance(light))

    def received(self, places: Float64[ndarray, "n 3"]) -> Float64[ndarray, "n K"]:
        """Mean irradiance on every patch under a white point light of unit irradiance at 1 m at each place."""
        lights = [PointLight((x, y, z), falloff="inverse-square") for x, y, z in places.tolist()]
        return self._tracer.white_on_patches(lights).T.astype(np.float64)

    @functools.cached_property
    def _tracer(self) -> ReceivedLight:
        return ReceivedLight(self.cells, self.occluders)


@functools.lru_cache(maxsize=4)
def _of_tables(scene: bytes, cells: bytes) -> CloudLights:
    image = np.frombuffer(cells, np.float32).reshape(2, -1, 4)
    return CloudLights(Cells.of_image(image), occluders_of(scene), np.zeros((0, 3)))


@dataclass(frozen=True, eq=False)
class UnseenLights:
    """By what the ways of interpolating a cloud are compared: lights that they are not given, on a sample of texels.

    `prints` of the L train lights at `places`; `gram` (L + V, L + V): inner products of the images, V validation lights behind.
    """

    prints: Fingerprints
    gram: Float64[ndarray, "M M"]
    places: Float64[ndarray, "L 3"]
    validation: Float64[ndarray, "V 3"]
    inside: CloudLights

    @property
    def by_validation(self) -> bool:
        """Whether there are validation lights enough to choose by; else train lights are left out one by one."""
        return len(self.validation) >= LEAST_VALIDATION

    def fingerprint_error(self) -> float:
        """Relative RMSE of ridge regression on fingerprints."""
        if not self.by_validation:
            return float(np.sqrt(np.mean(self.prints.errors)))
        return self._error(self.prints.weights(self.inside.received(self.validation)))

    def kernel_error(self, kernel: CloudKernel) -> float:
        """Relative RMSE of the article's kernel."""
        count = len(self.places)
        if self.by_validation:
            return self._error(kernel.weights(self.validation).dense(count))
        weights = np.zeros((count, count))
        for i in range(count):
            others = np.delete(np.arange(count), i)
            alone = CloudKernel(self.places[others], kernel.visible, kernel.nearest)
            weights[i, others] = alone.weights(self.places[i : i + 1]).dense(count - 1)[0]
        return self._error(weights, first=0)

    def _error(self, weights: Float64[ndarray, "n L"], first: int | None = None) -> float:
        """Of lights from `first` on (by default the validation lights) as sums of train lights: the mean over lights, in squares."""
        count = len(self.places)
        start = count if first is None else first
        own = np.diag(self.gram)[start : start + len(weights)]
        across = self.gram[start : start + len(weights), :count]
        squares = own - 2 * np.einsum("nl,nl->n", weights, across)
        squares += np.einsum("nl,lk,nk->n", weights, self.gram[:count, :count], weights, optimize=True)
        return float(np.sqrt(np.mean(np.maximum(squares, 0) / np.maximum(own, 1e-30))))


def chosen_interpolation(wanted: Interpolation, unseen: UnseenLights | None, kernel: CloudKernel) -> tuple[str, dict[str, Any]]:
    """(interpolation, relative errors at unseen lights that chose it); the kernel where nothing is known of `unseen` lights."""
    if unseen is None:
        return "kernel", {}
    errors = {"fingerprint": unseen.fingerprint_error()}
    if wanted == "auto":
        errors["kernel"] = unseen.kernel_error(kernel)
    rule = "validation" if unseen.by_validation else "leave-one-light-out"
    return min(errors, key=lambda name: errors[name]), {"interpolation_errors": errors, "chosen_by": rule}


def unseen_lights(
    capture: Capture, inside: CloudLights, seed: int = 0, rows_of: Callable[[Int[ndarray, " n"]], Float32[ndarray, "n M C"]] | None = None
) -> UnseenLights:
    """Of the train lights of a cloud; the ridge of the fingerprints is chosen by left-out lights.

    `rows_of`: what receivers show under the train and validation lights, by default their images' colors.
    """
    train, validation = capture.indices("train"), capture.indices("validation")
    places = capture.positions(train)
    received = inside.received(places)
    texels = sampled_texels(capture, SAMPLE_TEXELS)
    rows = capture.sample([*train, *validation], texels) if rows_of is None else rows_of(texels)
    flat = rows.transpose(1, 0, 2).reshape(rows.shape[1], -1)
    gram = (flat @ flat.T).astype(np.float64)
    cells = inside.cells
    areas = np.maximum(np.bincount(cells.patches, cells.areas), 1e-30)
    middle = patch_means(cells, cells.places.astype(np.float64))
    normal = patch_means(cells, cells.normals.astype(np.float64))
    extent = max(float(np.ptp(middle, axis=0).max()), 1e-9)
    features = np.concatenate([PLACE_WEIGHT * middle / extent, normal, VISIBILITY_WEIGHT * visibility_axes(received.T > 0)], axis=1)
    prints = Fingerprints.of(received, areas, scales_of(features, areas, seed), gram[: len(train), : len(train)])
    return UnseenLights(prints, gram, places, capture.positions(validation), inside)
