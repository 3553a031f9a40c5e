"""Rays to an environment map: half of them by the cosine, half to where the map is bright, weighed by both densities [Veach1995]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.light_geometry import environment_samples
from srbf.lights import EnvironmentLight
from srbf.visibility.hemisphere import cosine_directions

RAYS = 32  # of a point; as many again to where the map is bright


@dataclass(frozen=True, eq=False)
class EnvironmentSampler:
    """A map to draw directions from: the texels' shares of all its light, summed up row by row, and the density per steradian."""

    light: EnvironmentLight
    sums: Float64[ndarray, " t"]
    density: Float64[ndarray, " t"]

    @staticmethod
    def of(light: EnvironmentLight) -> EnvironmentSampler:
        """A black map is drawn from evenly."""
        _, solid_angle = environment_samples(light.image, "sphere", light.rotation)
        flux = np.abs(light.image).mean(axis=2, dtype=np.float64).ravel() * solid_angle.ravel()
        flux = flux if flux.any() else solid_angle.ravel()
        return EnvironmentSampler(light, np.cumsum(flux / flux.sum()), flux / flux.sum() / solid_angle.ravel())

    def rays(
        self, normals: Float64[ndarray, "n q 3"], rng: np.random.Generator, count: int = RAYS
    ) -> tuple[Float64[ndarray, "n q c 3"], Float64[ndarray, "n q c 3"]]:
        """(unit vectors, what each adds to the irradiance if nothing is in its way): of every point 2 `count`, whose sum is the light."""
        by_cosine = cosine_directions(normals, count, rng)
        chosen = (np.arange(count) + rng.uniform(size=(*normals.shape[:2], count))) / count
        texel = np.minimum(np.searchsorted(self.sums, chosen.ravel(), side="right"), len(self.sums) - 1)
        to_light = self._within(texel, rng).reshape(*normals.shape[:2], count, 3)
        ways = np.concatenate([by_cosine, to_light], axis=2)
        cosine = np.maximum(np.einsum("nqck,nqk->nqc", ways, normals), 0)
        at = self._texel_of(ways.reshape(-1, 3))
        density = cosine / np.pi + self.density[at].reshape(cosine.shape)
        radiance = self.light.image.reshape(-1, 3)[at].reshape(ways.shape).astype(np.float64)
        return ways, radiance * (cosine / np.maximum(count * density, 1e-30))[..., None]

    def _within(self, texel: ndarray, rng: np.random.Generator) -> Float64[ndarray, "m 3"]:
        """A random direction of each texel, even in solid angle."""
        height, width = self.light.image.shape[:2]
        row, column = np.divmod(texel, width)
        top, bottom = (np.cos(np.pi * (row + step) / height) for step in (0, 1))
        z = top + rng.uniform(size=len(texel)) * (bottom - top)
        azimuth = (0.5 - (column + rng.uniform(size=len(texel))) / width) * 2 * np.pi
        radius = np.sqrt(np.maximum(1 - z**2, 0))
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1) @ self.light.rotation.T

    def _texel_of(self, ways: Float64[ndarray, "m 3"]) -> ndarray:
        height, width = self.light.image.shape[:2]
        x, y, z = (ways @ self.light.rotation).T
        row = np.clip(np.arccos(np.clip(z, -1, 1)) / np.pi * height, 0, height - 1).astype(np.int64)
        column = ((0.5 - np.arctan2(y, x) / (2 * np.pi)) * width).astype(np.int64) % width
        return row * width + column
