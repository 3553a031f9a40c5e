"""What every method owes: linearity, no light, the clamp, determinism, order of receivers, dilation, the disk, a place in the world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_captures import write_capture

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight
from srbf.methods import linear_response, projected_weights, relight
from srbf.methods import responses as asset_responses
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.sphere import random_directions

Method = RelightingMap | EigenMap | ClusteredEigenMap

METHODS: dict[str, Method] = {
    "maps": RelightingMap(k=15),
    "maps-hammersley3": RelightingMap(k=9, centers="hammersley3", spread="min", ridge=0.01),
    "maps-bytes": RelightingMap(k=12, encoding="uint8"),
    "maps-harmonics": RelightingMap(k=9, basis="spherical-harmonics", encoding="float"),
    "eigen": EigenMap(components=6),
    "eigen-float": EigenMap(components=5, encoding="float", spread=0.4, ridge=0.01),
    "eigen-bytes": EigenMap(components=8, encoding="uint8", weighting="relative"),
    "clustered": ClusteredEigenMap(clusters=3, components=4),
    "clustered-bytes": ClusteredEigenMap(clusters=4, components=3, encoding="uint8", spread=0.5, ridge=0.1),
}
FEW = 30  # lights: enough to fit all of them, in half the time of sixty
FLOAT32 = 3e-6  # relative rounding of a sum of a few dozen float32 products


def lambert(shape: tuple[int, int]):
    """A colored plane facing up."""
    return lambda direction: np.broadcast_to(max(0.0, direction[2]) * np.array([0.8, 0.5, 0.2]), (*shape, 3))


@pytest.fixture(scope="module", params=list(METHODS))
def method(request: pytest.FixtureRequest) -> Method:
    return METHODS[request.param]


LIGHTS: list[Light] = [
    DirectionalLight((0.3, 0.2, 0.9), (1, 0.5, 0.2)),
    PointLight((0.2, 0.1, 0.7), (0.4, 1, 0.3), a0=0.8),
    SpotLight((0, -0.5, 1), (1, 1, 0.5), direction=(0, 0.5, -1), inner=0.2, outer=0.7),
    EnvironmentLight(np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)),
]


@pytest.fixture(scope="module")
def waves(tmp_path_factory: pytest.TempPathFactory, plane_positions: np.ndarray) -> Capture:
    """Random, direction-dependent responses with holes, an emissive ambient and curved positions."""
    rng = np.random.default_rng(5)
    waves = rng.normal(size=(10, 14, 3, 3))
    coverage = (rng.random((10, 14)) > 0.2).astype(np.float32)
    positions = plane_positions.copy()
    positions[..., 2] = rng.random((10, 14)) * 0.2
    return write_capture(
        tmp_path_factory.mktemp("waves") / "capture",
        lambda d: 1 + np.sin(waves @ d),
        position=positions,
        coverage=coverage,
        ambient=rng.random((10, 14, 3)).astype(np.float32),
    )


@pytest.fixture(scope="module")
def asymmetric(waves: Capture, method: Method) -> Asset:
    return method.encode(waves)


@pytest.mark.parametrize("light", LIGHTS)
def test_response_is_linear_in_color_and_additive(asymmetric: Asset, light) -> None:
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


def test_many_directions_at_once_are_each_by_itself(asymmetric: Asset) -> None:
    directions = random_directions(7, "sphere", np.random.default_rng(0))
    together = asset_responses(asymmetric, directions)
    apart = np.stack([linear_response(asymmetric, [DirectionalLight(tuple(d))]) for d in directions])
    np.testing.assert_allclose(together, apart, atol=FLOAT32 * np.abs(apart).max() * 10)


def test_an_environment_is_the_sum_of_its_texels(asymmetric: Asset) -> None:
    """Row i lies from pi/2 - i pi/6 of elevation down, its columns run clockwise from -x; what is below the horizon counts for nothing."""
    image = np.random.default_rng(1).random((6, 12, 3)).astype(np.float32)
    suns: list[Light] = []
    for row, column in np.ndindex(3, 12):
        elevation, azimuth = np.pi / 2 - (row + 0.5) * np.pi / 6, np.pi - (column + 0.5) * np.pi / 6
        direction = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
        solid_angle = np.pi / 6 * (np.cos(row * np.pi / 6) - np.cos((row + 1) * np.pi / 6))
        suns.append(DirectionalLight(direction, tuple(solid_angle * image[row, column].astype(np.float64) * [1, 2, 0.5])))
    expected = projected_weights(asymmetric, suns)
    weights = projected_weights(asymmetric, [EnvironmentLight(image, (1, 2, 0.5))])
    np.testing.assert_allclose(weights, expected, atol=1e-9 * np.abs(expected).max())
    assert np.abs(expected).max() > 0.1


def test_rows_at_a_time_make_no_difference(asymmetric: Asset, monkeypatch: pytest.MonkeyPatch) -> None:
    directions = random_directions(3, "hemisphere", np.random.default_rng(2))
    whole, many = linear_response(asymmetric, LIGHTS), asset_responses(asymmetric, directions)
    monkeypatch.setattr("srbf.methods.over_lights.CHUNK", 3 * 14)  # does not divide the 10 rows
    np.testing.assert_allclose(linear_response(asymmetric, LIGHTS), whole, atol=FLOAT32 * np.abs(whole).max() * 10)
    np.testing.assert_allclose(asset_responses(asymmetric, directions), many, atol=FLOAT32 * np.abs(many).max() * 10)


def test_a_moved_asset_is_lit_where_it_stands(asymmetric: Asset) -> None:
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    at, size = np.array([5.0, -2.0, 1.0]), 2.0
    to_asset = np.eye(4)
    to_asset[:3, :3], to_asset[:3, 3] = turn.T / size, -turn.T @ at / size
    instance = replace(asymmetric, manifest={**asymmetric.manifest, "asset_from_world": to_asset.tolist()})
    sun, point_light, spot, environment = LIGHTS

    def placed(light: PointLight) -> PointLight:
        return replace(light, position=tuple(size * turn @ light.position + at), a0=size * light.a0, radius=size * light.radius)

    moved: list[Light] = [
        replace(sun, direction=tuple(turn @ sun.direction)),
        placed(point_light),
        replace(placed(spot), direction=tuple(turn @ spot.direction)),
        replace(environment, image=np.roll(environment.image, -4, axis=1)),  # a quarter turn about z is a quarter of the columns
    ]
    here = linear_response(asymmetric, LIGHTS)
    np.testing.assert_allclose(linear_response(instance, moved), here, atol=FLOAT32 * np.abs(here).max() * 10)


@pytest.mark.lengthy
def test_permuting_receivers_permutes_the_picture(make_capture, method) -> None:
    if isinstance(method, ClusteredEigenMap):
        method = replace(method, clusters=1)  # where clusters start depends on the order of the texels
    rng = np.random.default_rng(8)
    waves = rng.normal(size=(6, 5, 3, 3))
    order = rng.permutation(30)
    shuffled = waves.reshape(30, 3, 3)[order].reshape(6, 5, 3, 3)
    one = method.encode(make_capture(lambda d: np.sin(waves @ d), name="a", lights=FEW))
    two = method.encode(make_capture(lambda d: np.sin(shuffled @ d), name="b", lights=FEW))
    if isinstance(method, RelightingMap):
        atol = FLOAT32 if method.encoding == "float" else 0
        np.testing.assert_allclose(two.stored.reshape(-1, 30, 3), one.stored.reshape(-1, 30, 3)[:, order], rtol=0, atol=atol)
        return
    directions = random_directions(5, "hemisphere", rng)
    responses = asset_responses(one, directions).reshape(5, 30, 3)[:, order]
    step = {"half": 2.0**-11, "float": 1e-4, "uint8": 1 / 255}[method.encoding]  # axes turn by rounding, and planes with them
    np.testing.assert_allclose(asset_responses(two, directions).reshape(5, 30, 3), responses, atol=4 * step * np.abs(responses).max())


def test_uncovered_texels_hold_their_nearest_covered_neighbor(asymmetric: Asset) -> None:
    covered = np.argwhere(asymmetric.covered)
    for row, column in np.argwhere(~asymmetric.covered)[:20]:
        nearest = np.linalg.norm(covered - [row, column], axis=1)
        candidates = covered[nearest == nearest.min()]
        stored = asymmetric.stored[:, row, column]
        index = asymmetric.tables.get("cluster_index", np.zeros_like(asymmetric.covered))
        assert any((asymmetric.stored[:, r, c] == stored).all() and index[r, c] == index[row, column] for r, c in candidates)


@pytest.mark.parametrize("encoding", ["half", "float", "uint8"])
@pytest.mark.parametrize("name", ["maps", "eigen", "clustered"])
def test_disk_round_trip_is_exact(make_capture, name: str, tmp_path, encoding: str) -> None:
    scale = np.random.default_rng(3).random((7, 9, 1))  # Lambert alone is one scalar
    asset = replace(METHODS[name], encoding=encoding).encode(
        make_capture(lambda d: lambert((7, 9))(d) * scale + np.maximum(0, d[0] - scale), lights=FEW)
    )
    asset.save(tmp_path / "asset")
    again = Asset.open(tmp_path / "asset")
    np.testing.assert_array_equal(again.stored, asset.stored)
    assert set(again.tables) == set(asset.tables)
    for name, table in asset.tables.items():
        assert again.tables[name].dtype == table.dtype
        np.testing.assert_array_equal(again.tables[name], table)
    np.testing.assert_allclose(again.coefficients(), asset.coefficients(), rtol=1e-6)
    assert again.manifest == asset.manifest
    np.testing.assert_array_equal(relight(again, LIGHTS[:1]), relight(asset, LIGHTS[:1]))


def test_fit_is_deterministic(make_capture, method) -> None:
    capture = make_capture(lambert((5, 5)), lights=FEW)
    one, two = method.encode(capture), method.encode(capture)
    np.testing.assert_array_equal(one.stored, two.stored)
    for name, table in one.tables.items():
        np.testing.assert_array_equal(two.tables[name], table)
    assert one.manifest == two.manifest


def test_what_a_capture_says_of_itself_goes_along(asymmetric: Asset, method) -> None:
    assert asymmetric.encoding == method.encoding
    assert set(asymmetric.images) == {"position", "coverage", "ambient"}
    assert asymmetric.domain == "hemisphere" and asymmetric.manifest["source"]["fit"]["train_lights"] == 60
