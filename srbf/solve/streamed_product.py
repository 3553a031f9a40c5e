"""The product of a few rows of weights with a matrix of millions of columns whose rows arrive in blocks, half or float."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.compute.threads import cores, one_blas_thread
from srbf.io.float16 import finite_to_float32

TILE_BYTES = 1 << 19  # of converted rows and their part of the product, to fit a core's cache
TASK_COLUMNS = 1 << 15  # per task of a thread; fixed, so that sums are the same on any number of cores


class StreamedProduct:
    """X = sum over rows l of W[:, l] B[l], for B of L rows of P columns with C components, which arrive in blocks.

    `weights` (J, L) keep the components separate: X is (J, P C). `weights` (J, L, C) also sum over the components:
    X(j, p) = sum_{l,c} W[j, l, c] B(l, p, c), (J, P).

    Rows may be float32 or finite float16, which are converted in cache; products and sums are float32 and
    bit-identical for any number of cores. Memory: X, and TILE_BYTES per core. Cost: 2 J L P C flops. X is read and written once per
    block, so feed dozens of rows at a time.
    """

    def __init__(self, weights: Float[ndarray, "J L"] | Float[ndarray, "J L C"]) -> None:
        self._weights = np.asarray(weights, np.float32)
        self._result: np.ndarray | None = None
        self._norm_squared = 0.0

    @property
    def result(self) -> Float32[ndarray, "J M"]:
        """X of the rows fed so far."""
        assert self._result is not None, "no rows were fed"
        return self._result

    @property
    def norm_squared(self) -> float:
        """|B|^2 of the rows fed so far, in float32 precision."""
        return self._norm_squared

    def add(self, first_row: int, block: Float[ndarray, "*block"]) -> None:
        """Feed rows first_row … first_row + b - 1, (b, P C) or (b, P, C); every row exactly once, in any order."""
        rows = len(block)
        weights = self._weights[:, first_row : first_row + rows]  # (J, b) or (J, b, C)
        joint = weights.ndim == 3
        parts = weights.shape[2] if joint else 1
        block = block.reshape(rows, -1, parts)  # (b, M, parts)
        columns = block.shape[1]
        fresh = self._result is None
        result = np.empty((len(weights), columns), np.float32) if self._result is None else self._result
        weights = np.ascontiguousarray(weights).reshape(len(weights), -1)  # (J, b parts)
        width = max(64, TILE_BYTES // (4 * sum(weights.shape)))

        def work(task: slice) -> float:
            converted = np.empty((rows, parts, min(width, columns)), np.float32)
            product = np.empty((len(weights), min(width, columns)), np.float32)
            squares = 0.0
            for start in range(task.start, task.stop, width):
                tile = slice(start, min(start + width, task.stop))
                size = tile.stop - tile.start
                values = converted[:, :, :size]
                source = block[:, tile].transpose(0, 2, 1)  # (b, parts, size)
                if block.dtype == np.float16:
                    finite_to_float32(source, values)
                else:
                    np.copyto(values, source)
                flat = values.reshape(-1, size)  # copies only the last, narrower tile of a task
                np.matmul(weights, flat, out=product[:, :size])
                if fresh:
                    result[:, tile] = product[:, :size]
                else:
                    result[:, tile] += product[:, :size]
                squares += float(np.vdot(flat, flat))
            return squares

        self._norm_squared += sum(in_tasks(work, columns))
        self._result = result

    def row_energies(self) -> Float64[ndarray, " J"]:
        """Sum of squares of every row of X, float32 within a piece of columns, float64 over pieces."""
        result = self.result
        return np.sum(in_tasks(lambda task: np.array([np.dot(row, row) for row in result[:, task]], np.float64), result.shape[1]), axis=0)

    def transform(self, matrix: Float64[ndarray, "I J"]) -> Float32[ndarray, "I M"]:
        """`matrix` X by float64 products of pieces of columns; a square `matrix` overwrites X."""
        result = self.result
        in_place = len(matrix) == len(result)
        transformed = result if in_place else np.empty((len(matrix), result.shape[1]), np.float32)

        def work(task: slice) -> None:
            transformed[:, task] = matrix @ result[:, task].astype(np.float64)

        in_tasks(work, result.shape[1])
        self._result = None if in_place else result
        return transformed


def in_tasks(work: Callable[[slice], object], columns: int) -> list:
    """`work` on pieces of TASK_COLUMNS columns by one thread per core, with single-threaded matrix products; results in order."""
    tasks = [slice(start, min(start + TASK_COLUMNS, columns)) for start in range(0, columns, TASK_COLUMNS)]
    with one_blas_thread(), ThreadPoolExecutor(cores()) as workers:
        return list(workers.map(work, tasks))
