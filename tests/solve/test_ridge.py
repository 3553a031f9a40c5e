"""The ridge path against lstsq, the normal equations, and fits repeated without a row."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.ridge import RidgePath

ROUNDING = 1e-9  # float64 solves of conditions below 1e3


@pytest.mark.parametrize("shape", [(30, 8), (8, 30)])
def test_operator_without_ridge_is_lstsq(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    matrix, right = rng.normal(size=shape), rng.normal(size=(shape[0], 4))
    expected = np.linalg.lstsq(matrix, right, rcond=None)[0]
    np.testing.assert_allclose(RidgePath(matrix).operator(0) @ right, expected, atol=ROUNDING)


def test_rank_deficient_gives_the_least_norm() -> None:
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(20, 3)) @ rng.normal(size=(3, 7))
    np.testing.assert_allclose(RidgePath(matrix).operator(0), np.linalg.pinv(matrix, rcond=1e-8), atol=ROUNDING)


@pytest.mark.parametrize("shape", [(30, 8), (8, 30)])
@pytest.mark.parametrize("ridge", [1e-3, 0.5, 30.0])
def test_operator_solves_the_regularised_normal_equations(shape: tuple[int, int], ridge: float) -> None:
    matrix = np.random.default_rng(2).normal(size=shape)
    expected = np.linalg.solve(matrix.T @ matrix + ridge * np.eye(shape[1]), matrix.T)
    np.testing.assert_allclose(RidgePath(matrix).operator(ridge), expected, atol=ROUNDING)


@pytest.mark.parametrize(("shape", "ridge"), [((30, 8), 0), ((30, 8), 0.01), ((30, 8), 5.0), ((8, 30), 0.3)])
def test_left_out_equals_refitting_without_the_row(shape: tuple[int, int], ridge: float) -> None:
    rng = np.random.default_rng(3)
    matrix, right = rng.normal(size=shape), rng.normal(size=(shape[0], 4))
    residuals = RidgePath(matrix).left_out(ridge) @ right
    for i in range(shape[0]):
        rest = np.arange(shape[0]) != i
        system = matrix[rest].T @ matrix[rest] + ridge * np.eye(shape[1])
        refitted = np.linalg.solve(system, matrix[rest].T @ right[rest])
        np.testing.assert_allclose(residuals[i], right[i] - matrix[i] @ refitted, atol=ROUNDING)


def test_rows_that_nothing_else_predicts_stay_finite() -> None:
    # Row 0 has a coefficient of its own: without ridge its left-out residual is undefined.
    matrix = np.zeros((6, 3))
    matrix[0, 0] = 1
    matrix[1:, 1:] = np.random.default_rng(4).normal(size=(5, 2))
    assert np.isfinite(RidgePath(matrix).left_out(0)).all()
