"""Adaptive clustered PCA: planted dimensions are found, the average is kept, and axes go where they save most."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.solve.adaptive_clustered_pca import _counts, adaptive_cluster
from srbf.solve.clustered_pca import Clusters, cluster
from srbf.solve.pca import principal_axes

pytest.importorskip("sklearn")

FLOAT32 = 1e-4  # relative: squared distances are differences of float32 squares


def planted(dimensions: tuple[int, ...], each: int = 200, size: int = 40, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(`each` vectors in an affine subspace of each of the dimensions, far from the others, which one each is in)."""
    rng = np.random.default_rng(seed)
    parts = []
    for number, dimension in enumerate(dimensions):
        span = np.linalg.qr(rng.normal(size=(size, max(1, dimension))))[0][:, :dimension]
        parts.append(40 * np.eye(size)[number] + rng.normal(size=(each, dimension)) @ span.T)
    return np.concatenate(parts).astype(np.float32), np.repeat(np.arange(len(dimensions)), each)


def random_vectors(n: int = 1500, size: int = 60) -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.tanh(rng.normal(size=(n, 30)) * 0.7 ** np.arange(30) @ rng.normal(size=(30, size))).astype(np.float32)


def identity(size: int) -> np.ndarray:
    return np.eye(size, dtype=np.float32)


def test_planted_dimensions_are_recovered() -> None:
    dimensions = (0, 1, 3, 8)
    vectors, labels = planted(dimensions)
    found = adaptive_cluster(vectors, identity(40), 4, 3.0)
    nearest, distance = found.assign(vectors)
    assert len(set(zip(labels.tolist(), nearest.tolist(), strict=True))) == 4
    assert tuple(found.counts[nearest[::200]]) == dimensions
    assert distance.max() < FLOAT32 * (vectors**2).sum(axis=1).max()
    assert found.axes.shape == (4, 40, 8)
    fixed = cluster(vectors, identity(40), 4, 3).assign(vectors)[1]  # as many axes on average
    assert distance.sum() < 0.01 * fixed.sum()


def test_axes_are_orthonormal_and_padded_with_zeros() -> None:
    found = adaptive_cluster(random_vectors(), identity(60), 6, 4.0)
    for axes, count in zip(found.axes, found.counts, strict=True):
        np.testing.assert_allclose(axes.T @ axes, np.diag(np.arange(axes.shape[1]) < count), atol=1e-5)


@pytest.mark.parametrize("average", [0, 0.5, 3, 7.25])
def test_the_average_number_of_axes_is_kept(average: float) -> None:
    vectors = random_vectors()
    found = adaptive_cluster(vectors, identity(60), 8, average)
    assert found.mean_count(found.assign(vectors)[0]) == pytest.approx(average, abs=0.25)


def test_no_cluster_has_more_axes_than_the_most() -> None:
    vectors, _ = planted((0, 1, 3, 8))
    assert adaptive_cluster(vectors, identity(40), 4, 3.0, most=4).counts.max() == 4


@pytest.mark.parametrize(("count", "axes"), [(4, 3), (12, 6)])
def test_at_the_same_average_it_loses_nothing_to_equal_numbers(count: int, axes: int) -> None:
    vectors = random_vectors()
    features = np.ascontiguousarray(principal_axes(vectors, 40)[0].T)
    adaptive = adaptive_cluster(vectors, features, count, axes).assign(vectors)[1].sum()
    assert adaptive < 1.05 * cluster(vectors, features, count, axes).assign(vectors)[1].sum()


def test_one_cluster_is_pca() -> None:
    vectors = random_vectors()
    found = adaptive_cluster(vectors, identity(60), 1, 5)
    singular = np.linalg.svd(vectors - vectors.mean(axis=0), compute_uv=False)
    assert found.counts.tolist() == [5]
    assert found.assign(vectors)[1].sum() == pytest.approx((singular[5:] ** 2).sum(), rel=1e-3)


def test_axes_go_where_they_save_the_most_error_per_vector() -> None:
    """Against every other distribution of the same budget."""
    energies, sizes = np.array([[9.0, 4, 1], [30, 2, 1]]), np.array([1, 4])
    counts = _counts(energies, sizes, 6 / 5, 3)
    cost = {(a, b): a * 1 + b * 4 for a in range(4) for b in range(4)}
    saved = {pair: energies[0, : pair[0]].sum() + energies[1, : pair[1]].sum() for pair in cost if cost[pair] <= 6}
    assert tuple(counts) == max(saved, key=lambda pair: saved[pair]) == (2, 1)


def test_it_may_be_used_in_place_of_clusters() -> None:
    vectors = random_vectors(400)
    found = adaptive_cluster(vectors, identity(60), 5, 3)
    assert isinstance(found, Clusters)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(60, 60)))[0].astype(np.float32)
    direct, through = found.assign(vectors), found.through(turn).assign(vectors @ turn)
    np.testing.assert_array_equal(direct[0], through[0])
    np.testing.assert_allclose(direct[1], through[1], atol=FLOAT32 * (vectors**2).sum(axis=1).max())
    np.testing.assert_array_equal(found.through(turn).counts, found.counts)


@pytest.mark.parametrize(("n", "count", "axes"), [(1, 1, 2), (3, 8, 4), (20, 6, 5), (40, 2, 30)])
def test_few_vectors_leave_nothing_undefined(n: int, count: int, axes: int) -> None:
    vectors = np.random.default_rng(5).normal(size=(n, 10)).astype(np.float32)
    found = adaptive_cluster(vectors, identity(10), count, axes)
    nearest, distance = found.assign(vectors)
    assert np.isfinite(found.means).all() and np.isfinite(found.axes).all() and np.isfinite(distance).all()
    assert len(found.means) == len(found.counts) == min(count, n) and nearest.max() < len(found.means)


def test_the_same_seed_gives_the_same_clusters() -> None:
    one, two = (adaptive_cluster(random_vectors(300), identity(60), 5, 3, seed=7) for _ in range(2))
    np.testing.assert_array_equal(one.means, two.means)
    np.testing.assert_array_equal(one.axes, two.axes)


def test_what_has_no_meaning() -> None:
    for count, axes in ((0, 3), (3, -1)):
        with pytest.raises(InputError, match="1 or more clusters"):
            adaptive_cluster(random_vectors(20), identity(60), count, axes)
