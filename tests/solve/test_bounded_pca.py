"""Components of numbers between bounds: exact at full rank, within the bounds where plain components are not, outliers do not lead."""

from __future__ import annotations

import numpy as np

from srbf.solve.bounded_pca import bounded_pca
from srbf.solve.pca import principal_axes

ROUNDS, LARGEST = 60, 1.0


def approximated(start: np.ndarray, low: np.ndarray, high: np.ndarray, count: int) -> np.ndarray:
    mean, axes, scores = bounded_pca(start, low, high, count, ROUNDS, LARGEST)
    np.testing.assert_allclose(axes @ axes.T, np.diag((np.abs(axes).sum(axis=1) > 0).astype(float)), atol=1e-5)
    return mean + scores @ axes


def test_full_rank_is_exact() -> None:
    rng = np.random.default_rng(1)
    numbers = rng.normal(size=(6, 40)).astype(np.float32)
    for count in (5, 9):  # as many axes as there are, and more
        np.testing.assert_allclose(approximated(numbers, numbers, numbers, count), numbers, atol=1e-5)
    np.testing.assert_allclose(approximated(numbers[:1], numbers[:1], numbers[:1], 3), numbers[:1])


def test_without_slack_it_is_principal_components() -> None:
    numbers = (0.2 * np.random.default_rng(2).normal(size=(30, 40))).astype(np.float32)  # residuals below LARGEST
    mean = numbers.mean(axis=0)
    axes, _ = principal_axes(numbers - mean, 8)
    plain = mean + (numbers - mean) @ axes.T @ axes
    found = approximated(numbers, numbers, numbers, 8)
    np.testing.assert_allclose(np.linalg.norm(found - numbers), np.linalg.norm(plain - numbers), rtol=1e-3)


def test_what_the_bounds_leave_open_costs_nothing() -> None:
    """Rank 3 and, at random places, any larger number: found again."""
    rng = np.random.default_rng(3)
    truth = (5 + rng.normal(size=(60, 3)) @ rng.normal(size=(3, 50))).astype(np.float32)
    hidden = rng.random(truth.shape) < 0.3
    start = np.where(hidden, truth + rng.uniform(0, 3, truth.shape), truth).astype(np.float32)
    low = np.where(hidden, -np.inf, truth).astype(np.float32)
    found = approximated(start, low, start, 3)
    outside = np.maximum(np.maximum(low - found, found - start), 0)
    mean = start.mean(axis=0)
    axes, _ = principal_axes(start - mean, 3)
    plain = mean + (start - mean) @ axes.T @ axes
    missed = np.maximum(np.maximum(low - plain, plain - start), 0)
    assert np.linalg.norm(outside) < 0.1 * np.linalg.norm(missed)


def test_outliers_do_not_lead() -> None:
    rng = np.random.default_rng(4)
    truth = np.outer(rng.normal(size=60), rng.normal(size=50)).astype(np.float32)
    odd = truth.copy()
    odd.ravel()[rng.integers(truth.size, size=60)] += 30
    found = approximated(odd, odd, odd, 1)
    axes, _ = principal_axes(odd - odd.mean(axis=0), 1)
    plain = odd.mean(axis=0) + (odd - odd.mean(axis=0)) @ axes.T @ axes
    assert np.median(np.abs(found - truth)) < 0.5 * np.median(np.abs(plain - truth))
