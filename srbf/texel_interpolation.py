"""Missing texels of an image, interpolated from the nearest known ones: near in the image, the scene, and the direction of the normal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32

NEIGHBORS = 4
WIDTH = 0.7  # of the Gaussian of distance beyond the nearest, spacings of known texels
TURN = 4.0  # spacings that opposite normals count half of


def interpolation(
    known: Bool[ndarray, "H W"],
    coverage: Float32[ndarray, "H W"],
    position: Float32[ndarray, "H W 3"] | None = None,
    normal: Float32[ndarray, "H W 3"] | None = None,
) -> Any:
    """The linear map from the texels that are `known` to all texels of an image.

    The value at texel p is Σ_q w_q x_q / Σ_q w_q over the 4 nearest known covered texels q, w_q = exp(−(d_q² − d_min²) / (2 · 0.7²)). d
    is Euclidean over place in the image, position and normal, in units of the mean spacing of known texels; a known texel keeps its
    value. So light does not leak between charts, or around edges. What is not covered takes the nearest covered texel of the image.

    Parameters
    ----------
    known
        (H, W), at least one of them covered.
    coverage
        (H, W), above 0 where the receiver is.
    position, normal
        (H, W, 3) in meters, and of unit length; None: distance in the image alone.

    Returns
    -------
    scipy.sparse.csr_matrix
        (P, K) float32 on the K known texels in their order, row by row; each row adds up to 1. 36 bytes per texel.

    Notes
    -----
    One k-d tree search per texel: about 8 s for a million texels.
    """
    from scipy import ndimage
    from scipy.sparse import csr_matrix
    from scipy.spatial import cKDTree

    covered = coverage > 0
    if not (covered & known).any():
        covered = np.ones_like(covered)
    spacing = float(np.sqrt(known.size / known.sum()))
    place = _places(covered, position, normal, spacing)
    column = np.cumsum(known) - 1  # of a known texel, among them
    source = np.flatnonzero((known & covered).ravel())
    asked = np.flatnonzero(covered.ravel())
    count = min(NEIGHBORS, len(source))
    distance, nearest = (array.reshape(len(asked), count) for array in cKDTree(place[source]).query(place[asked], k=count, workers=-1))
    weight = np.exp((distance[:, :1] ** 2 - distance**2) / (2 * WIDTH**2))
    itself = known.ravel()[asked]
    weight[itself] = source[nearest[itself]] == asked[itself, None]
    weight /= weight.sum(axis=1, keepdims=True)
    row = np.zeros(known.size, np.int64)
    row[asked] = np.arange(len(asked))
    if not covered.all():
        where = ndimage.distance_transform_edt(~covered, return_distances=False, return_indices=True)
        row = row.reshape(known.shape)[tuple(where)].ravel()
    first = np.arange(known.size + 1) * count
    return csr_matrix(
        (weight[row].astype(np.float32).ravel(), column.ravel()[source[nearest]][row].astype(np.int32).ravel(), first),
        shape=(known.size, int(known.sum())),
    )


def _places(
    covered: Bool[ndarray, "H W"], position: Float32[ndarray, "H W 3"] | None, normal: Float32[ndarray, "H W 3"] | None, spacing: float
) -> Float32[ndarray, "P D"]:
    """Coordinates of each texel in which distances are compared, in units of `spacing` texels."""
    y, x = np.mgrid[: covered.shape[0], : covered.shape[1]]
    parts = [np.stack([x, y], axis=2) / spacing]
    if position is not None:
        apart = np.linalg.norm(np.diff(position, axis=1), axis=2)[covered[:, 1:] & covered[:, :-1]]
        apart = apart[np.isfinite(apart) & (apart > 0)]
        texel = float(np.median(apart)) if len(apart) else 1.0
        parts.append(np.nan_to_num(position.astype(np.float64)) / (texel * spacing))
    if normal is not None:
        parts.append(np.nan_to_num(normal) * TURN)
    return np.concatenate(parts, axis=2).reshape(covered.size, -1).astype(np.float32)
