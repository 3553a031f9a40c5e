"""Direct light of lights inside the scene by rays: what nothing shades is exact, penumbrae are what an edge leaves of a light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from closed_forms import build_plane, quad
from rooms import room

from srbf.lights import AreaLight, DirectionalLight, Light, NamedLight, PointLight, SphereLight, SpotLight
from srbf.unshadowed import irradiance_from
from srbf.visibility.rays import RayTracer

TEXEL = 5e-3  # relative: a texel's mean and its center
PENUMBRA = 0.02  # of the unshadowed light: up to 512 points of a light
CONE = 0.03  # of the unshadowed light, at a hard edge: points of a sphere by rays, and 64 by which the closed form knows it
LIGHTS: dict[str, Light] = {
    "point": PointLight((0.2, 0.1, 0.8), falloff="inverse-square"),
    "spot": SpotLight((0.2, 0.1, 0.8), direction=(0, 0, -1), inner=1.2, outer=1.4, falloff="inverse-square"),
    "sphere": SphereLight((0.2, 0.1, 0.8), size=0.25),
    "sphere cut by the horizon": SphereLight((0.2, 0.1, 0.05), size=0.3),
    "area": AreaLight((0.2, 0.1, 0.8), u=(0.5, 0, 0), v=(0, -0.4, 0.2)),
    "upright area": AreaLight((0.2, 0.1, 0.2), u=(0, 0.8, 0), v=(0, 0, 0.8)),
}
SPOTS = {
    "spot with a size": SpotLight((0.2, 0.1, 0.8), direction=(0, 0.2, -1), inner=0.5, outer=0.8, falloff="inverse-square", size=0.2),
    "hard spot with a size": SpotLight((0.2, 0.1, 0.8), direction=(0, 0, -1), inner=0.6, outer=0.6, falloff="inverse-square", size=0.1),
}
WIDE = SpotLight((0, 0, 1.0), direction=(0, 0, -1), inner=1.5, outer=1.5, falloff="inverse-square", size=0.1)


@pytest.mark.parametrize("kind", LIGHTS)
def test_an_open_plane_has_the_closed_form(kind: str) -> None:
    receivers = build_plane(footprint=0.2)
    found = RayTracer(receivers).response([LIGHTS[kind]])[..., 0]
    place, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    expected = irradiance_from(LIGHTS[kind], place, normal).reshape(found.shape)
    center = np.array(LIGHTS[kind].position)  # type: ignore[union-attr]
    apart = np.linalg.norm(place - center, axis=1).reshape(found.shape) > 0.4
    np.testing.assert_allclose(found[apart], expected[apart], rtol=TEXEL, atol=TEXEL * expected.mean())
    assert np.isfinite(found).all()


@pytest.mark.parametrize("kind", SPOTS)
def test_a_spot_with_a_size_has_a_soft_cone_and_the_energy_of_its_cone(kind: str) -> None:
    receivers, light = build_plane(footprint=0.2), SPOTS[kind]
    found = RayTracer(receivers).response([light])[..., 0]
    place, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    expected = irradiance_from(light, place, normal).reshape(found.shape)
    assert np.abs(found - expected).max() < CONE * expected.max()
    assert found.sum() == pytest.approx(expected.sum(), rel=TEXEL)
    whole = irradiance_from(light.without_cone(), place, normal).reshape(found.shape)
    share = np.divide(expected, whole, out=np.zeros_like(whole), where=whole > 0)
    sharp = irradiance_from(replace(light, size=0.0), place, normal).reshape(found.shape)
    assert ((share > 0.05) & (sharp == 0)).any() and ((share < 0.95) & (share > 0.5)).any()


@pytest.mark.lengthy
def test_an_area_is_cut_by_an_edge() -> None:
    """Behind the edge of a roof, a point sees what of the light is past the plane through itself and the edge."""
    roof = quad([-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5])
    receivers = build_plane(roof, footprint=0.02)
    light = AreaLight((0, 0, 1.0), u=(0.4, 0, 0), v=(0, -0.4, 0))
    found = RayTracer(receivers).response([light])[..., 0]
    place, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    edge = -place[:, 0]  # where the plane through the point and the edge meets the light
    left = np.clip(edge, -0.2, 0.2)
    expected = np.zeros(len(place))
    for i in np.flatnonzero(left < 0.2 - 1e-9):
        width = 0.2 - left[i]
        part = AreaLight((0.2 - width / 2, 0, 1.0), u=(width, 0, 0), v=(0, -0.4, 0))
        expected[i] = irradiance_from(part, place[i : i + 1], normal[i : i + 1])[0] * part.area / light.area
    expected = expected.reshape(found.shape)
    within = np.abs(edge.reshape(found.shape)) < 0.2
    assert (expected[within] / expected.max() > 0.1).any()
    assert np.abs(found - expected).max() < PENUMBRA * expected.max()


@pytest.mark.parametrize("light", [SphereLight((0, 0, 1.0), size=0.1), WIDE])
def test_a_sphere_seen_past_an_edge_is_a_part_of_its_disc(light: Light) -> None:
    roof = quad([-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5])
    receivers = build_plane(roof, footprint=0.02)
    found = RayTracer(receivers).response([light])[..., 0]
    place, normal = (receivers.images[name].reshape(-1, 3) for name in ("position", "normal"))
    whole = irradiance_from(light, place, normal).reshape(found.shape)
    row = len(found) // 2
    x = place[:, 0].reshape(found.shape)[row]
    t = np.clip(0.5 * x / np.hypot(x, 0.5) / 0.1, -1, 1)  # distance of the center from the plane through point and edge, over the radius
    share = found[row] / whole[row]
    expected = (np.arccos(-t) + t * np.sqrt(1 - t * t)) / np.pi
    assert np.abs(share - expected).max() < PENUMBRA
    assert (share[x > 0.2] > 1 - 1e-3).all() and (share[x < -0.2] == 0).all()


@pytest.mark.lengthy
@pytest.mark.parametrize("angle", [0.1, 0.3])
def test_each_sun_has_a_penumbra_of_its_own_angle(angle: float) -> None:
    """Past the edge of a roof 0.5 m up, a disc of that angle is cut off over 0.5 tan(angle)."""
    roof = quad([-9, -9, 0.5], [0, -9, 0.5], [0, 9, 0.5], [-9, 9, 0.5])
    receivers = build_plane(roof, footprint=0.02)
    tracer = RayTracer(receivers)
    found = tracer.response([DirectionalLight((0, 0, 1), angle=angle)])[..., 0]
    x = receivers.images["position"][len(found) // 2, :, 0]
    t = np.clip(x / 0.5 / np.tan(angle / 2), -1, 1)
    expected = (np.arccos(-t) + t * np.sqrt(1 - t * t)) / np.pi
    assert np.abs(found[len(found) // 2] - expected).max() < PENUMBRA
    both = tracer.response([DirectionalLight((0, 0, 1), angle=angle), DirectionalLight((0, 0, 1))])[..., 0]
    np.testing.assert_allclose(both - found, tracer.response([DirectionalLight((0, 0, 1))])[..., 0], atol=1e-5)


def test_a_light_in_a_surface_is_finite() -> None:
    receivers = build_plane(footprint=1.0)
    x = float(receivers.images["position"][7, 9, 0]), float(receivers.images["position"][7, 9, 1])
    lights: list[Light] = [
        PointLight((*x, 0.0), falloff="inverse-square"),
        PointLight((*x, 1e-6), falloff="inverse-square"),
        SphereLight((*x, 0.0), size=0.01),
        AreaLight((*x, 0.0), u=(0.1, 0, 0), v=(0, 0.1, 0)),
        AreaLight((*x, 1e-6), u=(0.1, 0, 0), v=(0, -0.1, 0)),
    ]
    for light in lights:
        assert np.isfinite(RayTracer(receivers).response([light])).all()


def test_a_panel_at_its_own_mesh_shines() -> None:
    """The glowing rectangle that a scene shows where a light is does not shade it."""
    panel = quad([-0.2, -0.2, 1], [0.2, -0.2, 1], [0.2, 0.2, 1], [-0.2, 0.2, 1])
    light = AreaLight((0, 0, 1), u=(0.4, 0, 0), v=(0, -0.4, 0))
    found, alone = (RayTracer(build_plane(*shown)).response([light]) for shown in ((panel,), ()))
    np.testing.assert_allclose(found, alone, rtol=1e-4)


@pytest.mark.lengthy
def test_penumbrae_of_a_room_have_no_speckles() -> None:
    receivers = room(64)
    covered = receivers.images["coverage"] > 0
    found = RayTracer(receivers).response([AreaLight((0, 0, 1.99), u=(0.6, 0, 0), v=(0, -0.6, 0))])[..., 0]
    many = RayTracer(receivers, samples=512).response([AreaLight((0, 0, 1.99), u=(0.6, 0, 0), v=(0, -0.6, 0))])[..., 0]
    peak = np.quantile(many[covered], 0.999)
    assert np.abs(found - many)[covered].max() < 0.05 * peak
    assert -10 * np.log10((((found - many) / peak)[covered] ** 2).mean()) > 45


def test_named_lights_add_nothing() -> None:
    assert (RayTracer(build_plane()).response([NamedLight("Window")]) == 0).all()
