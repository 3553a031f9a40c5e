"""Form factors to a few small surfels by points on them: what emits is bright, and few of a receiver's own rays would meet it."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float64, Int
from srbf.visibility.form_factors import RayOrigins
from srbf.visibility.surface_cells import OFFSET
from srbf.visibility.surfels import Surfels

if TYPE_CHECKING:
    from scipy.sparse import csr_array

POINTS = 64  # of a surfel, from which those of a receiver are drawn
AIMED = 4  # rays of a receiver to each surfel, at least
MOST_AIMED = 16
ALL_RAYS = 4e7  # of all receivers
FAR = 2.0  # diameters of a surfel, from which on it is aimed at
PAIRS = 1 << 20  # at a time


class AimedFactors:
    """Form factors to those surfels that emit, F = cos cos' A / (pi r^2) in the mean over points that see each other.

    Closer than FAR diameters, a receiver's own rays stay: they meet the surfel often, and the quotient varies much there.
    """

    def __init__(self, surfels: Surfels, seed: int = 0) -> None:
        self.chosen: Int[ndarray, " E"] = np.flatnonzero(surfels.emission.any(axis=1))
        self._surfels, self._seed = surfels, seed
        self._is_chosen = np.zeros(surfels.count, bool)
        self._is_chosen[self.chosen] = True

    def put(self, factors: csr_array, origins: RayOrigins, receivers: int, seed: int) -> csr_array:
        """`factors` (n, S) of rays, with those of the surfels that emit measured again where these are far. `receivers`: of how many in all
        these are some."""
        from scipy.sparse import csr_array

        if not len(self.chosen):
            return factors
        count = int(np.clip(ALL_RAYS / max(1, receivers * len(self.chosen)), AIMED, MOST_AIMED))
        kept = ~self._is_chosen[factors.indices]
        rows = np.repeat(np.arange(factors.shape[0]), np.diff(factors.indptr))
        values = factors[:, self.chosen].toarray()
        batch = max(1, PAIRS // (count * len(self.chosen)))
        for start in range(0, len(values), batch):
            part = slice(start, start + batch)
            far, aimed = self._aimed(RayOrigins(origins.points[part], origins.normals[part], origins.weights[part]), count, [seed, start])
            values[part] = np.where(far, aimed, values[part])
        row, column = np.nonzero(values)
        data = np.concatenate([factors.data[kept], values[row, column]]).astype(np.float32)
        places = np.concatenate([rows[kept], row]), np.concatenate([factors.indices[kept], self.chosen[column]])
        return csr_array((data, places), shape=factors.shape)

    def _aimed(self, origins: RayOrigins, count: int, seed: list[int]) -> tuple[Bool[ndarray, "n E"], Float64[ndarray, "n E"]]:
        """(which are far, form factors of those)."""
        rng = np.random.default_rng(seed)
        points, normals = self._points
        middle, diameter = points.mean(axis=1), self._diameters
        origin = np.asarray(origins.points, np.float64)
        n, of_each = origins.weights.shape
        away = np.linalg.norm(origin[:, :1] - middle[None], axis=2)  # (n, E)
        far = away > FAR * diameter
        row, column = np.nonzero(far)
        if not len(row):
            return far, np.zeros(far.shape)
        weights = np.cumsum(origins.weights, axis=1, dtype=np.float64)
        weights /= np.maximum(weights[:, -1:], 1e-30)
        total = np.zeros(len(row))
        for k in range(count):
            turn = (k + rng.uniform(size=len(row))) / count
            own = np.minimum((weights[row] < turn[:, None]).sum(axis=1), of_each - 1)
            other = (POINTS // count * k + rng.integers(POINTS // count, size=len(row))) % POINTS
            start, up = origin[row, own], np.asarray(origins.normals, np.float64)[row, own]
            end, facing = points[column, other], normals[column, other]
            start, end = start + self._lift * up, end + self._lift * facing
            vector = end - start
            squared = np.einsum("nk,nk->n", vector, vector)
            distance = np.sqrt(np.maximum(squared, 1e-30))
            cosines = np.einsum("nk,nk->n", vector, up) * -np.einsum("nk,nk->n", vector, facing)
            front = (np.einsum("nk,nk->n", vector, up) > 0) & (cosines > 0)
            front[front] = ~self._surfels.blocked(start[front], vector[front] / distance[front, None], distance[front])
            total += np.where(front, cosines / np.maximum(squared**2, 1e-30), 0)
        found = np.zeros(far.shape)
        found[row, column] = total * self._surfels.cells.areas[self.chosen[column]] / (np.pi * count)
        return far, found

    @functools.cached_property
    def _points(self) -> tuple[Float64[ndarray, "E q 3"], Float64[ndarray, "E q 3"]]:
        points, normals = self._surfels.spread(POINTS, self._seed)
        return points[self.chosen], normals[self.chosen]

    @functools.cached_property
    def _diameters(self) -> Float64[ndarray, " E"]:
        points = self._points[0]
        return 2 * np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2).max(axis=1)

    @functools.cached_property
    def _lift(self) -> float:
        return OFFSET * float(np.ptp(self._surfels.cells.places, axis=0).max(initial=0))
