"""Linear least squares with an optional ridge, for one small matrix and millions of right-hand sides that arrive in blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64


@dataclass(frozen=True)
class LeastSquaresReport:
    """What a solve says of itself: condition number and rank of A, and the norm of what it left over the norm of B."""

    condition_number: float
    rank: int
    relative_residual: float


@dataclass(eq=False)
class StreamedLeastSquares:
    """Minimise |A X - B|^2 + ridge |X|^2 over X, for a (L, K) matrix A and a (L, M) right-hand side B fed row block by row block.

    With A = U S V^T, the stream accumulates only U^T B, (K, M): U is orthonormal, so this sum is as well conditioned in
    float32 as the data are, whatever the condition of A. The answer X = V diag(s / (s^2 + ridge)) U^T B is formed once, in
    float64, at the end. Singular values below `rank_tolerance` times the largest count as zero (minimum-norm solution), as
    numpy.linalg.lstsq has it.

    The least-squares solution is unique when A has rank K or ridge > 0. Relative error of X grows with the condition number;
    a ridge bounds it by s_max^2 / ridge. Memory: (K, M) float32 and one block. Work: one (K, b) x (b, M) product a block.
    """

    matrix: Float64[ndarray, "L K"]
    ridge: float = 0.0
    rank_tolerance: float = 1e-10
    _projected: np.ndarray | None = field(default=None, init=False)
    _norm_squared: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        self._u, self._s, self._vt = np.linalg.svd(np.asarray(self.matrix, np.float64), full_matrices=False)
        self._kept = self._s > self.rank_tolerance * self._s[0]

    @property
    def solution_operator(self) -> Float64[ndarray, "K L"]:
        """The (K, L) matrix W with X = W B: the ridge-regularised pseudo-inverse of A."""
        return (self._vt.T * self._filter()) @ self._u.T

    def add(self, first_row: int, block: Float32[ndarray, "b M"]) -> None:
        """Feed rows first_row … first_row + b - 1 of B; every row exactly once, in any order."""
        rows = slice(first_row, first_row + len(block))
        part = self._u[rows].T.astype(np.float32) @ block  # (K, M)
        if self._projected is None:
            self._projected = part
        else:
            self._projected += part
        self._norm_squared += float(np.einsum("bm,bm->", block, block, dtype=np.float64))

    def solve(self, chunk: int = 1 << 18) -> Float32[ndarray, "K M"]:
        """X, once all rows are fed; formed in float64 by column chunks, kept in float32."""
        assert self._projected is not None, "no rows were fed"
        operator = self._vt.T * self._filter()  # (K, K)
        solution = np.empty((len(operator), self._projected.shape[1]), np.float32)
        for start in range(0, solution.shape[1], chunk):
            part = slice(start, start + chunk)
            solution[:, part] = operator @ self._projected[:, part].astype(np.float64)
        return solution

    def report(self) -> LeastSquaresReport:
        """Condition, rank and residual; the residual by Pythagoras, so it floors near 1e-4 of the data in float32."""
        assert self._projected is not None, "no rows were fed"
        kept_fraction = self._s * self._filter()  # 1 where untouched, 0 where cut
        norms = np.array([float(np.dot(row.astype(np.float64), row)) for row in self._projected])
        outside = max(0.0, self._norm_squared - float(norms.sum()))
        damped = float(((1 - kept_fraction) ** 2 * norms).sum())
        residual = np.sqrt((outside + damped) / self._norm_squared) if self._norm_squared > 0 else 0.0
        smallest = self._s[-1]
        return LeastSquaresReport(
            condition_number=float(self._s[0] / smallest) if smallest > 0 else float("inf"),
            rank=int(self._kept.sum()),
            relative_residual=float(residual),
        )

    def _filter(self) -> Float[ndarray, " K"]:
        gain = np.zeros_like(self._s)
        gain[self._kept] = self._s[self._kept] / (self._s[self._kept] ** 2 + self.ridge)
        return gain
