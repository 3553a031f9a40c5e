"""Compressed depths: the map, exact depths at full rank, a roof's shadow in closed form, doors, suns, and lights with a size."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import build_plane, quad
from made_rooms import Room

from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, PointLight, SphereLight
from srbf.sphere import random_directions
from srbf.unshadowed import irradiance_from
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.hemisphere_map import SIDE, directions, four_around, place_of, places
from srbf.visibility.pca_direct import PcaDirect
from srbf.visibility.pca_visibility import DepthMaps, PcaVisibility, bounded_depths, pca_visibility
from srbf.visibility.rays import RayTracer
from srbf.visibility.received import RayShadows, starts_of
from srbf.visibility.receivers import Receivers

pytest.importorskip("embreex")
pytest.importorskip("sklearn")

TEXEL = 2 / SIDE  # about the angle between directions of a map, rad
BYTES = 0.06  # m: 2 / 255 of the ranges of a few axes in a room of some meters
DOOR = Room.box((4, 3, 2.5), 0.25, 0.6, (2.0, 1.0, 1.8))
STARTS, NORMALS = starts_of(DOOR.places, DOOR.normals)[::3], DOOR.normals[::3].astype(np.float32)


def fitted(receivers: Receivers, free: np.ndarray, count: int) -> PcaDirect:
    """Every texel's depths."""
    covered = receivers.images.get("coverage", np.ones((receivers.height, receivers.width))) >= 0.5
    position, normal = (receivers.images[name][covered] for name in ("position", "normal"))
    occluders = EmbreeTriangles(receivers.triangles.corners[receivers.triangles.occluders])
    return PcaDirect(receivers, pca_visibility(starts_of(position, normal), normal, occluders, free, count))


@pytest.fixture(scope="module")
def below_a_roof() -> PcaDirect:
    """A plane, and a roof half a meter above it where x < 0."""
    roof = quad([-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5])
    free = np.random.default_rng(1).uniform([-1.5, -1.5, 0.05], [1.5, 1.5, 1.6], (200, 3))
    return fitted(build_plane(roof, size=20, footprint=1e-3), free, 24)


def test_the_map_is_even_and_its_inverse_is_exact() -> None:
    toward = directions(SIDE)
    np.testing.assert_allclose(np.linalg.norm(toward, axis=1), 1)
    rows, columns = np.divmod(np.arange(SIDE**2), SIDE)
    middles = (np.stack([columns, rows], axis=1) + 0.5) / SIDE
    np.testing.assert_allclose(places(toward), middles, atol=1e-12)
    np.testing.assert_allclose(toward.mean(axis=0), [0, 0, 0.5], atol=1e-3)  # of the hemisphere
    np.testing.assert_allclose((toward**2).mean(axis=0), 1 / 3, atol=1e-3)
    texels, weights = four_around(middles, SIDE)
    np.testing.assert_allclose(weights.max(axis=1), 1, atol=1e-9)
    np.testing.assert_array_equal(np.take_along_axis(texels, weights.argmax(axis=1)[:, None], 1)[:, 0], np.arange(SIDE**2))
    _, weights = four_around(np.random.default_rng(1).random((500, 2)), SIDE)
    np.testing.assert_allclose(weights.sum(axis=1), 1)


def test_rounding_does_not_turn_the_map_of_a_wall() -> None:
    toward = random_directions(50, "sphere", np.random.default_rng(2))
    toward[:, 0] = np.abs(toward[:, 0])
    wall = np.tile([1.0, 0.0, 0.0], (50, 1))
    np.testing.assert_allclose(place_of(toward, wall + [0, 0, 1e-8]), place_of(toward, wall - [0, 0, 1e-8]), atol=1e-9)


def test_at_full_rank_depths_are_those_of_rays() -> None:
    """Also within the bounds where a few components are all there is."""
    starts, normals = starts_of(DOOR.places[::60], DOOR.normals[::60]), DOOR.normals[::60].astype(np.float32)
    occluders = EmbreeTriangles(DOOR.corners)
    found = pca_visibility(starts, normals, occluders, DOOR.free, len(starts))
    maps = DepthMaps(starts, normals, occluders, found.far)
    every = np.arange(len(starts))
    depths = found.depths(every, np.tile(np.arange(SIDE**2), (len(starts), 1)))
    np.testing.assert_allclose(depths, maps.trace(every)[0], atol=BYTES)
    start, (low, high) = bounded_depths(maps, every, DOOR.free)
    assert (low <= start).all() and (start <= high).all()


