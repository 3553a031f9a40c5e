"""Kernel ridge regression: all penalties after one eigendecomposition, and predictions at left-out rows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64, Int

GUARD = 1e-9  # of the mean of a group's diagonal; keeps rows finite that no others predict


@dataclass(frozen=True, eq=False)
class KernelPath:
    """All solutions a = (K + ridge I)^-1 B of one positive semidefinite (L, L) kernel K; K(x, rows) a predicts B at x.

    For K = A A^T this is ridge regression on the columns of A, whose coefficients are A^T a.
    """

    kernel: Float64[ndarray, "L L"]
    _values: ndarray = field(init=False, repr=False)
    _vectors: ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        values, vectors = np.linalg.eigh(self.kernel)
        object.__setattr__(self, "_values", np.maximum(values, 0))
        object.__setattr__(self, "_vectors", vectors)

    def solve(self, ridge: float, right: Float64[ndarray, "L N"]) -> Float64[ndarray, "L N"]:
        """(K + ridge I)^-1 right, ridge > 0: two (L, L) x (L, N) products."""
        return self._vectors @ ((self._vectors.T @ right) / (self._values + ridge)[:, None])

    def diagonal(self, ridge: float, power: int = 1) -> Float64[ndarray, " L"]:
        """The diagonal of (K + ridge I)^-power."""
        return self._vectors**2 @ (self._values + ridge) ** -float(power)

    def blocks(self, ridge: float, groups: Int[ndarray, "G s"], power: int = 1) -> Float64[ndarray, "G s s"]:
        """(K + ridge I)^-power at the rows and columns of each group."""
        rows = self._vectors[groups]  # (G, s, L)
        return (rows * (self._values + ridge) ** -float(power)) @ rows.transpose(0, 2, 1)

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
