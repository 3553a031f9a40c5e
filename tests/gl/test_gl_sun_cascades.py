"""Nested shadow maps of suns: a view over a plain of 100 m, with thin sticks before the camera, is lit as by rays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from closed_forms import flat_normals, quad

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.lights import DirectionalLight
from srbf.sphere import normalize
from srbf.visibility import shadow_map
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers
from srbf.visibility.shadow_map import ShadowMapper
from srbf.visibility.sun_cascades import MOST, Cascades

pytest.importorskip("embreex")

WIDTH, HEIGHT = 96, 54
RELATIVE = 0.02  # relative RMSE of maps against rays, of picture elements that edges of shadows cross most
SUN = DirectionalLight((0.5, 0.3, 0.8))


@pytest.fixture(scope="module")
def plain() -> Receivers:
    """A camera 1.5 m above a plain, behind sticks 3 cm wide."""
    rng = np.random.default_rng(3)
    sticks = []
    for x, y in zip(rng.uniform(-2, 2, 40), rng.uniform(-8, -4, 40), strict=True):
        sticks.append(quad([x, y, 0], [x + 0.03, y, 0], [x + 0.03, y, 0.5], [x, y, 0.5]))
    ground = np.array([[[-50, -50, 0], [150, -50, 0], [-50, 150, 0]]], np.float32)
    corners = np.concatenate([ground, *sticks]).astype(np.float32)
    none, count = np.zeros((1, KNOTS, 3), np.float32), len(corners)
    triangles = Triangles(corners, flat_normals(corners), np.zeros(count, np.int64), np.ones(count, bool), none)
    camera = {
        "type": "PERSP",
        "matrix_world": [[1, 0, 0, 0], [0, 0.25881905, -0.96592583, -10], [0, 0.96592583, 0.25881905, 1.5], [0, 0, 0, 1]],
        "frame": [[0.8, 0.45, -1], [0.8, -0.45, -1], [-0.8, -0.45, -1], [-0.8, 0.45, -1]],
        "filter": "BOX",
        "filter_width": 1.0,
    }
    v, u = (np.mgrid[:HEIGHT, :WIDTH].reshape(2, -1) + 0.5) / [[HEIGHT], [WIDTH]]
    matrix = np.array(camera["matrix_world"])
    ways = normalize(np.stack([-0.8 + 1.6 * u, 0.45 - 0.9 * v, -np.ones_like(u)], axis=1) @ matrix[:3, :3].T)
    hit, far, _ = EmbreeTriangles(corners).first_hit(np.broadcast_to(matrix[:3, 3], ways.shape).astype(np.float32), ways.astype(np.float32))
    met = hit >= 0
    position = matrix[:3, 3] + ways * np.where(met, far, 0)[:, None]
    normal = triangles.normals[np.maximum(hit, 0), 0] * np.where(met, 1, 0)[:, None]
    normal *= np.where((normal * ways).sum(axis=1) > 0, -1, 1)[:, None]
    images: dict[str, Any] = {
        "position": position.reshape(HEIGHT, WIDTH, 3).astype(np.float32),
        "normal": normal.reshape(HEIGHT, WIDTH, 3).astype(np.float32),
        "coverage": met.reshape(HEIGHT, WIDTH).astype(np.float32),
        "albedo": np.full((HEIGHT, WIDTH, 3), 0.5, np.float32),
    }
    return Receivers(WIDTH, HEIGHT, "radiance", images, triangles, {"sun_angle": 0.0, "camera": camera})


def error(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(((found - expected) ** 2).mean() / (expected**2).mean()))


@pytest.mark.lengthy
@pytest.mark.parametrize("angle", [0.0, 0.02])
def test_near_shadows_are_as_by_rays(context: Any, plain: Receivers, angle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    covered = plain.images["coverage"] > 0
    light = replace(SUN, angle=angle)
    rays = RayTracer(plain).response([light])[covered]
    with ShadowMapper(plain, size=512, context=context) as mapper:
        nested = error(mapper.response([light])[covered], rays)
    monkeypatch.setattr(shadow_map, "Cascades", OneMap)
    with ShadowMapper(plain, size=512, context=context) as mapper:
        single = error(mapper.response([light])[covered], rays)
    assert nested < RELATIVE and nested < 0.5 * single


class OneMap(Cascades):
    """As for receivers without a camera."""

    def __init__(self, points: np.ndarray, camera: object, width: int, center: np.ndarray) -> None:
        super().__init__(points, None, width, center)


def test_maps_are_nested_and_the_last_holds_all(plain: Receivers) -> None:
    covered = plain.images["coverage"] > 0
    points = plain.images["position"][covered].astype(np.float64)
    cascades = Cascades(points, plain.camera, WIDTH, np.zeros(3))
    frames = cascades.frames(np.array(SUN.direction), 512)
    sides = [frame.extent for frame in frames]
    assert 2 < len(frames) <= MOST and sides == sorted(sides)
    flat = points @ np.stack([frames[-1].across, frames[-1].up], axis=1) - frames[-1].low
    assert flat.min() >= 0 and flat.max() <= sides[-1]
    assert len(cascades.frames(np.array(SUN.direction), 1 << 20)) == 1  # fine enough
    assert len(Cascades(points, None, WIDTH, np.zeros(3)).frames(np.array(SUN.direction), 512)) == 1
