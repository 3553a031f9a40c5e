"""Penumbrae against the spacing of the lights: suns of known size behind the edges of half-spaces."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.evaluation.light_spacing import ShadowSampling, count_edges, shadow_sampling
from srbf.sphere import mean_spacing, normalize, point_set


def behind_walls(sun_angle: float, directions: np.ndarray, texels: int = 400) -> np.ndarray:
    """(L, n) responses of Lambert texels facing anywhere upwards, each with a half-space of its own hiding the sun's disc."""
    rng = np.random.default_rng(5)
    normals, walls = normalize(rng.normal(size=(texels, 3)) * [0.5, 0.5, 0.1] + [0, 0, 1]), normalize(rng.normal(size=(texels, 3)))
    walls *= np.sign((walls * normals).sum(axis=1, keepdims=True))  # every texel sees what is before it
    t = np.clip(np.arcsin(directions @ walls.T) / max(sun_angle / 2, 1e-9), -1, 1)
    visible = 0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi  # the part of a disc beyond a chord
    return np.maximum(0, directions @ normals.T) * visible


@pytest.mark.slow
@pytest.mark.parametrize(("domain", "lights"), [("hemisphere", 150), ("sphere", 400)])
def test_hard_suns_are_jumped_and_soft_ones_not(make_capture, domain: str, lights: int) -> None:
    directions = point_set("hammersley", lights, domain)
    spacing = mean_spacing(directions)
    jumped = []
    for number, size in enumerate((0, 0.5, 1, 2)):
        capture = make_capture(
            lambda d, size=size: np.repeat(behind_walls(size * spacing, d[None]).reshape(20, 20, 1), 3, axis=2),
            directions=directions,
            holdout=1,
            name=f"capture{number}",
        )
        found = shadow_sampling(capture)
        assert found.lights == lights and found.spacing == pytest.approx(spacing)
        assert found.edges > 0.005
        jumped.append(found.jumped)
        assert found.too_coarse == (size <= 0.5)
        assert ("too coarse" in found.sentence()) == (size <= 0.5)
        assert f"{np.degrees(spacing):.1f} degrees" in found.sentence() and f"{found.jumped:.0%}" in found.sentence()
    assert jumped[0] > 0.97
    assert jumped[0] > jumped[1] > jumped[2] > jumped[3]
    assert jumped[3] < 0.1


@pytest.mark.parametrize("lights", [60, 400])
def test_lambert_surfaces_have_no_edges(lights: int) -> None:
    directions = point_set("fibonacci", lights, "sphere")
    normals = normalize(np.random.default_rng(2).normal(size=(500, 3)))
    responses = np.maximum(0, directions @ normals.T).astype(np.float32)
    edges, jumped, looked = count_edges(directions, responses)
    assert edges == jumped == 0
    assert looked > 500


def test_a_capture_without_shadows_says_so(make_capture) -> None:
    found = shadow_sampling(make_capture(lambda d: np.full((4, 4, 3), d[2])))
    assert found.edges == 0 and not found.too_coarse
    assert "hardly a shadow edge" in found.sentence()


def test_noise_is_no_shadow() -> None:
    directions = point_set("hammersley", 400, "hemisphere")
    rng = np.random.default_rng(3)
    noisy = np.repeat(directions[:, 2:], 300, axis=1) * (1 + 0.04 * rng.normal(size=(400, 300)))
    edges, _, looked = count_edges(directions, noisy.astype(np.float32))
    assert edges < 1e-3 * looked


def test_too_little_to_look_at(make_capture) -> None:
    with pytest.raises(InputError, match="2 train lights"):
        shadow_sampling(make_capture(lambda d: np.ones((2, 2, 3)), lights=1))
    with pytest.raises(InputError, match="covered"):
        shadow_sampling(make_capture(lambda d: np.ones((2, 2, 3)), coverage=np.zeros((2, 2), np.float32), name="bare"))


def test_a_sun_of_known_size_decides() -> None:
    found = ShadowSampling(lights=400, spacing=0.128, edges=0.05, jumped=0.3)
    assert not found.too_coarse
    hard, soft = (ShadowSampling(400, 0.128, 0.05, share, sun) for share, sun in ((0.3, 0.0), (0.6, 0.128)))
    assert hard.too_coarse and "the sun is 0.0 degrees wide" in hard.sentence()
    assert not soft.too_coarse and "the sun is 7.3 degrees wide" in soft.sentence()
    assert not ShadowSampling(400, 0.128, 0.0, 0.0, 0.0).too_coarse  # nothing casts a shadow
