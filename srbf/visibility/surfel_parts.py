"""Parts of surfels: the points of each at which direct light is measured, so that a shadow's edge crosses surfels little by little."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float64, Int
from srbf.visibility.surface_cells import Cells, Fragments, contain, frames, grouped_cells
from srbf.visibility.surfels import Surfels, halves

SPLITS = 2  # of a surfel's triangles, in halves: some for each part
SIDE = 2  # parts of a surfel along either of its sides
TURN = np.arctan(1 / 2)  # rad, at most: four parts turned by it are at four distances from an edge, each as far from the next


def parts_of(surfels: Surfels) -> Cells:
    """About SIDE^2 cells of each surfel, their areas together its area; the patch of each is the number of its surfel.

    Their places are turned about the middle of the surfel, by a random angle each, so that no row of surfels leaves a shadow at once.
    """
    sides = Fragments(surfels.corners, np.zeros_like(surfels.corners[:, 0])).both_sides()
    owner = surfels.owners.ravel()
    corners, owner = sides.corners[owner >= 0], owner[owner >= 0]
    for _ in range(SPLITS):
        corners, owner = halves(corners), np.repeat(owner, 2)
    fragments = Fragments(corners, np.zeros_like(corners[:, 0]))
    named, part = np.unique(SIDE**2 * owner + _quarters(fragments, owner, surfels.cells), return_inverse=True)
    cells = grouped_cells(fragments, part.ravel()).with_patches(named // SIDE**2)
    turned = _turned(cells, surfels.cells)
    kept = np.bincount(cells.patches, ~_on_surfel(turned, cells.patches, fragments, owner), surfels.count) > 0
    return replace(cells, places=np.where(kept[cells.patches, None], cells.places, turned).astype(np.float32))


def _turned(parts: Cells, surfels: Cells) -> Float64[ndarray, "N 3"]:
    """Places of parts, turned about their middle in their surfel's plane, and stretched as the surfel is."""
    count = len(surfels.places)
    places, own = parts.places.astype(np.float64), parts.patches
    weights = np.maximum(np.bincount(own, parts.areas, count), 1e-30)
    middle = np.stack([np.bincount(own, parts.areas * places[:, k], count) for k in range(3)], axis=1) / weights[:, None]
    across = [axis[own] for axis in frames(surfels.normals.astype(np.float64))]
    x, y = (np.einsum("nk,nk->n", places - middle[own], axis) for axis in across)
    wide, high = (np.sqrt(np.bincount(own, along**2, count))[own] + 1e-9 for along in (x, y))
    angle = np.random.default_rng(0).uniform(-TURN, TURN, count)[own]
    dx = (np.cos(angle) - 1) * x - np.sin(angle) * wide / high * y
    dy = (np.cos(angle) - 1) * y + np.sin(angle) * high / wide * x
    return places + dx[:, None] * across[0] + dy[:, None] * across[1]


def _on_surfel(
    points: Float64[ndarray, "N 3"], own: Int[ndarray, " N"], fragments: Fragments, owner: Int[ndarray, " T"]
) -> Bool[ndarray, " N"]:
    """Whether each point is on one of the fragments of its surfel."""
    order = np.argsort(owner, kind="stable")
    starts = np.searchsorted(owner[order], np.arange(int(owner.max(initial=-1)) + 2))
    counts = np.diff(starts)[own]
    point = np.repeat(np.arange(len(points)), counts)
    fragment = order[np.arange(len(point)) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(starts[own], counts)]
    return np.bincount(point, contain(fragments.at(fragment), points[point]), len(points)) > 0


def _quarters(fragments: Fragments, owner: Int[ndarray, " T"], cells: Cells) -> Int[ndarray, " T"]:
    """The part of its surfel, 0 to SIDE^2 - 1, that each fragment is in: halves of its area along one side, and of each along the other."""
    found = np.zeros(len(owner), np.int64)
    for axis in frames(cells.normals.astype(np.float64)):
        along = np.einsum("tk,tk->t", fragments.centers, axis[owner])
        found = SIDE * found + _halves_by_area(along, fragments.areas, owner * SIDE**2 + found)
    return found


def _halves_by_area(along: Float64[ndarray, " T"], areas: Float64[ndarray, " T"], groups: Int[ndarray, " T"]) -> Int[ndarray, " T"]:
    """0 for what is in the first half of its group's area, in the order of `along`, else 1."""
    order = np.lexsort((along, groups))
    ends = np.cumsum(areas[order])
    first = np.searchsorted(groups[order], groups[order], side="left")
    last = np.searchsorted(groups[order], groups[order], side="right") - 1
    before = np.where(first > 0, ends[first - 1], 0.0)
    middle = (before + ends[last]) / 2
    found = np.empty(len(along), np.int64)
    found[order] = (ends - areas[order] / 2 > middle).astype(np.int64)
    return found
