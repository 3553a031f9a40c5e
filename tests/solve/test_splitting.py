"""Clusters by splitting: blobs are clusters, counts hold, weights and equal points count as they should."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.splitting import split_clusters


def spread(points: np.ndarray, labels: np.ndarray) -> float:
    return sum(float(((points[labels == k] - points[labels == k].mean(axis=0)) ** 2).sum()) for k in range(int(labels.max()) + 1))


def test_blobs_are_clusters() -> None:
    rng = np.random.default_rng(1)
    middles = rng.uniform(0, 10, (7, 3))
    which = rng.integers(7, size=600)
    labels = split_clusters(middles[which] + 0.01 * rng.normal(size=(600, 3)), 7)
    assert len({(a, b) for a, b in zip(which.tolist(), labels.tolist(), strict=True)}) == 7


@pytest.mark.parametrize("count", [1, 2, 37, 300])
def test_there_are_as_many_as_asked_for(count: int) -> None:
    points = np.random.default_rng(2).uniform(size=(300, 2))
    labels = split_clusters(points, count)
    assert np.unique(labels).tolist() == list(range(count))


def test_spread_is_near_that_of_squares() -> None:
    """The unit square in 64 parts: a square of side 1/8 has the variance 2 / 12 / 64, a hexagon 4 % less."""
    points = np.random.default_rng(3).uniform(size=(4000, 2))
    assert spread(points, split_clusters(points, 64)) < 1.15 * 4000 / 6 / 64


def test_weight_draws_clusters() -> None:
    points = np.linspace(0, 1, 400)[:, None]
    labels = split_clusters(points, 20, np.where(points[:, 0] < 0.5, 1000.0, 1.0))
    assert len(np.unique(labels[points[:, 0] < 0.5])) > 14


def test_equal_points_are_one_cluster() -> None:
    assert not split_clusters(np.zeros((5, 3)), 4).any()
    assert len(np.unique(split_clusters(np.array([[0.0], [0], [1], [5]]), 4))) == 3
    assert split_clusters(np.zeros((0, 3)), 4).shape == (0,)
