"""Direct light by rays against closed forms: cosines, shadow edges, penumbrae, transmittance, point lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from closed_forms import quad

from srbf.errors import InputError
from srbf.io.scene_glb import KNOTS
from srbf.lights import DirectionalLight, EnvironmentLight, PointLight, SpotLight
from srbf.sphere import normalize
from srbf.visibility.rays import RAY_OFFSET, SAMPLES, RayTracer
from srbf.visibility.receivers import Receivers

ROUNDING = 1e-6
TEXEL = 2 / SAMPLES  # a fraction of a texel's area by SAMPLES even points is that near at least


def columns(size: int = 40) -> np.ndarray:
    return -1 + 2 * (np.arange(size) + 0.5) / size


@pytest.mark.parametrize("direction", [(0, 0, 1), (0.6, 0, 0.8), (-0.3, 0.5, 0.2)])
def test_an_open_plane_responds_with_its_cosine(plane, direction) -> None:
    unit = normalize(np.array(direction, float))
    light = DirectionalLight(tuple(unit), (1.0, 2.0, 0.5))
    np.testing.assert_allclose(
        RayTracer(plane()).response([light]), np.broadcast_to(unit[2] * np.array(light.color), (40, 40, 3)), rtol=ROUNDING
    )


def test_radiance_is_albedo_over_pi_times_irradiance(plane) -> None:
    found = RayTracer(plane(albedo=(0.8, 0.4, 0.2))).response([DirectionalLight((0.0, 0.6, 0.8))])
    np.testing.assert_allclose(found, np.broadcast_to(np.array([0.8, 0.4, 0.2]) * 0.8 / np.pi, found.shape), rtol=ROUNDING)


def test_light_from_below_the_surface_gives_nothing(plane) -> None:
    assert (RayTracer(plane()).response([DirectionalLight((0.3, 0.1, -0.9))]) == 0).all()


@pytest.mark.parametrize("slope", [-0.7, 0.0, 0.4, 0.913])
def test_a_roof_edge_casts_its_shadow_where_geometry_says(plane, roof, slope) -> None:
    """The edge at x = 0, z = 1/2 falls at x = -slope / 2; each texel holds the part of it that is lit."""
    direction = normalize(np.array([slope, 0.0, 1.0]))
    found = RayTracer(plane(roof, footprint=1.0)).response([DirectionalLight(tuple(direction))])[..., 0] / direction[2]
    edge = -slope / 2
    expected = np.clip((columns() + 1 / 40 - edge) * 20, 0, 1)
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=TEXEL)
    assert found.mean() == pytest.approx(expected.mean(), abs=TEXEL / 40 / 4)


def test_a_ball_shades_its_disc(plane, sphere) -> None:
    found = RayTracer(plane(sphere, footprint=1.0, size=64)).response([DirectionalLight((0.0, 0.0, 1.0))])[..., 0]
    assert (1 - found).mean() * 4 == pytest.approx(np.pi * 0.4**2, rel=0.01)  # 64 steps of polygon: 0.2 % less


@pytest.mark.lengthy
def test_a_wide_sun_makes_a_penumbra_of_its_width(plane, roof) -> None:
    """Straight below, the part of a disc seen past an edge: (acos(-t) + t sqrt(1 - t^2)) / pi, t = x / (h tan(angle / 2))."""
    angle = 0.8
    found = RayTracer(plane(roof, footprint=0.05, sun_angle=angle), samples=256).response([DirectionalLight((0.0, 0.0, 1.0))])[..., 0]
    t = np.clip(columns() / (0.5 * np.tan(angle / 2)), -1, 1)
    expected = (np.arccos(-t) + t * np.sqrt(1 - t * t)) / np.pi
    cosine = found[:, -1].mean()  # of the disc's mean direction
    np.testing.assert_allclose(found.mean(axis=0) / cosine, expected, atol=0.01)


def test_panes_multiply_by_their_tint(plane, pane) -> None:
    found = RayTracer(plane(panes=(pane, pane + np.float32([0, 0, 0.1])))).response([DirectionalLight((0.0, 0.0, 1.0))])
    np.testing.assert_allclose(found[:, :15], 0.25, rtol=1e-5)
    np.testing.assert_allclose(found[:, 25:], 1, rtol=1e-5)


def test_a_tint_follows_the_angle(plane, pane) -> None:
    cosines = np.linspace(0, 1, KNOTS)
    transmittance = np.stack([cosines, cosines**2, 1.5 * cosines], axis=1)
    for sine in (0.0, 0.28, 0.6):
        cosine = np.sqrt(1 - sine * sine)
        found = RayTracer(plane(panes=(pane,), transmittance=transmittance)).response([DirectionalLight((-sine, 0.0, cosine))])[:, 0]
        expected = [np.interp(cosine, cosines, transmittance[:, c]) * cosine for c in range(3)]
        np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), rtol=1e-4)


def test_opaque_walls_behind_a_pane_still_shade(plane, pane, roof) -> None:
    found = RayTracer(plane(roof + np.float32([0, 0, 0.2]), panes=(pane,))).response([DirectionalLight((0.0, 0.0, 1.0))])
    assert (found[:, :15] == 0).all()


@pytest.mark.parametrize("falloff", ["linear", "inverse-square"])
def test_a_point_light_falls_off_and_is_shadowed(plane, roof, falloff) -> None:
    point_light = PointLight((0.5, 0.0, 1.0), (2.0, 1.0, 1.0), a0=1.5, falloff=falloff)
    receivers = plane(roof, footprint=1e-3)
    found = RayTracer(receivers).response([point_light])
    vector = np.array(point_light.position) - receivers.images["position"]
    distance = np.linalg.norm(vector, axis=2)
    strength = (1.5 / distance) ** (1 if falloff == "linear" else 2) * vector[..., 2] / distance
    lit = receivers.images["position"][..., 0] > -0.5  # the edge at (0, 1/2) seen from (1/2, 1)
    clear = np.abs(receivers.images["position"][..., 0] + 0.5) > 0.03
    np.testing.assert_allclose(found[..., 0][lit & clear], 2 * strength[lit & clear], rtol=1e-4)
    assert (found[~lit & clear] == 0).all()
    beyond = PointLight((0.5, 0.0, 0.3), falloff=falloff)  # below the roof: nothing is between
    assert (RayTracer(receivers).response([beyond]) > 0).all()


def test_a_spot_is_a_point_times_its_cone(plane) -> None:
    spot = SpotLight((0.0, 0.0, 1.0), direction=(0.0, 0.0, -1.0), inner=0.3, outer=0.4)
    found = RayTracer(plane()).response([spot])[..., 0]
    x = columns()
    radius = np.hypot(x[None, :], x[:, None])
    assert (found[radius > np.tan(0.4) + 0.05] == 0).all()
    point = RayTracer(plane()).response([PointLight((0.0, 0.0, 1.0))])[..., 0]
    np.testing.assert_allclose(found[radius < np.tan(0.3) - 0.05], point[radius < np.tan(0.3) - 0.05], rtol=1e-3)


def test_an_even_environment_adds_pi_times_its_radiance(plane) -> None:
    """To an open plane; beside an endless wall half of it."""
    environment = EnvironmentLight(np.full((4, 8, 3), 0.5, np.float32), color=(2.0, 1.0, 0.0))
    found = RayTracer(plane(size=8)).response([environment])
    np.testing.assert_allclose(found, np.broadcast_to([np.pi, np.pi / 2, 0], found.shape), rtol=0.04)
    np.testing.assert_allclose(found.mean(axis=(0, 1)), [np.pi, np.pi / 2, 0], rtol=0.004)
    wall = quad([1, -90, 0], [1, 90, 0], [1, 90, 90], [1, -90, 90])
    assert RayTracer(plane(wall, size=8)).response([environment])[:, -1, 0].mean() == pytest.approx(np.pi / 2, rel=0.02)


def test_a_small_bright_sun_in_a_map_is_found(plane) -> None:
    """As a directional light of its irradiance, with the shadow of a roof."""
    image = np.full((90, 180, 3), 1e-4, np.float32)
    image[10, 60] = 1000.0
    elevation, azimuth = np.pi / 2 - 10.5 * np.pi / 90, (0.5 - 60.5 / 180) * 2 * np.pi
    toward = (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation))
    sun = DirectionalLight(toward, (1000.0 * (np.pi / 90) ** 2 * np.cos(elevation),) * 3)
    tracer = RayTracer(plane(quad([0, -9, 0.2], [9, -9, 0.2], [9, 9, 0.2], [0, 9, 0.2]), size=16))
    found, expected = tracer.response([EnvironmentLight(image)])[..., 0], tracer.response([sun])[..., 0]
    sharp = np.abs(np.diff(expected, axis=1, append=expected[:, -1:])) + np.abs(np.diff(expected, axis=1, prepend=expected[:, :1])) < 0.01
    np.testing.assert_allclose(found[sharp], expected[sharp], atol=0.02 * expected.max())
    assert expected.min() == 0 < expected.max()


@pytest.mark.lengthy
def test_many_lights_add_up_and_runs_repeat(plane, sphere) -> None:
    one, two = DirectionalLight((0.3, 0.1, 0.8)), PointLight((0.5, -0.4, 1.3), (0.5, 0.2, 1.0))
    tracer = RayTracer(plane(sphere))
    np.testing.assert_allclose(tracer.response([one, two]), tracer.response([one]) + tracer.response([two]), rtol=1e-5, atol=1e-6)
    assert (RayTracer(plane(sphere)).response([one]) == tracer.response([one])).all()


def test_a_smooth_ball_has_no_terminator_blocks(smooth_ball) -> None:
    """On a coarse ball with rounded normals, light that the polygons shade though the rounded surface would not is let in."""
    sun = DirectionalLight((-0.7, 0.2, -0.3))
    expected = np.maximum(smooth_ball.images["normal"] @ np.array(sun.direction), 0)
    np.testing.assert_allclose(RayTracer(smooth_ball).response([sun])[..., 0], expected, atol=1e-5)
    unrounded = replace(smooth_ball.triangles, normals=np.zeros_like(smooth_ball.triangles.normals))
    blocky = RayTracer(replace(smooth_ball, triangles=unrounded)).response([sun])[..., 0]
    assert ((blocky == 0) & (expected > 0)).any()


def test_the_lift_is_small_against_a_texel(plane) -> None:
    """A box that stands on the plane shades right up to its foot."""
    assert RAY_OFFSET < 1e-4
    wall = np.array([[[0, -9, 0], [0, 9, 0], [0, 9, 2]], [[0, -9, 0], [0, 9, 2], [0, -9, 2]]], np.float32)
    found = RayTracer(plane(wall, footprint=1e-3)).response([DirectionalLight((-0.8, 0.0, 0.6))])[..., 0]
    np.testing.assert_allclose(found[:, 0:20], 0.6, rtol=1e-5)
    assert (found[:, 20:] == 0).all()


def test_what_is_missing_is_named(make_capture, plane_positions) -> None:
    capture = make_capture(lambda direction: np.ones((10, 14, 3)), position=plane_positions)
    with pytest.raises(InputError, match="scene.glb"):
        Receivers.of(capture)
