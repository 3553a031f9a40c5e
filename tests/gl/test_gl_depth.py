"""Views relit by a depth buffer in the position map's place, for every method and projection, out to a wide camera's corners."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from depth_twins import PROJECTIONS, projection

from srbf import methods
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.gl.depth_buffer import DepthCamera, DepthView
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight
from srbf.relighting.relighter import Relighter

HEIGHT, WIDTH = 9, 14
LIGHTS: list[Light] = [
    PointLight((0.4, -0.2, 1.1), (1.0, 0.5, 2.0), a0=0.7),
    SpotLight((0.4, -0.3, 1.5), (0.5, 1.0, 2.0), a0=0.8, direction=(0.1, 0.2, -1.0), inner=0.3, outer=0.9),
    DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3)),
]
# A sample of a float32 buffer is off by half a step; 8 m away, 0.25 m near: 8^2 / 0.25 * 2^-24 m, and light changes no faster than 1/m
ROUNDING = {"opengl": 2e-3, "direct3d": 2e-3, "opengl, infinite": 2e-3, "orthographic": 1e-4, "reversed": 2e-5, "reversed, infinite": 2e-5}


def scene(kind: str) -> tuple[np.ndarray, DepthView]:
    """What a camera sees of the floor z = 0 and a ball on it, by the closed forms of both: positions and depth buffer, row 0 at the top."""
    eye, target = np.array([0.3, -2.5, 2.0]), np.array([0.0, 0.0, 0.2])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    pose = np.eye(4)
    pose[:3] = np.stack([right, up, -forward, eye], axis=1)
    matrix, from_zero = projection(kind, far=400.0)
    camera = DepthCamera.of(pose, matrix, from_zero=from_zero)
    x = (2 * (np.arange(WIDTH) + 0.5) / WIDTH - 1)[None, :, None]
    y = (1 - 2 * (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None, None]
    if camera.orthographic:
        origin = eye + right * (x - matrix[0, 3]) / matrix[0, 0] + up * (y - matrix[1, 3]) / matrix[1, 1]
        ray = np.broadcast_to(forward, origin.shape)
    else:
        ray = forward + right * (x + matrix[0, 2]) / matrix[0, 0] + up * (y + matrix[1, 2]) / matrix[1, 1]
        origin = np.broadcast_to(eye, ray.shape)
    center, radius = np.array([0.0, 0.0, 1.0]), 1.0
    a, b = (ray**2).sum(axis=2), (ray * (origin - center)).sum(axis=2)
    inside = b**2 - a * (((origin - center) ** 2).sum(axis=2) - radius**2)
    ball = (-b - np.sqrt(np.maximum(inside, 0))) / a
    floor = np.where(ray[..., 2] < -1e-3, -origin[..., 2] / np.minimum(ray[..., 2], -1e-3), 30.0)  # above the horizon a far wall
    floor = np.minimum(floor, 30.0)
    distance = np.where(inside > 0, ball, floor)
    positions = origin + distance[..., None] * ray
    view = (positions - eye) @ pose[:3, :3]
    clip = np.concatenate([view, np.ones((HEIGHT, WIDTH, 1))], axis=2) @ matrix.T
    samples = clip[..., 2] / clip[..., 3]
    assert (inside > 0).sum() > 5 and (inside <= 0).sum() > 50
    return positions, DepthView((samples if from_zero else 0.5 * samples + 0.5).astype(np.float32), camera)


@pytest.mark.parametrize("kind", PROJECTIONS)
@pytest.mark.parametrize("method", ["relighting-map", "eigen-map", "clustered-eigen-map"])
def test_a_view_is_relit_by_its_depths(
    context: Any, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset], method: str, kind: str
) -> None:
    asset = make_asset(9) if method == "relighting-map" else make_planes(9, 5 if method.startswith("clustered") else None)
    positions, view = scene(kind)
    with Relighter(replace(asset, images={}), context=context, view=view) as relighter:
        found = relighter.relight(LIGHTS)
        alone = relighter.relight(LIGHTS[:1])
    asset.images["position"] = positions.astype(np.float32)
    for lights, image in ((LIGHTS, found), (LIGHTS[:1], alone)):
        expected = methods.relight(asset, lights)
        np.testing.assert_allclose(image, expected, atol=ROUNDING[kind] * expected.max())
        assert image[0, 0].max() > 0 or image[-1, -1].max() > 0  # corners are lit
    # Had depth along the axis been taken for the ray's length, the corners would be somewhere else
    if not view.camera.orthographic:
        wrong = replace(view.camera, center=view.camera.center * 0.7)
        with Relighter(replace(asset, images={}), context=context, view=replace(view, camera=wrong)) as relighter:
            assert np.abs(relighter.relight(LIGHTS) - methods.relight(asset, LIGHTS)).max() > 10 * ROUNDING[kind] * found.max()


def test_a_depth_buffer_of_another_size_is_refused(context: Any, make_asset: Callable[..., Asset]) -> None:
    _, view = scene("opengl")
    with pytest.raises(InputError, match=r"expected 9 x 14 depth samples, found \(9, 13\)"):
        Relighter(make_asset(), context=context, view=replace(view, samples=view.samples[:, 1:].copy()))


@pytest.mark.parametrize(
    ("change", "text"),
    [({(3, 3): 0.5}, "whose last row"), ({(0, 1): 0.2}, "leaves x and y apart"), ({(0, 0): 0.0}, "leaves x and y apart")],
)
def test_projections_that_are_none_are_refused(change: dict[tuple[int, int], float], text: str) -> None:
    matrix, from_zero = projection("opengl")
    for place, value in change.items():
        matrix[place] = value
    with pytest.raises(InputError, match=text):
        DepthCamera.of(np.eye(4), matrix, from_zero=from_zero)
