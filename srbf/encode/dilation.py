"""Dilation: texels outside a receiver get the value of the nearest covered texel, so that filtering at a chart's edge reads no hole."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int


def nearest_covered(coverage: Float32[ndarray, "H W"]) -> Int[ndarray, "H W"] | None:
    """Flat index of the nearest texel with any coverage; None if all or none are covered."""
    from scipy import ndimage

    covered = coverage > 0
    if covered.all() or not covered.any():
        return None
    rows, columns = ndimage.distance_transform_edt(~covered, return_distances=False, return_indices=True)
    return (rows * coverage.shape[1] + columns).astype(np.int64)


def dilate(image: ndarray, nearest: Int[ndarray, "H W"] | None) -> ndarray:
    """`image` (H, W, C) of any type with every uncovered texel replaced by its nearest covered one."""
    return image if nearest is None else image.reshape(-1, image.shape[2])[nearest.ravel()].reshape(image.shape)
