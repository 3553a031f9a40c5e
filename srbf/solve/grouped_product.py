"""A streamed product whose columns fall into groups with separate weights."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Int
from srbf.compute.threads import each, one_blas_thread
from srbf.io.float16 import finite_to_float32

COLUMN_BATCH = 1 << 12


class GroupedProduct:
    """X(j, p) = sum_{l,c} W[g(p), j, l, c] B(l, p, c), B of L rows fed block by block, g the group of column p.

    weights (G, J, L, C), groups (P,). Rows may be float32 or finite float16. Columns are gathered group by group, so that each piece is
    one product. Memory: X, an order of the columns, and one gathered piece per core. Cost: 2 J L P C flops and one gather of B.
    """

    def __init__(self, weights: Float32[ndarray, "G J L C"], groups: Int[ndarray, " P"]) -> None:
        self._weights = weights
        self._order = np.argsort(groups, kind="stable")
        sizes = np.bincount(groups, minlength=len(weights))
        starts = np.concatenate([[0], np.cumsum(sizes)])
        self._pieces = [
            (group, first, min(first + COLUMN_BATCH, int(starts[group + 1])))
            for group in range(len(weights))
            for first in range(int(starts[group]), int(starts[group + 1]), COLUMN_BATCH)
        ]
        self._sorted = np.zeros((weights.shape[1], len(groups)), np.float32)

    def add(self, first_row: int, block: Float[ndarray, "b P C"]) -> None:
        """Feed rows first_row … first_row + b - 1; every row exactly once, in any order."""
        rows = len(block)

        def work(number: int) -> None:
            group, start, stop = self._pieces[number]
            gathered = block[:, self._order[start:stop]]  # (b, n, C)
            values = gathered.transpose(0, 2, 1)
            if block.dtype == np.float16:
                values = finite_to_float32(np.ascontiguousarray(values), np.empty(values.shape, np.float32))
            weights = self._weights[group, :, first_row : first_row + rows]  # (J, b, C)
            self._sorted[:, start:stop] += weights.reshape(len(weights), -1) @ values.reshape(-1, stop - start)

        with one_blas_thread():
            each(work, len(self._pieces))

    @property
    def result(self) -> Float32[ndarray, "J P"]:
        """X of the rows fed so far, in the original order of columns."""
        result = np.empty_like(self._sorted)
        result[:, self._order] = self._sorted
        return result
