"""Radiance toward many viewers as a bake makes it: which directions are rendered, and their spherical harmonics at every receiver."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.basis.exitant_harmonics import lifted, projection_of_each
from srbf.sphere import fibonacci

CHUNK = 1 << 12  # receivers at a time
RIDGE = (
    0.03  # of a fit to few samples: a lobe as wide as Phong's of exponent 12 is 42 % off at order 3, at best 40 %, with 1/100 of the noise
)
HALF_SPHERE = 2  # directions for each harmonic: those behind a surface are turned above it


def viewer_directions(order: int) -> Float64[ndarray, "S 3"]:
    """Unit directions that a light's receivers are seen from, evenly over the sphere."""
    return fibonacci(HALF_SPHERE * (order + 1) ** 2)


def project(images: Float32[ndarray, "H W N"], normals: Float32[ndarray, "H W 3"], order: int) -> Float32[ndarray, "H W M"]:
    """N = 3 S: RGB radiance toward `viewer_directions`, one after the other, becomes M = 3 K: RGB of the harmonics.

    Least squares over the directions that each receiver was in fact seen from, see `lifted`. Receivers without a normal take the mean of
    all, so that they vary with no viewer.
    """
    height, width = normals.shape[:2]
    seen, facing = images.reshape(height * width, -1, 3), normals.reshape(-1, 3)
    viewers = viewer_directions(order)
    result = np.zeros((len(seen), (order + 1) ** 2, 3), np.float32)
    known = np.linalg.norm(facing, axis=1) > 0.5
    for start in range(0, len(seen), CHUNK):
        rows = np.arange(start, min(start + CHUNK, len(seen)))
        rows = rows[known[rows]]
        normal = facing[rows] / np.linalg.norm(facing[rows], axis=1, keepdims=True)
        shape = (len(rows), len(viewers), 3)
        from_where = lifted(np.broadcast_to(viewers, shape), np.broadcast_to(normal[:, None], shape))
        result[rows] = projection_of_each(from_where, order, RIDGE) @ seen[rows]
    result[~known, 0] = seen[~known].mean(axis=1) * np.sqrt(4 * np.pi)
    return result.reshape(height, width, -1)
