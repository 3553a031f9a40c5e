"""Normals at points of triangles, and the offset to the surface that the corner normals round."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64, Int
from srbf.io.scene_glb import Triangles
from srbf.vectors import lengths

SMOOTH_COS = 1 - 1e-6  # corner normals closer than that to the face normal belong to a flat face


def surface_at(
    triangles: Triangles, triangle: Int[ndarray, " n"], bary: Float[ndarray, "n 3"]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(shading normal, face normal, offset (m) to the surface that the corner normals round) at points of triangles.

    The offset is that of Cycles: half a parabola through the corners, or the lowest of the planes at the corners, whichever is larger
    [Hanika2021].
    """
    corners, normals = triangles.corners[triangle].astype(np.float64), triangles.normals[triangle].astype(np.float64)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.maximum(lengths(face), 1e-30)[:, None]
    face *= np.where(np.einsum("nc,nc->n", face, normals.sum(axis=1)) < 0, -1, 1)[:, None]
    mean = np.einsum("nk,nkc->nc", bary, normals)
    normal = mean / np.maximum(lengths(mean), 1e-20)[:, None]
    bent = ~(np.einsum("nkc,nc->nk", normals, face) > SMOOTH_COS).all(axis=1)
    lift = np.zeros_like(mean)
    lift[bent] = mean[bent] * _rounding(corners[bent], normals[bent], bary[bent])[:, None]
    return normal.astype(np.float32), face.astype(np.float32), lift.astype(np.float32)


def _rounding(
    corners: Float64[ndarray, "n 3 3"], normals: Float64[ndarray, "n 3 3"], bary: Float[ndarray, "n 3"]
) -> Float64[ndarray, " n"]:
    """Height (m) of the rounded surface above its triangle, by the estimate of Cycles."""

    def along(i: int, edge_from: int, edge_to: int) -> np.ndarray:
        return np.einsum("nc,nc->n", normals[:, i], corners[:, edge_to] - corners[:, edge_from])

    u, v = bary[:, 0], bary[:, 1]
    a = along(2, 2, 0) - along(0, 2, 0)
    b = along(2, 2, 1) - along(1, 2, 1)
    c = along(1, 0, 1) - along(0, 0, 1)
    parabola = a * u * (u - 1) + (a + b + c) * u * v + b * v * (v - 1)
    point = np.einsum("nk,nkc->nc", bary, corners)
    planes = []
    for i in range(3):
        highest = np.maximum(np.maximum(along(i, i, (i + 1) % 3), along(i, i, (i + 2) % 3)), 0)
        planes.append(np.maximum(np.einsum("nc,nc->n", corners[:, i] - point, normals[:, i]) + highest, 0))
    return np.maximum(np.minimum.reduce(planes), parabola / 2)
