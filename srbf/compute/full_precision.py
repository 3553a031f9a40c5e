"""Tables of halves as the processor multiplies them, converted once: numpy has no products of halves."""

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
