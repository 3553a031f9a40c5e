"""Direct light by rays: several per texel, over its footprint on the mesh and over the sun's disc, traced by Embree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.encode.dilation import dilate, nearest_covered
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight, attenuation, spot_cone
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.lightmap_points import LightmapPoints
from srbf.visibility.receivers import Receivers, disc_points, hashed, pixel_filter, spread_points
from srbf.visibility.shadow import transmittance
from srbf.visibility.surface import surface_at

FIRST_SAMPLES = 4  # of every texel
SAMPLES = 32  # of a texel whose first samples differ
MAX_SAMPLES = 512  # of a texel whose samples still differ, mostly at shadow edges
EDGE_BUDGET = 64  # samples of edges per texel of the image, in the mean
REFINE_STEP = 0.02  # irradiance between samples of a texel, or between neighbors, from which a texel is refined
NEIGHBOR_STEP = 0.2  # between neighbors: a shadow edge may cross a corner without samples
EDGE_STEP = 0.03  # between samples of a texel, from which it gets up to MAX_SAMPLES
CACHED_SAMPLES = 1 << 22  # kept from light to light
TEXEL_BATCH = 1 << 16
RAY_OFFSET = 1e-5  # m, plus this share of the distance from the origin: between a surface and the start of its shadow rays
MAX_WALLS = 32
TERMINATOR = 0.1  # cosine below which the ray of a smooth surface starts on the rounded surface [Hanika2021], Cycles' default
MIN_DIFFUSE = 1e-12  # share
NEIGHBOR_STEPS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))  # of a pixel, the nearest first


@dataclass(frozen=True)
class Samples:
    """n points on surfaces: texel, weight (0: no surface), position (m), shading and face normal, offset to the rounded surface (m)."""

    texel: Int[ndarray, " n"]
    weight: Float32[ndarray, " n"]
    point: Float32[ndarray, "n 3"]
    normal: Float32[ndarray, "n 3"]
    face: Float32[ndarray, "n 3"]
    lift: Float32[ndarray, "n 3"]
    share: Float32[ndarray, "n 3"] | Float32[ndarray, "n 1"]  # in its texel's mean; the albedo if a pixel shows several materials


class RayTracer:
    """Direct light on receivers by rays. Deterministic: the sample points are fixed. MissingLibraryError without embreex."""

    def __init__(self, receivers: Receivers, samples: int = SAMPLES) -> None:
        self._receivers = receivers
        self._count = max(samples, FIRST_SAMPLES)
        triangles = receivers.triangles
        self._all = EmbreeTriangles(triangles.corners)
        self._occluders = EmbreeTriangles(triangles.corners[triangles.occluders])
        self._filters = EmbreeTriangles(triangles.corners[triangles.filters])
        self._transmittance = triangles.transmittance
        self._filter_material = triangles.material[triangles.filters]
        self._filter_normals = triangles.normals[triangles.filters]
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
        self._pure: Int[ndarray, " P"] | None = None
        if receivers.camera is not None and receivers.quantity == "radiance":
            self._pure = self._materials_of_pixels()
        if receivers.camera is None:
            self._lightmap = LightmapPoints(receivers, self._all.first_hit)

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The direct light of `lights` in the receivers' quantity; environments add nothing."""
        height, width = self._receivers.height, self._receivers.width
        total = np.zeros((height * width, 3), np.float32)
        for light in lights:
            if not isinstance(light, EnvironmentLight):
                total += self._irradiance(light) * np.array(light.color, np.float32)
        return dilate(total.reshape(height, width, 3), self._nearest) * self._receivers.reflectance()

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    def _irradiance(self, light: DirectionalLight | PointLight) -> Float32[ndarray, "P 3"]:
        texels = self._receivers.height * self._receivers.width
        sums = _Sums(
            np.zeros((texels, 3)), np.zeros((texels, 3)), np.full((texels, 3), np.inf, np.float32), np.zeros((texels, 3), np.float32)
        )
        weight = np.zeros(texels)
        for start in range(0, len(self._texels), TEXEL_BATCH):
            samples = self._first(start)
            sums.add(samples, self._lit(samples, light, range(FIRST_SAMPLES)))
            weight += np.bincount(samples.texel, samples.weight, texels)
        ragged = self._ragged(sums.mean(), sums.low, sums.high, weight)
        self._refine(sums, light, ragged, range(FIRST_SAMPLES, self._count))
        edges = ragged[(sums.spread(ragged) > EDGE_STEP) | (self._steps(sums.mean())[ragged] > NEIGHBOR_STEP)]
        most = min(self._most, self._count + EDGE_BUDGET * len(self._texels) // max(1, len(edges)))
        self._refine(sums, light, edges, range(self._count, most))
        return sums.mean().astype(np.float32)

    def _refine(self, sums: _Sums, light: DirectionalLight | PointLight, texels: Int[ndarray, " e"], numbers: range) -> None:
        """Add samples `numbers` of `texels`."""
        step = max(1, TEXEL_BATCH * SAMPLES // max(1, len(numbers)))
        for start in range(0, len(texels) if len(numbers) else 0, step):
            samples = self._samples(texels[start : start + step], numbers)
            sums.add(samples, self._lit(samples, light, numbers))

    def _ragged(self, mean: np.ndarray, low: np.ndarray, high: np.ndarray, weight: np.ndarray) -> Int[ndarray, " e"]:
        """Texels whose samples differ, or that differ from a neighbor."""
        beside = self._steps(mean) > REFINE_STEP
        within = ((high - low).max(axis=1) > REFINE_STEP) | ((weight > 0) & (weight < FIRST_SAMPLES))
        chosen = (beside | within)[self._texels]
        return self._texels[chosen]

    def _steps(self, mean: np.ndarray) -> Float64[ndarray, " P"]:
        """Largest difference of each texel to a neighbor."""
        image = mean.max(axis=1).reshape(self._receivers.height, self._receivers.width)
        from scipy import ndimage

        return (ndimage.maximum_filter(image, 3) - ndimage.minimum_filter(image, 3)).ravel()

    def _first(self, start: int) -> Samples:
        if start in self._kept:
            return self._kept[start]
        samples = self._samples(self._texels[start : start + TEXEL_BATCH], range(FIRST_SAMPLES))
        if len(self._texels) * FIRST_SAMPLES <= CACHED_SAMPLES:
            self._kept[start] = samples
        return samples

    def _lit(self, samples: Samples, light: DirectionalLight | PointLight, numbers: range) -> Float32[ndarray, "n 3"]:
        """N.L times the light that reaches each sample, for a white light."""
        to_light, distance, strength = self._towards(samples, light, numbers)
        NoL = np.einsum("nc,nc->n", samples.normal, to_light)
        lit = np.flatnonzero((NoL > 0) & (samples.weight > 0) & (strength > 0))
        result = np.zeros((len(NoL), 3), np.float32)
        direction = to_light[lit].astype(np.float32)
        point, face = samples.point[lit], samples.face[lit]
        NgL = np.einsum("nc,nc->n", face, direction)
        low_sun = NoL[lit] < TERMINATOR
        amount = np.where(low_sun, 2 - (NgL + NoL[lit]) / TERMINATOR, 1 - NgL / TERMINATOR)
        origin = point + samples.lift[lit] * np.clip(amount, 0, 1)[:, None]
        origin += face * (np.where(NgL < 0, -1, 1) * RAY_OFFSET * (1 + np.abs(point).max(axis=1)))[:, None]
        passed = self._passed(origin, direction, None if distance is None else distance[lit])
        result[lit] = passed * (NoL * strength)[lit, None]
        return result

    def _towards(
        self, samples: Samples, light: DirectionalLight | PointLight, numbers: range
    ) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
        """(unit vector to the light, distance or None, strength) of every sample."""
        count = len(samples.texel)
        if isinstance(light, PointLight):
            vector = np.array(light.position) - samples.point
            distance = np.linalg.norm(vector, axis=1)
            unit = vector / np.maximum(distance, 1e-30)[:, None]
            strength = attenuation(distance, light)
            if isinstance(light, SpotLight):
                strength = strength * spot_cone(-(unit @ np.array(light.direction)), np.cos(light.inner), np.cos(light.outer))
            return unit, distance, strength
        axis = np.array(light.direction)
        if self._receivers.sun_angle == 0:
            return np.broadcast_to(axis, (count, 3)), None, np.ones(count)
        number = numbers.start + np.arange(count) // max(1, count // len(numbers))
        disc = disc_points((self._disc[number] + self._turn[samples.texel, 2:]) % 1) * np.tan(self._receivers.sun_angle / 2)
        across = np.cross(axis, [1, 0, 0] if abs(axis[0]) < 0.9 else [0, 1, 0])
        across /= np.linalg.norm(across)
        unit = axis + disc[:, :1] * across + disc[:, 1:] * np.cross(axis, across)
        return unit / np.linalg.norm(unit, axis=1, keepdims=True), None, np.ones(count)

    def _passed(self, origin: np.ndarray, direction: np.ndarray, distance: np.ndarray | None) -> Float32[ndarray, "n 3"]:
        """Transmittance of each ray: 0 behind opaque surfaces, else the product over the walls on the way."""
        free = ~self._occluders.occluded(origin, direction, distance)
        passed = np.repeat(free.astype(np.float32)[:, None], 3, axis=1)
        if not len(self._filter_material):
            return passed
        active = np.flatnonzero(free)
        start = origin[active].copy()
        left = None if distance is None else distance[active].copy()
        for _ in range(MAX_WALLS):
            hit, far, bary = self._filters.first_hit(start, direction[active])
            meets = (hit >= 0) if left is None else (hit >= 0) & (far < left)
            active, start, far, hit, bary = active[meets], start[meets], far[meets], hit[meets], bary[meets]
            if not len(active):
                break
            passed[active] *= self._wall(hit, bary, direction[active])
            step = far + RAY_OFFSET * (1 + np.abs(start).max(axis=1))
            start = start + direction[active] * step[:, None]
            left = None if left is None else left[meets] - step
        return passed

    def _wall(self, wall: Int[ndarray, " n"], bary: Float32[ndarray, "n 3"], direction: Float32[ndarray, "n 3"]) -> Float32[ndarray, "n 3"]:
        """Transmittance of one wall at the angle of each ray."""
        normal = np.einsum("nk,nkc->nc", bary, self._filter_normals[wall])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
        return transmittance(self._transmittance[self._filter_material[wall]], np.einsum("nc,nc->n", normal, direction))

    def _samples(self, texels: Int[ndarray, " e"], numbers: range) -> Samples:
        """Sample points `numbers` of each texel, ordered by sample."""
        square = (self._square[numbers.start : numbers.stop, None] + self._turn[None, texels, :2]) % 1  # (s, e, 2)
        texel = np.tile(texels, len(numbers))
        square = square.reshape(-1, 2)
        return self._seen(texel, square) if self._receivers.camera else self._on_lightmap(texel, square)

    def _on_lightmap(self, texel: np.ndarray, square: np.ndarray) -> Samples:
        found = self._lightmap.at(texel, square)
        return Samples(texel, found.weight, found.point, found.normal, found.face, found.lift, found.weight[:, None])

    def _seen(self, texel: np.ndarray, square: np.ndarray) -> Samples:
        origin, direction = self._looks(texel, square)
        hit, far, bary = self._all.first_hit(origin, direction)
        real = hit >= 0
        triangle = np.where(real, hit, 0)
        point = (origin + direction * np.where(real, far, 0)[:, None]).astype(np.float32)
        normal, face, lift = surface_at(self._receivers.triangles, triangle, bary)
        away = np.where(np.einsum("nc,nc->n", face, direction) > 0, -1, 1)[:, None].astype(np.float32)
        weight = real.astype(np.float32)
        share = weight[:, None] * (1 if self._pure is None else self._albedo(texel, self._receivers.triangles.material[triangle]))
        return Samples(texel, weight, point, normal * away, face * away, lift * away, share)

    def _looks(self, texel: np.ndarray, square: np.ndarray) -> tuple[Float32[ndarray, "n 3"], Float32[ndarray, "n 3"]]:
        """Camera rays: origin (m) and unit direction."""
        camera = self._receivers.camera
        assert camera is not None
        offset = pixel_filter(camera["filter"], camera["filter_width"], square)
        u = (texel % self._receivers.width + 0.5 + offset[:, 0]) / self._receivers.width
        v = (texel // self._receivers.width + 0.5 + offset[:, 1]) / self._receivers.height
        matrix, frame = np.array(camera["matrix_world"]), np.array(camera["frame"])
        top_right, _, bottom_left, top_left = frame
        aim = top_left + u[:, None] * (top_right - top_left) + v[:, None] * (bottom_left - top_left)
        if camera["type"] == "PERSP":
            origin = np.broadcast_to(matrix[:3, 3], aim.shape)
            direction = aim @ matrix[:3, :3].T
        else:
            origin = (aim * [1, 1, 0]) @ matrix[:3, :3].T + matrix[:3, 3]
            direction = np.broadcast_to(-matrix[:3, 2], aim.shape)
        direction = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        return origin.astype(np.float32), direction.astype(np.float32)

    def _materials_of_pixels(self) -> Int[ndarray, " P"]:
        """The material of each pixel; -1 if its first samples hit several, or none."""
        pure = np.full(self._receivers.height * self._receivers.width, -1)
        for start in range(0, len(self._texels), TEXEL_BATCH):
            texels = self._texels[start : start + TEXEL_BATCH]
            square = (self._square[:FIRST_SAMPLES, None] + self._turn[None, texels, :2]) % 1
            hit, _, _ = self._all.first_hit(*self._looks(np.tile(texels, FIRST_SAMPLES), square.reshape(-1, 2)))
            shown = np.where(hit >= 0, self._receivers.triangles.material[np.maximum(hit, 0)], -1).reshape(FIRST_SAMPLES, -1)
            pure[texels] = np.where((shown == shown[0]).all(axis=0), shown[0], -1)
        return pure

    def _albedo(self, texel: Int[ndarray, " n"], material: Int[ndarray, " n"]) -> Float32[ndarray, "n 3"]:
        """The albedo of a material in its pixel, or in the nearest pixel with that material alone; else that of the mixture."""
        assert self._pure is not None
        width, height = self._receivers.width, self._receivers.height
        image = self._receivers.images["albedo"].reshape(-1, 3)
        source = texel.copy()
        open_ = np.flatnonzero(self._pure[texel] != material)
        for right, down in NEIGHBOR_STEPS:
            if not len(open_):
                break
            column, row = texel[open_] % width + right, texel[open_] // width + down
            beside = np.clip(row, 0, height - 1) * width + np.clip(column, 0, width - 1)
            found = self._pure[beside] == material[open_]
            source[open_[found]] = beside[found]
            open_ = open_[~found]
        return np.maximum(image[source], 0)


@dataclass(frozen=True)
class _Sums:
    """Sums of P texels: light and shares, whose ratio times a texel's albedo is its radiance for any mixture; minimum and maximum."""

    total: Float64[ndarray, "P 3"]
    share: Float64[ndarray, "P 3"]
    low: Float32[ndarray, "P 3"]
    high: Float32[ndarray, "P 3"]

    def add(self, samples: Samples, light: Float32[ndarray, "n 3"]) -> None:
        """Add the light at `samples`."""
        every = np.broadcast_to(samples.share, light.shape)
        for channel in range(3):
            self.total[:, channel] += np.bincount(samples.texel, light[:, channel] * every[:, channel], len(self.total))
            self.share[:, channel] += np.bincount(samples.texel, every[:, channel], len(self.share))
        real = samples.weight > 0
        np.minimum.at(self.low, samples.texel[real], light[real])
        np.maximum.at(self.high, samples.texel[real], light[real])

    def mean(self) -> Float64[ndarray, "P 3"]:
        """Mean light of every texel."""
        return self.total / np.maximum(self.share, MIN_DIFFUSE)

    def spread(self, texels: Int[ndarray, " e"]) -> Float32[ndarray, " e"]:
        """Difference between the largest and the smallest sample of `texels`."""
        return (self.high[texels] - self.low[texels]).max(axis=1)
