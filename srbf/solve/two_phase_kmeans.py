"""Two-phase k-means: clusters by splitting are where the k-means algorithm starts [Hasan2005, section 3.3.1].

For one set of many points, or for many small sets of equal size at once.
"""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Int
from srbf.solve.splitting import split_clusters

UPDATES = 4  # of all means, in the second phase
SPLIT_UPDATES = 3  # of the two means of a cut
AT_ONCE = 0.25  # clusters of a set are cut together whose spread is at least that share of the set's largest
EQUAL = 1e-5  # of the largest feature: points closer to each other are the same


def two_phase(features: Float[ndarray, "N d"], count: int) -> Int[ndarray, " N"]:
    """The cluster of each point, 0 to at most `count` - 1, none empty: `split_clusters`, then k-means with all means."""
    from scipy.spatial import cKDTree

    points = np.asarray(features, np.float64)
    labels = split_clusters(points, count)
    for _ in range(UPDATES if count < len(points) else 0):
        size = np.bincount(labels)
        means = np.stack([np.bincount(labels, own) for own in points.T], axis=1) / size[:, None]
        labels = np.unique(cKDTree(means).query(points, workers=-1)[1], return_inverse=True)[1].ravel()
    return labels


def two_phase_sets(features: Float32[ndarray, "B N d"], present: Bool[ndarray, "B N"], count: int) -> Int[ndarray, "B N"]:
    """The cluster of each point of B sets, 0 to `count` - 1 in every set; -1 of points that are not `present`.

    A set of at most `count` points has a cluster for each. Memory: a few arrays of B N `count` / 8 and B N d numbers.
    """
    labels = np.full(present.shape, -1, np.int64)
    sizes = present.sum(axis=1)
    few = sizes <= count
    labels[few] = np.where(present[few], np.cumsum(present[few], axis=1) - 1, -1)
    many = np.flatnonzero(~few)
    if not len(many):
        return labels
    points, known = np.asarray(features[many], np.float32), present[many]
    own = np.full(known.shape, -1, np.int64)
    own[known] = _split(np.ascontiguousarray(points[known].T), sizes[many], count)
    for _ in range(UPDATES):
        own = np.where(known, _nearest(points, _means(points, own, count)), -1)
    labels[many] = own
    return labels


def _means(points: Float32[ndarray, "B N d"], labels: Int[ndarray, "B N"], count: int) -> Float32[ndarray, "B K d"]:
    """Of every cluster; far away of empty ones."""
    sets = len(points)
    known = labels >= 0
    flat = (labels + count * np.arange(sets)[:, None])[known]
    size = np.bincount(flat, minlength=sets * count)
    own = points[known]
    total = np.stack([np.bincount(flat, own[:, k], sets * count) for k in range(points.shape[2])], axis=1)
    means = np.where(size[:, None] > 0, total / np.maximum(size, 1)[:, None], 1e9)
    return means.reshape(sets, count, -1).astype(np.float32)


def _nearest(points: Float32[ndarray, "B N d"], means: Float32[ndarray, "B K d"]) -> Int[ndarray, "B N"]:
    """The mean nearest to each point of its set, by |m|^2 - 2 p . m."""
    found = np.empty(points.shape[:2], np.int64)
    for own, mean, row in zip(points, means, found, strict=True):
        away = own @ (-2 * mean.T)
        away += np.einsum("kd,kd->k", mean, mean)
        row[:] = away.argmin(axis=1)
    return found


