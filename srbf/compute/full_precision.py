"""Tables as the processor multiplies them: halves converted once, for numpy has no products of those, and one channel of several copied."""

from __future__ import annotations

import weakref

import numpy as np
from numpy import ndarray

from srbf.arrays import Float16, Float32

_kept: dict[int, tuple[weakref.ref[ndarray], Float32[ndarray, "C R N"]]] = {}


def by_channel(table: Float16[ndarray, "R N C"]) -> Float32[ndarray, "C R N"]:
    """The table in float32, one matrix a channel, kept for as long as the table is there. The table must not change."""
    number = id(table)
    kept = _kept.get(number)
    if kept is None or kept[0]() is not table:
        matrices = np.ascontiguousarray(table.transpose(2, 0, 1), np.float32)
        kept = (weakref.ref(table, lambda _: _kept.pop(number, None)), matrices)
        _kept[number] = kept
    return kept[1]


FEW = 3  # columns that BLAS takes one by one sooner than together


def times_columns(matrix: Float32[ndarray, "R N"], columns: Float32[ndarray, "N k"]) -> Float32[ndarray, "R k"]:
    """Their product."""
    if columns.shape[1] > FEW:
        return matrix @ columns
    return np.stack([matrix @ np.ascontiguousarray(column) for column in columns.T], axis=1)


def channel_products(left: Float32[ndarray, "R N C"], right: Float32[ndarray, "N k C"]) -> Float32[ndarray, "R k C"]:
    """The matrix product of each channel. numpy takes a tenth of the speed where channels are apart in memory: they are copied."""
    channels = zip(np.moveaxis(left, 2, 0), np.moveaxis(right, 2, 0), strict=True)
    return np.stack([np.ascontiguousarray(a) @ np.ascontiguousarray(b) for a, b in channels], axis=2)
