"""Surfels: small parts of all surfaces, between which light is exchanged, and what a ray finds of them."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.vectors import lengths
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.emitting_sides import lighting_others
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.patches import parted
from srbf.visibility.surface_cells import DARK, OFFSET, Cells, Fragments, cells_of, exposed, grouped_cells, lit, places_for

WITNESSES = 256  # free places by which it is known what a wall parts
REACH, REACH_RAYS = 3, 64  # bounces and rays by which sides are found that no free place sees
LEAST_VIEW = 0.1  # share of such a side's hemisphere that lit surfaces fill
SIDES = 1 << 14  # whose rays are traced at a time
CUTS = 6  # halvings of a triangle that a wall parts
GAP = 1 / 2  # of a surfel's size: what another surface is closer to is covered
DIM_SIZE = 2.0  # of surfels that neither reflect nor emit
MOST_OBJECTS = 500  # beyond, objects smaller than a surfel share them
EMISSION_STEPS = 4  # of what an object emits


@dataclass(frozen=True, eq=False)
class Surfels:
    """Cells of every side of the surfaces that light can reach, and the triangles (T, 3, 3) that block bounces.

    `owners` (2, T): the surfel of the front and of the back of each triangle; -1 of sides that are out of reach. `objects` (S,): the number
    of each surfel's object. `emission` (S, 3): mean radiance of what it emits itself. `hidden` (S,): those that emit into a gap which no
    free place sees, narrower than a surfel, as the back of a picture does: receivers there are lit, and the bounces stay in the gap.
    `transmission` (S, 3): what they let through diffusely, where any does. `gloss` (S, 3): what they reflect for lobes alone.
    """

    cells: Cells
    corners: Float32[ndarray, "T 3 3"]
    owners: Int[ndarray, "2 T"]
    objects: Int[ndarray, " S"]
    emission: Float32[ndarray, "S 3"]
    hidden: Bool[ndarray, " S"]
    transmission: Float32[ndarray, "S 3"] | None = None
    gloss: Float32[ndarray, "S 3"] | None = None

    @property
    def count(self) -> int:
        return len(self.cells.places)

    def seen_along(self, origins: Float64[ndarray, "n 3"], directions: Float64[ndarray, "n 3"]) -> Int[ndarray, " n"]:
        """The surfel that each ray meets first; -1 where it meets none, or a side out of reach."""
        return self.met_along(origins, directions)[0]

    def met_along(
        self, origins: Float64[ndarray, "n 3"], directions: Float64[ndarray, "n 3"]
    ) -> tuple[Int[ndarray, " n"], Bool[ndarray, " n"]]:
        """(the surfel that each ray meets first, -1 where it meets none, or a side out of reach; whether it meets any surface)."""
        triangle, _, _ = self._triangles.first_hit(origins, directions)
        back = np.einsum("nk,nk->n", self._normals[triangle], directions) > 0
        met = triangle >= 0
        return np.where(met, self.owners[back.astype(np.int64), triangle], -1), met

    def blocked(self, origins: Float64[ndarray, "n 3"], directions: Float64[ndarray, "n 3"], distance: Float64[ndarray, " n"]) -> ndarray:
        """(n,) whether a surface stands closer than `distance` along each ray."""
        return self._triangles.occluded(origins.astype(np.float32), directions, distance)

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
    emission: Float32[ndarray, "2 T 3"] | None = None,
) -> Surfels:
    """Surfels of about `size` meters of all that the free places see, larger where there would be more than `most`; None: about `most`.

    None straddles a border of albedo or of emission, a wall that stands on a surface, or the rim of what lies on it, nor are objects mixed,
    but small ones where there are thousands. Black surfaces have surfels of twice the size, since they may be made to emit. `surfaces`:
    opaque triangles of any side, no edge longer than a surfel; `objects`: of each, its object's number; `emission`: radiance of both sides.
    """
    if emission is None:
        emission = np.zeros((2, len(objects), 3), np.float32)
    width = float(np.sqrt(surfaces.areas.sum() / most)) if size is None else size
    surfaces, source = cut_at_walls(surfaces, occluders, GAP * width)
    objects, emission = objects[source], emission[:, source]
    both, object_of, shines = surfaces.both_sides(), np.concatenate([objects, objects]), np.concatenate(list(emission))
    kept = np.flatnonzero(both.areas > 0)
    seen = np.zeros(len(both.corners), bool)
    seen[kept[exposed(both.at(kept), occluders, free)]] = True
    light, gap = lighting_others(both, object_of, shines, width)
    kept, hidden = kept[(reached(both, seen) | light)[kept]], gap & ~seen
    owners = np.full(len(both.corners), -1, np.int64)
    if not len(kept):
        nothing = Cells.of_image(np.zeros((2, 0, 4), np.float32))
        dark = np.zeros((0, 3), np.float32)
        return Surfels(nothing, surfaces.corners, owners.reshape(2, -1), np.zeros(0, np.int64), dark, np.zeros(0, bool))
    fragments = both.at(kept)
    witnesses = lit(fragments.centers, fragments.normals, occluders, free[: min(WITNESSES, places_for(len(kept)))])
    under = covered(fragments.centers, fragments.normals, occluders, GAP * width)
    sides = _Sides(fragments, object_of[kept], shines[kept], hidden[kept], under, witnesses)
    area = sides.fragments.areas / sides.sizes**2
    least = float(np.sqrt(area.sum() / most))
    spacing = least if size is None else max(size, least)
    owner = sides.owners(spacing)
    while owner.max() >= most and spacing < 8 * least:  # surfels are cut at edges, borders and walls
        spacing *= float(np.sqrt((owner.max() + 1) / most))
        owner = sides.owners(spacing)
    owners[kept] = owner
    count = int(owner.max()) + 1
    of_cell, in_gap = np.zeros(count, np.int64), np.zeros(count, bool)
    of_cell[owner], in_gap[owner] = sides.objects, sides.hidden
    own = np.maximum(np.bincount(owner, sides.fragments.areas, count), 1e-30)
    flux = np.stack([np.bincount(owner, sides.fragments.areas * sides.emission[:, c], count) for c in range(3)], axis=1)
    cells = grouped_cells(sides.fragments, owner).with_patches(np.arange(count))
    radiance = (flux / own[:, None]).astype(np.float32)
    return Surfels(cells, surfaces.corners, owners.reshape(2, -1), of_cell, radiance, in_gap)


@dataclass(frozen=True, eq=False)
class _Sides:
    """Sides that have surfels: `objects` (N,), `emission` (N, 3), which are `hidden` and `covered`, `seen` (N, F) from which places."""

    fragments: Fragments
    objects: Int[ndarray, " N"]
    emission: Float32[ndarray, "N 3"]
    hidden: Bool[ndarray, " N"]
    covered: Bool[ndarray, " N"]
    seen: Bool[ndarray, "N F"]

    @property
    def is_dim(self) -> Bool[ndarray, " N"]:
        """Those that neither reflect nor emit."""
        return (self.fragments.albedo.max(axis=1) < DARK) & ~self.emission.any(axis=1)

    @property
    def sizes(self) -> Float64[ndarray, " N"]:
        """Of their surfels, by that of the others."""
        return np.where(self.is_dim, DIM_SIZE, 1.0)

    def owners(self, spacing: float) -> Int[ndarray, " N"]:
        """The surfel of every side: those of a cell that share places from which they are seen; one that none sees joins another."""
        apart, owner, count = self._apart(spacing), np.empty(len(self.objects), np.int64), 0
        sizes = self.sizes
        for size in np.unique(sizes):
            chosen = sizes == size
            owner[chosen] = count + cells_of(self.fragments.at(chosen), float(size) * spacing, apart[chosen])[1]
            count = int(owner[chosen].max()) + 1
        return _parted_cells(owner, self.seen)

    def _apart(self, spacing: float) -> Int[ndarray, " N"]:
        """What no surfel has two of: objects, small ones of many together unless they emit; steps of emission; hidden and covered sides."""
        count = int(self.objects.max()) + 1
        strength = self.emission.max(axis=1)
        most = np.zeros(count)
        np.maximum.at(most, self.objects, strength)
        large = np.bincount(self.objects, self.fragments.areas, count) >= spacing**2
        own = (most > 0) | large | (len(np.unique(self.objects)) <= MOST_OBJECTS)
        step = np.ceil(EMISSION_STEPS * strength / np.maximum(most, 1e-30)[self.objects]).astype(np.int64)
        return np.where(own[self.objects], self.objects * (EMISSION_STEPS + 1) + step, -1) * 4 + 2 * self.covered + self.hidden


def reached(both: Fragments, seen: Bool[ndarray, " T"]) -> Bool[ndarray, " T"]:
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


def covered(
    points: Float64[ndarray, "n 3"], normals: Float64[ndarray, "n 3"], occluders: EmbreeTriangles, gap: float
) -> Bool[ndarray, " n"]:
    """Above which points another surface lies, less than `gap` (m) along the normal."""
    if not len(points):
        return np.zeros(0, bool)
    lift = OFFSET * float(np.ptp(points, axis=0).max())
    return occluders.occluded((points + lift * normals).astype(np.float32), normals, np.full(len(points), gap))


def cut_at_walls(surfaces: Fragments, occluders: EmbreeTriangles, gap: float) -> tuple[Fragments, Int[ndarray, " U"]]:
    """(triangles, those that another surface parts in halves, a few times over; of which each is a part).

    It parts one where a corner is hidden from the middle, or is not covered, within `gap` (m), where the middle is.
    """
    done: list[tuple[ndarray, ndarray, ndarray]] = []
    corners, albedo, source = surfaces.corners, surfaces.albedo, np.arange(len(surfaces.corners))
    lift = OFFSET * float(np.ptp(corners.reshape(-1, 3), axis=0).max(initial=0))
    for _ in range(CUTS):
        own = Fragments(corners, albedo)
        hidden = np.zeros(len(corners), bool)
        for side in (1.0, -1.0):
            middle = own.centers + side * lift * own.normals
            under = covered(own.centers, side * own.normals, occluders, gap)
            for corner in range(3):
                vector = 0.98 * (corners[:, corner] - own.centers)
                hidden |= under != covered(own.centers + vector, side * own.normals, occluders, gap)
                distance = lengths(vector)
                direction = vector / np.maximum(distance, 1e-30)[:, None]
                hidden |= occluders.occluded(middle.astype(np.float32), direction, distance)
        done.append((corners[~hidden], albedo[~hidden], source[~hidden]))
        corners, albedo, source = halves(corners[hidden]), np.repeat(albedo[hidden], 2, axis=0), np.repeat(source[hidden], 2)
    done.append((corners, albedo, source))
    every = [np.concatenate(part) for part in zip(*done, strict=True)]
    return Fragments(every[0], every[1]), every[2]


def halves(corners: Float32[ndarray, "T 3 3"]) -> Float32[ndarray, "U 3 3"]:
    """Every triangle cut through the middle of its longest edge; the halves of one follow each other."""
    edges = lengths(np.roll(corners, -1, axis=1) - corners)
    turn = (edges.argmax(axis=1)[:, None] + np.arange(3)) % 3
    first, second, third = np.moveaxis(np.take_along_axis(corners, turn[:, :, None], axis=1), 1, 0)
    middle = (first + second) / 2
    return np.stack([np.stack([first, middle, third], axis=1), np.stack([middle, second, third], axis=1)], axis=1).reshape(-1, 3, 3)


def _parted_cells(owner: Int[ndarray, " N"], seen: Bool[ndarray, "N F"]) -> Int[ndarray, " N"]:
    """Cells without parts that share no place from which they are seen; what none sees joins another part of its cell."""
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
