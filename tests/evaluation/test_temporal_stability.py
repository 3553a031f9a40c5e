"""A sweeping light: what a perfect relighter, a gain, a wave, held frames, cross-faded images and Gaussians do to its figures."""

from __future__ import annotations

import json

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.evaluation.temporal_stability import compare, dense_reference, frames, great_circles, lambert_sweep, sampled_texels, sweep
from srbf.light_domain.directions import LOWEST
from srbf.lights import DirectionalLight
from srbf.methods import relight
from srbf.methods.relighting_map import RelightingMap
from srbf.sphere import point_set

ROUNDING = 1e-5  # float32 responses, differences of neighboring frames
PATH = great_circles("hemisphere", 300, 3)  # (3, 100, 3)
STEPS = 99


def curve(values: np.ndarray, texels: int = 5) -> np.ndarray:
    """(C, F) or (F,) values as responses of gray texels."""
    values = np.broadcast_to(values, PATH.shape[:2])
    return np.repeat(np.repeat(values[:, :, None, None], texels, axis=2), 3, axis=3).astype(np.float32)


@pytest.mark.parametrize("domain", ["hemisphere", "sphere"])
def test_great_circles(domain: str) -> None:
    path = great_circles(domain)
    assert path.shape[0] * path.shape[1] == 240
    np.testing.assert_allclose(np.linalg.norm(path, axis=2), 1, atol=1e-12)
    steps = np.linalg.norm(np.diff(path, axis=1), axis=2)
    np.testing.assert_allclose(steps, steps[0, 0], atol=1e-12)  # of even speed
    for circle in path:
        assert np.linalg.svd(circle)[1][2] < 1e-9  # in a plane through the middle
    if domain == "hemisphere":
        assert path[..., 2].min() == pytest.approx(np.sin(LOWEST))
        assert path[..., 2].max() > 0.999
    else:
        np.testing.assert_allclose(path[:, 0], path[:, -1], atol=1e-12)
    with pytest.raises(InputError, match="3 frames"):
        great_circles(domain, 4, 2)


def shadowed() -> np.ndarray:
    """Five texels that a hard shadow leaves one after the other, under the cosine."""
    frame = np.arange(100)[None, :, None, None]
    leaves = np.array([20, 35, 50, 65, 80])[:, None]
    return (PATH[..., 2][:, :, None, None] * (frame >= leaves) * np.ones(3)).astype(np.float32)


def test_a_perfect_relighter() -> None:
    motion = compare(PATH, shadowed(), shadowed())
    assert (motion.change_ratio, motion.largest_step) == (1, 1)
    assert (motion.brightness_error, motion.largest_flicker, motion.ghosting) == (0, 0, 0)
    assert motion.edge_kept == pytest.approx(1, rel=ROUNDING)
    assert motion.edge_texels == 1 and motion.edge.sum() > 0


def test_without_shadows_there_is_no_ghosting_and_nothing_is_kept() -> None:
    motion = compare(PATH, curve(np.ones(100)), curve((np.arange(100) >= 50).astype(float)))
    assert (motion.ghosting, motion.edge_kept, motion.change_ratio) == (0, 0, 0)


def test_a_gain_is_no_flicker() -> None:
    reference = curve(PATH[..., 2])
    motion = compare(PATH, np.float32(1.3) * reference, reference)
    assert motion.change_ratio == pytest.approx(1.3, rel=ROUNDING)
    assert motion.brightness_error == pytest.approx(0.3, rel=1e-4)
    assert motion.largest_flicker < ROUNDING
    assert motion.edge_texels == 0 and motion.ghosting == 0  # a cosine is no shadow edge


def test_a_wave_is_flicker_of_its_height() -> None:
    reference = PATH[..., 2]
    angle = np.linspace(LOWEST, np.pi - LOWEST, 100)
    motion = compare(PATH, curve(reference + 0.03 * np.sin(16 * angle)), curve(reference))
    # Waves this short are nearly orthogonal to an affine function of the direction: it takes up a few per cent, at the ends.
    assert motion.largest_flicker == pytest.approx(0.03 / reference.mean(), rel=0.1)
    assert motion.change_ratio > 1


def test_held_frames_are_popping() -> None:
    """Change of 1 a step, shown every eleventh step only: steps of 11, rms sqrt(11)."""
    ramp = np.arange(100.0) + 1
    motion = compare(PATH, curve(1 + np.floor((np.arange(100)) / 11) * 11), curve(ramp))
    assert motion.largest_step == pytest.approx(11)
    assert motion.change_ratio == pytest.approx(np.sqrt(11))


@pytest.mark.parametrize("fade", [4, 10, 24])
def test_cross_fading_is_ghosting_by_its_share_outside_the_edge(fade: int) -> None:
    """A hard edge passes in one step, with a step on either side 3; a fade of M even steps shows M - 3 parts of M beside them."""
    frame = np.arange(100)
    hard = (frame >= 50).astype(float)
    faded = np.clip((frame - 49.5 + fade / 2) / fade, 0, 1) if fade % 2 else np.clip((frame - 49 + fade / 2) / fade, 0, 1)
    motion = compare(PATH, curve(faded), curve(hard))
    assert motion.ghosting == pytest.approx((fade - 3) / fade, rel=1e-3)
    assert motion.edge_kept == pytest.approx(1 / fade, rel=1e-3)
    assert motion.change_ratio == pytest.approx(1 / np.sqrt(fade), rel=1e-3)


