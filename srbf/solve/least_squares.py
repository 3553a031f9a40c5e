"""Linear least squares with an optional ridge, for one small matrix and millions of right-hand sides that arrive in blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.solve.streamed_product import StreamedProduct


@dataclass(frozen=True)
class LeastSquaresReport:
    """Condition number and rank of A, and the norm of the residual over the norm of B."""

    condition_number: float
    rank: int
    relative_residual: float


@dataclass(eq=False)
class StreamedLeastSquares:
    """Minimize |A X - B|^2 + ridge |X|^2 over X, for an (L, K) matrix A and an (L, M) right-hand side B that arrives in blocks of rows.

    With A = U S V^T, the stream accumulates only U^T B, (K, M): U is orthonormal, so this sum is as well conditioned in
    float32 as the data are, for any condition of A. The solution X = V diag(s / (s^2 + ridge)) U^T B is formed once, in
    float64, at the end. Singular values below `rank_tolerance` times the largest count as zero (minimum-norm solution), as
    in numpy.linalg.lstsq.

    The least-squares solution is unique when A has rank K or ridge > 0. Relative error of X grows with the condition number;
    a ridge bounds it by s_max^2 / ridge. Memory: (K, M) float32; the solution replaces the sums (unless L < K).
    Cost: 2 K L M flops, on all cores.
    """

    matrix: Float64[ndarray, "L K"]
    ridge: float = 0.0
    rank_tolerance: float = 1e-10
    _solution: np.ndarray | None = field(default=None, init=False)
    _norms: np.ndarray | None = field(default=None, init=False)  # of the rows of U^T B, squared, after X has replaced them

    def __post_init__(self) -> None:
        self._u, self._s, self._vt = np.linalg.svd(np.asarray(self.matrix, np.float64), full_matrices=False)
        self._kept = self._s > self.rank_tolerance * self._s[0]
        self._projected = StreamedProduct(self._u.T)

    @property
    def solution_operator(self) -> Float64[ndarray, "K L"]:
        """The (K, L) matrix W with X = W B: the ridge-regularized pseudo-inverse of A."""
        return (self._vt.T * self._filter()) @ self._u.T

    def add(self, first_row: int, block: Float[ndarray, "*block"]) -> None:
        """Feed rows first_row … first_row + b - 1 of B, float32 or finite float16; every row exactly once, in any order, before `solve`."""
        assert self._solution is None, "rows were fed after the solution was formed"
        self._projected.add(first_row, block)

    def solve(self) -> Float32[ndarray, "K M"]:
        """X after all rows are fed; computed in float64 by pieces of columns, stored in float32."""
        if self._solution is None:
            self._norms = self._row_norms()
            self._solution = self._projected.transform(self._vt.T * self._filter())
        return self._solution

    def energies(self) -> tuple[float, Float64[ndarray, " J"]]:
        """|B|^2 and that of each row of U^T B: energies of parts of the columns add up to those of all columns."""
        return self._projected.norm_squared, self._row_norms() if self._norms is None else self._norms

    def report(self, energies: tuple[float, Float64[ndarray, " J"]] | None = None) -> LeastSquaresReport:
        """Condition, rank and residual; the residual by Pythagoras, so it floors near 1e-4 of the data in float32.

        `energies`: those of columns solved elsewhere.
        """
        norm_squared, norms = self.energies() if energies is None else energies
        kept_fraction = self._s * self._filter()  # 1 if unchanged, 0 if cut
        outside = max(0.0, norm_squared - float(norms.sum()))
        damped = float(((1 - kept_fraction) ** 2 * norms).sum())
        residual = np.sqrt((outside + damped) / norm_squared) if norm_squared > 0 else 0.0
        smallest = self._s[-1]
        return LeastSquaresReport(
            condition_number=float(self._s[0] / smallest) if smallest > 0 else float("inf"),
            rank=int(self._kept.sum()),
            relative_residual=float(residual),
        )

    def _row_norms(self) -> Float64[ndarray, " K"]:
        return self._projected.row_energies()

    def _filter(self) -> Float[ndarray, " K"]:
        gain = np.zeros_like(self._s)
        gain[self._kept] = self._s[self._kept] / (self._s[self._kept] ** 2 + self.ridge)
        return gain
