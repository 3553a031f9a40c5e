"""Shadow maps in a view: pixels that show two surfaces, and pixels that the edge of a shadow crosses, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from closed_forms import flat_normals, from_above, quad

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight, SphereLight, SpotLight
from srbf.unshadowed import irradiance_from
from srbf.visibility.lookup_points import EDGE_POINTS, SHADOW_POINTS, LookupPoints
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers, pixel_filter
from srbf.visibility.shadow_map import ShadowMapper

SIDE, EDGE, HEIGHT = 24, 0.03, 0.5  # pixels; where the table ends, m, off the borders of pixels; how high it is
FILTER = ("BLACKMAN_HARRIS", 1.5)  # Cycles' own
WITHIN, MEAN = 0.01, 0.005  # of a pixel: a light's change over it, and few looks of one with a size; of all
ALBEDO, OTHER = np.array([0.7, 0.6, 0.5]), np.array([0.2, 0.4, 0.1])
LIGHTS: dict[str, Light] = {  # all from the side on which no shadow falls on the floor that is seen
    "point": PointLight((2.0, 0.1, 1.5), falloff="inverse-square"),
    "spot": SpotLight((2.0, 0.1, 1.5), direction=(-0.8, 0.0, -0.6), inner=1.0, outer=1.2, falloff="inverse-square"),
    "sphere": SphereLight((2.0, 0.1, 1.5), size=0.1),
    "area": AreaLight((2.0, 0.1, 1.5), u=(-0.1, 0.0, 0.1), v=(0.0, 0.2, 0.0)),
    "sun": DirectionalLight((0.6, 0.0, 0.8)),
}


def view(*occluders: np.ndarray, table: bool = True, albedo: np.ndarray = ALBEDO) -> Receivers:
    """A floor of 2 x 2 m from above by an orthographic camera, and on x < EDGE a table before it, of another material and `albedo`."""
    parts = [quad([-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0])]
    if table:
        parts.append(quad([-9, -9, HEIGHT], [EDGE, -9, HEIGHT], [EDGE, 9, HEIGHT], [-9, 9, HEIGHT]))
    parts += occluders
    corners = np.concatenate(parts).astype(np.float32)
    material = np.repeat(np.arange(len(parts)), 2)
    curves = np.zeros((len(parts), KNOTS, 3), np.float32)
    triangles = Triangles(corners, flat_normals(corners), material, np.ones(len(corners), bool), curves)
    x = -1 + 2 * (np.arange(SIDE) + 0.5) / SIDE
    on_table = table & (x < EDGE)
    position = np.zeros((SIDE, SIDE, 3), np.float32)
    position[..., 0], position[..., 1], position[..., 2] = x, -x[:, None], HEIGHT * on_table
    normal = np.broadcast_to(np.array([0, 0, 1], np.float32), position.shape)
    share = table_share()[:, None] if table else np.zeros((SIDE, 1))
    mean = np.broadcast_to(share * albedo + (1 - share) * ALBEDO, position.shape).astype(np.float32)
    images = {"position": position, "normal": normal, "albedo": mean}
    return Receivers(SIDE, SIDE, "radiance", images, triangles, {"sun_angle": 0.0, "camera": from_above(*FILTER)})


def table_share() -> np.ndarray:
    """What part of the filter of each column's pixels is on the table."""
    square = (np.arange(4096) + 0.5) / 4096
    offset = pixel_filter(*FILTER, np.stack([square, square], axis=1))[:, 0]
    x = -1 + 2 * (np.arange(SIDE)[:, None] + 0.5 + offset) / SIDE
    return (x < EDGE).mean(axis=1)