def _split(points: Float32[ndarray, "d n"], sizes: Int[ndarray, " B"], count: int) -> Int[ndarray, " n"]:
    """Clusters by splitting those of largest spread, of sets that lie one after another in `points`; numbers begin at 0 in each set."""
    total = points.shape[1]
    order = np.arange(total)  # the members of a cluster are next to each other
    starts, lengths, sets = np.concatenate([[0], np.cumsum(sizes)[:-1]]), np.array(sizes), np.arange(len(sizes))
    numbers = np.zeros(len(sizes), np.int64)
    own_clusters = np.ones(len(sizes), np.int64)
    least = (EQUAL * float(np.abs(points).max(initial=0))) ** 2
    means, spreads, axes = _measured(points, starts, lengths)
    while True:
        chosen = _largest(spreads, sets, count - own_clusters, least * lengths)
        if not len(chosen):
            break
        length = lengths[chosen]
        begins = np.concatenate([[0], np.cumsum(length)[:-1]])
        within = np.repeat(starts[chosen] - begins, length) + np.arange(int(length.sum()))
        members = order[within]
        own = points[:, members]
        side = own[np.repeat(axes[chosen], length), np.arange(len(members))] > np.repeat(
            means[axes[chosen], chosen], length
        )  # never all of a cluster but where rounding is all that parts it
        side = _halved(own, side, begins, length)
        second = np.add.reduceat(side.astype(np.int64), begins)
        first = length - second
        before = np.cumsum(side) - side  # members of second halves before each, of all clusters
        rank = before - np.repeat(before[begins], length)
        place = np.arange(len(members)) - np.repeat(begins, length)
        order[np.repeat(starts[chosen], length) + np.where(side, np.repeat(first, length) + rank, place - rank)] = members
        halves = np.concatenate([starts[chosen], starts[chosen] + first]), np.concatenate([first, second])
        real = (first > 0) & (second > 0)
        spreads[chosen[~real]] = 0
        again = np.sort(sets[chosen[real]])
        kept = chosen[real]
        turn = np.arange(len(again)) - np.searchsorted(again, again)  # the how manyth of its set
        by_set = np.argsort(sets[kept], kind="stable")
        fresh = np.empty(len(kept), np.int64)
        fresh[by_set] = own_clusters[again] + turn
        own_clusters += np.bincount(again, minlength=len(own_clusters))
        two = np.concatenate([real, real])
        begin, size = halves[0][two], halves[1][two]
        found = _measured(points[:, order[_ranges(begin, size)]], np.concatenate([[0], np.cumsum(size)[:-1]]).astype(np.int64), size)
        n = len(kept)
        lengths[kept], means[:, kept], spreads[kept], axes[kept] = size[:n], found[0][:, :n], found[1][:n], found[2][:n]
        starts, lengths = np.concatenate([starts, begin[n:]]), np.concatenate([lengths, size[n:]])
        sets, numbers = np.concatenate([sets, sets[kept]]), np.concatenate([numbers, fresh])
        means, spreads, axes = (
            np.concatenate([old, new[..., n:]], axis=-1) for old, new in zip((means, spreads, axes), found, strict=True)
        )
    labels = np.empty(total, np.int64)
    labels[order[_ranges(starts, lengths)]] = np.repeat(numbers, lengths)
    return labels


def _ranges(starts: Int[ndarray, " c"], lengths: Int[ndarray, " c"]) -> Int[ndarray, " n"]:
    """Whole numbers from each start on, as many as its length."""
    begins = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    return np.repeat(starts - begins, lengths) + np.arange(int(lengths.sum()))


def _measured(points: Float32[ndarray, "d n"], begins: Int[ndarray, " c"], lengths: Int[ndarray, " c"]) -> tuple[ndarray, ndarray, ndarray]:
    """(means (d, c), sums of squared distances from them (c,), the axis of largest variance (c,)) of clusters one after another."""
    means = np.add.reduceat(points, begins, axis=1) / lengths
    away = points - np.repeat(means, lengths, axis=1)
    squares = np.add.reduceat(away * away, begins, axis=1)
    return means.astype(np.float32), squares.sum(axis=0), squares.argmax(axis=0)


def _largest(spreads: ndarray, sets: Int[ndarray, " c"], missing: Int[ndarray, " B"], least: ndarray) -> Int[ndarray, " m"]:
    """The clusters to cut next: of every set those of large spread, as many as it has yet to get."""
    able = np.flatnonzero((spreads > least) & (missing[sets] > 0))
    if not len(able):
        return able
    able = able[np.lexsort((-spreads[able], sets[able]))]
    own = sets[able]
    first = np.searchsorted(own, own)
    wanted = (np.arange(len(able)) - first < missing[own]) & (spreads[able] >= AT_ONCE * spreads[able[first]])
    return able[wanted]


def _halved(points: Float32[ndarray, "d n"], side: Bool[ndarray, " n"], begins: Int[ndarray, " c"], lengths: Int[ndarray, " c"]) -> ndarray:
    """(n,) the half of each point after some updates of the two means of its cluster; halves that would be empty are left."""
    whole = np.add.reduceat(points, begins, axis=1)
    for _ in range(SPLIT_UPDATES):
        size = np.add.reduceat(side.astype(np.float32), begins)
        second = np.add.reduceat(points * side, begins, axis=1)
        one = (whole - second) / np.maximum(lengths - size, 1).astype(np.float32)
        other = second / np.maximum(size, 1)
        toward = other - one
        bound = np.einsum("dc,dc->c", toward, (one + other) / 2)
        moved = np.einsum("dn,dn->n", points, np.repeat(toward, lengths, axis=1)) > np.repeat(bound, lengths)
        parts = np.add.reduceat(moved.astype(np.int64), begins)
        real = (parts > 0) & (parts < lengths)
        side = np.where(np.repeat(real, lengths), moved, side)
    return side
