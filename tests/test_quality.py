"""What a byte buys: samples answer as their capture does, baselines are what they say, and a spectrum bounds every method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.evaluation import evaluate
from srbf.methods.relighting_map import RelightingMap
from srbf.quality import (
    ALL,
    IMAGE_BYTES,
    NEAREST,
    contest,
    error_of,
    name_of,
    nearest_image,
    planes_bound,
    scalars_of,
    score_asset,
    spectrum,
    texel_sample,
)

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
    method = RelightingMap(k=12, encoding="float")
    asset = method.encode(capture)
    whole = evaluate(asset, capture)["holdout"]
    with texel_sample(capture) as sample:
        assert len(sample.texels) == (HEIGHT - 1) * WIDTH and sample.texels.min() >= WIDTH
        kept = score_asset(asset.at(sample.texels), sample.capture, "holdout", whole["peak"])
        (fitted, *_) = contest(sample, [method], "holdout", whole["peak"])
        folder = sample.capture.folder
    assert not folder.exists()
    for score in (kept, fitted):
        assert score.psnr == pytest.approx(whole["psnr"], abs=0.01)  # sums in another order, float32
        assert score.relative_rmse == pytest.approx(whole["relative_rmse"], rel=1e-3)
        assert (score.family, score.name, score.bytes_per_texel) == ("relighting map", "12 maps", 12 * 16)
    assert name_of(asset) == "12 maps" and scalars_of(asset) == 36


def test_a_small_sample_is_repeatable_and_covered(capture: Capture) -> None:
    picks = []
    for _ in range(2):
        with texel_sample(capture, count=20) as sample:
            picks.append(sample.texels)
            answers = sample.capture.image(3).reshape(-1, 3)
            assert np.array_equal(answers, capture.image(3).reshape(-1, 3)[sample.texels])
    assert np.array_equal(*picks) and len(np.unique(picks[0])) == 20 and picks[0].min() >= WIDTH


def test_baselines_at_the_bytes_of_all_images(capture: Capture) -> None:
    with texel_sample(capture) as sample:
        nearest, every = contest(sample, [], "holdout", 1.0)
        found = nearest_image(sample.capture, np.arange(len(sample.texels)))
        train = sample.capture.indices("train")
        assert error_of(found, sample.capture, "train", 1.0)[1] == 0  # a train light's nearest image is its own
        tilted = sample.capture.directions(train[:1]) + 1e-4
        assert np.array_equal(found(tilted)[0], sample.capture.image(train[0]).reshape(-1, 3))
    assert (nearest.family, every.family) == (NEAREST, ALL)
    assert nearest.bytes_per_texel == every.bytes_per_texel == 60 * IMAGE_BYTES
    assert every.psnr > nearest.psnr + 3  # smooth answers are interpolated far better than they are picked


def test_the_spectrum_is_that_of_the_answers_and_bounds_every_fit(capture: Capture) -> None:
    with texel_sample(capture) as sample:
        train = sample.capture.indices("train")
        answers = np.concatenate([sample.capture.image(i).reshape(-1, 3) for i in train], axis=1)
        values = spectrum(sample)
        exact = np.linalg.svd(answers - answers.mean(axis=0), compute_uv=False)
        assert np.allclose(values[: len(exact)], exact, atol=2e-3 * exact[0])  # float32 sums; small values lose the most
        assert float((values**2).sum()) == pytest.approx(float((exact**2).sum()), rel=1e-4)
        bound = planes_bound(values, answers.size, 1.0)
        assert (np.diff(bound) >= 0).all()
        assert bound[0] == pytest.approx(-10 * np.log10(((answers - answers.mean(axis=0)) ** 2).mean()), abs=0.01)
        for k in (2, 5):
            asset = RelightingMap(k=k, encoding="float").encode(sample.capture)
            fitted = score_asset(asset, sample.capture, "train", 1.0)
            pooled = -10 * np.log10(fitted.relative_rmse**2 * (answers**2).mean())
            assert pooled <= bound[scalars_of(asset)] + 0.01
