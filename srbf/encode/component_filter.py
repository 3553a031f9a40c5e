"""Noise of a capture taken out of its components: planes through neighbors on the surface, where they agree within the noise.

Images of few samples leave grain in the components of single texels. What the median texel differs by from a plane through its neighbors
is noise: the slopes of light are no part of it. Where the neighbors lie on one plane within that noise, a value becomes the plane's, fitted
again by those that do; elsewhere, at edges, it stays. A value that its neighbors contradict is replaced by theirs. So grain goes and edges
stay, as in non-local means of a known variance, and where there is no noise next to nothing changes [Buades2005; Takeda2007].
"""

from __future__ import annotations

from dataclasses import dataclass

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
MEDIAN = 0.4549  # of the square of a normal variable of variance 1
BATCH = 1 << 15


def without_noise(
    components: Float32[ndarray, "S P"],
    index: Int[ndarray, " P"],
    covered: Bool[ndarray, " P"],
    positions: Float32[ndarray, "P 3"],
    normals: Float32[ndarray, "P 3"],
) -> Float32[ndarray, "S P"]:
    """Components with less noise; `index` is the cluster of every texel, and texels that are not covered stay as they are."""
    from scipy.spatial import cKDTree

    texels = np.flatnonzero(covered)
    if len(texels) <= NEIGHBORS:
        return components
    places, facing = positions[texels].astype(np.float64), normals[texels].astype(np.float64)
    near, _ = cKDTree(places).query(places[:: max(1, len(places) // 2048)], 2)
    size = max(float(np.median(near[:, 1])), 1e-9)  # between neighboring texels, m
    keys = np.concatenate([places / size, NORMAL_SCALE * facing], axis=1)
    far, neighbor = cKDTree(keys).query(keys, NEIGHBORS + 1, distance_upper_bound=REACH, workers=-1)
    known = np.isfinite(far[:, 1:])
    neighbor = np.where(known, neighbor[:, 1:], 0)
    own = index[texels]
    known &= own[neighbor] == own[:, None]
    values = np.ascontiguousarray(components[:, texels].T)  # (n, S)
    result = values.copy()
    squares = np.full(values.shape, np.nan, np.float32)
    enough = known.sum(axis=1) >= NEIGHBORS // 2
    planes = []
    for start in range(0, len(values), BATCH):
        part = slice(start, start + BATCH)
        across = np.cross(facing[part], np.where(np.abs(facing[part, :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0]))
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
        step = (places[neighbor[part]] - places[part, None]) / size
        flat = [np.einsum("bkc,bc->bk", step, axis) for axis in (across, np.cross(facing[part], across))]
        design = np.stack([np.ones_like(flat[0]), *flat], axis=2)  # (b, k, 3)
        fit = _fit(design, values[neighbor[part]], known[part].astype(np.float64))
        squares[part] = (values[part] - fit.slopes[:, 0]) ** 2 / (1 + fit.leverage)[:, None]
        planes.append((part, design, fit))
    variance = np.zeros((int(own.max()) + 1, values.shape[1]))
    for number in range(len(variance)):
        members = np.flatnonzero((own == number) & enough)
        if len(members) > NEIGHBORS:
            variance[number] = np.median(squares[members], axis=0) / MEDIAN
    for part, design, fit in planes:
        noise = 1 / np.maximum(2 * variance[own[part]], 1e-20)
        others = values[neighbor[part]]
        apart = np.einsum("bks,bs->bk", (others - design @ fit.slopes) ** 2, noise) / values.shape[1]
        agreeing = known[part] * np.exp(-SHARPNESS * np.maximum(apart - 1, 0))
        alone = np.einsum("bs,bs->b", (values[part] - fit.slopes[:, 0]) ** 2, noise) / values.shape[1] / (1 + fit.leverage)
        is_outlier = alone > OUTLIER
        agreed = agreeing.sum(axis=1) / np.maximum(known[part].sum(axis=1), 1)
        whole = np.concatenate([design, np.broadcast_to([1.0, 0, 0], (len(design), 1, 3))], axis=1)
        weight = np.concatenate([agreeing, np.where(is_outlier, 0.0, 1.0)[:, None]], axis=1)
        smooth = _fit(whole, np.concatenate([others, values[part, None]], axis=1), weight).slopes[:, 0]
        chosen = enough[part] & (agreed > AGREED)
        result[part] = np.where(chosen[:, None], smooth, values[part])
    filtered = components.copy()
    filtered[:, texels] = result.T
    return filtered


@dataclass(frozen=True, eq=False)
class _Fit:
    """Planes through values (b, k, S): value at the middle and slopes (b, 3, S), variance of the former per unit of noise (b,)."""

    slopes: Float64[ndarray, "b 3 S"]
    leverage: Float64[ndarray, " b"]


def _fit(design: Float64[ndarray, "b k 3"], values: Float32[ndarray, "b k S"], weight: Float64[ndarray, "b k"]) -> _Fit:
    weighed = design * weight[:, :, None]
    matrix = np.einsum("bki,bkj->bij", weighed, design) + STEADY * np.eye(3)
    inverse = np.linalg.inv(matrix)
    return _Fit(inverse @ np.einsum("bki,bks->bis", weighed, values), inverse[:, 0, 0])
