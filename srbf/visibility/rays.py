"""Exact direct light by rays: several per texel, on the mesh over its footprint and over the sun's disc, traced by Embree."""

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

FIRST = 4  # samples of every texel
SAMPLES = 32  # of a texel whose first ones differ
MOST = 512  # of a texel whose samples still differ, at a shadow's edge above all
BUDGET = 64  # samples that edges may take, for each texel of the picture: where everything is an edge, each gets fewer
DIFFERENT = 0.02  # in irradiance, between samples of a texel or between neighbors
JUMP = 0.2  # between neighbors: a shadow's edge may cross a corner that no sample has met
EDGE = 0.03  # likewise between samples of a texel: it takes up to MOST, as where a shadow's edge crosses it
KEPT = 1 << 22  # samples kept from light to light; beyond, they are made anew
TEXELS = 1 << 16  # at a time
LIFT = 1e-5  # m at the origin and a part of the distance from it: how far off its surface a shadow ray starts
MOST_WALLS = 32
TERMINATOR = 0.1  # cosine below which a smooth surface's ray starts on the rounded surface [Hanika2021], as Cycles has it by default
TINY = 1e-12  # a share below which nothing is diffuse
NEAREST_FIRST = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))  # neighbors of a pixel


@dataclass(frozen=True)
class Samples:
    """n points on surfaces: texel each belongs to, its weight (0: nothing there), position, shading and face normal, rounding offset."""

    texel: Int[ndarray, " n"]
    weight: Float32[ndarray, " n"]
    point: Float32[ndarray, "n 3"]
    normal: Float32[ndarray, "n 3"]
    face: Float32[ndarray, "n 3"]
    lift: Float32[ndarray, "n 3"]
    share: Float32[ndarray, "n 3"] | Float32[ndarray, "n 1"]  # in its texel's mean: its albedo, where a pixel shows several


