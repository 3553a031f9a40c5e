"""Train images without their noise: grain goes and edges stay, other images are untouched, and all ways to read them agree."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from made_lightmaps import SIDE, STEP, floor_capture

from srbf.capture import Capture
from srbf.encode.denoised_capture import DenoisedCapture, denoised

NOISE = 0.2
Make = Callable[..., Capture]


def clean_of(capture: Capture) -> DenoisedCapture:
    found = denoised(capture)
    assert found is not None
    return found


def train_images(capture: Capture) -> np.ndarray:
    return np.stack([capture.image(i) for i in capture.indices("train")])


def rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


@pytest.fixture
def noisy(make_capture: Make) -> Capture:
    return floor_capture(make_capture, NOISE)


@pytest.fixture
def truth(make_capture: Make) -> Capture:
    return floor_capture(make_capture, 0.0, name="truth")


def test_noise_falls_and_edges_stay(noisy: Capture, truth: Capture) -> None:
    lost = train_images(clean_of(noisy)) - train_images(truth)
    assert rms(lost) < 0.5 * NOISE
    place = noisy.geometry("position")
    assert place is not None
    beside = np.abs(place[..., 0] - STEP * SIDE / 2) < 1.5 * STEP
    assert rms(lost[:, beside]) < 1.05 * NOISE  # too few neighbors agree: these texels stay


def test_images_without_noise_stay(truth: Capture) -> None:
    assert rms(train_images(clean_of(truth)) - train_images(truth)) < 0.01


def test_detail_stays_where_there_is_less_noise_than_elsewhere(make_capture: Make) -> None:
    grain, quiet = 0.1, 0.01
    noisy = floor_capture(make_capture, quiet, grain, noisier=20.0)
    lost = train_images(clean_of(noisy)) - train_images(floor_capture(make_capture, 0.0, grain, name="truth"))
    position = noisy.geometry("position")
    assert position is not None
    far = position[..., 1] > STEP * SIDE / 4
    assert rms(lost[:, ~far]) < 3 * quiet
    assert rms(lost[:, far]) < 0.6 * 20 * quiet


def test_only_train_images_change(noisy: Capture) -> None:
    clean = clean_of(noisy)
    for i in [*noisy.indices("validation"), *noisy.indices("holdout")]:
        np.testing.assert_array_equal(clean.image(i), noisy.image(i))
    np.testing.assert_array_equal(clean.coverage(), noisy.coverage())


def test_all_ways_to_read_an_image_agree(noisy: Capture) -> None:
    clean, train = clean_of(noisy), noisy.indices("train")
    expected = train_images(clean).reshape(len(train), -1, 3)
    seen = {}
    blocks = dict(clean.stream(train, lambda row, image: seen.update({row: image.copy()})))
    np.testing.assert_array_equal(np.concatenate(list(blocks.values())), expected)
    np.testing.assert_array_equal(np.stack([seen[row] for row in range(len(train))]), train_images(noisy).reshape(len(train), -1, 3))
    (rows,) = [block.copy() for _, block in clean.stream(train, rows=[(3, 5)])]
    np.testing.assert_array_equal(rows, expected[:, 3 * SIDE : 5 * SIDE])
    texels = np.array([5, 700, 31])
    lights = [train[3], noisy.indices("holdout")[0]]
    found = clean.sample(lights, texels)
    np.testing.assert_allclose(found[:, 0], expected[3, texels], rtol=1e-5)
    np.testing.assert_array_equal(found[:, 1], noisy.sample(lights[1:], texels)[:, 0])
    of_some = clean.with_roles([light.role if i % 2 == 0 else None for i, light in enumerate(clean.lights)])
    np.testing.assert_array_equal(of_some.image(1), clean.image(2))


@pytest.mark.lengthy
def test_the_order_of_texels_does_not_matter(make_capture: Make) -> None:
    order = np.random.default_rng(2).permutation(SIDE * SIDE)
    first = train_images(clean_of(floor_capture(make_capture, NOISE, name="first")))
    second = train_images(clean_of(floor_capture(make_capture, NOISE, order=order, name="second")))
    np.testing.assert_allclose(second.reshape(len(second), -1, 3), first.reshape(len(first), -1, 3)[:, order], atol=1e-3)


def test_a_capture_without_places_has_none(make_capture: Make) -> None:
    assert denoised(make_capture(lambda d: np.full((8, 8, 3), d[2]), name="bare")) is None
