"""Surfels: small parts of all surfaces, between which light is exchanged, and what a ray finds of them."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.patches import parted
from srbf.visibility.surface_cells import DARK, OFFSET, Cells, Fragments, cells_of, exposed, grouped_cells, lit

WITNESSES = 256  # free places by which it is known what a wall parts
REACH, REACH_RAYS = 3, 64  # bounces and rays by which sides are found that no free place sees
LEAST_VIEW = 0.1  # share of such a side's hemisphere that lit surfaces fill
SIDES = 1 << 14  # whose rays are traced at a time
CUTS = 4  # halvings of a triangle that a wall parts


@dataclass(frozen=True, eq=False)
class Surfels:
    """Cells of every side of the surfaces that light can reach, and the triangles (T, 3, 3) that block bounces.

    `owners` (2, T): the surfel of the front and of the back of each triangle; -1 of sides that are black or out of reach. `objects` (S,):
    the number of each surfel's object.
    """

    cells: Cells
    corners: Float32[ndarray, "T 3 3"]
    owners: Int[ndarray, "2 T"]
    objects: Int[ndarray, " S"]

    @property
    def count(self) -> int:
        return len(self.cells.places)

    def seen_along(self, origins: Float64[ndarray, "n 3"], directions: Float64[ndarray, "n 3"]) -> Int[ndarray, " n"]:
        """The surfel that each ray meets first; -1 where it meets none, or black."""
        return self.met_along(origins, directions)[0]

    def met_along(
        self, origins: Float64[ndarray, "n 3"], directions: Float64[ndarray, "n 3"]
    ) -> tuple[Int[ndarray, " n"], Bool[ndarray, " n"]]:
        """(the surfel that each ray meets first, -1 where it meets none, or black; whether it meets any surface)."""
        triangle, _, _ = self._triangles.first_hit(origins, directions)
        back = np.einsum("nk,nk->n", self._normals[triangle], directions) > 0
        met = triangle >= 0
        return np.where(met, self.owners[back.astype(np.int64), triangle], -1), met

    def spread(self, count: int, seed: int = 0) -> tuple[Float64[ndarray, "S q 3"], Float64[ndarray, "S q 3"]]:
        """`count` points of each surfel, evenly over its area, and unit normals there."""
        sides = Fragments(self.corners, np.zeros_like(self.corners[:, 0])).both_sides()
        owner = self.owners.ravel()
        order = np.argsort(owner, kind="stable")
        order = order[np.searchsorted(owner[order], 0) :]
        ends = np.cumsum(sides.areas[order])
        last = ends[np.searchsorted(owner[order], np.arange(self.count), side="right") - 1]
        first = np.concatenate([[0.0], last[:-1]])
        rng = np.random.default_rng(seed)
        shares = (np.arange(count) + rng.uniform(size=(self.count, count))) / count
        found = np.searchsorted(ends, first[:, None] + shares * (last - first)[:, None])
        side = order[np.minimum(found, len(order) - 1)]
        u, v = np.sqrt(rng.uniform(size=side.shape)), rng.uniform(size=side.shape)
        barycentric = np.stack([1 - u, u * (1 - v), u * v], axis=-1)
        points = np.einsum("nqk,nqkc->nqc", barycentric, sides.corners[side].astype(np.float64))
        return points, sides.normals[side]

    @functools.cached_property
    def _triangles(self) -> EmbreeTriangles:
        return EmbreeTriangles(self.corners)

    @functools.cached_property
    def _normals(self) -> Float64[ndarray, "T 3"]:
        return Fragments(self.corners, np.zeros_like(self.corners[:, 0])).normals


def surfels_of(
    surfaces: Fragments,
    objects: Int[ndarray, " T"],
    occluders: EmbreeTriangles,
    free: Float64[ndarray, "F 3"],
    size: float | None,
    most: int,
) -> Surfels:
    """Surfels of about `size` meters of all that the free places see, larger where there would be more than `most`; None: about `most`.

    None straddles a border of albedo, or a wall that stands on a surface. `surfaces`: opaque triangles of any side, no edge longer than a
    surfel; `objects`: of each, its object's number.
    """
    surfaces, objects = cut_at_walls(surfaces, objects, occluders)
    both, object_of = surfaces.both_sides(), np.concatenate([objects, objects])
    kept = np.flatnonzero((both.albedo.max(axis=1) >= DARK) & (both.areas > 0))
    seen = np.zeros(len(both.corners), bool)
    seen[kept[exposed(both.at(kept), occluders, free)]] = True
    kept = kept[reached(both, seen)[kept]]
    owners = np.full(len(both.corners), -1, np.int64)
    if not len(kept):
        return Surfels(Cells.of_image(np.zeros((2, 0, 4), np.float32)), surfaces.corners, owners.reshape(2, -1), np.zeros(0, np.int64))
    sides = both.at(kept)
    seen = lit(sides.centers, sides.normals, occluders, free[:WITNESSES])
    least = float(np.sqrt(sides.areas.sum() / most))
    spacing = least if size is None else max(size, least)
    owner = _owners(sides, spacing, seen)
    while owner.max() >= most and spacing < 8 * least:  # surfels are cut at edges, borders and walls
        spacing *= float(np.sqrt((owner.max() + 1) / most))
        owner = _owners(sides, spacing, seen)
    owners[kept] = owner
    of_cell = np.zeros(int(owner.max()) + 1, np.int64)
    of_cell[owner] = object_of[kept]
    return Surfels(grouped_cells(sides, owner), surfaces.corners, owners.reshape(2, -1), of_cell)


def reached(both: Fragments, seen: Bool[ndarray, T]) -> Bool[ndarray, " T"]:
    """Sides that the `seen` ones light, and those that these light: what is behind a chair, under a table, and that no free place sees.

    `both`: sides of triangles, the backs after the fronts. A side counts from LEAST_VIEW on, the share of its hemisphere that they fill,
    so that the far ground outside a window does not.
    """
    half = len(both.corners) // 2
    triangles, normals, areas = EmbreeTriangles(both.corners[:half]), both.normals, both.areas
    lift = OFFSET * float(np.ptp(both.corners.reshape(-1, 3), axis=0).max(initial=0))
    centers, found, last = both.centers, seen.copy(), np.flatnonzero(seen)
    received = np.zeros(len(areas))
    for step in range(REACH):
        for start in range(0, len(last), SIDES):
            own = last[start : start + SIDES]
            directions = cosine_directions(normals[own][:, None], REACH_RAYS, np.random.default_rng([step, start]))[:, 0].reshape(-1, 3)
            triangle, _, _ = triangles.first_hit(np.repeat(centers[own] + lift * normals[own], REACH_RAYS, axis=0), directions)
            back = np.einsum("nk,nk->n", normals[triangle], directions) > 0
            flux = np.repeat(areas[own] / REACH_RAYS, REACH_RAYS)
            met = triangle >= 0
            received += np.bincount((triangle + half * back)[met], flux[met], len(areas))
        now = received >= LEAST_VIEW * areas
        last = np.flatnonzero(now & ~found)
        found |= now
    return found


def cut_at_walls(surfaces: Fragments, objects: Int[ndarray, " T"], occluders: EmbreeTriangles) -> tuple[Fragments, Int[ndarray, " U"]]:
    """Triangles that another surface parts, so that a corner is hidden from the middle, in halves, a few times over."""
    done: list[tuple[ndarray, ndarray, ndarray]] = []
    corners, albedo = surfaces.corners, surfaces.albedo
    lift = OFFSET * float(np.ptp(corners.reshape(-1, 3), axis=0).max(initial=0))
    for _ in range(CUTS):
        own = Fragments(corners, albedo)
        hidden = np.zeros(len(corners), bool)
        for side in (1.0, -1.0):
            middle = own.centers + side * lift * own.normals
            for corner in range(3):
                vector = 0.98 * (corners[:, corner] - own.centers)
                distance = np.linalg.norm(vector, axis=1)
                direction = vector / np.maximum(distance, 1e-30)[:, None]
                hidden |= occluders.occluded(middle.astype(np.float32), direction, distance)
        done.append((corners[~hidden], albedo[~hidden], objects[~hidden]))
        corners, albedo, objects = _halves(corners[hidden]), np.repeat(albedo[hidden], 2, axis=0), np.repeat(objects[hidden], 2)
    done.append((corners, albedo, objects))
    every = [np.concatenate(part) for part in zip(*done, strict=True)]
    return Fragments(every[0], every[1]), every[2]


def _halves(corners: Float32[ndarray, "T 3 3"]) -> Float32[ndarray, "U 3 3"]:
    """Every triangle cut through the middle of its longest edge; the halves of one follow each other."""
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    turn = (edges.argmax(axis=1)[:, None] + np.arange(3)) % 3
    first, second, third = np.moveaxis(np.take_along_axis(corners, turn[:, :, None], axis=1), 1, 0)
    middle = (first + second) / 2
    return np.stack([np.stack([first, middle, third], axis=1), np.stack([middle, second, third], axis=1)], axis=1).reshape(-1, 3, 3)


def _owners(sides: Fragments, spacing: float, seen: Bool[ndarray, "T F"]) -> Int[ndarray, " T"]:
    """The surfel of every side: those of a cell that share places from which they are seen; one that none sees joins another."""
    _, owner = cells_of(sides, spacing)
    known = seen.any(axis=1)
    result = np.full(len(owner), -1, np.int64)
    if known.any():
        result[known] = parted(np.unique(owner[known], return_inverse=True)[1].ravel(), seen[known])
    first = np.full(int(owner.max()) + 1, -1, np.int64)
    first[owner[known]] = result[known]
    result[~known] = first[owner[~known]]
    rest = result < 0  # cells that none of the places sees
    result[rest] = result.max(initial=-1) + 1 + np.unique(owner[rest], return_inverse=True)[1].ravel()
    return result