class RayTracer:
    """Direct light on receivers by rays. Deterministic: points and their turns are fixed. MissingLibraryError without embreex."""

    def __init__(self, receivers: Receivers, samples: int = SAMPLES) -> None:
        self._receivers = receivers
        self._count = max(samples, FIRST)
        triangles = receivers.triangles
        self._all = EmbreeTriangles(triangles.corners)
        self._occluders = EmbreeTriangles(triangles.corners[triangles.occluders])
        self._filters = EmbreeTriangles(triangles.corners[triangles.filters])
        self._tints = triangles.tints
        self._filter_material = triangles.material[triangles.filters]
        self._filter_normals = triangles.normals[triangles.filters]
        height, width = receivers.height, receivers.width
        self._turn = hashed(height, width, 4).reshape(-1, 4)
        self._most = max(self._count, MOST)
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
        """`answer` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    def _irradiance(self, light: DirectionalLight | PointLight) -> Float32[ndarray, "P 3"]:
        texels = self._receivers.height * self._receivers.width
        sums = _Sums(
            np.zeros((texels, 3)), np.zeros((texels, 3)), np.full((texels, 3), np.inf, np.float32), np.zeros((texels, 3), np.float32)
        )
        weight = np.zeros(texels)
        for start in range(0, len(self._texels), TEXELS):
            samples = self._first(start)
            sums.add(samples, self._lit(samples, light, range(FIRST)))
            weight += np.bincount(samples.texel, samples.weight, texels)
        ragged = self._ragged(sums.mean(), sums.low, sums.high, weight)
        self._refine(sums, light, ragged, range(FIRST, self._count))
        edges = ragged[(sums.spread(ragged) > EDGE) | (self._steps(sums.mean())[ragged] > JUMP)]
        most = min(self._most, self._count + BUDGET * len(self._texels) // max(1, len(edges)))
        self._refine(sums, light, edges, range(self._count, most))
        return sums.mean().astype(np.float32)

    def _refine(self, sums: _Sums, light: DirectionalLight | PointLight, texels: Int[ndarray, " e"], numbers: range) -> None:
        """Add samples `numbers` of `texels`."""
        step = max(1, TEXELS * SAMPLES // max(1, len(numbers)))
        for start in range(0, len(texels) if len(numbers) else 0, step):
            samples = self._samples(texels[start : start + step], numbers)
            sums.add(samples, self._lit(samples, light, numbers))

    def _ragged(self, mean: np.ndarray, low: np.ndarray, high: np.ndarray, weight: np.ndarray) -> Int[ndarray, " e"]:
        """Texels whose samples differ, or that differ from a neighbor."""
        beside = self._steps(mean) > DIFFERENT
        within = ((high - low).max(axis=1) > DIFFERENT) | ((weight > 0) & (weight < FIRST))
        chosen = (beside | within)[self._texels]
        return self._texels[chosen]

    def _steps(self, mean: np.ndarray) -> Float64[ndarray, " P"]:
        """How far each texel and its neighbors differ."""
        image = mean.max(axis=1).reshape(self._receivers.height, self._receivers.width)
        from scipy import ndimage

        return (ndimage.maximum_filter(image, 3) - ndimage.minimum_filter(image, 3)).ravel()

    def _first(self, start: int) -> Samples:
        if start in self._kept:
            return self._kept[start]
        samples = self._samples(self._texels[start : start + TEXELS], range(FIRST))
        if len(self._texels) * FIRST <= KEPT:
            self._kept[start] = samples
        return samples

    def _lit(self, samples: Samples, light: DirectionalLight | PointLight, numbers: range) -> Float32[ndarray, "n 3"]:
        """N.L times what reaches each sample, for a white light."""
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
        origin += face * (np.where(NgL < 0, -1, 1) * LIFT * (1 + np.abs(point).max(axis=1)))[:, None]
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
        """What of a ray's light comes through: 0 behind what is opaque, else the product of the tints on the way."""
        free = ~self._occluders.occluded(origin, direction, distance)
        passed = np.repeat(free.astype(np.float32)[:, None], 3, axis=1)
        if not len(self._filter_material):
            return passed
        active = np.flatnonzero(free)
        start = origin[active].copy()
        left = None if distance is None else distance[active].copy()
        for _ in range(MOST_WALLS):
            hit, far, bary = self._filters.first_hit(start, direction[active])
            meets = (hit >= 0) if left is None else (hit >= 0) & (far < left)
            active, start, far, hit, bary = active[meets], start[meets], far[meets], hit[meets], bary[meets]
            if not len(active):
                break
            passed[active] *= self._tint(hit, bary, direction[active])
            step = far + LIFT * (1 + np.abs(start).max(axis=1))
            start = start + direction[active] * step[:, None]
            left = None if left is None else left[meets] - step
        return passed

    def _tint(self, wall: Int[ndarray, " n"], bary: Float32[ndarray, "n 3"], direction: Float32[ndarray, "n 3"]) -> Float32[ndarray, "n 3"]:
        """What one wall passes at the angle of each ray."""
        normal = np.einsum("nk,nkc->nc", bary, self._filter_normals[wall])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
        return transmittance(self._tints[self._filter_material[wall]], np.einsum("nc,nc->n", normal, direction))

    def _samples(self, texels: Int[ndarray, " e"], numbers: range) -> Samples:
        """Points `numbers` of each texel, sample by sample."""
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
        """The camera's rays: origin and direction."""
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
        """The one material that each pixel shows; -1 where its first samples show several, or nothing."""
        pure = np.full(self._receivers.height * self._receivers.width, -1)
        for start in range(0, len(self._texels), TEXELS):
            texels = self._texels[start : start + TEXELS]
            square = (self._square[:FIRST, None] + self._turn[None, texels, :2]) % 1
            hit, _, _ = self._all.first_hit(*self._looks(np.tile(texels, FIRST), square.reshape(-1, 2)))
            shown = np.where(hit >= 0, self._receivers.triangles.material[np.maximum(hit, 0)], -1).reshape(FIRST, -1)
            pure[texels] = np.where((shown == shown[0]).all(axis=0), shown[0], -1)
        return pure

    def _albedo(self, texel: Int[ndarray, " n"], material: Int[ndarray, " n"]) -> Float32[ndarray, "n 3"]:
        """The albedo of a material as its pixel shows it, or the nearest pixel that shows it alone; of the mixture where none does."""
        assert self._pure is not None
        width, height = self._receivers.width, self._receivers.height
        image = self._receivers.images["albedo"].reshape(-1, 3)
        source = texel.copy()
        open_ = np.flatnonzero(self._pure[texel] != material)
        for right, down in NEAREST_FIRST:
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
    """Sums of P texels: light and shares, whose ratio times a texel's albedo is its radiance whatever mixture it shows; least and most."""

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
        """Light of every texel so far."""
        return self.total / np.maximum(self.share, TINY)

    def spread(self, texels: Int[ndarray, " e"]) -> Float32[ndarray, " e"]:
        """How far the samples of `texels` differ."""
        return (self.high[texels] - self.low[texels]).max(axis=1)
