"""Products of sparse matrices that are a few percent full, through dense blocks: more multiplications, at many times the speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32

if TYPE_CHECKING:
    from scipy.sparse import csr_array

BLOCK = 1 << 11  # rows that are dense at a time


def product(matrix: csr_array, right: Float32[ndarray, "S n"]) -> Float32[ndarray, "P n"]:
    """`matrix` (P, S) times `right`."""
    found = np.empty((matrix.shape[0], right.shape[1]), np.float32)
    for start in range(0, len(found), BLOCK):
        part = slice(start, start + BLOCK)
        found[part] = matrix[part].toarray() @ right
    return found


def transposed_product(matrix: csr_array, right: Float32[ndarray, "P n"]) -> Float32[ndarray, "S n"]:
    """The transpose of `matrix` (P, S) times `right`."""
    found = np.zeros((matrix.shape[1], right.shape[1]), np.float32)
    for start in range(0, len(right), BLOCK):
        part = slice(start, start + BLOCK)
        found += matrix[part].toarray().T @ right[part]
    return found
