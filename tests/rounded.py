"""Rounded receivers of closed form: balls and tori, flat or smooth, whose lightmap is the grid of their two angles."""

from __future__ import annotations

import numpy as np
from closed_forms import flat_normals

from srbf.direct.receivers import Receivers
from srbf.scene_file import KNOTS, Triangles


def rounded(
    kind: str, around: int, across: int, size: int, smooth: bool, at: tuple[float, float, float] = (0, 0, 0), scale: float = 1
) -> Receivers:
    """A ball of radius `scale`, or a torus of radii 1 and 0.35 times it, of `around` by `across` faces."""
    v, u = np.meshgrid(np.arange(across + 1) / across, np.arange(around + 1) / around, indexing="ij")
    turn, other = 2 * np.pi * u, np.pi * v if kind == "ball" else 2 * np.pi * v
    ring = np.sin(other) if kind == "ball" else np.cos(other)
    height = np.cos(other) if kind == "ball" else -np.sin(other)
    normals = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=2)
    main = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=2)
    points = (normals if kind == "ball" else main + 0.35 * normals) * scale + np.array(at)
    uv = np.stack([u, v], axis=2)

    def triangles(grid: np.ndarray) -> np.ndarray:
        """(across, around, 2, 3, c), the diagonal from the corner of least u and v."""
        a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        return np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)

    corners = triangles(points).reshape(-1, 3, 3).astype(np.float32)
    of_corners = triangles(normals).reshape(-1, 3, 3).astype(np.float32) if smooth else flat_normals(corners)
    middle = (np.arange(size) + 0.5) / size
    row, column = (middle[:, None] * across, middle[None, :] * around)
    row, column = np.broadcast_arrays(row, column)
    j, i = row.astype(int), column.astype(int)
    down, right = row - j, column - i
    upper = right > down
    bary = np.where(upper[..., None], np.stack([1 - right, down, right - down], -1), np.stack([1 - down, down - right, right], -1))
    own = (j * around + i) * 2 + upper
    position = np.einsum("hwk,hwkc->hwc", bary, corners[own])
    normal = np.einsum("hwk,hwkc->hwc", bary, of_corners[own])
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-20)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    images = {"position": position.astype(np.float32), "normal": normal.astype(np.float32)}
    images["coverage"] = (area[own] > 1e-9 * scale * scale).astype(np.float32)  # triangles at the poles have none
    scene = Triangles(
        corners,
        of_corners,
        np.zeros(len(corners), int),
        np.ones(len(corners), bool),
        np.zeros((1, KNOTS, 3), np.float32),
        triangles(uv).reshape(-1, 3, 2).astype(np.float32),
    )
    return Receivers(size, size, "irradiance", images, scene, {"sun_angle": 0.0, "footprint": 0.5})
