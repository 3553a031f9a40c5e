"""Direct light on receivers by compressed depths: at texels or vertices, without rays and without shadow maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.encode.dilation import dilate, nearest_covered
from srbf.light_geometry import points_on
from srbf.light_linking import refuse_linked
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight, radius_of
from srbf.sphere import point_set
from srbf.unshadowed import irradiance_from
from srbf.visibility.pca_visibility import LOOKS, PcaVisibility
from srbf.visibility.received import starts_of
from srbf.visibility.receivers import Receivers, disc_points


@dataclass(frozen=True, eq=False)
class PcaDirect:
    """Direct light of P covered texels that keep what they see. A light with a size is looked at in LOOKS^2 places."""

    receivers: Receivers
    visibility: PcaVisibility

    def response(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The direct light of `lights` in the receivers' quantity; environments and named lights add nothing."""
        receivers = self.receivers
        covered = self._covered
        positions = receivers.images["position"][covered].astype(np.float64)
        normals = receivers.images["normal"][covered].astype(np.float64)
        starts = starts_of(positions, normals)
        refuse_linked(lights, "`direct=pca`")
        total = np.zeros((len(positions), 3), np.float32)
        for light in lights:
            if isinstance(light, (DirectionalLight, PointLight, AreaLight)):
                irradiance = irradiance_from(light, positions, normals)
                lit = np.flatnonzero(irradiance > 0)
                seen = irradiance[lit] * self._seen(light, lit, starts[lit].astype(np.float64), normals[lit])
                color = np.array(light.color)
                if isinstance(light, PointLight):
                    color = color * light.factors(positions[lit] - np.array(light.position))
                total[lit] += (seen[:, None] * color).astype(np.float32)
        image = np.zeros((*covered.shape, 3), np.float32)
        image[covered] = total
        nearest = None if covered.all() else nearest_covered(covered.astype(np.float32))
        return dilate(image, nearest) * receivers.reflectance()

    def directional(self, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        """`response` to a white light from each of many directions."""
        return np.stack([self.response([DirectionalLight((float(x), float(y), float(z)))]) for x, y, z in directions])

    @property
    def _covered(self) -> ndarray:
        coverage = self.receivers.images.get("coverage")
        return np.ones((self.receivers.height, self.receivers.width), bool) if coverage is None else coverage >= 0.5

    def _seen(
        self, light: Light, points: Int[ndarray, " n"], starts: Float64[ndarray, "n 3"], normals: Float64[ndarray, "n 3"]
    ) -> Float64[ndarray, " n"]:
        """How much of a light some texels see: looks count as much as the light from there would add."""
        if isinstance(light, DirectionalLight):
            shares = [self.visibility.visible(points, np.broadcast_to(way, starts.shape), None) for way in self._suns(light)]
            return np.mean(shares, axis=0)
        seen, whole = np.zeros(len(points)), np.zeros(len(points))
        for place, facing in _looks(light):
            vector = place - starts
            distance = np.linalg.norm(vector, axis=1)
            unit = vector / np.maximum(distance, 1e-30)[:, None]
            added = np.maximum(np.einsum("nc,nc->n", unit, normals), 0) / np.maximum(distance, 1e-6) ** 2
            if facing is not None:
                added = added * np.maximum(-(unit @ facing), 0)
            seen += added * self.visibility.visible(points, unit, distance)
            whole += added
        return seen / np.maximum(whole, 1e-30)

    def _suns(self, light: DirectionalLight) -> Float64[ndarray, "n 3"]:
        """Unit vectors over a sun's disc."""
        axis = np.array(light.direction)
        angle = light.angle_or(self.receivers.sun_angle)
        if angle == 0:
            return axis[None]
        across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
        across /= np.linalg.norm(across)
        offset = disc_points(_grid()) * np.tan(angle / 2)
        unit = axis + offset[:, :1] * across + offset[:, 1:] * np.cross(axis, across)
        return unit / np.linalg.norm(unit, axis=1, keepdims=True)


def _looks(light: Light) -> list[tuple[ndarray, ndarray | None]]:
    """Places of a light, and which way each shines, None: all around."""
    if isinstance(light, AreaLight):
        return [(place, np.array(light.direction)) for place in points_on(light, _grid())]
    assert isinstance(light, PointLight)
    if (size := radius_of(light)) > 0:
        normals = point_set("fibonacci", 2 * LOOKS**2, "sphere")  # half of them face a receiver
        return [(np.array(light.position) + size * normal, normal) for normal in normals]
    return [(np.array(light.position), None)]


def _grid() -> Float64[ndarray, "n 2"]:
    """Middles of LOOKS x LOOKS squares of [0, 1]^2."""
    steps = (np.arange(LOOKS) + 0.5) / LOOKS
    return np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
