"""Direct light by rays: several per texel, over its footprint on the mesh and over the light's extent, traced by Embree."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.compute.threads import each, one_blas_thread
from srbf.encode.dilation import dilate, nearest_covered
from srbf.light_linking import Objects
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight, has_size
from srbf.unshadowed import irradiance_from
from srbf.vectors import largest_component, lengths
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.environment_rays import RAYS as ENVIRONMENT_RAYS
from srbf.visibility.environment_rays import EnvironmentSampler
from srbf.visibility.light_rays import CastingLight, rays_towards
from srbf.visibility.lightmap_points import LightmapPoints
from srbf.visibility.linked_triangles import casting, lit_at, lit_triangles
from srbf.visibility.material_albedo import MaterialAlbedo, nearest_pure
from srbf.visibility.outlines import outlines
from srbf.visibility.receivers import Receivers, hashed, pixel_filter, spread_points
from srbf.visibility.shadow import rounded_share
from srbf.visibility.shadow_rays import RAY_OFFSET, ShadowRays
from srbf.visibility.surface import surface_at
from srbf.visibility.texel_sums import TexelSums

FIRST_SAMPLES = 4  # of every texel
FIRST_IN_VIEW, FINE_VIEW = 16, 1 << 18  # of every pixel, where shadows of thin things fall between few; of views of at most so many pixels
SAMPLES = 32  # of a texel whose first samples differ
MAX_SAMPLES = 512  # of a texel whose samples still differ, mostly at shadow edges
MANY_EDGES = 0.1  # of the lit texels, for which edges get MAX_SAMPLES: the noise of fewer counts less in the picture
EDGE_BUDGET = 64  # samples of edges per texel of the image, in the mean
SPREAD_ROUNDS = 6  # in which texels beside a penumbra's are found to be part of it
CACHED_SAMPLES = 1 << 22  # kept from light to light
TEXEL_BATCH = 1 << 16
BATCH = 1 << 16  # samples at a time, in each thread
ENVIRONMENT_POINTS = 8  # of a texel, from each of which rays go to an environment
ENVIRONMENT_BATCH = 1 << 18  # such rays at a time
LEAST_BUMP, LEAST_BUMP_COS, SAME_PLACE = 1e-2, 0.2, 1e-2  # change of a normal; its cosine; off the place, over the distance to the eye
SAME_NORMAL = 0.9  # cosine between the smooth normals of samples that a pixel's bump map turns as it does its center's
GOLDEN = (math.sqrt(5) - 1) / 2
MATERIAL_SAMPLES = 64  # of a pixel that shows several materials


@dataclass(frozen=True)
class Samples:
    """n points on surfaces: texel, weight (0: no surface), position (m), shading and face normal, offset to the rounded surface (m).

    `triangle`: that each is on, -1 of none.
    """

    texel: Int[ndarray, " n"]
    weight: Float32[ndarray, " n"]
    point: Float32[ndarray, "n 3"]
    normal: Float32[ndarray, "n 3"]
    face: Float32[ndarray, "n 3"]
    lift: Float32[ndarray, "n 3"]
    share: Float32[ndarray, "n 3"] | Float32[ndarray, "n 1"]  # in its texel's mean; the albedo if a pixel shows several materials
    triangle: Int[ndarray, " n"]


class RayTracer:
    """Direct light on receivers by rays. Deterministic: the sample points are fixed. MissingLibraryError without embreex."""

    def __init__(self, receivers: Receivers, samples: int = SAMPLES) -> None:
        self._receivers = receivers
        self._few = FIRST_IN_VIEW if receivers.camera is not None and receivers.width * receivers.height <= FINE_VIEW else FIRST_SAMPLES
        self._count = max(samples, self._few)
        triangles = receivers.triangles
        self._all = EmbreeTriangles(triangles.corners)
        self._shadow_rays: dict[Objects | None, ShadowRays] = {None: ShadowRays(triangles)}
        height, width = receivers.height, receivers.width
        self._turn = hashed(height, width, 4).reshape(-1, 4)
        self._most = max(self._count, MAX_SAMPLES)
        points = spread_points(self._most)
        self._square, self._disc = points[:, :2], points[:, 2:]
        coverage = receivers.images.get("coverage")
        covered = np.ones(height * width, bool) if coverage is None else coverage.ravel() > 0
        self._texels = np.flatnonzero(covered)
        self._nearest = None if coverage is None else nearest_covered(coverage)
        self._kept: dict[int, Samples] = {}
        self._materials: MaterialAlbedo | None = None
        self._bumps: tuple[Float32[ndarray, "P 3"], Float32[ndarray, "P 3"]] | None = None
        self._outlines = np.zeros(height * width, bool)
        if receivers.camera is None:
            self._lightmap = LightmapPoints(receivers, self._all.first_hit)
        else:
            found = outlines(receivers.images["position"], receivers.images["normal"])
            self._outlines = _most_beside(found.ravel(), height)  # pixels are filtered wider than one
            self._bumps = self._bumped()
            if receivers.quantity == "radiance":
                self._materials = self._materials_of_pixels()

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The direct light of `lights` in the receivers' quantity; named lights add nothing."""
        height, width = self._receivers.height, self._receivers.width
        total = np.zeros((height * width, 3), np.float32)
        for light in lights:
            if isinstance(light, EnvironmentLight):
                total += self._of_environment(light) * np.array(light.color, np.float32)
            if isinstance(light, (DirectionalLight, PointLight, AreaLight)):
                total += self._irradiance(light) * np.array(light.color, np.float32)
        return dilate(total.reshape(height, width, 3), self._nearest) * self._receivers.reflectance()

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    def edges(self) -> Int[ndarray, " e"]:
        """The pixels of a view that show several materials, or are beside another surface."""
        return np.flatnonzero(self._outlines)

    def samples(self, texels: Int[ndarray, " e"], numbers: range) -> Samples:
        """Points on surfaces: samples `numbers`, from 0, of the footprints of `texels`, ordered by sample."""
        step = max(1, TEXEL_BATCH * SAMPLES // max(1, len(numbers)))
        if len(texels) <= step:
            return self._samples(texels, numbers)
        parts = [self._samples(texels, range(number, number + 1)) for number in numbers]
        return Samples(*(np.concatenate([getattr(part, entry.name) for part in parts]) for entry in fields(Samples)))

    def samples_at(self, texels: Int[ndarray, " n"], squares: Float64[ndarray, "n 2"]) -> Samples:
        """Points on surfaces at the places `squares`, in [0, 1)^2, of the footprints of texels."""
        return self._seen(texels, squares) if self._receivers.camera else self._on_lightmap(texels, squares)

    def shown(self, texels: Int[ndarray, " e"], numbers: range) -> tuple[Samples, Int[ndarray, " n"]]:
        """`samples` of a view, and the pixel that shows the material of each alone, or its own."""
        found = self.samples(texels, numbers)
        if self._materials is None:
            return found, found.texel
        source = nearest_pure(
            self._materials.pure, (self._receivers.height, self._receivers.width), found.texel, self._shown(texels, numbers).ravel()
        )
        return found, np.where(source >= 0, source, found.texel)

    def reaching(
        self,
        samples: Samples,
        chosen: Int[ndarray, " n"],
        direction: Float32[ndarray, "n 3"],
        distance: Float64[ndarray, " n"] | None,
        blockers: Objects | None = None,
    ) -> Float32[ndarray, "n 3"]:
        """What part of the light along unit vectors from the `chosen` samples reaches them, up to a `distance` (m; None: endless).

        `blockers`: what casts its shadows, None: all.
        """
        return self._casting(blockers).passed(self._origins(samples, chosen, direction), direction, distance)

    def _casting(self, blockers: Objects | None) -> ShadowRays:
        if blockers not in self._shadow_rays:
            self._shadow_rays[blockers] = ShadowRays(casting(self._receivers.triangles, blockers))
        return self._shadow_rays[blockers]

    def lit(self, light: CastingLight) -> Bool[ndarray, " T"] | None:
        """On which triangles a light shines; None: on all."""
        return lit_triangles(self._receivers.triangles, light)

    def _irradiance(self, light: CastingLight) -> Float32[ndarray, "P 3"]:
        self._casting(light.blockers)  # once, before threads ask for it
        shown = self.lit(light)
        sums = TexelSums.empty(self._receivers.height, self._receivers.width, self._scale(light), has_size(light))
        weight = np.zeros(len(sums.total))
        starts = range(0, len(self._texels), max(1, BATCH // self._few))

        def first(number: int) -> None:
            samples = self._first(starts[number], starts.step)
            self._add(sums, samples, light, shown, range(self._few))
            weight[self._texels[starts[number] : starts[number] + starts.step]] = samples.weight.reshape(self._few, -1).sum(axis=0)

        with one_blas_thread():
            each(first, len(starts))
        sums = sums.relative(self._texels)
        partly = (weight > 0) & (weight < self._few)
        refined = np.zeros(len(weight), bool)
        for _ in range(SPREAD_ROUNDS):
            new = self._texels[((sums.ragged() | partly | self._outlines) & ~refined)[self._texels]]
            self._refine(sums, light, shown, new, range(self._few, self._count))
            refined[new] = True
        edges = np.flatnonzero(refined & sums.edges())
        share = len(edges) / max(1, int((sums.total[self._texels] > 0).any(axis=1).sum()))  # of what is lit
        enough = max(MAX_SAMPLES // 8, int(MAX_SAMPLES * min(1.0, share / MANY_EDGES)))
        most = min(self._most, enough, self._count + EDGE_BUDGET * len(self._texels) // max(1, len(edges)))
        self._refine(sums, light, shown, edges, range(self._count, most))
        return sums.mean().astype(np.float32)

    def _of_environment(self, light: EnvironmentLight) -> Float32[ndarray, "P 3"]:
        """By ENVIRONMENT_POINTS points of every texel."""
        sampler = EnvironmentSampler.of(light)
        sums = TexelSums.empty(self._receivers.height, self._receivers.width, None)
        step = max(1, ENVIRONMENT_BATCH // (2 * ENVIRONMENT_POINTS * ENVIRONMENT_RAYS))
        starts = range(0, len(self._texels), step)
        found: list[Any] = [None] * len(starts)

        def trace(number: int) -> None:
            samples = self._samples(self._texels[starts[number] : starts[number] + step], range(ENVIRONMENT_POINTS))
            found[number] = samples, self._under_environment(samples, sampler, np.random.default_rng(starts[number]))

        with one_blas_thread():
            each(trace, len(starts))
        for samples, visible in found:
            ones = np.ones(len(samples.texel))
            sums.add(samples.texel[: len(ones) // ENVIRONMENT_POINTS], samples.share, ones, visible, ones)
        return sums.mean().astype(np.float32)

    def _under_environment(self, samples: Samples, sampler: EnvironmentSampler, rng: np.random.Generator) -> Float32[ndarray, "n 3"]:
        """The irradiance of each sample; the rays of a texel's points are one even set."""
        normals = samples.normal.reshape(ENVIRONMENT_POINTS, -1, 3).transpose(1, 0, 2).astype(np.float64)
        ways, light = (array.transpose(1, 0, 2, 3).reshape(-1, 3) for array in sampler.rays(normals, rng))
        point = np.repeat(np.arange(len(samples.texel)), 2 * ENVIRONMENT_RAYS)
        lit = np.flatnonzero(light.any(axis=1) & (samples.weight[point] > 0))
        own, direction = point[lit], ways[lit].astype(np.float32)
        passed = light[lit] * self.reaching(samples, own, direction, None)
        return np.stack([np.bincount(own, passed[:, c], len(samples.texel)) for c in range(3)], axis=1).astype(np.float32)

    @staticmethod
    def _origins(samples: Samples, chosen: Int[ndarray, " n"], direction: Float32[ndarray, "n 3"]) -> Float32[ndarray, "n 3"]:
        """Where shadow rays of the `chosen` samples start: off their face, and on the rounded surface where that matters."""
        point, face = samples.point[chosen], samples.face[chosen]
        NoL, NgL = (np.einsum("nc,nc->n", normal, direction) for normal in (samples.normal[chosen], face))
        origin = point + samples.lift[chosen] * rounded_share(NoL, NgL)[:, None]
        offset = np.where(NgL < 0, -1, 1) * RAY_OFFSET * (1 + largest_component(point))
        return (origin + face * offset[:, None]).astype(np.float32)

    def _scale(self, light: CastingLight) -> Float64[ndarray, " P"] | None:
        """Every texel's unshadowed irradiance; None for suns."""
        if isinstance(light, DirectionalLight):
            return None
        if isinstance(light, SpotLight):
            light = light.without_cone()
        position, normal = (self._receivers.images[name].reshape(-1, 3)[self._texels] for name in ("position", "normal"))
        scale = np.zeros(self._receivers.height * self._receivers.width)
        scale[self._texels] = irradiance_from(light, position, normal)
        return scale if self._receivers.camera is None else _most_beside(scale, self._receivers.height)

    def _refine(
        self, sums: TexelSums, light: CastingLight, shown: Bool[ndarray, " T"] | None, texels: Int[ndarray, " e"], numbers: range
    ) -> None:
        """Add samples `numbers` of `texels`; `shown`: triangles that the light shines on."""
        starts = range(0, len(texels) if len(numbers) else 0, max(1, BATCH // max(1, len(numbers))))

        def add(number: int) -> None:
            own = texels[starts[number] : starts[number] + starts.step]
            self._add(sums, self._samples(own, numbers), light, shown, numbers)

        with one_blas_thread():
            each(add, len(starts))

    def _first(self, start: int, count: int) -> Samples:
        if start in self._kept:
            return self._kept[start]
        texels = self._texels[start : start + count]
        samples = self.samples_at(np.tile(texels, self._few), _balanced(self._turn[texels], self._few).reshape(-1, 2))
        if len(self._texels) * self._few <= CACHED_SAMPLES:
            self._kept[start] = samples
        return samples

    def _add(self, sums: TexelSums, samples: Samples, light: CastingLight, shown: Bool[ndarray, " T"] | None, numbers: range) -> None:
        """Add the light that reaches each sample from a white light."""
        count = len(samples.texel)

        def square() -> Float64[ndarray, "n 2"]:
            number = numbers.start + np.arange(count) // max(1, count // len(numbers))
            return (self._disc[number] + self._turn[samples.texel, 2:]) % 1

        rays = rays_towards(light, samples.point, samples.normal, self._receivers.sun_angle, square)
        NoL = np.einsum("nc,nc->n", samples.normal, rays.direction)
        visible = rays.opening.astype(np.float32)
        if shown is not None:
            visible *= lit_at(shown, samples.triangle)[:, None]
        lit = np.flatnonzero((NoL > 0) & (samples.weight > 0) & (rays.irradiance > 0) & (largest_component(visible) > 0))
        distance = None if rays.distance is None else rays.distance[lit]
        visible[lit] *= self.reaching(samples, lit, rays.direction[lit].astype(np.float32), distance, light.blockers)
        sums.add(samples.texel[: count // len(numbers)], samples.share, rays.importance, visible, rays.irradiance)

    def _samples(self, texels: Int[ndarray, " e"], numbers: range) -> Samples:
        """Sample points `numbers` of each texel, ordered by sample."""
        texel, square = np.tile(texels, len(numbers)), self._squares(texels, numbers)
        return self.samples_at(texel, square)

    def _squares(self, texels: Int[ndarray, " e"], numbers: range) -> Float64[ndarray, "n 2"]:
        square = (self._square[numbers.start : numbers.stop, None] + self._turn[None, texels, :2]) % 1  # (s, e, 2)
        if numbers.start == 0:
            square[:FIRST_SAMPLES] = _balanced(self._turn[texels], FIRST_SAMPLES)[: len(numbers)]
        return square.reshape(-1, 2)

    def _on_lightmap(self, texel: np.ndarray, square: np.ndarray) -> Samples:
        found = self._lightmap.at(texel, square)
        return Samples(texel, found.weight, found.point, found.normal, found.face, found.lift, found.weight[:, None], found.triangle)

    def _seen(self, texel: np.ndarray, square: np.ndarray) -> Samples:
        offset = self._offsets(square)
        origin, direction = self._looks(texel, offset)
        hit, far, bary = self._all.first_hit(origin, direction)
        real = hit >= 0
        triangle = np.where(real, hit, 0)
        point = (origin + direction * np.where(real, far, 0)[:, None]).astype(np.float32)
        normal, face, lift = surface_at(self._receivers.triangles, triangle, bary)
        away = np.where(np.einsum("nc,nc->n", face, direction) > 0, -1, 1)[:, None].astype(np.float32)
        if self._receivers.sampling.get("behind"):
            away = -away
        normal = normal * away
        if self._bumps is not None:
            smooth, bump = self._bumps
            turned = normal + self._bump_at(bump, texel, offset) * (np.einsum("nc,nc->n", normal, smooth[texel]) > SAME_NORMAL)[:, None]
            normal = turned / np.maximum(lengths(turned), 1e-20)[:, None]
        weight = real.astype(np.float32)
        share = weight[:, None]
        if self._materials is not None:
            share = share * self._materials.at(texel, self._receivers.triangles.material[triangle])
        return Samples(texel, weight, point, normal, face * away, lift * away, share, hit.astype(np.int64))

    def _bumped(self) -> tuple[Float32[ndarray, "P 3"], Float32[ndarray, "P 3"]] | None:
        """(smooth normals at the centers of pixels, what turns them into those that the bake saw); None where there are no bump maps."""
        centers = self._seen(self._texels, np.full((len(self._texels), 2), 0.5))
        seen = self._receivers.images["normal"].reshape(-1, 3)[self._texels]
        same = (centers.weight > 0) & (np.einsum("nc,nc->n", seen, centers.normal) > LEAST_BUMP_COS)
        position = self._receivers.images["position"].reshape(-1, 3)[self._texels]
        origin, _ = self._looks(self._texels, np.zeros((len(self._texels), 2)))
        far = np.linalg.norm(position - centers.point, axis=1) > SAME_PLACE * np.linalg.norm(position - origin, axis=1)
        change = np.where((same & ~far)[:, None], seen - centers.normal, 0)
        if np.abs(change).max(initial=0) < LEAST_BUMP:
            return None
        smooth, bump = np.zeros((2, self._receivers.height * self._receivers.width, 3), np.float32)
        smooth[self._texels], bump[self._texels] = centers.normal, change
        return smooth, bump

    def _offsets(self, square: np.ndarray) -> Float64[ndarray, "n 2"]:
        """Places of the unit square as offsets from the centers of pixels, in pixels."""
        camera = self._receivers.camera
        assert camera is not None
        return pixel_filter(camera["filter"], camera["filter_width"], square)

    def _bump_at(self, bump: Float32[ndarray, "P 3"], texel: np.ndarray, offset: np.ndarray) -> Float32[ndarray, "n 3"]:
        """Between the centers of pixels, by linear interpolation."""
        from scipy.ndimage import map_coordinates

        height, width = self._receivers.height, self._receivers.width
        place = np.stack([texel // width + offset[:, 1], texel % width + offset[:, 0]])
        planes = bump.reshape(height, width, 3).transpose(2, 0, 1)
        return np.stack([map_coordinates(plane, place, order=1, mode="nearest") for plane in planes], axis=1)

    def _looks(self, texel: np.ndarray, offset: np.ndarray) -> tuple[Float32[ndarray, "n 3"], Float32[ndarray, "n 3"]]:
        """Camera rays through offsets from the centers of pixels: origin (m) and unit direction."""
        camera = self._receivers.camera
        assert camera is not None
        u = (texel % self._receivers.width + 0.5 + offset[:, 0]) / self._receivers.width
        v = (texel // self._receivers.width + 0.5 + offset[:, 1]) / self._receivers.height
        matrix, frame = np.array(camera["matrix_world"], np.float64), np.array(camera["frame"], np.float64)
        top_right, _, bottom_left, top_left = frame
        aim = top_left + u[:, None] * (top_right - top_left) + v[:, None] * (bottom_left - top_left)
        if camera["type"] == "PERSP":
            origin = np.broadcast_to(matrix[:3, 3], aim.shape)
            direction = aim @ matrix[:3, :3].T
        else:
            origin = (aim * [1, 1, 0]) @ matrix[:3, :3].T + matrix[:3, 3]
            direction = np.broadcast_to(-matrix[:3, 2], aim.shape)
        direction = direction / lengths(direction)[:, None]
        return origin.astype(np.float32), direction.astype(np.float32)

    def _materials_of_pixels(self) -> MaterialAlbedo:
        """What each pixel shows: by its first samples, and by MATERIAL_SAMPLES beside pixels that show several, which may be thin."""
        pure = np.full(self._receivers.height * self._receivers.width, -1)
        for start in range(0, len(self._texels), TEXEL_BATCH):
            texels = self._texels[start : start + TEXEL_BATCH]
            shown = self._shown(texels, range(FIRST_SAMPLES))
            pure[texels] = np.where((shown == shown[0]).all(axis=0), shown[0], -1)
        tested = np.zeros(len(pure), bool)
        pixels, materials = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
        while len(mixed := self._texels[(_most_beside((pure < 0) | self._outlines, self._receivers.height) & ~tested)[self._texels]]):
            tested[mixed] = True
            for start in range(0, len(mixed), TEXEL_BATCH):
                texels = mixed[start : start + TEXEL_BATCH]
                shown = self._shown(texels, range(MATERIAL_SAMPLES))
                one = (shown == shown[0]).all(axis=0)
                pure[texels] = np.where(one, shown[0], -1)
                own = np.tile(texels, MATERIAL_SAMPLES)
                real = np.flatnonzero((shown.ravel() >= 0) & ~np.tile(one, MATERIAL_SAMPLES))
                pixels.append(own[real])
                materials.append(shown.ravel()[real])
        self._outlines |= pure < 0
        return MaterialAlbedo.of(self._receivers.images["albedo"], pure, np.concatenate(pixels), np.concatenate(materials))

    def _shown(self, texels: Int[ndarray, " e"], numbers: range) -> Int[ndarray, "s e"]:
        """The materials that samples of pixels hit, -1 for none."""
        hit, _, _ = self._all.first_hit(*self._looks(np.tile(texels, len(numbers)), self._offsets(self._squares(texels, numbers))))
        return np.where(hit >= 0, self._receivers.triangles.material[np.maximum(hit, 0)], -1).reshape(len(numbers), -1)


def _most_beside(values: Bool[ndarray, " P"] | Float[ndarray, " P"], height: int) -> ndarray:
    """The largest of each pixel and its neighbors."""
    from scipy import ndimage

    return ndimage.maximum_filter(values.reshape(height, -1), 3).ravel()


def _balanced(turn: Float64[ndarray, "e 4"], count: int) -> Float64[ndarray, "s e 2"]:
    """4 or 16 points of the unit square, one in each cell of a grid, with their mean in its middle: a linear change makes no noise."""
    side = math.isqrt(count)
    cells = np.stack(np.divmod(np.arange(count // 2), side)[::-1], axis=-1)[:, None]
    jitter = np.stack([turn[:, :2], turn[:, 2:]])[np.arange(count // 2) % 2]
    half = (cells + (jitter + np.arange(count // 2)[:, None, None] // 2 * GOLDEN) % 1) / side
    return np.concatenate([half, 1 - half])
