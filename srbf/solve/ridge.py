"""Ridge regression for the choice of a penalty: leave-one-out residuals in closed form, and the operator of each penalty."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64

RANK_TOLERANCE = 1e-10
LEAST_FREEDOM = 1e-6  # of 1 - h_ii; below, no other row predicts row i


@dataclass(frozen=True, eq=False)
class RidgePath:
    """All ridge solutions X = A^T (A A^T + ridge I)^-1 B of one (L, K) matrix A, after one singular value decomposition.

    The residual of a left-out row i is (B_i - A_i X) / (1 - h_ii), h the diagonal of A W, without another fit.
    """

    matrix: Float64[ndarray, "L K"]
    _u: ndarray = field(init=False, repr=False)
    _s: ndarray = field(init=False, repr=False)
    _vt: ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name, value in zip(("_u", "_s", "_vt"), np.linalg.svd(self.matrix, full_matrices=False), strict=True):
            object.__setattr__(self, name, value)

    def operator(self, ridge: float) -> Float64[ndarray, "K L"]:
        """W with X = W B; the minimum-norm one if X is not unique."""
        kept = self._s > RANK_TOLERANCE * self._s[0]
        gain = np.divide(self._s, self._s**2 + ridge, out=np.zeros_like(self._s), where=kept)
        return (self._vt.T * gain) @ self._u.T

    def left_out(self, ridge: float) -> Float64[ndarray, "L L"]:
        """E with E B the residual of every row if it alone is left out."""
        residual = np.eye(len(self.matrix)) - self.matrix @ self.operator(ridge)
        return residual / np.maximum(np.diag(residual), LEAST_FREEDOM)[:, None]
