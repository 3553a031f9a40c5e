"""Sample points of a lightmap's texels: on the mesh if it is known, else along the slopes of the maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.vectors import lengths
from srbf.visibility.footprints import FirstHit, footprints
from srbf.visibility.receivers import Receivers
from srbf.visibility.surface import surface_at


@dataclass(frozen=True)
class Points:
    """n points: weight in their texel's mean, position (m), shading and face normal, offset to the rounded surface (m), triangle or -1."""

    weight: Float32[ndarray, " n"]
    point: Float32[ndarray, "n 3"]
    normal: Float32[ndarray, "n 3"]
    face: Float32[ndarray, "n 3"]
    lift: Float32[ndarray, "n 3"]
    triangle: Int[ndarray, " n"]


class LightmapPoints:
    """Points of all texels; without Embree's `first_hit`, only the scene's lightmap coordinates locate the mesh."""

    def __init__(self, receivers: Receivers, first_hit: FirstHit | None) -> None:
        self._receivers = receivers
        self._slopes = [g.reshape(-1, 3) for name in ("position", "normal") for g in receivers.gradients(name)]
        self._side = float(receivers.sampling.get("footprint", 1.0))
        self._mesh = footprints(receivers, self._slopes[:2], first_hit)

    def at(self, texel: Int[ndarray, " n"], square: Float64[ndarray, "n 2"]) -> Points:
        """The points at `square`, in [0, 1)^2 of each texel's footprint."""
        triangle = self._mesh.triangle[texel]
        lost = triangle < 0
        triangle = np.maximum(triangle, 0)
        bary, weight = self._mesh.points(texel, square, self._side)
        normal, face, lift = surface_at(self._receivers.triangles, triangle, bary)
        point = np.einsum("nk,nkc->nc", bary, self._receivers.triangles.corners[triangle]).astype(np.float32)
        center = self._receivers.images["normal"].reshape(-1, 3)[texel]
        turned = np.where(np.einsum("nc,nc->n", normal, center) < 0, -1, 1)[:, None].astype(np.float32)
        normal, face, lift = normal * turned, face * turned, lift * turned
        if lost.any():
            point[lost], normal[lost] = self._off_mesh(texel[lost], ((square[lost] - 0.5) * self._side).astype(np.float32))
            face[lost], lift[lost], weight[lost] = normal[lost], 0, 1
        return Points(weight, point, normal, face, lift, np.where(lost, -1, triangle))

    def _off_mesh(self, texel: ndarray, offset: ndarray) -> tuple[ndarray, ndarray]:
        """(point, normal) at an offset (texels) from the center, along the slopes of position and normal map."""
        position, normal = (self._receivers.images[name].reshape(-1, 3)[texel] for name in ("position", "normal"))
        right, down, turn_right, turn_down = (slope[texel] for slope in self._slopes)
        normal = normal + turn_right * offset[:, :1] + turn_down * offset[:, 1:]
        normal /= np.maximum(lengths(normal), 1e-20)[:, None]
        return position + right * offset[:, :1] + down * offset[:, 1:], normal
