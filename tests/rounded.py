"""Rounded receivers of closed form: lightmaps of spheres and tori over a grid of faces, as a bake would write them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.visibility.receivers import Receivers

Surface = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  # (s, t) in [0, 1] to points and unit normals


def sphere(s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The unit sphere, its poles at t = 0 and 1."""
    turn, polar = 2 * np.pi * s, np.pi * t
    unit = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), -np.cos(polar)], axis=-1)
    return unit, unit


def torus(s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A torus about z of radii 1 and 1/4."""
    around, across = 2 * np.pi * s, 2 * np.pi * t
    out = np.stack([np.cos(around), np.sin(around), np.zeros_like(around)], axis=-1)
    unit = np.cos(across)[..., None] * out + np.sin(across)[..., None] * np.array([0, 0, 1.0])
    return out + unit / 4, unit


@dataclass(frozen=True)
class Lightmap:
    """Receivers, and the face normal of every texel's triangle (H, W, 3)."""

    receivers: Receivers
    face: np.ndarray


MARGIN = 0.0137  # of the lightmap about its one chart: no texel's center lies on an edge


def lightmap(surface: Surface, columns: int, rows: int, size: int, smooth: bool, footprint: float = 0.5, mapped: bool = True) -> Lightmap:
    """A lightmap of `size` squared over a mesh of columns x rows faces of two triangles each; `mapped`: the scene holds its coordinates."""
    grid_s, grid_t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    points, units = surface(grid_s, grid_t)
    u, v = np.meshgrid((np.arange(size) + 0.5) / size, 1 - (np.arange(size) + 0.5) / size)
    u, v = ((c - MARGIN) / (1 - 2 * MARGIN) for c in (u, v))
    covered = (np.minimum(u, v) >= 0) & (np.maximum(u, v) < 1)
    u, v = np.clip(u, 0, 0.999999), np.clip(v, 0, 0.999999)
    i, j = (u * columns).astype(int), (v * rows).astype(int)
    x, y = u * columns - i, v * rows - j
    upper = y > x  # (i, j) (i + 1, j + 1) (i, j + 1), else (i, j) (i + 1, j) (i + 1, j + 1)
    bary = np.where(upper[..., None], np.stack([1 - y, x, y - x], -1), np.stack([1 - x, x - y, y], -1))
    jj, ii = np.mgrid[:rows, :columns]
    below = np.stack([[jj, jj, jj + 1], [ii, ii + 1, ii + 1]], 0).reshape(2, 3, -1)
    above = np.stack([[jj, jj + 1, jj + 1], [ii, ii + 1, ii]], 0).reshape(2, 3, -1)
    each = np.concatenate([below, above], axis=2).transpose(0, 2, 1)  # (2, T, 3)
    corners, normals = points[each[0], each[1]], units[each[0], each[1]]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-30)
    face *= np.where(np.einsum("nc,nc->n", face, normals.sum(axis=1)) < 0, -1, 1)[:, None]
    if not smooth:
        normals = np.repeat(face[:, None], 3, axis=1)
    number = j * columns + i + np.where(upper, rows * columns, 0)
    position = np.einsum("hwk,hwkc->hwc", bary, corners[number])
    normal = np.einsum("hwk,hwkc->hwc", bary, normals[number])
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-30)
    kept = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) > 1e-9  # none at the poles
    flat = MARGIN + (1 - 2 * MARGIN) * np.stack([grid_s, grid_t], axis=-1)[each[0], each[1]]
    flat[..., 1] = 1 - flat[..., 1]
    count = int(kept.sum())
    triangles = Triangles(
        corners[kept].astype(np.float32),
        normals[kept].astype(np.float32),
        np.zeros(count, int),
        np.ones(count, bool),
        np.zeros((1, KNOTS, 3), np.float32),
        flat[kept].astype(np.float32) if mapped else None,
    )
    images = {
        "position": position.astype(np.float32),
        "normal": normal.astype(np.float32),
        "coverage": (covered & kept[number]).astype(np.float32),
    }
    return Lightmap(Receivers(size, size, "irradiance", images, triangles, {"sun_angle": 0.0, "footprint": footprint}), face[number])
