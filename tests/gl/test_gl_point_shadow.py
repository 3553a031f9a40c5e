"""Shadow maps of lights inside a scene against rays: a whole room, panes, rounded surfaces, planes that nothing shades."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from closed_forms import build_plane, quad
from made_profiles import picture, uneven
from rooms import room
from rounded import lightmap, sphere

from srbf.light_profile import Profile
from srbf.lights import AreaLight, Light, PointLight, SphereLight, SpotLight
from srbf.unshadowed import irradiance_from
from srbf.visibility.rays import RayTracer
from srbf.visibility.shadow_map import ShadowMapper

SIDE = 1024  # texels per side of maps, half of what ships: the bars below hold, and the software renderer takes half the time
PSNR = 45.0  # dB of the room's light, its peak the 99.9 % quantile; 50 to 65 measured
LIGHTS: dict[str, Light] = {
    "point": PointLight((0.1, -0.1, 1.6), falloff="inverse-square"),
    "point near a wall": PointLight((-0.85, 0.2, 1.3)),
    "narrow spot": SpotLight((-0.7, -0.7, 1.8), direction=(0.6, 0.6, -1.2), inner=0.4, outer=0.6, falloff="inverse-square"),
    "wide spot": SpotLight((-0.7, -0.7, 1.0), direction=(0.6, 0.6, -0.2), inner=1.2, outer=1.5, falloff="inverse-square"),
    "spot with a size": SpotLight((-0.7, -0.7, 1.8), direction=(0.6, 0.6, -1.2), inner=0.4, outer=0.6, falloff="inverse-square", size=0.12),
    "wide spot with a size": SpotLight(
        (-0.7, -0.7, 1.0), direction=(0.6, 0.6, -0.2), inner=1.2, outer=1.5, falloff="inverse-square", size=0.12
    ),
    "sphere": SphereLight((0.1, -0.1, 1.6), size=0.15),
    "ies": PointLight((0.1, -0.1, 1.6), falloff="inverse-square", direction=(0.5, 0.2, -1), roll=0.3, profile=uneven),
    "picture": SpotLight(
        (-0.7, -0.7, 1.8),
        direction=(0.6, 0.6, -1.2),
        inner=0.4,
        outer=0.6,
        falloff="inverse-square",
        profile=Profile(picture(), projected=True),
    ),
    "sphere with a profile": SphereLight((0.1, -0.1, 1.6), size=0.15, roll=0.3, profile=uneven),
    "area": AreaLight((0.0, 0.0, 1.99), u=(0.6, 0, 0), v=(0, -0.6, 0)),
}


@pytest.fixture(scope="module")
def closed_room() -> Any:
    return room(64)


@pytest.fixture(scope="module")
def mapper(context: Any, closed_room: Any) -> Any:
    with ShadowMapper(closed_room, size=SIDE, context=context) as made:
        yield made


@pytest.mark.lengthy
@pytest.mark.parametrize("kind", LIGHTS)
def test_a_room_is_lit_as_by_rays(mapper: Any, closed_room: Any, kind: str) -> None:
    covered = closed_room.images["coverage"] > 0
    rays = RayTracer(closed_room).response([LIGHTS[kind]])[covered]
    mapped = mapper.response([LIGHTS[kind]])[covered]
    peak = np.quantile(rays, 0.999)
    assert -10 * np.log10((((mapped - rays) / peak) ** 2).mean()) > PSNR
    assert mapped.mean() == pytest.approx(rays.mean(), rel=0.01)
    assert (mapped[rays.max(axis=1) == 0] < 0.05 * peak).all()  # no light gets into shadows


@pytest.mark.lengthy
def test_lights_add_up_and_scale(mapper: Any) -> None:
    point, area = LIGHTS["point"], LIGHTS["area"]
    colored = PointLight(point.position, (2.0, 0.5, 0.0), falloff="inverse-square")  # type: ignore[union-attr]
    both = mapper.response([colored, area])
    np.testing.assert_allclose(
        both, mapper.response([point]) * np.array([2, 0.5, 0], np.float32) + mapper.response([area]), rtol=1e-4, atol=1e-6
    )


@pytest.mark.lengthy
@pytest.mark.parametrize("kind", ["point", "narrow spot", "wide spot", "spot with a size", "sphere", "area"])
def test_nothing_shades_an_open_plane(context: Any, kind: str) -> None:
    receivers = build_plane(size=48, half=2.0, footprint=0.1)
    light = LIGHTS[kind]
    place, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    expected = irradiance_from(light, place, normal)
    with ShadowMapper(receivers, size=SIDE, context=context) as mapper:
        found = mapper.response([light])[..., 0].ravel()
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=2e-3 * expected.max())


def test_grazing_light_does_not_shade_its_plane(context: Any) -> None:
    receivers = build_plane(size=48, footprint=0.1)
    light = PointLight((-0.9, 0.0, 0.02))
    place, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    expected = irradiance_from(light, place, normal).reshape(48, 48)
    with ShadowMapper(receivers, size=SIDE, context=context) as mapper:
        found = mapper.response([light])[..., 0]
    far = np.abs(receivers.images["position"][..., 0] + 0.9) > 0.2
    assert (found[far] > 0.9 * expected[far]).all()


@pytest.mark.lengthy
def test_panes_multiply_by_their_transmittance(context: Any) -> None:
    pane = quad([-0.5, -0.5, 0.9], [0.5, -0.5, 0.9], [0.5, 0.5, 0.9], [-0.5, 0.5, 0.9])
    receivers = room(64, np.concatenate([pane, pane + np.array([0, 0, 0.1], np.float32)]), passed=0.5)
    covered = receivers.images["coverage"] > 0
    rays = RayTracer(receivers)
    with ShadowMapper(receivers, size=SIDE, context=context) as mapper:
        for light in (LIGHTS["point"], LIGHTS["area"]):
            expected, found = rays.response([light])[covered], mapper.response([light])[covered]
            peak = np.quantile(expected, 0.999)
            assert -10 * np.log10((((found - expected) / peak) ** 2).mean()) > PSNR - 5
    clear = RayTracer(room(64)).response([LIGHTS["point"]])[covered]
    ratio = rays.response([LIGHTS["point"]])[covered][clear > 0] / clear[clear > 0]
    assert ((ratio > 0.24) & (ratio < 0.26)).any()


@pytest.mark.parametrize("smooth", [False, True], ids=["flat", "smooth"])
def test_a_ball_about_a_light_and_one_beside_it_have_no_stripes(context: Any, smooth: bool) -> None:
    """Nothing convex shades itself."""
    made = lightmap(sphere, 24, 12, 48, smooth, footprint=1e-4)
    covered = made.receivers.images["coverage"] > 0
    normal = made.receivers.images["normal"] if smooth else made.face
    light = PointLight((2.0, 1.0, 1.5), falloff="inverse-square", a0=2.0)
    expected = irradiance_from(light, made.receivers.images["position"].reshape(-1, 3), normal.reshape(-1, 3)).reshape(covered.shape)
    with ShadowMapper(made.receivers, size=SIDE, context=context) as mapper:
        error = (mapper.response([light])[..., 0] - expected)[covered]
    assert np.sqrt((error**2).mean()) < 0.005 * expected[covered].max() and np.abs(error).max() < 0.05 * expected[covered].max()


@pytest.mark.lengthy
def test_two_rooms_without_a_door_exchange_no_light(context: Any) -> None:
    wall = quad([0, -9, -1], [0, 9, -1], [0, 9, 9], [0, -9, 9])
    receivers = build_plane(wall, size=48)
    beyond = receivers.images["position"][..., 0] < -0.05
    with ShadowMapper(receivers, size=SIDE, context=context) as mapper:
        for light in (
            PointLight((0.3, 0, 0.5)),
            SphereLight((0.3, 0, 0.5), size=0.2),
            AreaLight((0.3, 0, 0.5), u=(0, 0.2, 0), v=(0, 0, 0.2)),
        ):
            found = mapper.response([light])[..., 0]
            assert found.max() > 0 or isinstance(light, AreaLight)
            assert (found[beyond] == 0).all()