def test_an_echo_counts_twice_its_height_and_a_still_texel_nothing() -> None:
    frame = np.arange(100)
    hard = (frame >= 50).astype(float)
    echo = hard + 0.25 * ((frame >= 20) & (frame < 25))
    relit, reference = curve(echo), curve(hard)
    motion = compare(PATH, relit, reference)
    assert motion.ghosting == pytest.approx(0.5, rel=ROUNDING)
    assert motion.ghost.sum(axis=0).nonzero()[0].tolist() == [19, 24]
    relit[:, :, 2:], reference[:, :, 2:] = 0.5 * echo[:, None, None], 0.5  # three texels of five see no edge
    assert compare(PATH, relit, reference).ghosting == pytest.approx(0.5, rel=ROUNDING)


def test_negative_responses_are_clamped_as_the_picture_is() -> None:
    reference = curve(np.maximum(0, PATH[..., 0]))
    assert compare(PATH, curve(PATH[..., 0]), reference).change_ratio == 1


def test_a_black_reference_is_refused() -> None:
    with pytest.raises(InputError, match="black"):
        compare(PATH, curve(1 + PATH[..., 2]), curve(np.zeros(100)))


@pytest.mark.slow
def test_twenty_five_gaussians_of_the_hemisphere_pulse_and_those_of_the_sphere_hold_the_cosine() -> None:
    lights = point_set("hammersley", 400, "hemisphere")
    paper = lambert_sweep(RelightingMap(k=25, spread="mean", ridge=0).encode, lights)
    assert 0.06 < paper.brightness_error < 0.1
    assert paper.largest_flicker > 0.015
    around = lambert_sweep(RelightingMap(k=25, domain="sphere", spread="mean", ridge=0, encoding="float").encode, lights)
    assert around.brightness_error < 0.02
    chosen = lambert_sweep(RelightingMap(k=25).encode, lights)  # spread and ridge by what they predict
    assert chosen.brightness_error < 0.02
    assert around.largest_flicker < 0.01


@pytest.mark.lengthy
def test_a_sweep_is_the_relit_picture(make_capture, plane_positions: np.ndarray) -> None:
    waves = np.random.default_rng(0).normal(size=(10, 14, 3, 3))
    coverage = np.ones((10, 14), np.float32)
    coverage[:, :4] = 0
    capture = make_capture(lambda d: 1 + np.sin(waves @ d), coverage=coverage, ambient=np.full((10, 14, 3), 0.25, np.float32))
    asset = RelightingMap(k=15).encode(capture)
    path = great_circles(asset.domain, 12, 2)
    texels = sampled_texels(asset.covered, 50)
    assert len(texels) == 50 and (np.diff(texels) > 0).all() and (texels % 14 >= 4).all()
    motion = sweep(asset, lambda d: (1 + np.sin(waves @ d.T).transpose(3, 0, 1, 2)).reshape(len(d), -1, 3)[:, texels], texels, path)
    pictures = list(frames(asset, path))
    for direction, brightness, picture in zip(path.reshape(-1, 3), motion.relit_brightness.ravel(), pictures, strict=True):
        expected = relight(asset, [DirectionalLight(tuple(direction))])
        np.testing.assert_allclose(picture, expected, atol=1e-4)
        assert brightness == pytest.approx((expected - 0.25).reshape(-1, 3)[texels].mean(), abs=1e-4)
    assert motion.change_ratio == pytest.approx(1, abs=0.15)
    document = json.loads(json.dumps(motion.as_dict(), allow_nan=False))
    np.testing.assert_array_equal(document["flicker"], motion.flicker)


@pytest.mark.lengthy
def test_a_dense_reference_is_the_truth_where_lights_are_dense(make_capture) -> None:
    waves = np.random.default_rng(1).normal(size=(4, 5, 3, 3))
    capture = make_capture(lambda d: 1.5 + np.sin(waves @ d), lights=300, holdout=20)
    texels = np.array([0, 7, 19])
    holdout = capture.indices("holdout")
    inside = [i for i in holdout if capture.lights[i].direction[2] > 0.2]
    expected = np.stack([capture.image(i).reshape(-1, 3)[texels] for i in inside])
    np.testing.assert_allclose(dense_reference(capture, texels)(capture.directions(inside)), expected, atol=0.05)


@pytest.mark.lengthy
@pytest.mark.parametrize(("domain", "tolerance"), [("hemisphere", 0.015), ("sphere", 0.025)])
def test_a_dense_reference_keeps_a_lambert_planes_brightness(make_capture, domain: str, tolerance: float) -> None:
    capture = make_capture(lambda d: np.full((1, 2, 3), max(0, d[2])), lights=400, domain=domain)
    path = great_circles(domain)
    texels = np.array([0, 1])
    got = dense_reference(capture, texels)(path.reshape(-1, 3)).reshape(*path.shape[:2], 2, 3)
    truth = np.repeat(np.repeat(np.maximum(path[..., 2], 0)[:, :, None, None], 2, axis=2), 3, axis=3).astype(np.float32)
    assert compare(path, got, truth).brightness_error < tolerance


def test_nothing_covered_is_refused() -> None:
    with pytest.raises(InputError, match="covered"):
        sampled_texels(np.zeros((3, 4), bool))
