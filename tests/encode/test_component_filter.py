"""Noise out of components: grain goes, edges and clusters stay, and where there is no noise nothing changes."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.encode.component_filter import without_noise

SIDE = 48
PLACES = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE), [0.0], indexing="ij"), -1).reshape(-1, 3).astype(np.float32) * 0.05
UP = np.broadcast_to(np.array([0, 0, 1], np.float32), PLACES.shape)
ALL = np.ones(len(PLACES), bool)
ONE = np.zeros(len(PLACES), np.int64)
SMOOTH = np.stack([np.sin(PLACES[:, 0]), PLACES[:, 1] ** 2, np.cos(2 * PLACES[:, 0] + PLACES[:, 1])]).astype(np.float32)
NOISE = 0.1


def noisy(values: np.ndarray, seed: int = 0) -> np.ndarray:
    return (values + NOISE * np.random.default_rng(seed).standard_normal(values.shape)).astype(np.float32)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


def test_grain_goes() -> None:
    found = without_noise(noisy(SMOOTH), ONE, ALL, PLACES, UP)
    assert rms(found - SMOOTH) < 0.5 * NOISE


def test_what_has_no_noise_stays() -> None:
    assert rms(without_noise(SMOOTH, ONE, ALL, PLACES, UP) - SMOOTH) < 0.005


@pytest.mark.parametrize("apart", ["by their values", "by their clusters", "by their normals"])
def test_the_two_sides_of_an_edge_do_not_mix(apart: str) -> None:
    right = PLACES[:, 0] > PLACES[:, 0].mean()
    height = 2.0 if apart == "by their values" else 0.25
    truth = np.where(right, height, 0.0)[None].repeat(2, axis=0).astype(np.float32)
    index = right.astype(np.int64) if apart == "by their clusters" else ONE
    normals = np.where(right[:, None], np.array([1, 0, 0], np.float32), UP) if apart == "by their normals" else UP
    found = without_noise(noisy(truth), index, ALL, PLACES, normals)
    beside = np.abs(PLACES[:, 0] - PLACES[:, 0].mean()) < 0.06
    assert rms((found - truth)[:, beside]) < NOISE
    assert abs(float(found[0, right & beside].mean()) - height) < 0.03


def test_single_bright_texels_go() -> None:
    truth = noisy(SMOOTH, 3)
    truth[:, 1000] += 5
    assert np.abs(without_noise(truth, ONE, ALL, PLACES, UP)[:, 1000] - SMOOTH[:, 1000]).max() < 3 * NOISE


def test_texels_outside_the_receiver_and_tiny_receivers_stay() -> None:
    covered = PLACES[:, 1] > 0.5
    values = noisy(SMOOTH)
    np.testing.assert_array_equal(without_noise(values, ONE, covered, PLACES, UP)[:, ~covered], values[:, ~covered])
    few = np.arange(len(PLACES)) < 10
    np.testing.assert_array_equal(without_noise(values, ONE, few, PLACES, UP), values)
