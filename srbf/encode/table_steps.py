"""Tables as multiples of powers of two, so that their files pack well: no finer than pictures show."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float16, Float32

VALUE_STEP = 2.0**-5  # of the rms of a cluster's functions
COLUMN_ERROR = 0.04  # of what one surfel, or what shapes lay on one, is, rms; twice that shows as colored blotches in a dim room
LEAST = 1e-30
ROUNDING_NOISE = 1 / np.sqrt(12.0)  # rms, of a step


def steps_by_cluster(functions: ndarray, clusters: int) -> Float16[ndarray, "F N c"]:
    """Functions (F, N, c) as half floats, multiples of one power of two in each of the clusters, of F / clusters functions in order."""
    of_cluster = functions.astype(np.float32).reshape(clusters, -1)
    rms = np.sqrt((of_cluster**2).mean(axis=1, keepdims=True))
    return _rounded(of_cluster, VALUE_STEP * rms).reshape(functions.shape).astype(np.float16)


def steps_by_column(
    transfer: Float32[ndarray, "r S c"], shapes: Float32[ndarray, " r"], error: float = COLUMN_ERROR
) -> Float32[ndarray, "r S c"]:
    """Weights of r shapes from S surfels as multiples of a power of two each: of a shape of a small rms, `shapes`, coarser ones.

    Together they change the picture that a surfel makes by `error`, rms; those of many surfels average out.
    """
    size = np.maximum(shapes, LEAST).astype(np.float32)[:, None, None]
    lit = (transfer * size) ** 2
    column = np.sqrt(lit.sum(axis=(0, 2), keepdims=True))
    return _rounded(transfer, error / (ROUNDING_NOISE * np.sqrt(transfer.shape[0] * transfer.shape[2])) * column / size)


def _rounded(values: ndarray, step: ndarray) -> ndarray:
    """To multiples of the power of two nearest to `step`."""
    even = power_of_two(step)
    return np.round(values / even) * even


def power_of_two(values: ndarray) -> ndarray:
    """The nearest power of two of each, float32."""
    return np.exp2(np.round(np.log2(np.maximum(values, LEAST)))).astype(np.float32)
