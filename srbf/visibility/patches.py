"""Patches: cells of the surfaces in groups that emit as one, no group across a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.errors import MissingLibraryError
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.surface_cells import DARK, Cells, Fragments, cells_of, exposed, lit

CELLS_PER_PATCH = 10  # about; the fewest that measure a light close to a patch
MOST_CELLS, FEWEST_CELLS = 12000, 4000
VISIBILITY_AXES = 12
PLACE_WEIGHT, VISIBILITY_WEIGHT = 2.0, 0.2  # of the scene's longest side; of the rms
SPLITS = 3  # tries to keep to the number of patches when some are parted
ROUNDS = 30  # of k-means


@dataclass(frozen=True, eq=False)
class Patches:
    """Cells in patches, and the fragments that emit: those of cells that reflect anything, with the patch of each.

    Patch 0 to K - 1 are of diffuse surfaces; cells of black ones are in none, and left out.
    """

    cells: Cells
    fragments: Fragments
    owners: Int[ndarray, " T"]

    @property
    def count(self) -> int:
        return self.cells.patch_count


def patches_of(surfaces: Fragments, occluders: EmbreeTriangles, free: Float64[ndarray, "F 3"], count: int, seed: int = 0) -> Patches:
    """At most `count` patches of all surfaces that the free places see: fewer where there are fewer cells.

    Cells are grouped by k-means on place, normal, albedo and on what places see them, so that no patch spans a wall: the last are the
    leading axes of the matrix "lit by which free place", its columns of unit length. `surfaces`: triangles of any side, no edge longer than
    a cell.
    """
    sides = surfaces.at(surfaces.albedo.max(axis=1) >= DARK).both_sides()
    sides = sides.at(sides.areas > 0)
    sides = sides.at(exposed(sides, occluders, free))
    if not len(sides.corners):
        return Patches(Cells.of_image(np.zeros((2, 0, 4), np.float32)), sides, np.zeros(0, np.int64))
    cells, owner = cells_of(sides, float(np.sqrt(sides.areas.sum() / cell_count(count))))
    seen = lit(cells.places.astype(np.float64), cells.normals.astype(np.float64), occluders, free)
    labels = label_cells(cells, seen, count, seed)
    return Patches(cells.with_patches(labels), sides, labels[owner])


def unemitting(cells: Cells) -> Patches:
    """Cells by which light is measured alone: nothing emits."""
    nothing = Fragments(np.zeros((0, 3, 3), np.float32), np.zeros((0, 3), np.float32))
    return Patches(cells, nothing, np.zeros(0, np.int64))


def cell_count(patches: int) -> int:
    """About how many cells that many patches are made of."""
    return int(np.clip(CELLS_PER_PATCH * patches, FEWEST_CELLS, MOST_CELLS))


def label_cells(cells: Cells, seen: Bool[ndarray, "N F"], count: int, seed: int = 0) -> Int[ndarray, " N"]:
    """The patch of every cell, 0 to at most `count` - 1, none empty.

    k-means on place, normal, albedo and visibility. Where no place sees two parts of a patch, they are two patches.
    """
    if len(cells.places) <= count:
        return np.arange(len(cells.places))
    extent = max(float(np.ptp(cells.places, axis=0).max()), 1e-9)
    features = np.concatenate(
        [PLACE_WEIGHT * cells.places / extent, cells.normals, cells.albedo, VISIBILITY_WEIGHT * visibility_axes(seen)], axis=1
    )
    asked = count
    for _ in range(SPLITS):
        labels = parted(group(features, cells.areas, asked, seed), seen)
        found = int(labels.max()) + 1
        if found <= count:
            break
        asked = max(1, asked - (found - count))
    return labels


def group(features: ndarray, weights: ndarray, count: int, seed: int = 0) -> Int[ndarray, " N"]:
    """Groups of about equal features by weighted k-means, 0 to at most `count` - 1, none empty."""
    try:
        from sklearn.cluster import KMeans
    except ImportError as error:
        raise MissingLibraryError("patches need scikit-learn: pip install scikit-learn") from error
    found = KMeans(count, n_init=1, max_iter=ROUNDS, random_state=seed).fit(features.astype(np.float64), sample_weight=weights)
    return np.unique(found.labels_, return_inverse=True)[1].ravel().astype(np.int64)


def parted(labels: Int[ndarray, " N"], seen: Bool[ndarray, "N F"]) -> Int[ndarray, " N"]:
    """Groups without parts that share no place from which they are seen; of what none sees, one part a group."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    order = np.argsort(labels, kind="stable")  # parts are numbered by group, then by their first cells
    place, cell = np.nonzero(np.column_stack([seen, ~seen.any(axis=1)])[order].T)
    linked = (np.diff(place) == 0) & (np.diff(labels[order][cell]) == 0)  # each with the next of its group that a place sees
    graph = csr_array((np.ones(linked.sum()), (cell[:-1][linked], cell[1:][linked])), shape=(len(labels), len(labels)))
    result = np.empty(len(labels), np.int64)
    result[order] = connected_components(graph, directed=False)[1]
    return result


def visibility_axes(seen: Bool[ndarray, "N F"]) -> Float32[ndarray, "N Z"]:
    """Coordinates of every cell on the leading axes of "lit by which place", of unit length in the rms: what sees the same is close."""
    matrix = seen.astype(np.float32)
    matrix /= np.sqrt(np.maximum(matrix.sum(axis=0, dtype=np.float64), 1)).astype(np.float32)
    values, vectors = np.linalg.eigh((matrix.T @ matrix).astype(np.float64))
    axes = matrix @ vectors[:, ::-1][:, :VISIBILITY_AXES].astype(np.float32)
    return axes / np.float32(max(float(np.sqrt((axes**2).sum(axis=1).mean())), 1e-12))
