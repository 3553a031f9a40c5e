"""Surfaces as cells: small parts of all that a light in free space can reach, by which it is measured what falls where.

A cell has a place, a normal, an area and an albedo; it belongs to a patch, a group of cells that emits as one. Surfaces have two sides, and
a side that no free place sees has no cell: what lies under a box or outside a closed room takes no light and gives none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.compute.threads import each
from srbf.vectors import cross, lengths
from srbf.visibility.embree import EmbreeTriangles

OFFSET = 1e-4  # of the scene's size: between a surface and the end of a ray to it
STAGES = (16, 192)  # places that most surfaces are seen from
RAYS = 1 << 18  # that each core traces at a time
MOST_RAYS, FEWEST_PLACES = 1 << 26, 48  # of points to places, in a stage, where the points are more than that many each
LAYERS = 1 / 8  # of a cell's size: walls that are farther apart are not in one cell
NORMAL_BINS = 2  # per axis and sign: a cell's fragments face about the same way
FLAT = 0.01  # of a fragment's longest edge: how far a point is off it at most
DARK = 1e-3  # albedo below which nothing is reflected


@dataclass(frozen=True, eq=False)
class Fragments:
    """Small triangles, T of them, wound so that the geometric normal points into the side that is meant; albedo (T, 3) linear."""

    corners: Float32[ndarray, "T 3 3"]
    albedo: Float32[ndarray, "T 3"]

    @cached_property
    def normals(self) -> Float64[ndarray, "T 3"]:
        """Unit normals; 0 of triangles without area."""
        return self._cross / np.maximum(lengths(self._cross)[:, None], 1e-30)

    @cached_property
    def areas(self) -> Float64[ndarray, " T"]:
        """In square meters."""
        return lengths(self._cross) / 2

    @cached_property
    def centers(self) -> Float64[ndarray, "T 3"]:
        """Centroids, m."""
        return self.corners.mean(axis=1, dtype=np.float64)

    @cached_property
    def _cross(self) -> Float64[ndarray, "T 3"]:
        corners = self.corners.astype(np.float64)
        return cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    def both_sides(self) -> Fragments:
        """Every triangle twice, the second time turned over."""
        return Fragments(np.concatenate([self.corners, self.corners[:, ::-1]]), np.concatenate([self.albedo, self.albedo]))

    def at(self, chosen: ndarray) -> Fragments:
        """Those of a mask or of indices."""
        return Fragments(self.corners[chosen], self.albedo[chosen])


@dataclass(frozen=True, eq=False)
class Cells:
    """N cells: place (m) on the surface, unit normal, exposed area (square meters), albedo, and the patch that each belongs to."""

    places: Float32[ndarray, "N 3"]
    normals: Float32[ndarray, "N 3"]
    areas: Float32[ndarray, " N"]
    albedo: Float32[ndarray, "N 3"]
    patches: Int[ndarray, " N"]

    @property
    def patch_count(self) -> int:
        return int(self.patches.max()) + 1 if len(self.patches) else 0

    def at(self, chosen: ndarray) -> Cells:
        """Those of a mask or of indices."""
        return Cells(self.places[chosen], self.normals[chosen], self.areas[chosen], self.albedo[chosen], self.patches[chosen])

    def with_patches(self, patches: Int[ndarray, " N"]) -> Cells:
        """The same cells in other patches."""
        return replace(self, patches=patches)

    def image(self) -> Float32[ndarray, "2 N 4"]:
        """As patches.exr holds them: (x, y, z, area) and (normal, patch)."""
        first = np.concatenate([self.places, self.areas[:, None]], axis=1)
        second = np.concatenate([self.normals, self.patches[:, None]], axis=1)
        return np.stack([first, second]).astype(np.float32)

    @staticmethod
    def of_image(image: Float32[ndarray, "2 N 4"]) -> Cells:
        """From `image`; the albedo, which a light's irradiance does not need, is 0."""
        return Cells(
            np.ascontiguousarray(image[0, :, :3]),
            np.ascontiguousarray(image[1, :, :3]),
            np.ascontiguousarray(image[0, :, 3]),
            np.zeros((image.shape[1], 3), np.float32),
            np.round(image[1, :, 3]).astype(np.int64),
        )


def exposed(fragments: Fragments, occluders: EmbreeTriangles, free: Float64[ndarray, "F 3"]) -> Bool[ndarray, " T"]:
    """Which fragments are seen from any of the free places, on the side of their normal; of many, from some of them."""
    found = np.zeros(len(fragments.corners), bool)
    for first, last in zip((0, *STAGES), (*STAGES, len(free)), strict=True):
        left = np.flatnonzero(~found)
        places = free[first : min(last, first + places_for(len(left)))]
        if len(left) and len(places):
            found[left] = lit(fragments.centers[left], fragments.normals[left], occluders, places).any(axis=1)
    return found


