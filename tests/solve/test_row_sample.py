"""Rows that stand for all: how many, which, and what their squares sum to."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.row_sample import bright_rows


@pytest.mark.parametrize("hot", [0, 5])
def test_scaled_rows_have_the_squares_of_all(hot: int) -> None:
    rng = np.random.default_rng(3)
    values = rng.gamma(0.5, size=4000)
    values[rng.choice(4000, hot, replace=False)] = 200
    found = []
    for seed in range(40):
        rows, probability = bright_rows(values**2, 500, np.random.default_rng(seed))
        assert (np.diff(rows) > 0).all() and 250 <= len(rows) <= 501
        found.append((values[rows] ** 2 / probability).sum())
    assert np.mean(found) == pytest.approx((values**2).sum(), rel=0.02)


def test_what_is_brightest_is_always_there() -> None:
    energy = np.full(10_000, 1e-3)
    energy[[17, 9_999]] = 50
    for seed in range(20):
        rows, probability = bright_rows(energy, 100, np.random.default_rng(seed))
        assert {17, 9_999} <= set(rows) and probability[rows == 17] == 1


@pytest.mark.parametrize("energy", [np.zeros(50), np.ones(3), np.zeros(0)])
def test_few_or_dark_rows(energy: np.ndarray) -> None:
    rows, probability = bright_rows(energy, 1000, np.random.default_rng(0))
    assert rows.tolist() == list(range(len(energy))) and (probability == 1).all()
