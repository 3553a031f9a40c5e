"""Points with similar columns merged into fewer: complete linkage under the metric of a light cloud [Kristensen2005, section 4.1]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.errors import InputError

Mean = Literal["harmonic", "arithmetic"]
ROW_BATCH = 1 << 22  # numbers of a block of differences
BLOCKED = 2.0  # the metric of a pair that is not to be merged, over the largest of all others


@dataclass(frozen=True, eq=False)
class MergeTree:
    """The order in which L points merge: `steps` (L - 1, 4) as of scipy's linkage, whose heights are the largest metric of two members.

    `limit` is the height from which on a merge joins points that do not see each other.
    """

    steps: Float64[ndarray, "S 4"]
    limit: float

    def groups(self, threshold: float = 1.0) -> Int[ndarray, " L"]:
        """The group of each point, from 0 in the order of first members: in a group every pair has a metric below `threshold`.

        Weights of the metric that are f times as large give what the threshold 1/f gives.
        """
        from scipy.cluster.hierarchy import fcluster

        if not len(self.steps):
            return np.zeros(1, np.int64)
        found = fcluster(self.steps, np.nextafter(min(threshold, self.limit), 0), "distance")
        _, first, labels = np.unique(found, return_index=True, return_inverse=True)
        return np.argsort(np.argsort(first))[labels].astype(np.int64)

    def into(self, count: int) -> Int[ndarray, " L"]:
        """The same for the threshold that leaves `count` groups; more where not enough points see each other, or metrics are equal."""
        if count < 1:
            raise InputError(f"expected `count` of 1 or more merged lights, found {count}")
        heights = np.append(np.sort(self.steps[:, 2]), np.inf)
        return self.groups(float(heights[max(0, len(heights) - count)]))


def merge_tree(
    positions: Float[ndarray, "L 3"],
    differences: Float[ndarray, "L L"],
    visible: Bool[ndarray, "L L"],
    distance_weight: float,
    difference_weight: float,
) -> MergeTree:
    """The tree under the metric of a pair of points j, k at `positions` (m)

        w1 |p_j - p_k| + w2 max_c sqrt(sum_i (X_ij^c - X_ik^c)^2) + V_jk                      [Kristensen2005, eq. 9]

    with w1 = `distance_weight` (1/m), w2 = `difference_weight`, the maximum over receivers = `differences` (see `largest_differences`), and
    V infinite between points that do not see each other. The article's text calls it single linkage; its rule, that all pairs of two
    groups must be close, is complete linkage. Cost: L^2 numbers and time.
    """
    from scipy.cluster.hierarchy import linkage
    from scipy.spatial.distance import pdist

    positions = np.asarray(positions, np.float64)
    if len(positions) < 2:
        return MergeTree(np.zeros((0, 4)), np.inf)
    upper = np.triu_indices(len(positions), 1)
    metric = distance_weight * pdist(positions) + difference_weight * np.asarray(differences, np.float64)[upper]
    if not np.isfinite(metric).all():
        raise InputError("expected finite positions and responses of the lights to merge, found others; bake the capture again")
    hidden = ~visible[upper]
    limit = BLOCKED * max(1.0, float(metric.max()))
    metric[hidden] = limit
    return MergeTree(linkage(metric, "complete"), limit)


def largest_differences(responses: Float32[ndarray, "P L *n"]) -> Float64[ndarray, "L L"]:
    """max over receivers of the distance between two lights' responses (P, L, n: channels, or channels x functions). Cost: P L^2 n / 2."""
    flat = np.ascontiguousarray(np.moveaxis(responses.reshape(*responses.shape[:2], -1), 1, 0))  # (L, P, n)
    count = len(flat)
    found = np.zeros((count, count))
    if not flat.size:
        return found
    rows = max(1, ROW_BATCH // flat[0].size)
    for j in range(count - 1):
        for start in range(j + 1, count, rows):
            apart = flat[start : start + rows] - flat[j]
            found[j, start : start + rows] = np.einsum("lpn,lpn->lp", apart, apart).max(axis=1)
    return np.sqrt(found + found.T)


def metric_weights(positions: Float[ndarray, "L 3"], differences: Float[ndarray, "L L"]) -> tuple[float, float]:
    """(w1, w2) that give the largest distance (m) and the largest difference of two lights half a unit of the metric each.

    So the largest metric is at most one, and the reciprocals of a scene's size and of its intensities follow, as in the article. Scenes
    with detailed light need larger ones: a factor on both, or `MergeTree.into`.
    """
    from scipy.spatial.distance import pdist

    far = float(pdist(np.asarray(positions, np.float64)).max(initial=0)) if len(positions) > 1 else 0.0
    apart = float(np.max(differences, initial=0))
    return 0.5 / far if far else 1.0, 0.5 / apart if apart else 1.0


def merged(values: Float[ndarray, "*P L n"], groups: Int[ndarray, " L"], mean: Mean = "harmonic") -> Float64[ndarray, "*P G n"]:
    """The columns of each group's light: means over its members. Positions merge by the arithmetic mean.

    The harmonic mean n / sum(1/x) is 0 where a member is 0 (its limit); it never exceeds the arithmetic mean, so merged light is darker.
    Where members differ in sign, as coefficients or indirect light less direct highlights may, it has no meaning: there the arithmetic
    mean stands in.
    """
    counts = np.bincount(groups).astype(np.float64)[:, None]
    values = np.asarray(values, np.float64)
    arithmetic = _summed(values, groups) / counts
    if mean == "arithmetic":
        return arithmetic
    with np.errstate(divide="ignore", over="ignore"):
        inverse = _summed(np.where(values == 0, np.inf, 1 / np.where(values == 0, 1, np.abs(values))), groups)
        harmonic = np.where(np.isfinite(inverse) & (inverse > 0), counts / inverse, 0.0) * np.sign(arithmetic)
    mixed = _summed((values > 0).astype(np.float64), groups) * _summed((values < 0).astype(np.float64), groups) > 0
    return np.where(mixed, arithmetic, harmonic)


def _summed(values: Float64[ndarray, "*P L n"], groups: Int[ndarray, " L"]) -> Float64[ndarray, "*P G n"]:
    """Sums over the members of each group."""
    order = np.argsort(groups, kind="stable")
    starts = np.searchsorted(groups[order], np.arange(int(groups.max()) + 1))
    return np.add.reduceat(np.take(values, order, axis=-2), starts, axis=-2)
