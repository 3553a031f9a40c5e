"""Direct light of a view whose pixels have specular lobes, which reflect it toward its camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight
from srbf.microfacets import alpha_of, reflected
from srbf.unshadowed import irradiance_from
from srbf.vectors import lengths
from srbf.visibility.light_rays import CastingLight, has_extent, rays_towards
from srbf.visibility.linked_triangles import lit_at
from srbf.visibility.rays import RayTracer, Samples
from srbf.visibility.receivers import Receivers, spread_points
from srbf.visibility.shadow_map import ShadowMapper

POINTS, SIZED_POINTS, MOST_POINTS = 4, 32, 96  # of a pixel; of one that a light with a size lights; of one whose first points differ
RAGGED = 0.2  # how far a pixel's first points are from their mean, over the largest of it
DARK = 0.05  # of the mean over pixels: differences that do not count
BATCH = 1 << 19  # samples at a time
LEAST = 1e-4  # specular reflectance of a pixel that counts
LEAST_COS = 1e-3  # to a light, of a pixel whose shadow is known by its irradiance


def has_gloss(receivers: Receivers) -> bool:
    """Whether a view's pixels have lobes, and a camera that sees them from one place or direction."""
    return (
        receivers.camera is not None and {"glossy", "lobe"} <= receivers.images.keys() and bool((receivers.images["glossy"] > LEAST).any())
    )


