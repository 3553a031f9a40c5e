"""What every method owes: linearity, no light, the clamp, determinism, order of receivers, dilation, the disk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.lights import DirectionalLight, EnvironmentLight, PointLight, SpotLight
from srbf.methods import relight
from srbf.methods.relighting_map import RelightingMap, linear_response

METHODS = [RelightingMap(k=15), RelightingMap(k=9, centers="hammersley3", spread="min", ridge=0.01)]
FLOAT32 = 3e-6  # relative rounding of a sum of a few dozen float32 products


def lambert(shape: tuple[int, int]):
    """A coloured plane facing up."""
    return lambda direction: np.broadcast_to(max(0.0, direction[2]) * np.array([0.8, 0.5, 0.2]), (*shape, 3))


@pytest.fixture(params=METHODS, ids=lambda method: f"{type(method).__name__}-{method.k}")
def method(request: pytest.FixtureRequest) -> RelightingMap:
    return request.param


LIGHTS = [
    DirectionalLight((0.3, 0.2, 0.9), (1, 0.5, 0.2)),
    PointLight((0.2, 0.1, 0.7), (0.4, 1, 0.3), a0=0.8),
    SpotLight((0, -0.5, 1), (1, 1, 0.5), direction=(0, 0.5, -1), inner=0.2, outer=0.7),
    EnvironmentLight(np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)),
]


@pytest.fixture
def asymmetric(make_capture, plane_positions, method) -> Asset:
    """Random, direction-dependent answers with holes, an emissive ambient and curved positions."""
    rng = np.random.default_rng(5)
    waves = rng.normal(size=(10, 14, 3, 3))
    coverage = (rng.random((10, 14)) > 0.2).astype(np.float32)
    positions = plane_positions.copy()
    positions[..., 2] = rng.random((10, 14)) * 0.2
    capture = make_capture(
        lambda d: 1 + np.sin(waves @ d),
        position=positions,
        coverage=coverage,
        ambient=rng.random((10, 14, 3)).astype(np.float32),
    )
    return method.encode(capture)


@pytest.mark.parametrize("light", LIGHTS)
def test_response_is_linear_in_colour_and_additive(asymmetric: Asset, light) -> None:
    one = linear_response(asymmetric, [light])
    twice = linear_response(asymmetric, [replace(light, color=tuple(2 * c for c in light.color))])
    scale = np.abs(one).max()
    np.testing.assert_allclose(twice, 2 * one, atol=FLOAT32 * scale * 10)
    together = linear_response(asymmetric, [light, *LIGHTS])
    apart = one + sum(linear_response(asymmetric, [other]) for other in LIGHTS)
    np.testing.assert_allclose(together, apart, atol=FLOAT32 * np.abs(apart).max() * 10)


def test_no_light_gives_exactly_ambient(asymmetric: Asset) -> None:
    np.testing.assert_array_equal(relight(asymmetric, []), asymmetric.images["ambient"])


def test_negative_sums_are_clamped_before_ambient(asymmetric: Asset) -> None:
    dark = DirectionalLight((0, 0, 1), (-5, -5, -5))
    np.testing.assert_array_equal(relight(asymmetric, [dark]) >= asymmetric.images["ambient"], True)


def test_permuting_receivers_permutes_the_maps(make_capture, method) -> None:
    rng = np.random.default_rng(8)
    waves = rng.normal(size=(6, 5, 3, 3))
    order = rng.permutation(30)
    shuffled = waves.reshape(30, 3, 3)[order].reshape(6, 5, 3, 3)
    one = method.encode(make_capture(lambda d: np.sin(waves @ d), name="a"))
    two = method.encode(make_capture(lambda d: np.sin(shuffled @ d), name="b"))
    np.testing.assert_array_equal(one.stored.reshape(-1, 30, 3)[:, order], two.stored.reshape(-1, 30, 3))


def test_uncovered_texels_hold_their_nearest_covered_neighbour(asymmetric: Asset) -> None:
    covered = np.argwhere(asymmetric.covered)
    for row, column in np.argwhere(~asymmetric.covered)[:20]:
        nearest = np.linalg.norm(covered - [row, column], axis=1)
        candidates = covered[nearest == nearest.min()]
        stored = asymmetric.stored[:, row, column]
        assert any((asymmetric.stored[:, r, c] == stored).all() for r, c in candidates)


@pytest.mark.parametrize("encoding", ["half", "float", "uint8"])
def test_disk_round_trip_is_exact(make_capture, method, tmp_path, encoding: str) -> None:
    asset = replace(method, encoding=encoding).encode(make_capture(lambert((7, 9))))
    asset.save(tmp_path / "asset")
    again = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(again.stored, asset.stored)
    np.testing.assert_array_equal(again.table, asset.table)
    np.testing.assert_allclose(again.coefficients(), asset.coefficients(), rtol=1e-6)
    assert again.manifest == asset.manifest


def test_fit_is_deterministic(make_capture, method) -> None:
    capture = make_capture(lambert((5, 5)))
    one, two = method.encode(capture), method.encode(capture)
    np.testing.assert_array_equal(one.stored, two.stored)
    assert one.manifest == two.manifest