@pytest.mark.lengthy
def test_a_roof_casts_its_shadow(below_a_roof: PcaDirect) -> None:
    """A light at (0.3, 0, 1) is hidden from x < -0.3."""
    receivers = below_a_roof.receivers
    position, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    light = PointLight((0.3, 0.0, 1.0), (1.0, 0.5, 0.2), falloff="inverse-square")
    found = below_a_roof.response([light]).reshape(-1, 3)
    expected = irradiance_from(light, position, normal) * (position[:, 0] > -0.3)
    inside = np.abs(position[:, 0] + 0.3) > 0.15
    np.testing.assert_allclose(found[inside], expected[inside, None] * light.color, rtol=1e-4, atol=1e-6)


def test_a_sun_shines_past_the_roof(below_a_roof: PcaDirect) -> None:
    """From 45 degrees over +x it reaches x > -0.5."""
    position = below_a_roof.receivers.images["position"].reshape(-1, 3)
    found = below_a_roof.directional(np.array([[0.5**0.5, 0.0, 0.5**0.5]]))[0].reshape(-1, 3)
    inside = np.abs(position[:, 0] + 0.5) > 0.15
    np.testing.assert_allclose(found[inside, 0], 0.5**0.5 * (position[inside, 0] > -0.5), atol=0.05)


@pytest.mark.parametrize(
    "light", [AreaLight((0.2, 0.1, 1.2), u=(0.0, -0.8, 0.0), v=(-1.0, 0.0, 0.0)), SphereLight((0.0, 0.0, 1.1), size=0.3)]
)
def test_a_light_with_a_size_has_a_penumbra(below_a_roof: PcaDirect, light: AreaLight | SphereLight) -> None:
    found, exact = below_a_roof.response([light]), RayTracer(below_a_roof.receivers).response([light])
    assert np.linalg.norm(found - exact) < 0.06 * np.linalg.norm(exact)
    part = exact[..., 0] / irradiance_from(
        light, *(below_a_roof.receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    ).reshape(20, 20)
    assert ((part > 0.2) & (part < 0.8)).any()


def test_an_open_plane_never_shades_itself() -> None:
    receivers = build_plane(size=12)
    free = np.random.default_rng(3).uniform([-1, -1, 0.05], [1, 1, 1], (50, 3))
    lights: list[Light] = [PointLight((0.9, 0.1, 0.06)), DirectionalLight((0.98, 0.0, 0.19899749))]
    for light in lights:
        exact = irradiance_from(light, *(receivers.images[name].reshape(-1, 3) for name in ("position", "normal")))
        np.testing.assert_allclose(fitted(receivers, free, 4).response([light])[..., 0].ravel(), exact, rtol=1e-5)
    assert not fitted(receivers, free, 4).response([EnvironmentLight(np.ones((4, 8, 3), np.float32))]).any()


@pytest.fixture(scope="module")
def rooms() -> PcaVisibility:
    """What the walls of two rooms with a door see."""
    return pca_visibility(STARTS, NORMALS, EmbreeTriangles(DOOR.corners), DOOR.free, 25)


@pytest.mark.lengthy
def test_few_points_of_two_rooms_are_misclassified(rooms: PcaVisibility) -> None:
    exact = RayShadows(STARTS, EmbreeTriangles(DOOR.corners))
    wrong = total = 0
    for place in DOOR.free[:20]:
        vector = place - STARTS
        distance = np.linalg.norm(vector, axis=1)
        toward = vector / distance[:, None]
        facing = np.flatnonzero(np.einsum("nc,nc->n", toward, NORMALS) > 0)
        seen = rooms.visible(facing, toward[facing], distance[facing])
        wrong += int(((seen >= 0.5) != exact.visible(facing, toward[facing], distance[facing])).sum())
        total += len(facing)
    assert wrong < 0.03 * total and total > 3000
    assert rooms.byte_count() < 2025 * len(STARTS)


def test_points_are_taken_in_parts(rooms: PcaVisibility, monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.arange(0, len(rooms.normals), 7)
    toward = random_directions(len(points), "sphere", np.random.default_rng(4))
    distance = np.full(len(points), 1.0)
    whole = rooms.visible(points, toward, distance)
    monkeypatch.setattr("srbf.visibility.pca_visibility.MOST_AT_ONCE", 50)
    np.testing.assert_array_equal(rooms.visible(points, toward, distance), whole)
