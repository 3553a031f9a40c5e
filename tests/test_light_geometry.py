"""Irradiance of lights with a size: closed forms, sums over many points, limits."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.light_geometry import area_samples, points_on
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, NamedLight, PointLight, SphereLight, SpotLight
from srbf.sphere import normalize, point_set
from srbf.unshadowed import irradiance_from

SIDE = 250  # points per side of a light that is summed
SUMMED = 4e-3  # such sums, relative to the largest
UP = np.array([[0.0, 0.0, 1.0]])


def surfaces(count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Points about the origin that face anywhere."""
    rng = np.random.default_rng(0)
    return rng.uniform(-1, 1, (count, 3)), normalize(rng.normal(size=(count, 3)))


def summed(points: np.ndarray, facing: np.ndarray, areas: float, place: np.ndarray, normal: np.ndarray) -> float:
    """The integral of cos_l cos_x / r^2 over points of a surface."""
    vector = points - place
    squared = (vector**2).sum(axis=1)
    toward = vector / np.sqrt(squared)[:, None]
    return float((np.maximum(-(toward * facing).sum(axis=1), 0) * np.maximum(toward @ normal, 0) / squared).sum() * areas)


def test_an_area_is_the_integral_over_it() -> None:
    light = AreaLight((0.1, 0.0, 1.5), u=(0.6, 0.1, 0.0), v=(0.0, -0.3, 0.5), a0=1.5)
    steps = (np.arange(SIDE) + 0.5) / SIDE
    points = points_on(light, np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2))
    places, normals = surfaces()
    exact = irradiance_from(light, places, normals)
    expected = [summed(points, np.array(light.direction), light.a0**2 / SIDE**2, p, n) for p, n in zip(places, normals, strict=True)]
    assert (exact > 0).sum() > 10 and (exact == 0).any()
    np.testing.assert_allclose(exact, expected, atol=SUMMED * exact.max())


def test_a_sphere_is_the_integral_over_it() -> None:
    light = SphereLight((0.1, 0.0, 0.3), size=0.35)
    outward = point_set("fibonacci", SIDE**2, "sphere")
    places, normals = surfaces()
    outside = np.linalg.norm(places - light.position, axis=1) > 1.3 * light.size
    exact = irradiance_from(light, places[outside], normals[outside])
    radiance = light.a0**2 / (np.pi * light.size**2)
    area = 4 * np.pi * light.size**2 / SIDE**2
    points = np.array(light.position) + light.size * outward
    expected = [radiance * summed(points, outward, area, p, n) for p, n in zip(places[outside], normals[outside], strict=True)]
    np.testing.assert_allclose(exact, expected, atol=SUMMED * exact.max())
    toward = normalize(np.array(light.position) - places[outside])
    sine = light.size / np.linalg.norm(np.array(light.position) - places[outside], axis=1)
    assert (np.abs((toward * normals[outside]).sum(axis=1)) < sine).sum() > 5  # cut by the horizon


def test_far_away_they_are_point_lights() -> None:
    places = np.array([[0.0, 0.0, -40.0], [10.0, 5.0, -40.0]])
    normals = np.repeat(UP, 2, axis=0)
    point = irradiance_from(PointLight((0, 0, 0), a0=2, falloff="inverse-square"), places, normals)
    sphere = irradiance_from(SphereLight((0, 0, 0), size=0.3, a0=2), places, normals)
    np.testing.assert_allclose(sphere, point, rtol=1e-9)
    area = irradiance_from(AreaLight((0, 0, 0), u=(0.3, 0, 0), v=(0, -0.4, 0), a0=2), places, normals)
    cosine = 40 / np.linalg.norm(places, axis=1)
    np.testing.assert_allclose(area, point * cosine, rtol=1e-3)


def test_close_to_an_area_it_fills_the_half_space() -> None:
    light = AreaLight((0, 0, 1e-3), u=(2, 0, 0), v=(0, -2, 0), a0=1.0)
    assert irradiance_from(light, np.zeros((1, 3)), UP)[0] == pytest.approx(np.pi * light.a0**2 / light.area, rel=1e-2)
    assert irradiance_from(light, np.array([[0.0, 0.0, 1e-3]]), UP)[0] == 0  # in its plane
    assert irradiance_from(light, np.array([[0.0, 0.0, 0.5]]), -UP)[0] == 0  # behind it


def test_the_parts_of_an_area_add_up() -> None:
    places, normals = surfaces(200)
    whole = AreaLight((0, 0, 1.2), u=(1, 0, 0), v=(0, -0.5, 0.3))
    halves = [AreaLight((x, 0, 1.2), u=(0.5, 0, 0), v=(0, -0.5, 0.3)) for x in (-0.25, 0.25)]
    parts = np.mean([irradiance_from(half, places, normals) for half in halves], axis=0)
    np.testing.assert_allclose(parts, irradiance_from(whole, places, normals), atol=1e-12)


def test_lights_without_a_size() -> None:
    assert irradiance_from(DirectionalLight((0, 0.6, 0.8)), np.zeros((1, 3)), UP).tolist() == pytest.approx([0.8])
    spot = SpotLight((0, 0, 2), direction=(0, 0, -1), inner=0.1, outer=0.2, falloff="inverse-square")
    found = irradiance_from(spot, np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 2]]), np.repeat(UP, 3, axis=0))
    assert found.tolist() == pytest.approx([0.25, 0, 0]) and np.isfinite(found).all()


@pytest.mark.parametrize("light", [NamedLight("Window"), EnvironmentLight(np.ones((2, 4, 3), np.float32))])
def test_lights_without_a_place_are_refused(light: Light) -> None:
    with pytest.raises(InputError, match="place or a direction"):
        irradiance_from(light, np.zeros((1, 3)), UP)


@pytest.mark.parametrize("count", [1, 16, 37])
def test_samples_of_an_area_are_spread_over_it(count: int) -> None:
    light = AreaLight((1, 2, 3), u=(2, 0, 0), v=(0, 0, 1))
    points, shares = area_samples(light, count)
    assert points.shape == (count, 3) and shares.sum() == pytest.approx(1)
    np.testing.assert_allclose((points * shares[:, None]).sum(axis=0), light.position, atol=1 / count)
    assert (np.abs(points - light.position) <= [1, 0, 0.5]).all()
