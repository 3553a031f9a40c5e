"""Clustered PCA: vectors in clusters, each with its mean and a few principal axes [Sloan2003, Kristensen2005]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.errors import MissingLibraryError

POWER_STEPS = 2  # of subspace iteration between two assignments, started at the previous axes
LAST_STEPS = 6
LAST_ASSIGNMENTS = 3  # at the full number of axes
OVERSAMPLED = 4  # axes iterated beyond those kept
VECTOR_BATCH = 1 << 13


@dataclass(frozen=True, eq=False)
class Clusters:
    """C affine subspaces: means (C, M) and orthonormal axes (C, M, S)."""

    means: Float32[ndarray, "C M"]
    axes: Float32[ndarray, "C M S"]

    def through(self, features: Float32[ndarray, "M D"]) -> Clusters:
        """The same subspaces under an orthonormal map to D features; residuals become those of the features."""
        return Clusters(self.means @ features, np.einsum("cms,md->cds", self.axes, features, optimize=True))

    def assign(self, vectors: Float32[ndarray, "n M"]) -> tuple[Int[ndarray, " n"], Float32[ndarray, " n"]]:
        """(nearest cluster, squared distance from its subspace) of every vector."""
        count, size, axes = self.axes.shape
        flat = self.axes.transpose(1, 0, 2).reshape(size, count * axes)
        offset = np.einsum("cm,cms->cs", self.means, self.axes)
        squared = np.einsum("cm,cm->c", self.means, self.means)
        nearest, distance = np.empty(len(vectors), np.int64), np.empty(len(vectors), np.float32)
        for start in range(0, len(vectors), VECTOR_BATCH):
            part = vectors[start : start + VECTOR_BATCH]
            squares = np.einsum("nm,nm->n", part, part)[:, None] - 2 * part @ self.means.T + squared
            if axes:
                along = (part @ flat).reshape(len(part), count, axes) - offset
                squares -= np.einsum("ncs,ncs->nc", along, along)
            best = squares.argmin(axis=1)
            nearest[start : start + len(part)] = best
            distance[start : start + len(part)] = np.maximum(squares[np.arange(len(part)), best], 0)
        return nearest, distance


def cluster(vectors: Float32[ndarray, "n M"], features: Float32[ndarray, "M D"], count: int, axes: int, seed: int = 0) -> Clusters:
    """Clusters of least squared distance: k-means first, then one axis after the other, with vectors reassigned in between.

    This finds better optima than k-means with all axes at once, since vectors move to clusters whose next axis fits them
    [Kristensen2005, section 6]. Assignment uses `features` only, an orthonormal map that keeps most of the vectors' energy; means and
    axes use the complete vectors. A cluster with too few vectors restarts at vectors of large distance.
    """
    try:
        from sklearn.cluster import MiniBatchKMeans
    except ImportError as error:
        raise MissingLibraryError("clustered eigen maps need scikit-learn: pip install scikit-learn") from error
    rng = np.random.default_rng(seed)
    seen = vectors @ features
    count = min(count, len(vectors))
    if count == 1:
        labels = np.zeros(len(vectors), np.int64)
    else:
        labels = MiniBatchKMeans(count, random_state=seed, n_init=1, batch_size=2048, max_iter=20).fit(seen).labels_.astype(np.int64)
    found = Clusters(np.zeros((count, vectors.shape[1]), np.float32), np.zeros((count, vectors.shape[1], 0), np.float32))
    distance = np.ones(len(vectors), np.float32)
    for grown in _growth(axes):
        found = _fit(vectors, _filled(labels, distance, count, grown, rng), found.axes, grown, POWER_STEPS, rng)
        labels, distance = found.through(features).assign(seen)
    for _ in range(LAST_ASSIGNMENTS):
        found = _fit(vectors, _filled(labels, distance, count, axes, rng), found.axes, axes, LAST_STEPS, rng)
        labels, distance = found.through(features).assign(seen)
    return found


def _growth(axes: int) -> list[int]:
    """Numbers of axes on the way to `axes`: one more at first, then by a third."""
    sizes, size = [], 1
    while size < axes:
        sizes.append(size)
        size = max(size + 1, size * 4 // 3)
    return [*sizes, axes]


def _filled(labels: Int[ndarray, " n"], distance: Float32[ndarray, " n"], count: int, axes: int, rng: np.random.Generator) -> np.ndarray:
    """`labels` in which every cluster has enough vectors to fit its axes; small ones get random vectors, weighted by distance."""
    sizes = np.bincount(labels, minlength=count)
    small = np.flatnonzero(sizes < axes + 2)
    if not len(small) or float(distance.sum()) == 0:
        return labels
    labels = labels.copy()
    wanted = min(2 * axes + 4, len(labels) // count + 1)
    chance = distance / distance.sum(dtype=np.float64)
    for number in small:
        nonzero = int(np.count_nonzero(chance))
        labels[rng.choice(len(labels), min(wanted, nonzero), replace=False, p=chance / chance.sum())] = number
    return labels


def _fit(vectors: np.ndarray, labels: np.ndarray, before: np.ndarray, axes: int, steps: int, rng: np.random.Generator) -> Clusters:
    """Mean and leading axes of every cluster by subspace iteration from the axes `before`."""
    count, size = len(before), vectors.shape[1]
    means, found = np.zeros((count, size), np.float32), np.zeros((count, size, axes), np.float32)
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(count + 1))
    for number in range(count):
        members = vectors[order[starts[number] : starts[number + 1]]]
        if not len(members):
            continue
        means[number] = members.mean(axis=0)
        rows = members - means[number]
        wanted = min(axes + OVERSAMPLED, len(rows), size)
        fresh = rng.standard_normal((size, max(0, wanted - before.shape[2])), np.float32)
        trial = np.concatenate([before[number], fresh], axis=1)[:, :wanted]
        for _ in range(steps):
            trial, _ = np.linalg.qr(rows.T @ (rows @ trial))
        _, energy, turn = np.linalg.svd(rows @ trial, full_matrices=False)
        kept = min(axes, len(energy))
        leading = (trial @ turn.T)[:, :kept]
        found[number, :, :kept] = np.where(energy[:kept] > 1e-6 * max(float(energy[0]), 1e-30), leading, 0)
    return Clusters(means, found)