@pytest.mark.lengthy
@pytest.mark.parametrize("kind", LIGHTS)
def test_a_pixel_with_two_surfaces_shows_both(context: Any, kind: str) -> None:
    """By the part of its filter that each fills, each lit at its own height."""
    receivers, light = view(), LIGHTS[kind]
    x, y = receivers.images["position"][..., 0].ravel(), receivers.images["position"][..., 1].ravel()
    share = np.tile(table_share(), SIDE)[:, None]
    up = np.broadcast_to([0.0, 0.0, 1.0], (SIDE**2, 3))
    if isinstance(light, DirectionalLight):
        table, floor = np.full((2, SIDE**2), 0.8)
    else:
        table = irradiance_from(light, np.column_stack([np.minimum(x, EDGE), y, np.full_like(x, HEIGHT)]), up)
        floor = irradiance_from(light, np.column_stack([np.maximum(x, EDGE), y, np.zeros_like(x)]), up)
    expected = (share * table[:, None] + (1 - share) * floor[:, None]) * ALBEDO / np.pi
    with ShadowMapper(receivers, context=context) as mapper:
        found = mapper.response([light]).reshape(-1, 3)
    mixed = (share[:, 0] > 0.02) & (share[:, 0] < 0.98)
    assert mixed.any()
    step = np.abs(table - floor)[:, None] * ALBEDO / np.pi
    np.testing.assert_array_less(np.abs(found - expected)[mixed], (2 / EDGE_POINTS * step + WITHIN * expected)[mixed])
    assert found[mixed].mean() == pytest.approx(expected[mixed].mean(), rel=MEAN)


@pytest.mark.lengthy
@pytest.mark.parametrize("kind", LIGHTS)
def test_materials_count_as_by_rays(context: Any, kind: str) -> None:
    receivers = view(albedo=OTHER)
    expected = RayTracer(receivers).response([LIGHTS[kind]])
    with ShadowMapper(receivers, context=context) as mapper:
        found = mapper.response([LIGHTS[kind]])
    np.testing.assert_allclose(found, expected, atol=2 / EDGE_POINTS * expected.max())
    assert np.sqrt(((found - expected) ** 2).mean()) < MEAN * expected.max()


def test_an_edge_of_a_shadow_is_as_wide_as_the_filter(context: Any) -> None:
    """Of a roof over x < 0 outside the view, whose edge the sun casts to x = 0.3."""
    roof = quad([-9, -9, 4], [-2.7, -9, 4], [-2.7, 9, 4], [-9, 9, 4])
    receivers = view(roof, table=False)
    sun = DirectionalLight((-0.6, 0.0, 0.8))
    square = (np.arange(4096) + 0.5) / 4096
    offset = pixel_filter(*FILTER, np.stack([square, square], axis=1))[:, 0]
    lit = (-1 + 2 * (np.arange(SIDE)[:, None] + 0.5 + offset) / SIDE > 0.3).mean(axis=1)
    with ShadowMapper(receivers, context=context) as mapper:
        found = mapper.response([sun])[..., 0] / (ALBEDO[0] * 0.8 / np.pi)
    assert ((lit > 0.1) & (lit < 0.9)).any()
    np.testing.assert_allclose(found, np.broadcast_to(lit, found.shape), atol=4 / SHADOW_POINTS)


def test_points_go_where_the_picture_has_edges() -> None:
    points = LookupPoints.of(view())
    beside = np.unique(points.edges % SIDE)
    assert {11, 12} <= set(beside.tolist()) and set(beside.tolist()) <= {10, 11, 12, 13}
    total = np.sum([layer.weight for layer in points.layers], axis=0)
    assert (total[points.edges] == 0).all()
    np.testing.assert_allclose(np.delete(total, points.edges), 1, rtol=1e-6)
    plain = LookupPoints.of(view(table=False))
    assert not len(plain.edges)
    image = np.ones((SIDE, SIDE, 3), np.float32)
    assert not list(plain.of_shadows(image))
    image[:, :5] = 0.2
    ((pixels, (samples,)),) = plain.of_shadows(image)
    assert set((pixels % SIDE).tolist()) == {4, 5}
    assert np.bincount(samples.texel, minlength=SIDE**2)[pixels].min() == SHADOW_POINTS
