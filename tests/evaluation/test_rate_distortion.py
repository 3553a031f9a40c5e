"""Error by bytes: a sample scores like its capture, baselines have their bytes, and a spectrum bounds every method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.evaluation.errors_by_role import evaluate
from srbf.evaluation.rate_distortion import (
    ALL,
    IMAGE_BYTES,
    NEAREST,
    contest,
    error_of,
    nearest_image,
    planes_bound,
    score_asset,
    spectrum,
)
from srbf.methods import method_of
from srbf.methods import responses as asset_responses
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap

MakeCapture = Callable[..., Capture]
HEIGHT, WIDTH = 9, 11


def facets(direction: np.ndarray) -> np.ndarray:
    """Lambert surfaces that each face another way."""
    rows, columns = np.indices((HEIGHT, WIDTH))
    normals = np.stack([rows - 4.0, columns - 5.0, np.full((HEIGHT, WIDTH), 6.0)], axis=2)
    lit = np.maximum(normals @ direction / np.linalg.norm(normals, axis=2), 0)
    return lit[..., None] * np.array([1.0, 0.8, 0.5])


@pytest.fixture
def capture(make_capture: MakeCapture) -> Capture:
    coverage = np.ones((HEIGHT, WIDTH), np.float32)
    coverage[0] = 0
    return make_capture(facets, lights=60, holdout=6, coverage=coverage)


def test_a_sample_of_all_texels_scores_as_the_whole(capture: Capture) -> None:
    method = RelightingMap(k=12, encoding="float", spread=0.6, ridge=0.01)
    asset = method.encode(capture)
    whole = evaluate(asset, capture)["holdout"]
    texels = np.arange(WIDTH, HEIGHT * WIDTH)  # the first row is not covered
    sample = capture.load(texels)
    kept = score_asset(asset.at(texels), sample, "holdout", whole["peak"])
    (fitted, *_) = contest(sample, [method], "holdout", whole["peak"])
    for score in (kept, fitted):
        assert score.psnr == pytest.approx(whole["psnr"], abs=0.01)  # sums in another order, float32
        assert score.relative_rmse == pytest.approx(whole["relative_rmse"], rel=1e-3)
        assert (score.family, score.name, score.bytes_per_texel) == ("relighting map", "12 maps, float", 12 * 16)
    assert method_of(asset).numbers_per_texel(asset) == 36


@pytest.mark.slow
def test_every_family_is_told_apart(capture: Capture) -> None:
    sample = capture.load(np.arange(WIDTH, HEIGHT * WIDTH))
    methods = [
        RelightingMap(k=9, basis="spherical-harmonics"),
        EigenMap(components=8),
        ClusteredEigenMap(clusters=3, components=4, encoding="uint8"),
    ]
    harmonics, eigen, clustered, *_ = contest(sample, methods, "holdout", 1.0)
    assert (harmonics.family, harmonics.name, harmonics.bytes_per_texel) == ("spherical harmonics", "9 maps", 72)
    assert (eigen.family, eigen.name, eigen.bytes_per_texel) == ("eigen map", "8 components", 16)
    assert (clustered.family, clustered.name) == ("clustered eigen map", "4 components, 3 clusters, bytes")
    assert clustered.bytes_per_texel == 5  # four scalars and the index
    assert eigen.psnr > harmonics.psnr  # at fewer bytes: the facets' responses have a few components


def test_baselines_at_the_bytes_of_all_images(capture: Capture) -> None:
    sample = capture.load(np.arange(WIDTH, HEIGHT * WIDTH))
    nearest, every = contest(sample, [], "holdout", 1.0)
    found = nearest_image(sample, np.arange(sample.width))
    train = sample.indices("train")
    assert error_of(found, sample, "train", 1.0)[1] == 0  # a train light's nearest image is its own
    tilted = sample.directions(train[:1]) + 1e-4
    assert np.array_equal(found(tilted)[0], sample.image(train[0]).reshape(-1, 3))
    assert (nearest.family, every.family) == (NEAREST, ALL)
    assert nearest.bytes_per_texel == every.bytes_per_texel == 60 * IMAGE_BYTES
    assert every.psnr > nearest.psnr + 3  # smooth responses are interpolated far better than they are picked


def test_the_spectrum_is_that_of_the_responses_and_bounds_every_fit(capture: Capture) -> None:
    sample = capture.load(np.arange(WIDTH, HEIGHT * WIDTH))
    train = sample.indices("train")
    responses = np.concatenate([sample.image(i).reshape(-1, 3) for i in train], axis=1)
    values = spectrum(sample)
    exact = np.linalg.svd(responses - responses.mean(axis=0), compute_uv=False)
    assert np.allclose(values[: len(exact)], exact, atol=2e-3 * exact[0])  # float32 sums; small values lose the most
    assert float((values**2).sum()) == pytest.approx(float((exact**2).sum()), rel=1e-4)
    bound = planes_bound(values, responses.size, 1.0)
    assert (np.diff(bound) >= 0).all()
    assert bound[0] == pytest.approx(-10 * np.log10(((responses - responses.mean(axis=0)) ** 2).mean()), abs=0.01)
    for method in (RelightingMap(k=2, spread=1.0, ridge=0.0, encoding="float"), EigenMap(components=3, encoding="float")):
        asset = method.encode(sample)
        fitted = np.concatenate(list(asset_responses(asset, sample.directions(train))[:, 0]), axis=1)  # not clamped
        reached = -10 * np.log10(((fitted - responses) ** 2).mean())
        assert reached <= bound[method_of(asset).numbers_per_texel(asset)] + 0.01
    assert reached > bound[1]  # the eigen map comes near it
