"""The shadow map against rays, away from edges and everywhere on average; and what it refuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from closed_forms import ball, build_plane, quad
from rounded import lightmap, sphere, torus
from scipy import ndimage

from srbf.lights import DirectionalLight, EnvironmentLight, NamedLight
from srbf.sphere import random_directions
from srbf.visibility.rays import RayTracer
from srbf.visibility.shadow_map import ShadowMapper

NEAR = 1e-5  # sums in single precision
PSNR = 40.0  # dB of direct light, its peak 1, against closed forms and rays
EDGES = 0.05  # rms where 3 x 3 texels of a 2048-texel map are softer than a ray


@pytest.fixture(scope="module")
def scene() -> Any:
    pane = quad([0.2, -0.9, 0.3], [0.9, -0.9, 0.5], [0.9, 0.9, 0.5], [0.2, 0.9, 0.3])
    transmittance = np.linspace(0.2, 1.2, 24).reshape(8, 3)
    return build_plane(
        ball(0.4, [-0.4, 0, 0.6]), panes=(pane, pane + np.float32([0, 0, 0.2])), transmittance=transmittance, size=64, footprint=1.0
    )


@pytest.mark.lengthy
@pytest.mark.parametrize("number", range(4))
def test_it_equals_rays_away_from_edges(context: Any, scene: Any, number: int) -> None:
    direction = random_directions(4, "hemisphere", np.random.default_rng(5))[number]
    direction = (direction + [0, 0, 0.3]) / np.linalg.norm(direction + [0, 0, 0.3])
    rays = RayTracer(scene).directional(direction[None])[0]
    with ShadowMapper(scene, context=context) as mapper:
        mapped = mapper.directional(direction[None])[0]
    spread = ndimage.maximum_filter(rays, (5, 5, 1)) - ndimage.minimum_filter(rays, (5, 5, 1))
    inside = spread.max(axis=2) < 0.02
    assert inside.mean() > 0.5 and rays[inside].min() < rays[inside].max()
    np.testing.assert_allclose(mapped[inside], rays[inside], atol=0.01)  # half floats of the transmittances
    assert np.sqrt(((mapped - rays) ** 2).mean()) < EDGES


def test_an_open_plane_never_shades_itself(context: Any) -> None:
    receivers = build_plane(size=64)
    with ShadowMapper(receivers, context=context) as mapper:
        for z in (1.0, 0.5, 0.1):
            light = DirectionalLight((np.sqrt(1 - z * z), 0.0, z), (1.0, 2.0, 3.0))
            expected = np.broadcast_to(z * np.array([1, 2, 3]), (64, 64, 3))
            np.testing.assert_allclose(mapper.response([light]), expected, rtol=NEAR)


@pytest.mark.lengthy
def test_a_wide_sun_softens_it(context: Any) -> None:
    roof = quad([-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5])
    receivers = build_plane(roof, footprint=0.05, sun_angle=0.8)
    up = np.array([[0.0, 0.0, 1.0]])
    with ShadowMapper(receivers, context=context) as mapper:
        mapped = mapper.directional(up)[0, ..., 0]
    np.testing.assert_allclose(mapped.mean(axis=0), RayTracer(receivers).directional(up)[0, ..., 0].mean(axis=0), atol=0.05)


def test_environments_and_named_lights_add_nothing(context: Any) -> None:
    with ShadowMapper(build_plane(), context=context) as mapper:
        lights = [EnvironmentLight(np.ones((4, 8, 3), np.float32)), NamedLight("Window")]
        assert (mapper.response(lights) == 0).all()


@pytest.mark.parametrize("smooth", [False, True], ids=["flat", "smooth"])
@pytest.mark.parametrize(("faces", "size"), [((12, 6), 64), ((24, 12), 48), pytest.param((64, 32), 160, marks=pytest.mark.slow)])
def test_a_ball_alone_has_no_stripes(context: Any, faces: tuple[int, int], size: int, smooth: bool) -> None:
    """Its light is N.L at every covered texel: nothing convex shades itself."""
    made = lightmap(sphere, *faces, size, smooth, footprint=0.5 if not smooth else 1e-4)
    covered = made.receivers.images["coverage"] > 0
    normal = made.receivers.images["normal"] if smooth else made.face
    with ShadowMapper(made.receivers, context=context) as mapper:
        for sun in random_directions(3, "sphere", np.random.default_rng(2)):
            error = mapper.directional(sun[None])[0, ..., 0] - np.maximum(normal @ sun, 0)
            assert -10 * np.log10((error[covered] ** 2).mean()) > PSNR
            assert np.abs(error[covered]).max() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("mapped", [True, False], ids=["with coordinates", "without"])
@pytest.mark.parametrize("smooth", [False, True], ids=["flat", "smooth"])
def test_a_torus_shades_itself_as_by_rays(context: Any, smooth: bool, mapped: bool) -> None:
    made = lightmap(torus, 36, 14, 96, smooth, mapped=mapped)
    covered = made.receivers.images["coverage"] > 0
    suns = random_directions(2, "sphere", np.random.default_rng(4))
    rays = RayTracer(made.receivers).directional(suns)
    with ShadowMapper(made.receivers, context=context) as mapper:
        error = (mapper.directional(suns) - rays)[:, covered]
    assert (rays[:, covered] == 0).any()
    assert -10 * np.log10((error**2).mean()) > PSNR
