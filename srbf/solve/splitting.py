"""Clusters by splitting: the one of largest spread is cut in two, again and again [Hasan2005]."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Int

UPDATES = 3  # of the two means of a cut
AT_ONCE = 0.25  # clusters are cut together whose spread is at least that share of the largest
POWER_STEPS = 6  # toward the longest axis of a cluster


def split_clusters(features: Float[ndarray, "N d"], count: int, weights: Float[ndarray, " N"] | None = None) -> Int[ndarray, " N"]:
    """The cluster of each point, 0 to at most `count` - 1, none empty: fewer where fewer points differ.

    Spread is the weighted sum of squared distances from a cluster's mean. A cluster is cut across its longest axis, and both means are
    moved UPDATES times. Memory: a few arrays like `features`.
    """
    points = np.asarray(features, np.float64)
    number = len(points)
    weight = np.ones(number) if weights is None else np.maximum(np.asarray(weights, np.float64), 1e-12)
    labels = np.zeros(number, np.int64)
    if not number:
        return labels
    spread = np.array([_spreads(points, weight, labels, 1)[0]])
    while len(spread) < count:
        order = np.argsort(-spread)[: count - len(spread)]
        chosen = order[spread[order] >= max(AT_ONCE * float(spread[order[0]]), 1e-24)]
        if not len(chosen):
            break
        slot = np.full(len(spread), -1)
        slot[chosen] = np.arange(len(chosen))
        members = np.flatnonzero(slot[labels] >= 0)
        own = slot[labels[members]]
        side = _halves(points[members], weight[members], own, len(chosen))
        moved = members[side]
        labels[moved] = len(spread) + own[side]
        renewed = np.concatenate([2 * own[~side], 2 * own[side] + 1])
        found = _spreads(
            points[np.concatenate([members[~side], moved])], weight[np.concatenate([members[~side], moved])], renewed, 2 * len(chosen)
        )
        spread[chosen] = found[::2]
        spread = np.concatenate([spread, found[1::2]])
    return np.unique(labels, return_inverse=True)[1].ravel()


def _means(points: ndarray, weight: ndarray, labels: ndarray, count: int) -> ndarray:
    total = np.maximum(np.bincount(labels, weight, count), 1e-300)
    return np.stack([np.bincount(labels, weight * points[:, k], count) for k in range(points.shape[1])], axis=1) / total[:, None]


def _spreads(points: ndarray, weight: ndarray, labels: ndarray, count: int) -> ndarray:
    """(count,) of each cluster; 0 of one whose points are equal."""
    away = points - _means(points, weight, labels, count)[labels]
    return np.bincount(labels, weight * np.einsum("nd,nd->n", away, away), count)


def _halves(points: ndarray, weight: ndarray, labels: ndarray, count: int) -> ndarray:
    """(n,) whether each point is in the second half of its cluster; both halves have points."""
    away = points - _means(points, weight, labels, count)[labels]
    axis = np.ones((count, points.shape[1])) + 0.01 * np.arange(points.shape[1])
    farthest = np.lexsort((np.einsum("nd,nd->n", away, away), labels))[np.cumsum(np.bincount(labels, minlength=count)) - 1]
    axis = away[farthest]  # never across all points of the cluster
    for _ in range(POWER_STEPS):
        along = np.einsum("nd,nd->n", away, axis[labels])
        axis = np.stack([np.bincount(labels, weight * along * away[:, k], count) for k in range(points.shape[1])], axis=1)
        axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    side = np.einsum("nd,nd->n", away, axis[labels]) > 0
    for _ in range(UPDATES):
        pair = _means(points, weight, 2 * labels + side, 2 * count)
        first, second = pair[::2], pair[1::2]
        middle, toward = (first + second) / 2, second - first
        moved = np.einsum("nd,nd->n", points - middle[labels], toward[labels]) > 0
        parts = np.bincount(2 * labels + moved, minlength=2 * count).reshape(-1, 2)
        whole = (parts > 0).all(axis=1)[labels]
        side = np.where(whole, moved, side)
    return side
