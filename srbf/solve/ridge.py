"""Ridge regression whose penalty is chosen: closed-form left-out residuals, and the operators that go with each penalty."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64

RANK_TOLERANCE = 1e-10
LEAST_FREEDOM = 1e-6  # 1 - h_ii below it: row i has a coefficient of its own, and nothing is left to predict it


@dataclass(frozen=True, eq=False)
class RidgePath:
    """All ridge solutions X = A^T (A A^T + ridge I)^-1 B of one (L, K) matrix A, after one singular value decomposition.

    The residual of row i when i is left out is (B_i - A_i X) / (1 - h_ii), h the diagonal of A W: no fit is repeated.
    """

    matrix: Float64[ndarray, "L K"]
    _u: ndarray = field(init=False, repr=False)
    _s: ndarray = field(init=False, repr=False)
    _vt: ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name, value in zip(("_u", "_s", "_vt"), np.linalg.svd(self.matrix, full_matrices=False), strict=True):
            object.__setattr__(self, name, value)

    def operator(self, ridge: float) -> Float64[ndarray, "K L"]:
        """W with X = W B; of least norm where a ridge of 0 leaves X open."""
        kept = self._s > RANK_TOLERANCE * self._s[0]
        gain = np.divide(self._s, self._s**2 + ridge, out=np.zeros_like(self._s), where=kept)
        return (self._vt.T * gain) @ self._u.T

    def left_out(self, ridge: float) -> Float64[ndarray, "L L"]:
        """E with E B the residual of every row when it alone is left out."""
        residual = np.eye(len(self.matrix)) - self.matrix @ self.operator(ridge)
        return residual / np.maximum(np.diag(residual), LEAST_FREEDOM)[:, None]
