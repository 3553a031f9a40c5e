"""A linear filter that removes noise on surfaces and preserves edges: planes fitted to the neighbors that agree within the noise.

Guide values of a known noise variance decide the weights. For each texel a plane is fitted to its neighbors, and fitted again to those
that are within the noise of the plane. Its row of the filter is the value of that plane at the texel. Where fewer than half of the
neighbors agree, as at edges, the texel keeps its value. One that is far off the plane of its neighbors has no weight in its own fit. Where
there is no noise, almost nothing changes, as with non-local means of a known variance [Buades2005; Takeda2007].
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int

NEIGHBORS = 16
NORMAL_SCALE = 8.0  # texel sizes: how far away a neighbor counts for facing elsewhere, per unit of the normals' difference
REACH = 4.0  # texel sizes: neighbors farther away are none
SHARPNESS = 2.0  # how fast a neighbor's weight falls beyond the noise
AGREED = 0.5  # share of the neighbors that must lie on the plane
OUTLIER = 8.0  # squared distance from the neighbors' plane, over that of noise, from which a value is contradicted
STEADY = 1e-3  # added to the normal equations: a row of neighbors gives no slope across
LEAST_VARIANCE = 1e-20
MEDIAN = 0.4549  # of the square of a normal variable of variance 1
BATCH = 1 << 15


@dataclass(frozen=True, eq=False)
class Neighbors:
    """The nearest of n texels to each, by place and normal: `number` (n, K), 0 where not `known`. `size`: between texels, m."""

    places: Float64[ndarray, "n 3"]
    facing: Float64[ndarray, "n 3"]
    size: float
    number: Int[ndarray, "n K"]
    known: Bool[ndarray, "n K"]

    @staticmethod
    def of(positions: Float32[ndarray, "n 3"], normals: Float32[ndarray, "n 3"]) -> Neighbors:
        """Of more than NEIGHBORS texels: positions in meters."""
        from scipy.spatial import cKDTree

        places, facing = positions.astype(np.float64), normals.astype(np.float64)
        near, _ = cKDTree(places).query(places[:: max(1, len(places) // 2048)], 2)
        size = max(float(np.median(near[:, 1])), 1e-9)
        keys = np.concatenate([places / size, NORMAL_SCALE * facing], axis=1)
        tree = cKDTree(keys)
        number, known = np.zeros((len(keys), NEIGHBORS), np.int32), np.zeros((len(keys), NEIGHBORS), bool)
        for start in range(0, len(keys), BATCH):
            part = slice(start, start + BATCH)
            far, found = tree.query(keys[part], NEIGHBORS + 1, distance_upper_bound=REACH, workers=-1)
            known[part] = np.isfinite(far[:, 1:])
            number[part] = np.where(known[part], found[:, 1:], 0)
        return Neighbors(places, facing, size, number, known)

    def within(self, labels: Int[ndarray, " n"]) -> Neighbors:
        """Only those of the same label."""
        return replace(self, known=self.known & (labels[self.number] == labels[:, None]))

    @property
    def enough(self) -> Bool[ndarray, " n"]:
        """Texels with so many neighbors that these say something."""
        return self.known.sum(axis=1) >= NEIGHBORS // 2

    def batches(self) -> Iterator[tuple[slice, Float64[ndarray, "b K 3"]]]:
        """Parts of the texels, and 1 and the coordinates of each one's neighbors in its tangent plane, in texel sizes."""
        for start in range(0, len(self.places), BATCH):
            part = slice(start, start + BATCH)
            facing = self.facing[part]
            across = np.cross(facing, np.where(np.abs(facing[:, :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0]))
            across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
            step = (self.places[self.number[part]] - self.places[part, None]) / self.size
            flat = [np.einsum("bkc,bc->bk", step, axis) for axis in (across, np.cross(facing, across))]
            yield part, np.stack([np.ones_like(flat[0]), *flat], axis=2)

    def median(self, values: Float32[ndarray, " n"]) -> Float32[ndarray, " n"]:
        """Of each texel's value and its neighbors'."""
        found = np.empty_like(values)
        for start in range(0, len(values), BATCH):
            part = slice(start, start + BATCH)
            near = np.where(self.known[part], values[self.number[part]], np.nan)
            found[part] = np.nanmedian(np.concatenate([values[part, None], near], axis=1), axis=1)
        return found


def off_planes(neighbors: Neighbors, values: Float32[ndarray, "n S"]) -> Float32[ndarray, "n S"]:
    """Squared distance of values from the planes through their neighbors, less what noise moves these: of noise alone, its variance."""
    squares = np.empty_like(values)
    for part, design in neighbors.batches():
        fit = _fit(design, values[neighbors.number[part]], neighbors.known[part].astype(np.float64))
        squares[part] = (values[part] - fit.slopes[:, 0]) ** 2 / (1 + fit.leverage)[:, None]
    return squares


def plane_filter(neighbors: Neighbors, guide: Float32[ndarray, "n S"], variance: Float32[ndarray, "n S"]) -> Any:
    """The filter, a sparse (n, n) float32 whose rows add up to 1; `variance` is that of the noise of `guide`.

    Memory: 8 (NEIGHBORS + 1) bytes per texel, and as much again while it is made.
    """
    from scipy.sparse import csr_array

    count, width = len(guide), NEIGHBORS + 1
    rows = np.zeros((count, width), np.float32)
    enough = neighbors.enough
    for part, design in neighbors.batches():
        known, others = neighbors.known[part], guide[neighbors.number[part]]
        fit = _fit(design, others, known.astype(np.float64))
        noise = 1 / np.maximum(2.0 * variance[part], LEAST_VARIANCE)
        apart = np.einsum("bks,bs->bk", (others - design @ fit.slopes) ** 2, noise) / guide.shape[1]
        agreeing = known * np.exp(-SHARPNESS * np.maximum(apart - 1, 0))
        alone = np.einsum("bs,bs->b", (guide[part] - fit.slopes[:, 0]) ** 2, noise) / guide.shape[1] / (1 + fit.leverage)
        agreed = agreeing.sum(axis=1) / np.maximum(known.sum(axis=1), 1)
        whole = np.concatenate([design, np.broadcast_to([1.0, 0, 0], (len(design), 1, 3))], axis=1)
        weight = np.concatenate([agreeing, np.where(alone > OUTLIER, 0.0, 1.0)[:, None]], axis=1)
        own = _middle(whole, weight)
        chosen = enough[part] & (agreed > AGREED)
        own[~chosen] = 0
        own[~chosen, -1] = 1
        rows[part] = own / own.sum(axis=1, keepdims=True)
    columns = np.concatenate([neighbors.number, np.arange(count, dtype=np.int32)[:, None]], axis=1)
    ends = np.arange(count + 1, dtype=np.int64) * width
    made = csr_array((rows.ravel(), columns.ravel(), ends.astype(np.int32 if ends[-1] < 1 << 31 else np.int64)), shape=(count, count))
    made.eliminate_zeros()
    return made


@dataclass(frozen=True, eq=False)
class _Fit:
    """Planes through values (b, k, S): value at the middle and slopes (b, 3, S), variance of the former per unit of noise (b,)."""

    slopes: Float64[ndarray, "b 3 S"]
    leverage: Float64[ndarray, " b"]


def _fit(design: Float64[ndarray, "b k 3"], values: Float32[ndarray, "b k S"], weight: Float64[ndarray, "b k"]) -> _Fit:
    weighed = design * weight[:, :, None]
    inverse = _inverse(design, weighed)
    return _Fit(inverse @ np.einsum("bki,bks->bis", weighed, values), inverse[:, 0, 0])


def _middle(design: Float64[ndarray, "b k 3"], weight: Float64[ndarray, "b k"]) -> Float64[ndarray, "b k"]:
    """Weights of the values in the plane's value at the middle."""
    weighed = design * weight[:, :, None]
    return np.einsum("bi,bki->bk", _inverse(design, weighed)[:, 0], weighed)


def _inverse(design: Float64[ndarray, "b k 3"], weighed: Float64[ndarray, "b k 3"]) -> Float64[ndarray, "b 3 3"]:
    inverse: ndarray = np.linalg.inv(np.einsum("bki,bkj->bij", weighed, design) + STEADY * np.eye(3))
    return inverse
