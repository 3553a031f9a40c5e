"""Direct light that the pixels of a view let through: what falls on the backs of their surfaces, by rays and by shadow maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from closed_forms import build_plane, from_above, quad

from srbf.lights import AreaLight, DirectionalLight, Light, PointLight
from srbf.unshadowed import irradiance_from
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers
from srbf.visibility.shadow_map import ShadowMapper

pytest.importorskip("embreex")

SIDE = 16
LOOKS = 0.02  # of the largest value: an area's light by a few looks
PASSED = np.array([0.5, 0.2, 0.3], np.float32)
LIGHTS: dict[str, Light] = {
    "point": PointLight((0.3, 0.1, -0.8), falloff="inverse-square"),
    "area": AreaLight((0.3, 0.1, -0.8), u=(0.3, 0.0, 0.0), v=(0.0, 0.3, 0.0)),
    "sun": DirectionalLight((0.0, 0.6, -0.8)),
}


def sheet(*occluders: np.ndarray, thin: bool = True) -> Receivers:
    """A sheet of 2 x 2 m from above, whose half x < 0 lets light through."""
    made = build_plane(*occluders, size=SIDE, albedo=(0.4, 0.4, 0.4), camera=from_above("BOX", 1.0))
    if thin:
        made.images["transmission"] = np.where(made.images["position"][..., :1] < 0, PASSED, 0).astype(np.float32)
    return made


def behind(receivers: Receivers) -> Receivers:
    found = receivers.behind()
    assert found is not None
    return found


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("by", ["rays", "shadow maps"])
def test_light_from_behind_passes(by: str, kind: str) -> None:
    """tau / pi times the irradiance of the back, where the sheet lets light through, and nothing of a light in front."""
    receivers, light = behind(sheet()), LIGHTS[kind]
    points = receivers.images["position"].reshape(-1, 3)
    down = np.broadcast_to([0.0, 0.0, -1.0], points.shape)
    irradiance = np.full(len(points), 0.8) if isinstance(light, DirectionalLight) else irradiance_from(light, points, down)
    expected = np.where(points[:, :1] < 0, PASSED, 0) * irradiance[:, None] / np.pi
    above = PointLight((0.3, 0.1, 0.8), falloff="inverse-square")
    if by == "rays":
        found, none = (RayTracer(receivers).response([one]) for one in (light, above))
    else:
        with ShadowMapper(receivers, size=512) as mapper:
            found, none = (mapper.response([one]) for one in (light, above))
    np.testing.assert_allclose(found.reshape(-1, 3), expected, atol=LOOKS * expected.max())
    assert (none == 0).all()


def test_what_is_behind_the_sheet_shades_it() -> None:
    """A roof below y < 0 keeps the sun off."""
    roof = quad([-9, -9, -0.5], [9, -9, -0.5], [9, 0, -0.5], [-9, 0, -0.5])
    found = RayTracer(behind(sheet(roof))).response([DirectionalLight((0.0, 0.0, -1.0))])[:, 0, 0]
    np.testing.assert_allclose(found, np.where(np.arange(SIDE) < SIDE // 2, PASSED[0] / np.pi, 0), rtol=1e-4, atol=1e-6)


def test_opaque_views_have_no_backs() -> None:
    opaque = sheet(thin=False)
    assert opaque.behind() is None
    opaque.images["transmission"] = np.zeros_like(opaque.images["albedo"])
    assert opaque.behind() is None


def test_points_on_backs_face_away_and_are_of_translucent_pixels() -> None:
    points: Any = PixelPoints.of_view(behind(sheet()))
    np.testing.assert_allclose(points.normals, np.broadcast_to([0, 0, -1], points.normals.shape), atol=1e-6)
    column = np.unique(points.pixels % SIDE)
    assert column.tolist() == list(range(SIDE // 2))
    np.testing.assert_allclose(np.bincount(points.pixels, points.shares)[np.unique(points.pixels)], 1, rtol=1e-5)
