"""Clustered PCA: planted subspaces are found, residuals are what they are, and few vectors are enough."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.clustered_pca import Clusters, cluster
from srbf.solve.pca import principal_axes

pytest.importorskip("sklearn")

FLOAT32 = 1e-4  # relative: squared distances are differences of float32 squares


def planted(clusters: int, axes: int, size: int, n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(vectors in `clusters` affine subspaces of `axes` dimensions far from each other, which one each is in)."""
    rng = np.random.default_rng(seed)
    means = rng.normal(size=(clusters, size)) * 6 / np.sqrt(size)
    spans = np.stack([np.linalg.qr(rng.normal(size=(size, axes)))[0] for _ in range(clusters)])
    labels = rng.integers(clusters, size=n)
    vectors = means[labels] + np.einsum("nma,na->nm", spans[labels], rng.normal(size=(n, axes)))
    return vectors.astype(np.float32), labels


@pytest.mark.parametrize(("clusters", "axes"), [(1, 3), (4, 2), (6, 1)])
def test_planted_subspaces_are_recovered(clusters: int, axes: int) -> None:
    vectors, labels = planted(clusters, axes, 40, 600)
    features = np.ascontiguousarray(principal_axes(vectors, 30)[0].T)
    found = cluster(vectors, features, clusters, axes)
    nearest, distance = found.assign(vectors)
    assert distance.max() < FLOAT32 * (vectors**2).sum(axis=1).max()
    pairs = set(zip(labels.tolist(), nearest.tolist(), strict=True))
    assert len(pairs) == clusters  # one to one
    grams = np.einsum("cma,cmb->cab", found.axes, found.axes)
    np.testing.assert_allclose(grams, np.broadcast_to(np.eye(axes), grams.shape), atol=1e-5)


def test_distance_is_the_residual_of_the_nearest_subspace() -> None:
    rng = np.random.default_rng(1)
    axes = np.stack([np.linalg.qr(rng.normal(size=(12, 3)))[0] for _ in range(5)]).astype(np.float32)
    found = Clusters(rng.normal(size=(5, 12)).astype(np.float32), axes)
    vectors = rng.normal(size=(70, 12)).astype(np.float32)
    centered = vectors[:, None] - found.means
    residual = centered - np.einsum("cma,cka,nck->ncm", axes, axes, centered)
    squares = (residual**2).sum(axis=2)
    nearest, distance = found.assign(vectors)
    np.testing.assert_array_equal(nearest, squares.argmin(axis=1))
    np.testing.assert_allclose(distance, squares.min(axis=1), atol=FLOAT32)


def test_an_orthonormal_map_that_keeps_all_changes_no_residual() -> None:
    vectors, _ = planted(3, 2, 20, 200)
    vectors += np.random.default_rng(2).normal(size=vectors.shape).astype(np.float32) * 0.1
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(20, 20)))[0].astype(np.float32)
    found = cluster(vectors, turn, 3, 2)
    direct, through = found.assign(vectors), found.through(turn).assign(vectors @ turn)
    np.testing.assert_array_equal(direct[0], through[0])
    np.testing.assert_allclose(direct[1], through[1], atol=FLOAT32 * (vectors**2).sum(axis=1).max())


def test_one_cluster_is_pca() -> None:
    rng = np.random.default_rng(4)
    vectors = (rng.normal(size=(300, 15)) * 0.6 ** np.arange(15) + 3).astype(np.float32)
    found = cluster(vectors, np.eye(15, dtype=np.float32), 1, 4)
    singular = np.linalg.svd(vectors - vectors.mean(axis=0), compute_uv=False)
    assert found.assign(vectors)[1].sum() == pytest.approx((singular[4:] ** 2).sum(), rel=1e-3)


@pytest.mark.parametrize(("n", "count", "axes"), [(3, 8, 4), (20, 6, 5), (40, 2, 30)])
def test_few_vectors_leave_nothing_undefined(n: int, count: int, axes: int) -> None:
    vectors = np.random.default_rng(5).normal(size=(n, 10)).astype(np.float32)
    found = cluster(vectors, np.eye(10, dtype=np.float32), count, axes)
    nearest, distance = found.assign(vectors)
    assert np.isfinite(found.means).all() and np.isfinite(found.axes).all() and np.isfinite(distance).all()
    assert found.axes.shape == (min(count, n), 10, axes) and nearest.max() < len(found.means)


def test_the_same_seed_gives_the_same_clusters() -> None:
    vectors, _ = planted(4, 2, 30, 300)
    one, two = (cluster(vectors, np.eye(30, dtype=np.float32), 5, 3, seed=7) for _ in range(2))
    np.testing.assert_array_equal(one.means, two.means)
    np.testing.assert_array_equal(one.axes, two.axes)
