"""Lights: what they accept, attenuation, the cone, and the environment's samples."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.light_geometry import attenuation, environment_samples, light_vectors, spot_cone
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, NamedLight, PointLight, SphereLight, SpotLight, moved

IDENTITY = np.eye(3)


def test_directions_are_normalised() -> None:
    assert DirectionalLight((0, 0, 2)).direction == (0, 0, 1)
    spot = SpotLight((0, 0, 1), direction=(0, 0, -5), inner=0.1, outer=0.2)
    assert spot.direction == (0, 0, -1)


@pytest.mark.parametrize(
    "make",
    [
        lambda: DirectionalLight((0, 0, 0)),
        lambda: DirectionalLight((0, float("nan"), 1)),
        lambda: PointLight((0, 0, 1), a0=0),
        lambda: PointLight((0, 0, 1), radius=-1),
        lambda: PointLight((0, 0, 1), falloff="cubic"),  # type: ignore[arg-type]
        lambda: SpotLight((0, 0, 1), direction=(0, 0, -1), inner=0.3, outer=0.2),
        lambda: SphereLight((0, 0, 1), size=0),
        lambda: SphereLight((0, 0, 1), size=float("inf")),
        lambda: AreaLight((0, 0, 1), u=(1, 0, 0), v=(-2, 0, 0)),
        lambda: AreaLight((0, 0, 1), u=(1, 0, 0), v=(0, 0, 0)),
        lambda: AreaLight((0, 0, 1), u=(1, 0, 0), v=(0, 1, 0), a0=0),
        lambda: NamedLight(""),
        lambda: NamedLight("Window", (1, 2)),  # type: ignore[arg-type]
        lambda: EnvironmentLight(np.full((2, 4, 3), np.nan, np.float32)),
    ],
)
def test_bad_lights_are_refused(make: object) -> None:
    with pytest.raises((InputError, TypeError)):
        make()  # type: ignore[operator]


def test_attenuation_closed_forms() -> None:
    distance = np.array([0.0, 0.5, 2.0])
    linear = PointLight((0, 0, 0), a0=3, radius=0.25)
    np.testing.assert_allclose(attenuation(distance, linear), [12, 6, 1.5])
    square = PointLight((0, 0, 0), a0=3, radius=0.25, falloff="inverse-square")
    np.testing.assert_allclose(attenuation(distance, square), [144, 36, 2.25])


def test_spot_cone_is_full_inside_none_outside_and_monotonic() -> None:
    inner, outer = np.cos(0.2), np.cos(0.5)
    angles = np.linspace(0, np.pi, 500)
    cone = spot_cone(np.cos(angles), inner, outer)
    assert (cone[angles <= 0.2] == 1).all() and (cone[angles >= 0.5001] == 0).all()
    assert (np.diff(cone) <= 0).all()
    step = spot_cone(np.cos(angles), inner, inner)
    assert set(np.unique(step)) <= {0.0, 1.0}


@pytest.mark.parametrize("height", [8, 9])  # with and without a row that straddles the horizon
@pytest.mark.parametrize(("domain", "area"), [("sphere", 4 * np.pi), ("hemisphere", 2 * np.pi)])
def test_environment_solid_angles_add_up(height: int, domain: str, area: float) -> None:
    directions, solid_angle = environment_samples(np.ones((height, 16, 3), np.float32), domain, IDENTITY)
    assert solid_angle.sum() == pytest.approx(area, rel=1e-12)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1, atol=1e-12)


def test_environment_axes() -> None:
    directions, _ = environment_samples(np.ones((90, 360, 3), np.float32), "sphere", IDENTITY)
    assert directions[0, 0, 2] > 0.99 and directions[-1, 0, 2] < -0.99  # top row towards +z
    np.testing.assert_allclose(directions[45, 180, :2], [1, 0], atol=0.05)  # u = 1/2 is azimuth 0, +x
    np.testing.assert_allclose(directions[45, 90, :2], [0, 1], atol=0.05)  # u = 1/4 is +y


def test_moved_carries_lights_along() -> None:
    matrix = np.array([[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1.0]])  # quarter turn, twice as large, 1 m along x
    assert moved(DirectionalLight((1, 0, 0)), matrix).direction == pytest.approx((0, 1, 0))
    point_light = moved(PointLight((1, 0, 3), a0=2), matrix)
    assert point_light.position == pytest.approx((1, 2, 6)) and point_light.a0 == pytest.approx(4)
    spot = moved(SpotLight((0, 0, 0), direction=(1, 0, 0), inner=0.1, outer=0.2), matrix)
    assert spot.direction == pytest.approx((0, 1, 0)) and spot.inner == 0.1
    sphere = moved(SphereLight((1, 0, 3), size=0.5, a0=2), matrix)
    assert sphere.position == pytest.approx((1, 2, 6)) and (sphere.size, sphere.radius, sphere.a0) == pytest.approx((1, 1, 4))
    area = moved(AreaLight((1, 0, 3), u=(1, 0, 0), v=(0, 0, 1), a0=2), matrix)
    assert area.position == pytest.approx((1, 2, 6)) and area.a0 == pytest.approx(4)
    assert area.u == pytest.approx((0, 2, 0)) and area.v == pytest.approx((0, 0, 2)) and area.direction == pytest.approx((1, 0, 0))
    window = NamedLight("Window", (2, 1, 1))
    assert moved(window, matrix) is window


def test_a_sphere_is_its_center_from_outside_and_no_brighter_inside() -> None:
    sphere, center = SphereLight((0, 0, 1), size=0.25, a0=2), PointLight((0, 0, 1), a0=2, falloff="inverse-square")
    positions = np.array([[0, 0, 3], [1, 2, 0], [0, 0, 1.2]])
    np.testing.assert_array_equal(light_vectors(sphere, positions)[0], light_vectors(center, positions)[0])
    strength, expected = light_vectors(sphere, positions)[1], light_vectors(center, positions)[1]
    np.testing.assert_allclose(strength[:2], expected[:2])
    assert strength[2] == pytest.approx(2**2 / 0.25**2)
