"""Samples of a lightmap's texels on the triangles that they show, as Cycles bakes them: one triangle per texel, mirrored at its edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.scene_file import Triangles

CENTRE = (0.501, 0.502)  # of a texel, where Blender looks for its triangle: off the middle, so that edges along texels decide one way
PAIRS = 1 << 22  # of a triangle and a texel at a time
OUTSIDE = 1.0  # texels: how far off its triangle the centre of a covered texel may lie
APART = 2.0  # texels: how far the position of a texel may lie off its triangle, before that triangle is one that overlaps it
SMALLEST = 1e-12  # of the unit square, twice the area of a triangle: below, nothing is shown on it


@dataclass(frozen=True, eq=False)
class Footprints:
    """The triangle of every texel (-1: none known), barycentric place (u, v) of its centre and their change per texel right and down."""

    triangle: Int[ndarray, " P"]
    place: Float64[ndarray, "P 2"]
    right: Float64[ndarray, "P 2"]
    down: Float64[ndarray, "P 2"]

    @staticmethod
    def of(triangles: Triangles, position: Float32[ndarray, "H W 3"]) -> Footprints | None:
        """By the lightmap coordinates of the scene; None where it has none. `position` decides between triangles that overlap."""
        if triangles.lightmap is None:
            return None
        height, width = position.shape[:2]
        known = np.flatnonzero(np.isfinite(triangles.lightmap).all(axis=(1, 2)))
        corners = triangles.lightmap[known].astype(np.float64) * [width, height]
        edge = corners[:, :2] - corners[:, 2:]  # (T, 2, 2): from the third corner to the others
        determinant = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
        real = np.abs(determinant) > SMALLEST * width * height
        space = triangles.corners[known]
        real &= np.cross(space[:, 1] - space[:, 0], space[:, 2] - space[:, 0]).any(axis=1)
        known, corners, edge = known[real], corners[real], edge[real]
        slopes = np.linalg.inv(edge) if len(edge) else edge  # (T, xy, uv): p = c + (u, v) edge
        best = np.full(height * width, np.inf)
        chosen = np.full(height * width, -1)
        flat = position.reshape(-1, 3)
        low = np.clip(np.floor(corners.min(axis=1) - OUTSIDE), 0, [width - 1, height - 1]).astype(int)
        high = np.clip(np.ceil(corners.max(axis=1) + OUTSIDE), 0, [width - 1, height - 1]).astype(int)
        sides = high - low + 1
        ends = np.cumsum(sides.prod(axis=1))
        first = 0
        while first < len(known):
            done = ends[first - 1] if first else 0
            last = max(first + 1, int(np.searchsorted(ends, done + PAIRS, "right")))
            counts = sides[first:last].prod(axis=1)
            which = np.repeat(np.arange(first, last), counts)
            number = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
            column, row = low[which, 0] + number % sides[which, 0], low[which, 1] + number // sides[which, 0]
            texel = row * width + column
            score = _misfit(column, row, which, corners, slopes, triangles.corners[known], flat[texel])
            order = np.lexsort((-which, score, texel))  # the last of equals, as a bake writes them
            texel, score, which = texel[order], score[order], which[order]
            lead = np.ones(len(texel), bool)
            lead[1:] = texel[1:] != texel[:-1]
            texel, score, which = texel[lead], score[lead], which[lead]
            better = score <= best[texel]
            better &= np.isfinite(score)
            best[texel[better]], chosen[texel[better]] = score[better], which[better]
            first = last
        has = chosen >= 0
        triangle = np.where(has, known[chosen] if len(known) else -1, -1)
        place, right, down = (np.zeros((height * width, 2)) for _ in range(3))
        own = chosen[has]
        centre = np.stack([np.flatnonzero(has) % width, np.flatnonzero(has) // width], axis=1) + CENTRE
        place[has] = np.einsum("nx,nxu->nu", centre - corners[own, 2], slopes[own])
        right[has], down[has] = slopes[own, 0], slopes[own, 1]
        return Footprints(triangle, place, right, down)

    def weights(self, texel: Int[ndarray, " n"], offset: Float32[ndarray, "n 2"]) -> Float32[ndarray, "n 3"]:
        """Barycentric weights, in [0, 1], of points `offset` texels right and down of the centres of texels, mirrored at the edges."""
        moved = self.place[texel] + self.right[texel] * offset[:, :1] + self.down[texel] * offset[:, 1:]
        u = _mirrored(moved[:, 0], np.ones(len(texel)))
        v = _mirrored(moved[:, 1], 1 - u)
        return np.stack([u, v, 1 - u - v], axis=1).astype(np.float32)


def _misfit(
    column: np.ndarray,
    row: np.ndarray,
    which: np.ndarray,
    corners: np.ndarray,
    slopes: np.ndarray,
    world: Float32[ndarray, "T 3 3"],
    position: Float32[ndarray, "n 3"],
) -> Float64[ndarray, " n"]:
    """How far (texels) texels lie off triangles in the layer and in space; infinite where too far."""
    centre = np.stack([column, row], axis=1) + CENTRE
    uv = np.einsum("nx,nxu->nu", centre - corners[which, 2], slopes[which])
    bary = np.concatenate([uv, 1 - uv.sum(axis=1, keepdims=True)], axis=1)
    per_texel = np.stack([np.linalg.norm(slope, axis=1) for slope in (slopes[:, :, 0], slopes[:, :, 1], -slopes.sum(axis=2))], axis=1)
    outside = np.maximum(0, -bary / per_texel[which]).max(axis=1)
    inside = np.clip(bary, 0, None)
    inside /= inside.sum(axis=1, keepdims=True)
    point = np.einsum("nk,nkc->nc", inside, world[which])
    edges = world[:, :2] - world[:, 2:]
    length = np.linalg.norm(np.einsum("txu,tuc->txc", slopes, edges), axis=2).max(axis=1)  # m per texel
    apart = np.linalg.norm(point - position, axis=1) / np.maximum(length[which], 1e-30)
    return np.where((outside < OUTSIDE) & (apart < APART), outside + np.where(apart > 0.1, apart, 0), np.inf)


def _mirrored(value: np.ndarray, most: np.ndarray) -> np.ndarray:
    """`value` reflected into [0, most], by each."""
    turn = np.mod(value, np.maximum(2 * most, 1e-12))
    return np.clip(np.where(turn > most, 2 * most - turn, turn), 0, most)
