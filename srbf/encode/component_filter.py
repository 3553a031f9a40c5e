"""Noise of a capture taken out of its components: each cluster's texels filtered by the planes that they lie on.

Images of few samples leave grain in the components of single texels. What the median texel of a cluster differs by from a plane through
its neighbors is noise: the slopes of light are no part of it.
"""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Int
from srbf.encode.plane_filter import MEDIAN, NEIGHBORS, Neighbors, off_planes, plane_filter


def without_noise(
    components: Float32[ndarray, "S P"],
    index: Int[ndarray, " P"],
    covered: Bool[ndarray, " P"],
    positions: Float32[ndarray, "P 3"],
    normals: Float32[ndarray, "P 3"],
) -> Float32[ndarray, "S P"]:
    """Components with less noise; `index` is the cluster of every texel, and texels that are not covered stay as they are."""
    texels = np.flatnonzero(covered)
    if len(texels) <= NEIGHBORS:
        return components
    own = index[texels]
    neighbors = Neighbors.of(positions[texels], normals[texels]).within(own)
    values = np.ascontiguousarray(components[:, texels].T)  # (n, S)
    squares, enough = off_planes(neighbors, values), neighbors.enough
    variance = np.zeros((int(own.max()) + 1, values.shape[1]), np.float32)
    for number in range(len(variance)):
        members = np.flatnonzero((own == number) & enough)
        if len(members) > NEIGHBORS:
            variance[number] = np.median(squares[members], axis=0) / MEDIAN
    filtered = components.copy()
    filtered[:, texels] = (plane_filter(neighbors, values, variance[own]) @ values).T
    return filtered
