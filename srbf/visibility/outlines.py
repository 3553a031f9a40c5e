"""Where the picture of a view has edges of surfaces."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32

SAME_COS, OFF_PLANE = 0.95, 0.1  # of neighbors in a view: their normals, and the distance off a plane over that from each other


def outlines(positions: Float32[ndarray, "H W 3"], normals: Float32[ndarray, "H W 3"]) -> Bool[ndarray, "H W"]:
    """Pixels of a view beside another surface: positions (m) off the plane of a neighbor, or other normals. Few samples may miss a part."""
    found = np.zeros(positions.shape[:2], bool)
    for here, there in (
        ((slice(1, None), slice(None)), (slice(None, -1), slice(None))),
        ((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
    ):
        vector = positions[there] - positions[here]
        off = np.maximum(*(np.abs((vector * normals[side]).sum(axis=2)) for side in (here, there)))
        differs = (off > OFF_PLANE * np.linalg.norm(vector, axis=2)) | ((normals[here] * normals[there]).sum(axis=2) < SAME_COS)
        found[here] |= differs
        found[there] |= differs
    return found
