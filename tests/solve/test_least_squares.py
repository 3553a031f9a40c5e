"""The streamed solve against numpy.linalg.lstsq and the normal equations."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.least_squares import StreamedLeastSquares

FLOAT32_STREAM = 2e-6  # relative: products are float32, the factorization float64


def fed(matrix: np.ndarray, right: np.ndarray, ridge: float, block: int) -> StreamedLeastSquares:
    solve = StreamedLeastSquares(matrix, ridge)
    for first in range(0, len(right), block):
        solve.add(first, right[first : first + block].astype(np.float32))
    return solve


@pytest.mark.parametrize("block", [1, 7, 40])
def test_equals_lstsq_whatever_the_blocks(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.solve.streamed_product.TASK_COLUMNS", 13)
    rng = np.random.default_rng(1)
    matrix, right = rng.normal(size=(40, 6)), rng.normal(size=(40, 50))
    expected, residuals, rank, singular = np.linalg.lstsq(matrix, right, rcond=None)
    solve = fed(matrix, right, 0, block)
    np.testing.assert_allclose(solve.solve(), expected, atol=FLOAT32_STREAM * np.abs(right).max())
    report = solve.report()
    assert report.rank == rank == 6
    assert report.condition_number == pytest.approx(singular[0] / singular[-1])
    assert report.relative_residual == pytest.approx(np.sqrt(residuals.sum() / (right**2).sum()), rel=1e-4)


def test_ridge_solves_the_regularised_normal_equations() -> None:
    rng = np.random.default_rng(2)
    matrix, right = rng.normal(size=(30, 8)), rng.normal(size=(30, 5))
    solve = fed(matrix, right, 0.7, 4)
    expected = np.linalg.solve(matrix.T @ matrix + 0.7 * np.eye(8), matrix.T @ right)
    np.testing.assert_allclose(solve.solve(), expected, atol=FLOAT32_STREAM * 5)
    np.testing.assert_allclose(solve.solution_operator @ right, expected, atol=1e-12)
    left = np.linalg.norm(matrix @ expected - right) / np.linalg.norm(right)
    assert solve.report().relative_residual == pytest.approx(left, rel=1e-4)


def test_underdetermined_and_rank_deficient_give_the_minimum_norm() -> None:
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(10, 3)) @ rng.normal(size=(3, 6))  # rank 3
    right = rng.normal(size=(10, 4))
    solve = fed(matrix, right, 0, 10)
    np.testing.assert_allclose(solve.solve(), np.linalg.pinv(matrix, rcond=1e-10) @ right, atol=1e-5)
    assert solve.report().rank == 3


def test_ill_conditioned_columns_keep_their_fit() -> None:
    # Two nearly equal columns: coefficients are large and cancel, yet the fitted values must stay right.
    rng = np.random.default_rng(4)
    column = rng.normal(size=50)
    matrix = np.stack([column, column + 1e-5 * rng.normal(size=50)], axis=1)
    right = matrix @ np.array([[3.0], [-2.0]])
    fitted = matrix @ fed(matrix, right, 0, 9).solve().astype(np.float64)
    assert np.abs(fitted - right).max() < 1e-5 * np.abs(right).max()


def test_zero_data() -> None:
    solve = fed(np.eye(4)[:, :2], np.zeros((4, 3)), 0, 4)
    assert not solve.solve().any()
    assert solve.report().relative_residual == 0