def places_for(points: int) -> int:
    """How many places may be tested at so many points."""
    return max(FEWEST_PLACES, MOST_RAYS // max(1, points))


def lit(
    points: Float64[ndarray, "n 3"], normals: Float64[ndarray, "n 3"], occluders: EmbreeTriangles, free: Float64[ndarray, "F 3"]
) -> Bool[ndarray, "n F"]:
    """Which places light which points: in front of them, and nothing between."""
    result = np.zeros((len(points), len(free)), bool)
    scale = OFFSET * float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    starts = (points + scale * normals).astype(np.float32)
    offsets = np.einsum("nk,nk->n", points, normals)
    size = max(1, RAYS // max(1, len(free)))

    def test(number: int) -> None:
        part = slice(number * size, (number + 1) * size)
        row, column = np.nonzero(normals[part] @ free.T > offsets[part, None])
        vector = free[column] - starts[part][row]
        distance = lengths(vector)
        blocked = occluders.occluded(starts[part][row], vector / np.maximum(distance, 1e-30)[:, None], distance)
        result[part][row[~blocked], column[~blocked]] = True

    each(test, -(-len(points) // size))
    return result


def cells_of(fragments: Fragments, size: float, apart: Int[ndarray, " T"] | None = None) -> tuple[Cells, Int[ndarray, " T"]]:
    """(cells of about `size` meters, the cell of every fragment): fragments of one voxel that face about the same way are one cell.

    Those whose numbers in `apart` differ are not.
    """
    centers, normals = fragments.centers, fragments.normals
    major = np.abs(normals).argmax(axis=1)
    facing = 2 * major + (np.take_along_axis(normals, major[:, None], 1)[:, 0] < 0)
    across = np.floor((np.delete(normals, 0, 1) + 1) / 2 * NORMAL_BINS).astype(np.int64).clip(0, NORMAL_BINS - 1)
    color = np.floor(fragments.albedo.mean(axis=1) * 4).astype(np.int64)
    low = centers.min(axis=0) - size / 3  # no voxel's side in the plane of a wall at a round number
    voxel = np.floor((centers - low) / size).astype(np.int64)
    rough = np.abs(normals).max(axis=1) < 0.99  # curved or slanted: by its direction as well
    keys = np.column_stack([voxel, facing, np.where(rough[:, None], across, 0), color, *(() if apart is None else (apart,))])
    owner = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    owner = _layered(owner, np.where(rough, 0.0, np.take_along_axis(centers, major[:, None], 1)[:, 0]), size * LAYERS)
    return grouped_cells(fragments, owner), owner


def _layered(owner: Int[ndarray, " T"], height: Float64[ndarray, " T"], gap: float) -> Int[ndarray, " T"]:
    """Groups in parts between which lies a `gap` of heights: walls one behind another."""
    order = np.lexsort((height, owner))
    new = (np.diff(owner[order]) > 0) | (np.diff(height[order]) > gap)
    found = np.empty(len(owner), np.int64)
    found[order] = np.concatenate([[0], np.cumsum(new)]) if len(owner) else 0
    return found


def grouped_cells(fragments: Fragments, owner: Int[ndarray, " T"]) -> Cells:
    """The cells that fragments make together, in patch 0.

    A cell's place is the middle of its fragments where that is on the surface, else that of the fragment nearest to it.
    """
    centers, normals, areas = fragments.centers, fragments.normals, fragments.areas
    count = int(owner.max()) + 1 if len(owner) else 0
    area = np.bincount(owner, areas, count)
    safe = np.maximum(area, 1e-30)[:, None]

    def mean(values: ndarray) -> ndarray:
        return np.stack([np.bincount(owner, areas * values[:, k], count) for k in range(3)], axis=1) / safe

    middle, normal, albedo = mean(centers), mean(normals), mean(fragments.albedo)
    off = np.linalg.norm(centers - middle[owner], axis=1)
    order = np.lexsort((off, owner))
    nearest = order[np.searchsorted(owner[order], np.arange(count))]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    on_surface = np.bincount(owner, contain(fragments, middle[owner]), count) > 0
    return Cells(
        np.where(on_surface[:, None], middle, centers[nearest]).astype(np.float32),
        normal.astype(np.float32),
        area.astype(np.float32),
        albedo.astype(np.float32),
        np.zeros(count, np.int64),
    )


def contain(fragments: Fragments, points: Float64[ndarray, "T 3"]) -> Bool[ndarray, " T"]:
    """Whether each fragment has its point, within FLAT of its size."""
    corners, normals = fragments.corners.astype(np.float64), fragments.normals
    to_point = points[:, None] - corners  # (T, 3, 3)
    edges = np.roll(corners, -1, axis=1) - corners
    longest = lengths(edges).max(axis=1)
    inward = cross(normals[:, None], edges)
    inward /= np.maximum(lengths(inward)[..., None], 1e-30)
    inside = (np.einsum("tek,tek->te", inward, to_point) >= -FLAT * longest[:, None]).all(axis=1)
    return inside & (np.abs(np.einsum("tk,tk->t", normals, to_point[:, 0])) <= FLAT * longest)


def frames(normals: Float64[ndarray, "n 3"]) -> tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]:
    """Two unit vectors across each normal and each other, along the axes for a normal that is one [Duff2017]."""
    sign = np.where(normals[:, 2] >= 0, 1.0, -1.0)
    a = -1 / (sign + normals[:, 2])
    b = normals[:, 0] * normals[:, 1] * a
    tangent = np.stack([1 + sign * normals[:, 0] ** 2 * a, sign * b, -sign * normals[:, 0]], axis=1)
    return tangent, np.stack([b, sign + normals[:, 1] ** 2 * a, -normals[:, 1]], axis=1)
