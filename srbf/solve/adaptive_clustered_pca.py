"""Clustered PCA whose clusters have differing numbers of axes: each goes where it cuts the error most [Kristensen2005, section 5]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.errors import InputError, MissingLibraryError
from srbf.solve.clustered_pca import Clusters
from srbf.solve.pca import principal_axes

ITERATIONS = 30  # of growing, and as many at most of reassigning alone


@dataclass(frozen=True, eq=False)
class AdaptiveClusters(Clusters):
    """C affine subspaces of `counts` dimensions each; axes beyond a cluster's number are 0, so that S is the largest number."""

    counts: Int[ndarray, " C"]

    def through(self, features: Float32[ndarray, "M D"]) -> AdaptiveClusters:
        """The same subspaces under an orthonormal map to D features; residuals become those of the features."""
        mapped = super().through(features)
        return AdaptiveClusters(mapped.means, mapped.axes, self.counts)

    def mean_count(self, labels: Int[ndarray, " n"]) -> float:
        """Axes per vertex, on average over the assigned vectors."""
        return float(self.counts[labels].mean())


def adaptive_cluster(
    vectors: Float32[ndarray, "n M"],
    features: Float32[ndarray, "M D"],
    count: int,
    axes: float,
    seed: int = 0,
    most: int | None = None,
    iterations: int = ITERATIONS,
) -> AdaptiveClusters:
    """`count` clusters with `axes` axes per vector on average, none with more than `most`.

    k-means (Lloyd) first. Then in each iteration the mean and the eigenvalues of each cluster's scatter are found, axes are given one by
    one to the cluster of the largest eigenvalue n + 1 over its number of vectors, that is the error that the axis saves per vector, and
    vectors are reassigned with these numbers of axes. The average grows evenly over `iterations`; then vectors are reassigned until none
    changes its cluster, at most as often again. The article only adds axes; here each iteration gives all of them again, because
    vectors move to clusters with many axes, and the average would end above `axes` (by 1 to 11 % where vectors have no clusters).
    Assignment uses `features` only, an orthonormal map that keeps most of the vectors' energy; the final means and axes use the complete
    vectors. Cost of an iteration: C eigenproblems of D^3, and the assignment.
    """
    try:
        from sklearn.cluster import KMeans
    except ImportError as error:
        raise MissingLibraryError("clustered eigen maps need scikit-learn: pip install scikit-learn") from error
    if count < 1 or axes < 0 or iterations < 1:
        raise InputError(f"expected 1 or more clusters and iterations, and 0 or more `axes`, found {count}, {iterations} and {axes}")
    seen = vectors @ features
    count = min(count, len(vectors))
    limit = min(seen.shape[1], len(vectors)) if most is None else min(most, seen.shape[1])
    labels = KMeans(count, random_state=seed, n_init=1, algorithm="lloyd", max_iter=100).fit(seen).labels_.astype(np.int64)
    for round_ in range(2 * iterations):
        means, energies, turns = _local_pca(seen, labels, count)
        counts = _counts(energies, np.bincount(labels, minlength=count), axes * min(1, (round_ + 1) / iterations), limit)
        local = np.zeros((count, seen.shape[1], max(1, int(counts.max()))), np.float32)
        for number in range(count):
            local[number, :, : counts[number]] = turns[number, :, : counts[number]]
        before, labels = labels, Clusters(means, local).assign(seen)[0]
        if round_ >= iterations and (labels == before).all():
            break
    return _complete(vectors, labels, counts)


def _local_pca(
    seen: Float32[ndarray, "n D"], labels: Int[ndarray, " n"], count: int
) -> tuple[Float32[ndarray, "C D"], Float64[ndarray, "C D"], Float32[ndarray, "C D D"]]:
    """(mean, eigenvalues of the scatter, largest first, eigenvectors) of each cluster; 0 for one without vectors."""
    size = seen.shape[1]
    means, energies = np.zeros((count, size), np.float32), np.zeros((count, size))
    turns = np.zeros((count, size, size), np.float32)
    order = np.argsort(labels, kind="stable")
    ends = np.searchsorted(labels[order], np.arange(count + 1))
    for number in range(count):
        members = seen[order[ends[number] : ends[number + 1]]]
        if len(members):
            means[number] = members.mean(axis=0)
            rows = members - means[number]
            values, vectors = np.linalg.eigh((rows.T @ rows).astype(np.float64))
            energies[number], turns[number] = np.maximum(values[::-1], 0), vectors[:, ::-1]
    return means, energies, turns


def _counts(energies: Float64[ndarray, "C D"], sizes: Int[ndarray, " C"], average: float, limit: int) -> Int[ndarray, " C"]:
    """Axes of each cluster: those that save the most error per vector, until `average` per vector is reached."""
    counts, left = np.zeros(len(sizes), np.int64), average * sizes.sum()
    number, axis = np.nonzero(energies[:, :limit])
    saved = energies[number, axis] / sizes[number]
    for i in np.argsort(-saved, kind="stable"):
        if axis[i] == counts[number[i]] and sizes[number[i]] <= left:  # one after the other in each cluster
            counts[number[i]] += 1
            left -= sizes[number[i]]
    return counts


def _complete(vectors: Float32[ndarray, "n M"], labels: Int[ndarray, " n"], counts: Int[ndarray, " C"]) -> AdaptiveClusters:
    """Means and leading axes of the complete vectors of each cluster."""
    count, size, most = len(counts), vectors.shape[1], int(counts.max(initial=0))
    means, axes = np.zeros((count, size), np.float32), np.zeros((count, size, most), np.float32)
    for number in range(count):
        members = vectors[labels == number]
        if len(members):
            means[number] = members.mean(axis=0)
            if counts[number]:
                axes[number, :, : counts[number]] = principal_axes(members - means[number], int(counts[number]))[0].T
    return AdaptiveClusters(means, axes, counts)
