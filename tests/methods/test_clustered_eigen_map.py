"""The clustered eigen map: planted clusters come back whole, one cluster is an eigen map, and every texel has a cluster."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.methods import responses
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap

pytest.importorskip("sklearn")

EXACT = 1e-3  # relative: float32 planes and axes, values in a range of their own, a ridge of 1e-9
HEIGHT, WIDTH = 18, 20


def planted(clusters: int, components: int, seed: int = 0):
    """(response, labels): every texel in one of `clusters`, each with a mean and `components` RGB functions of its own."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(clusters, size=(HEIGHT, WIDTH))
    planes = rng.normal(size=(components, HEIGHT, WIDTH))

    def response(direction: np.ndarray) -> np.ndarray:
        means, functions = rng.normal(size=(clusters, 3)) * 2, rng.normal(size=(clusters, components, 3))
        return means[labels] + np.einsum("jhw,hwjc->hwc", planes, functions[labels])

    return response, labels


@pytest.mark.lengthy
@pytest.mark.parametrize(("clusters", "components"), [(1, 4), (4, 2), (5, 1)])
def test_planted_clusters_are_reproduced(make_capture, clusters: int, components: int) -> None:
    response, labels = planted(clusters, components)
    capture: Capture = make_capture(response, lights=40, holdout=0)
    asset = ClusteredEigenMap(clusters, components, spread=0.3, ridge=1e-9, encoding="float").encode(capture)
    expected = np.stack([capture.image(i) for i in capture.indices("train")])
    got = responses(asset, capture.directions())
    np.testing.assert_allclose(got, expected, atol=EXACT * np.abs(expected).max())
    index = asset.tables["cluster_index"]
    assert len(set(zip(labels.ravel().tolist(), index.ravel().tolist(), strict=True))) == clusters
    if clusters > 1:  # which as many scalars for all texels do not
        shared = EigenMap(components, spread=0.3, ridge=1e-9, encoding="float").encode(capture)
        assert np.abs(responses(shared, capture.directions()) - expected).max() > 0.1 * np.abs(expected).max()


def test_one_cluster_is_an_eigen_map(make_capture) -> None:
    rng = np.random.default_rng(2)
    waves = rng.normal(size=(HEIGHT, WIDTH, 3, 3))
    capture = make_capture(lambda d: np.sin(waves @ d), lights=60)
    directions = capture.directions(capture.indices("holdout"))
    settings = {"components": 5, "spread": 0.5, "ridge": 0.01, "encoding": "float"}
    expected = responses(EigenMap(**settings).encode(capture), directions)
    # The center of a cluster's range and the mean of the sample differ, their sums do not; axes come of few steps of iteration.
    got = responses(ClusteredEigenMap(clusters=1, **settings).encode(capture), directions)
    assert np.sqrt(((got - expected) ** 2).mean()) < 0.01 * np.sqrt((expected**2).mean())


def test_every_scalar_spans_its_clusters_range(make_capture) -> None:
    response, _ = planted(4, 3, seed=3)
    coverage = (np.random.default_rng(4).random((HEIGHT, WIDTH)) > 0.2).astype(np.float32)
    asset = ClusteredEigenMap(4, 3, encoding="float").encode(make_capture(response, lights=40, coverage=coverage))
    planes = asset.coefficients()[0]
    for number in range(4):
        own = planes[(asset.tables["cluster_index"] == number) & (coverage > 0)]
        np.testing.assert_allclose(own[:, :3].min(axis=0), -1, atol=1e-5)
        np.testing.assert_allclose(own[:, :3].max(axis=0), 1, atol=1e-5)
    assert not planes[..., 3].any()


@pytest.mark.lengthy
def test_bytes_cost_little(make_capture) -> None:
    response, _ = planted(4, 3, seed=5)
    capture = make_capture(response, lights=60, holdout=0).load()
    settings = {"spread": 0.3, "ridge": 1e-3}
    images = np.stack([capture.image(i) for i in capture.indices("train")])
    assets = [ClusteredEigenMap(4, 3, encoding=encoding, **settings).encode(capture) for encoding in ("float", "uint8")]
    floats, coded = (responses(asset, capture.directions()) for asset in assets)
    # A step of 2 / 255 in each of three scalars whose functions are about as large as the pictures.
    assert np.sqrt(((coded - floats) ** 2).mean()) < 0.01 * images.std()


@pytest.mark.slow
def test_more_clusters_serve_shadows(make_capture) -> None:
    rng = np.random.default_rng(6)
    walls = rng.normal(size=(12, 2))
    walls /= np.linalg.norm(walls, axis=1, keepdims=True)
    labels, reach = rng.integers(12, size=(HEIGHT, WIDTH)), rng.uniform(0, 0.3, (HEIGHT, WIDTH))
    capture = make_capture(
        lambda d: np.where((walls @ d[:2])[labels] > reach, 0, d[2])[..., None] * [1, 0.8, 0.6], lights=80, holdout=20
    ).load()
    one, six = (evaluate(ClusteredEigenMap(c, 2).encode(capture), capture)["holdout"]["psnr"] for c in (1, 6))
    assert six > one + 3


@pytest.mark.parametrize("settings", [{"clusters": 0}, {"clusters": 257}, {"components": 0}, {"ridge": 0.0}, {"spread": -1.0}])
def test_settings_that_no_clustered_eigen_map_has(settings: dict) -> None:
    with pytest.raises(InputError, match=next(iter(settings))):
        ClusteredEigenMap(**settings)


def test_more_clusters_than_texels(make_capture) -> None:
    coverage = np.zeros((HEIGHT, WIDTH), np.float32)
    coverage[3, 4:9] = 1
    response, _ = planted(3, 2)
    capture = make_capture(response, lights=30, coverage=coverage)
    asset = ClusteredEigenMap(clusters=16, components=3).encode(capture)
    assert asset.tables["cluster_index"].max() < asset.clusters <= 16
    assert np.isfinite(responses(asset, capture.directions())).all()


@pytest.mark.slow
def test_rows_of_a_large_image_are_served_alike(make_capture) -> None:
    """Every sixteen rows respond in a way of their own, as near things in a picture do: none may be left to its neighbors' clusters."""
    height, width, band = 512, 256, 16
    facing = np.random.default_rng(5).normal(size=(height // band, 3))
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    plane = np.random.default_rng(6).random((height, width, 1), np.float32)

    def response(direction: np.ndarray) -> np.ndarray:
        bump = np.repeat(np.exp(4 * (facing @ direction - 1)), band)[:, None, None]
        return (bump * (1 + plane)).repeat(3, axis=2)

    capture = make_capture(response, lights=24, holdout=0, encoding="half")
    asset = ClusteredEigenMap(2 * height // band, 2, spread=0.3, ridge=1e-9).encode(capture)
    error = np.zeros(height)
    for i in capture.indices("train"):
        relit = responses(asset, capture.directions([i]))[0]
        error += ((relit - capture.image(i)) ** 2).mean(axis=(1, 2))
    by_band = np.sqrt(error.reshape(-1, band).mean(axis=1) / 24)
    assert by_band.max() < 0.05 * np.sqrt(np.mean([(capture.image(i) ** 2).mean() for i in capture.indices("train")]))