class GlossyPixels:
    """The pixels of a view with a specular lobe: `texels` (G,), flat indices; lobes as the bake measured them."""

    def __init__(self, receivers: Receivers) -> None:
        images = receivers.images
        self.color = images["glossy"].reshape(-1, 3).astype(np.float64)
        roughness, share = images["lobe"].reshape(-1, 3).T[:2]
        self.alpha, self.share = alpha_of(roughness), np.asarray(share, np.float64)
        shown = (self.color.max(axis=1) > LEAST) & (images["lobe"].reshape(-1, 3)[:, 2] > 0)
        if "coverage" in images:
            shown &= images["coverage"].ravel() > 0
        shown &= np.linalg.norm(images["normal"].reshape(-1, 3), axis=1) > 0.5
        self.texels = np.flatnonzero(shown)
        assert receivers.camera is not None
        matrix = np.array(receivers.camera["matrix_world"], np.float64)
        self._eye = matrix[:3, 3] if receivers.camera["type"] == "PERSP" else None
        self._axis = matrix[:3, 2]

    def view(self, points: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
        """Unit vectors to the eye."""
        if self._eye is None:
            return np.broadcast_to(self._axis, points.shape)
        vector = self._eye - np.asarray(points, np.float64)
        return vector / np.maximum(lengths(vector), 1e-30)[:, None]

    def reflected(
        self, pixels: Int[ndarray, " n"], points: ndarray, normals: ndarray, directions: Float64[ndarray, "n 3"]
    ) -> Float64[ndarray, "n 3"]:
        """f NoL of the lobes of some pixels, at points with normals, of light from unit `directions`."""
        return reflected(normals, self.view(points), directions, self.color[pixels], self.alpha[pixels], self.share[pixels])


class GlossyRays:
    """Direct light by rays, that of lobes included, from several points of each pixel."""

    def __init__(self, receivers: Receivers, tracer: RayTracer) -> None:
        self._receivers, self._tracer, self._pixels = receivers, tracer, GlossyPixels(receivers)
        self._disc = spread_points(MOST_POINTS)[:, 2:]
        self._first: list[tuple[Samples, ndarray]] = []

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The radiance of diffuse reflection and of lobes, to which environments and named lights add nothing."""
        total = np.zeros((self._receivers.height * self._receivers.width, 3))
        for light in lights:
            if isinstance(light, (DirectionalLight, PointLight, AreaLight)):
                total[self._pixels.texels] += self._of(light) * np.array(light.color)
        diffuse = self._tracer.response(lights)
        return diffuse + total.reshape(diffuse.shape).astype(np.float32)

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    def _of(self, light: CastingLight) -> Float64[ndarray, "G 3"]:
        """The mean over POINTS points of every pixel, over more where these differ."""
        texels, step = self._pixels.texels, max(1, BATCH // POINTS)
        if not self._first:
            self._first = [self._tracer.shown(texels[start : start + step], range(POINTS)) for start in range(0, len(texels), step)]
        total, weight, farthest = np.zeros((len(texels), 3)), np.zeros(len(texels)), np.zeros(len(texels))
        for number, (samples, pixels) in enumerate(self._first):
            part = slice(number * step, number * step + step)
            found, counts = self._found(light, samples, pixels, 0)
            total[part], weight[part] = found.sum(axis=0), counts.sum(axis=0)
            strength = found.max(axis=2)
            farthest[part] = np.ptp(strength, axis=0)
        mean = total.max(axis=1) / np.maximum(weight, 1)
        sized = has_extent(light, self._receivers.sun_angle)
        most = SIZED_POINTS if sized else MOST_POINTS
        ragged = np.full(len(texels), sized) | (farthest > RAGGED * np.maximum(mean, DARK * mean.mean()))
        rest = np.flatnonzero(ragged)
        step = max(1, BATCH // most)
        for start in range(0, len(rest), step):
            own = rest[start : start + step]
            found, counts = self._found(light, *self._tracer.shown(texels[own], range(POINTS, most)), POINTS)
            total[own] += found.sum(axis=0)
            weight[own] += counts.sum(axis=0)
        return total / np.maximum(weight, 1)[:, None]

    def _found(
        self, light: CastingLight, samples: Samples, pixels: ndarray, first: int
    ) -> tuple[Float64[ndarray, "s e 3"], Float64[ndarray, "s e"]]:
        """What each sample of each pixel reflects, and its weight."""
        count = len(np.unique(samples.texel))
        each = len(samples.texel) // max(1, count)
        turn = np.tile(np.random.default_rng(first).random((count, 2)), (each, 1))
        square = np.repeat(self._disc[first : first + each], count, axis=0)
        rays = rays_towards(light, samples.point, samples.normal, self._receivers.sun_angle, lambda: (square + turn) % 1)
        NoL = np.einsum("nc,nc->n", samples.normal, rays.direction)
        shown = (samples.weight > 0) & lit_at(self._tracer.lit(light), samples.triangle)
        lit = np.flatnonzero((NoL > LEAST) & shown & (rays.irradiance > 0) & (rays.opening > 0).any(axis=1))
        direction = rays.direction[lit].astype(np.float32)
        own = self._pixels.reflected(pixels[lit], samples.point[lit], samples.normal[lit], rays.direction[lit].astype(np.float64))
        own *= (rays.irradiance[lit] * rays.importance[lit] / NoL[lit])[:, None] * rays.opening[lit]
        distance = None if rays.distance is None else rays.distance[lit]
        own *= self._tracer.reaching(samples, lit, direction, distance, light.blockers)
        found = np.zeros((len(samples.texel), 3))
        found[lit] = own
        return found.reshape(each, count, 3), samples.weight.reshape(each, count).astype(np.float64)


class GlossyMaps:
    """Direct light by a shadow mapper, that of lobes included: at the centers of pixels, dimmed as their irradiance is."""

    def __init__(self, receivers: Receivers, mapper: ShadowMapper) -> None:
        self._receivers, self._mapper, self._pixels = receivers, mapper, GlossyPixels(receivers)
        texels = self._pixels.texels
        self._points, self._normals = (receivers.images[name].reshape(-1, 3)[texels] for name in ("position", "normal"))

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The radiance of diffuse reflection and of lobes, of lights with a size for these at their middles."""
        irradiance = np.zeros((self._receivers.height, self._receivers.width, 3), np.float32)
        total = np.zeros((self._receivers.height * self._receivers.width, 3))
        for light in lights:
            own = self._mapper.irradiance([light])
            irradiance += own
            if isinstance(light, (DirectionalLight, PointLight, AreaLight)):
                total[self._pixels.texels] += self._of(light, own.reshape(-1, 3)[self._pixels.texels])
        return irradiance * self._receivers.reflectance() + total.reshape(irradiance.shape).astype(np.float32)

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    def _of(self, light: CastingLight, shadowed: Float32[ndarray, "G 3"]) -> Float64[ndarray, "G 3"]:
        """What the lobes reflect of a light that gives their pixels the irradiance `shadowed`."""
        unshadowed = irradiance_from(light, self._points, self._normals)
        color, direction = np.array(light.color, np.float64), self._toward(light)
        if isinstance(light, PointLight):
            color = color * light.factors(self._points - np.array(light.position))
        color = np.broadcast_to(color, (len(unshadowed), 3))
        NoL = np.einsum("nc,nc->n", self._normals, direction)
        lit = np.flatnonzero((NoL > LEAST_COS) & (unshadowed > 0))
        reflected = self._pixels.reflected(self._pixels.texels[lit], self._points[lit], self._normals[lit], direction[lit])
        seen = np.clip(shadowed[lit] / np.maximum(unshadowed[lit, None] * color[lit], 1e-30), 0, 1)
        found = np.zeros((len(NoL), 3))
        found[lit] = reflected * (unshadowed[lit] / NoL[lit])[:, None] * seen * color[lit]
        return found

    def _toward(self, light: CastingLight) -> Float64[ndarray, "G 3"]:
        if isinstance(light, DirectionalLight):
            return np.broadcast_to(np.array(light.direction, np.float64), self._points.shape)
        vector = np.array(light.position) - self._points
        return vector / np.maximum(lengths(vector), 1e-30)[:, None]
