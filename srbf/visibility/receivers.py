"""Geometry of the receivers of an asset or a capture, and sample points within each texel's footprint."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.channels import GLOSS, THROUGH
from srbf.errors import InputError
from srbf.io.scene_glb import Triangles, read_triangles
from srbf.receiver_images import Quantity

SAME_SURFACE_COS = 0.9  # of the normals of two neighbors that lie on one smooth surface
OFF_PLANE = 0.2  # of their distance, the largest distance of a neighbor from the tangent plane
LEAST_THROUGH = 1e-3  # transmittance of a pixel that counts
SEAM_RATIO = 2.0  # a neighbor farther than this many times the opposite one is across a seam


@dataclass(frozen=True, eq=False)
class Receivers:
    """Receivers under direct light: geometry (H, W, 3), optional unless needed, the scene, and the sampling of the bake.

    `sampling` holds sun_angle (rad) and, for a lightmap, footprint (texels), for a view its camera;
    `behind`: the backs of what the camera sees are lit.
    """

    width: int
    height: int
    quantity: Quantity
    images: dict[str, ndarray]
    triangles: Triangles
    sampling: dict[str, Any]

    @staticmethod
    def of(source: Asset | Capture) -> Receivers:
        """Of an asset or of a capture; InputError if it lacks data for direct light."""
        if isinstance(source, Asset):
            images, data, what = dict(source.images), source.scene, "asset"
        else:
            data, what = source.scene(), "capture"
            images = {
                name: image for name in ("position", "normal", "albedo", *GLOSS, THROUGH) if (image := source.channel(name)) is not None
            }
            images["coverage"] = source.coverage()
        if data is None:
            raise InputError(f"expected the {what} to hold scene.glb, found none: direct light needs the shadow casters; bake it indirect")
        needed = ["position", "normal"] + (["albedo"] if source.quantity == "radiance" else [])
        if missing := [name for name in needed if name not in images]:
            raise InputError(f"expected the {what} to hold {', '.join(missing)} for direct light, found none; bake it indirect")
        sampling = source.manifest.get("direct", {"sun_angle": 0.0})
        if source.manifest.get("receiver", {}).get("kind") == "probes":  # points: neighbors in the image are none in space
            sampling = {**sampling, "footprint": 0.0}
        return Receivers(source.width, source.height, source.quantity, images, read_triangles(data), sampling)

    @property
    def sun_angle(self) -> float:
        """Angular diameter of the sun, rad."""
        return float(self.sampling.get("sun_angle", 0.0))

    @property
    def camera(self) -> dict[str, Any] | None:
        """The camera of the bake, if rays can follow it."""
        return self.sampling.get("camera")

    def reflectance(self) -> Float32[ndarray, "H W 3"] | float:
        """The factor from irradiance to the asset's quantity: 1, or albedo / pi."""
        return 1.0 if self.quantity == "irradiance" else self.images["albedo"] / np.float32(np.pi)

    def behind(self) -> Receivers | None:
        """The same surfaces from behind, where they let light through: normals turned over, what passes as albedo.

        `sampling` says so: its rays' hits are turned over. None where nothing does, or where no radiance is asked for.
        """
        passed = self.images.get(THROUGH)
        if passed is None or self.quantity != "radiance" or not (shown := passed.max(axis=2) > LEAST_THROUGH).any():
            return None
        coverage = self.images.get("coverage")
        covered = np.where(shown, 1.0 if coverage is None else coverage, 0).astype(np.float32)
        images = {"position": self.images["position"], "normal": -self.images["normal"], "albedo": passed, "coverage": covered}
        return replace(self, images=images, sampling={**self.sampling, "behind": True})

    def gradients(self, name: str) -> tuple[Float32[ndarray, "H W 3"], Float32[ndarray, "H W 3"]]:
        """Change of position or normal per texel to the right and down; 0 without a neighbor on the same surface."""
        along = []
        for axis in (1, 0):
            ahead, behind = self._step(name, axis, 1), self._step(name, axis, -1)
            ok_ahead, ok_behind = self._same_surface(axis, 1), self._same_surface(axis, -1)
            length_ahead, length_behind = (np.linalg.norm(self._step("position", axis, s), axis=2) for s in (1, -1))
            ok_ahead &= ~(ok_behind & (length_ahead > SEAM_RATIO * length_behind))
            ok_behind &= ~(ok_ahead & (length_behind > SEAM_RATIO * length_ahead))
            weight = ok_ahead.astype(np.float32) + ok_behind
            mean = (ahead * ok_ahead[..., None] + behind * ok_behind[..., None]) / np.maximum(weight, 1)[..., None]
            along.append(mean.astype(np.float32))
        return along[0], along[1]

    def _step(self, name: str, axis: int, sign: int) -> np.ndarray:
        image = self.images[name]
        moved = np.roll(image, -sign, axis)
        edge = [slice(None)] * 2
        edge[axis] = slice(-1, None) if sign > 0 else slice(0, 1)
        moved[tuple(edge)] = image[tuple(edge)]
        return sign * (moved - image)

    def _same_surface(self, axis: int, sign: int) -> np.ndarray:
        normal, step = self.images["normal"], self._step("position", axis, sign)
        turned = self._step("normal", axis, sign) * sign + normal
        length = np.linalg.norm(step, axis=2)
        flat = np.abs((step * normal).sum(axis=2)) <= OFF_PLANE * length
        covered = self.images.get("coverage")
        real = np.ones(length.shape, bool) if covered is None else (covered > 0)
        neighbor = np.roll(real, -sign, axis)
        return flat & ((turned * normal).sum(axis=2) >= SAME_SURFACE_COS) & (length > 0) & real & neighbor


def spread_points(count: int) -> Float64[ndarray, "S 4"]:
    """`count` evenly spread points of the unit hypercube, best for powers of two [Sobol1967]."""
    from scipy.stats import qmc

    return qmc.Sobol(4, scramble=False).random_base2(max(0, int(np.ceil(np.log2(count)))))[:count]


def disc_points(square: Float64[ndarray, "*s 2"]) -> Float64[ndarray, "*s 2"]:
    """Area-preserving map of the unit square to the unit disc."""
    radius, turn = np.sqrt(square[..., 0]), 2 * np.pi * square[..., 1]
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1)


def pixel_filter(kind: str, width: float, square: Float64[ndarray, "S 2"]) -> Float64[ndarray, "S 2"]:
    """Offsets (pixels) distributed like the filter, as the samples of Cycles, so that all have equal weight.

    Cycles' Blackman-Harris filter is twice as wide as its setting, its Gaussian three times, its box always one pixel.
    """
    x = np.linspace(-0.5, 0.5, 1025)
    if kind == "BLACKMAN_HARRIS":
        a = 2 * np.pi * (x + 0.5)
        width *= 2
        density = 0.35875 - 0.48829 * np.cos(a) + 0.14128 * np.cos(2 * a) - 0.01168 * np.cos(3 * a)
    elif kind == "GAUSSIAN":
        width *= 3
        density = np.exp(-2 * (6 * x) ** 2)
    else:
        density = np.ones_like(x)
        width = 1.0
    cumulative = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return np.interp(square, cumulative / cumulative[-1], x) * width


def hashed(height: int, width: int, channels: int) -> Float64[ndarray, "H W c"]:
    """A fixed random number in [0, 1) per texel and channel, to shift its points and avoid banding."""
    return np.random.default_rng(0).random((height, width, channels))
