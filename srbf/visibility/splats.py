"""Surfels as splats: each an elliptical Gaussian on its plane, whose normalized mixture is what a receiver shows."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64, Int
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.surface_cells import Cells

SPREAD = 0.6  # of a Gaussian, in sides of its surfel
FLATTENED = 4.0  # a splat is so much thinner along its normal
CANDIDATES = 32  # nearest surfels of a receiver among which it finds its splats
FACING = 0.3  # cosine between normals, from which on a surfel counts
RAISED = (0.02, 0.2)  # sides above their surfaces, between which nothing may stand: what rests on a floor parts it
REACH = 1.5  # sides of a surfel, past which its splat ends
RECEIVERS = 1 << 14  # at a time


def splats_at(
    points: Float[ndarray, "P 3"],
    normals: Float[ndarray, "P 3"],
    cells: Cells,
    occluders: EmbreeTriangles,
    count: int,
    is_seen: bool = False,
) -> tuple[Int[ndarray, "P n"], Float64[ndarray, "P n"]]:
    """(surfels, weights that add up to 1) of the `count` splats that cover each point most; weights of 0 where none does.

    A splat covers a point where nothing stands between the two and both face about the same way. What no splat covers is dark: surfels are
    wherever light comes. `is_seen`: every point is, as pixels of a view are, so that those on a border, in part of two surfaces, show
    what is near.
    """
    from scipy.spatial import KDTree

    tree = KDTree(cells.places)
    most = min(CANDIDATES, len(cells.places))
    size = np.sqrt(np.maximum(cells.areas, 1e-30)).astype(np.float64)
    chosen = np.zeros((len(points), count), np.int64)
    weights = np.zeros((len(points), count))
    for first in range(0, len(points), RECEIVERS):
        part = slice(first, first + RECEIVERS)
        near = tree.query(points[part], most)[1].reshape(-1, most)  # (n, m)
        away = points[part, None] - cells.places[near]
        off = np.einsum("nmk,nmk->nm", away, cells.normals[near])
        squared = np.einsum("nmk,nmk->nm", away, away) + (FLATTENED**2 - 1) * off**2
        cosine = np.einsum("nk,nmk->nm", normals[part], cells.normals[near])
        strength = -0.5 * squared / (SPREAD * size[near]) ** 2
        seen = (cosine > FACING) & (strength > -0.5 * (REACH / SPREAD) ** 2)
        covering = seen.copy()
        for raised in RAISED:
            row, column = np.nonzero(seen)
            surfel = near[row, column]
            lift = raised * size[surfel][:, None]
            starts = cells.places[surfel] + lift * cells.normals[surfel]
            toward = points[part][row] + lift * normals[part][row] - starts
            distance = np.linalg.norm(toward, axis=1)
            blocked = occluders.occluded(starts.astype(np.float32), toward / np.maximum(distance, 1e-30)[:, None], distance)
            seen[row[blocked], column[blocked]] = False
        if is_seen:
            hidden = ~seen.any(axis=1)
            seen[hidden] = covering[hidden]
        strength = np.where(seen, strength, -np.inf)
        order = np.argsort(-strength, axis=1)[:, :count]
        found = np.exp(np.take_along_axis(strength, order, axis=1))
        chosen[part, : order.shape[1]] = np.take_along_axis(near, order, axis=1)
        weights[part, : order.shape[1]] = found / np.maximum(found.sum(axis=1, keepdims=True), 1e-30)
    return chosen, weights
