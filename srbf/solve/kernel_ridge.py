"""Kernel ridge regression: all penalties after one eigendecomposition, and predictions at left-out rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64, Int

GUARD = 1e-9  # of the mean of a group's diagonal; keeps rows finite that no others predict


@dataclass(frozen=True, eq=False)
class KernelPath:
    """All solutions a = (K + ridge I)^-1 B of one positive semidefinite (L, L) kernel K; K(x, rows) a predicts B at x.

    For K = A A^T this is ridge regression on the columns of A, whose coefficients are A^T a. K is `vectors` times `values` times
    `vectors`^T: 0 across them, where they are fewer than L.
    """

    values: Float64[ndarray, " K"]
    vectors: Float64[ndarray, "L K"]

    @staticmethod
    def of(kernel: Float64[ndarray, "L L"]) -> KernelPath:
        """By its eigenvectors."""
        values, vectors = np.linalg.eigh(kernel)
        return KernelPath(np.maximum(values, 0), vectors)

    @staticmethod
    def of_columns(columns: Float64[ndarray, "L K"]) -> KernelPath:
        """Of the kernel A A^T: all products take K / L of the time where A has no more than half as many columns as rows.

        With more, what is across the vectors is the small difference of large numbers.
        """
        if 2 * columns.shape[1] > len(columns):
            return KernelPath.of(columns @ columns.T)
        vectors, singular, _ = np.linalg.svd(columns, full_matrices=False)
        return KernelPath(singular**2, vectors)

    def solve(self, ridge: float, right: Float64[ndarray, "L N"]) -> Float64[ndarray, "L N"]:
        """(K + ridge I)^-1 right, ridge > 0: two (L, K) x (K, N) products."""
        along, across = self._inverse(ridge)
        found = self.vectors @ ((self.vectors.T @ right) * along[:, None])
        return found + across * right if across else found

    def diagonal(self, ridge: float, power: int = 1) -> Float64[ndarray, " L"]:
        """The diagonal of (K + ridge I)^-power."""
        along, across = self._inverse(ridge, power)
        return self._squares @ along + across

    def blocks(self, ridge: float, groups: Int[ndarray, "G s"], power: int = 1) -> Float64[ndarray, "G s s"]:
        """(K + ridge I)^-power at the rows and columns of each group."""
        along, across = self._inverse(ridge, power)
        rows = self.vectors[groups]  # (G, s, K)
        return (rows * along) @ rows.transpose(0, 2, 1) + across * np.eye(groups.shape[1])

    def _inverse(self, ridge: float, power: int = 1) -> tuple[Float64[ndarray, " K"], float]:
        """(K + ridge I)^-power: what the vectors have beside what is the same in all directions."""
        own = (self.values + ridge) ** -float(power)
        across = ridge ** -float(power) if self.vectors.shape[1] < len(self.vectors) else 0.0
        return own - across, across

    @cached_property
    def _squares(self) -> Float64[ndarray, "L K"]:
        return self.vectors**2

    def left_out_weights(self, ridge: float, groups: Int[ndarray, "G s"]) -> Float64[ndarray, "G s"]:
        """Weights that turn a group's rows of `solve` into the residual of its first row when the whole group is left out.

        With M = (K + ridge I)^-1, the residual at left-out rows g is (M_gg)^-1 (M B)_g, without another fit.
        """
        blocks = self.blocks(ridge, groups)
        size = groups.shape[1]
        guard = GUARD * np.einsum("gii->g", blocks) / size
        first = np.zeros((len(groups), size, 1))
        first[:, 0] = 1
        return np.linalg.solve(blocks + guard[:, None, None] * np.eye(size), first)[:, :, 0]
