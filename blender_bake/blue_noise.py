# SPDX-License-Identifier: GPL-3.0-or-later
"""Blue noise: points that are random and yet keep their distance from each other."""

from __future__ import annotations

import math

import numpy as np
from mathutils.kdtree import KDTree

SHARPNESS = 8
RELAXED, EXPONENT = 0.65, 1.5


def chosen(points: np.ndarray, count: int, volume: float) -> np.ndarray:
    """Indices of `count` of the points (N, 3): those left when the most crowded one is eliminated again and again.

    Weighted sample elimination [Yuksel2015]: a neighbor at distance d adds
    (1 - d / 2r)^8, r the radius at which `count` spheres fill `volume` (cubic meters) as densely as can be. N log N; the best results
    need several points per one chosen.
    """
    total = len(points)
    if count >= total or volume <= 0:
        return np.arange(min(count, total))
    radius = (volume / (4 * math.sqrt(2) * count)) ** (1 / 3)
    closest = radius * (1 - (count / total) ** EXPONENT) * RELAXED
    tree = KDTree(total)
    for i, point in enumerate(points.tolist()):
        tree.insert(point, i)
    tree.balance()
    neighbors, shares = [], []
    for point in points.tolist():
        near = tree.find_range(point, 2 * radius)
        neighbors.append(np.array([index for _, index, _ in near], np.intp))
        distances = np.array([distance for _, _, distance in near])
        shares.append((1 - np.minimum(np.maximum(distances, 2 * closest) / (2 * radius), 1)) ** SHARPNESS)
    crowd = np.array([share.sum() for share in shares])
    for _ in range(total - count):
        worst = int(np.argmax(crowd))
        crowd[neighbors[worst]] -= shares[worst]
        crowd[worst] = -np.inf
    return np.nonzero(np.isfinite(crowd))[0]
