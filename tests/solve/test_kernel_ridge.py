"""The kernel path against direct solves, ridge regression on a matrix, and fits repeated without a group of rows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from srbf.solve.kernel_ridge import KernelPath
from srbf.solve.ridge import RidgePath

ROUNDING = 1e-8  # float64 solves of conditions below 1e5
RIDGES = [1e-3, 0.3, 20.0]
Way = Callable[[np.ndarray], KernelPath]
WAYS: list[Way] = [lambda matrix: KernelPath.of(matrix @ matrix.T), KernelPath.of_columns]


def problem(rows: int = 30, columns: int = 8) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return rng.normal(size=(rows, columns)), rng.normal(size=(rows, 4))


@pytest.mark.parametrize("ridge", RIDGES)
@pytest.mark.parametrize("columns", [8, 60])
@pytest.mark.parametrize("make", WAYS)
def test_solutions_are_those_of_the_ridge_path(make: Way, ridge: float, columns: int) -> None:
    matrix, right = problem(columns=columns)
    path = make(matrix)
    np.testing.assert_allclose(matrix.T @ path.solve(ridge, right), RidgePath(matrix).operator(ridge) @ right, atol=ROUNDING)


@pytest.mark.parametrize("ridge", RIDGES)
@pytest.mark.parametrize("make", WAYS)
def test_blocks_and_diagonals_are_those_of_the_inverse(make: Way, ridge: float) -> None:
    matrix, _ = problem()
    inverse = np.linalg.inv(matrix @ matrix.T + ridge * np.eye(30))
    path = make(matrix)
    groups = np.array([[3, 5, 9], [0, 29, 4]])
    for power, expected in ((1, inverse), (2, inverse @ inverse)):
        scale = np.abs(expected).max()
        np.testing.assert_allclose(path.diagonal(ridge, power), np.diag(expected), atol=ROUNDING * scale)
        np.testing.assert_allclose(path.blocks(ridge, groups, power)[1], expected[np.ix_(groups[1], groups[1])], atol=ROUNDING * scale)


@pytest.mark.parametrize("ridge", RIDGES)
@pytest.mark.parametrize("group", [[4], [4, 11], [4, 0, 17, 29, 2]])
@pytest.mark.parametrize("make", WAYS)
def test_a_group_left_out_equals_refitting_without_it(make: Way, ridge: float, group: list[int]) -> None:
    matrix, right = problem()
    path = make(matrix)
    groups = np.array([group])
    residual = np.einsum("gs,gsn->gn", path.left_out_weights(ridge, groups), path.solve(ridge, right)[groups])[0]
    rest = np.setdiff1d(np.arange(30), group)
    refitted = np.linalg.solve(matrix[rest].T @ matrix[rest] + ridge * np.eye(8), matrix[rest].T @ right[rest])
    np.testing.assert_allclose(residual, right[4] - matrix[4] @ refitted, atol=1e-6)


def test_rows_that_nothing_else_predicts_stay_finite() -> None:
    kernel = np.zeros((6, 6))
    kernel[0, 0] = 1
    assert np.isfinite(KernelPath.of(kernel).left_out_weights(1e-12, np.array([[0, 1], [2, 3]]))).all()
