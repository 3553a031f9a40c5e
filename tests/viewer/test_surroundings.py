"""A lightmap in its scene: its own colors on the receiver, its surroundings, and colored glass that shows what is behind it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from closed_forms import quad
from test_page import HEIGHT, WIDTH, shown_as
from test_scene import CANVAS, orbit_pixel
from view_assets import scene_glb
from web_assets import HALF_EXTENT, complete, on_a_plane

from srbf.asset import Asset
from srbf.io.image import read_image
from srbf.lights import DirectionalLight
from srbf.methods import relight

ALBEDO = np.array([0.8, 0.5, 0.2])
GLASS = np.array([0.9, 0.4, 0.3])
EYE, TARGET = np.array([0.3, -1.8, 8.0]), np.array([0.0, 0.0, 0.2])
EXPOSURE = 1.0
SUN = DirectionalLight((-0.45, -0.5, 0.74))


@pytest.fixture
def table(make_asset: Callable[..., Asset]) -> Asset:
    """The same light on every texel, so that neither blur nor refraction can move it."""
    asset = on_a_plane(make_asset(k=4, height=12, width=16, encoding="half"))
    asset.stored[:] = asset.stored.astype(np.float32).mean(axis=(1, 2), keepdims=True) ** 2 + 0.2
    asset.images["coverage"] = np.ones((12, 16), np.float32)
    return complete(asset, source={"receiver": {"kind": "lightmap", "object": "Table"}})


@pytest.fixture
def page(table: Asset, tmp_path: Path, serve: Callable[..., str]) -> str:
    """The table, a red post beside it, and a thin pane of glass over its right half."""
    a, b, z = HALF_EXTENT
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 1], [1, 0], [0, 0]], np.float32)
    plain = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
    things = (
        (
            "Table",
            quad([-a, -b, z], [a, -b, z], [a, b, z], [-a, b, z]),
            {"pbrMetallicRoughness": {**plain, "baseColorFactor": [*ALBEDO, 1]}},
        ),
        (
            "Post",
            quad([-2.2, -0.3, z], [-1.7, -0.3, z], [-1.7, 0.3, z], [-2.2, 0.3, z]),
            {"pbrMetallicRoughness": {**plain, "baseColorFactor": [0.9, 0.05, 0.05, 1]}},
        ),
        (
            "Pane",
            quad([0.3, -0.7, z + 0.4], [1.2, -0.7, z + 0.4], [1.2, 0.7, z + 0.4], [0.3, 0.7, z + 0.4]),
            {
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0, "baseColorFactor": [*GLASS, 1]},
                "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.0}},
            },
        ),
    )
    (tmp_path / "scene.glb").write_bytes(scene_glb(*things, uv=("Table", uv)))
    table.save(tmp_path / "asset")
    return serve(tmp_path / "asset", None, tmp_path / "scene.glb")


def saved(chromium: Any, folder: Path) -> np.ndarray:
    """The picture's bytes, without gizmos."""
    (folder / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
    return np.asarray(read_image(folder / "saved.png", 3) * 255)


def at(picture: np.ndarray, place: list[float]) -> np.ndarray:
    x, y = orbit_pixel(np.array(place), EYE, TARGET)
    assert 0 < x < CANVAS[0] and 0 < y < CANVAS[1]
    return picture[int(y), int(x)]


def test_a_lightmap_lies_in_its_scene_and_glass_shows_what_is_behind(chromium: Any, table: Asset, page: str, tmp_path: Path) -> None:
    z = HALF_EXTENT[2]
    where = f"#{{'eye':[{EYE.tolist()},{TARGET.tolist()}],'selected':-1,'exposure':{EXPOSURE}}}"
    chromium("open", url=page + where, width=WIDTH, height=HEIGHT)
    assert chromium.state()["view"] == "scene"
    picture = saved(chromium, tmp_path)
    assert picture.shape[:2] == CANVAS[::-1]
    irradiance = relight(table, [SUN])[6, 8]
    radiance = irradiance * ALBEDO / np.pi
    bare = at(picture, [-0.6, 0.1, z])
    np.testing.assert_allclose(bare, shown_as(radiance, EXPOSURE), atol=2)  # half floats between the two passes
    glazed = at(picture, [0.75, 0.0, z + 0.4])
    np.testing.assert_allclose(glazed, shown_as(radiance * GLASS, EXPOSURE), atol=4)
    assert (np.abs(glazed - bare) > 20).any()
    post = at(picture, [-1.95, 0.0, z])
    assert post[0] > 1.5 * post[1] > 0, "its own red, by three.js's sun, under a reflection of the daylight"
    chromium("press", keys=["t"])
    alone = saved(chromium, tmp_path)
    assert chromium.state()["view"] == "mesh"
    np.testing.assert_allclose(at(alone, [-1.95, 0.0, z]), [15, 17, 20], atol=1)
    np.testing.assert_allclose(at(alone, [-0.6, 0.1, z]), shown_as(irradiance, EXPOSURE), atol=2)
    np.testing.assert_allclose(at(alone, [0.75, 0.0, z]), shown_as(irradiance, EXPOSURE), atol=2)


def test_light_of_vertices_is_mixed_across_triangles(
    chromium: Any, make_asset: Callable[..., Asset], tmp_path: Path, serve: Callable
) -> None:
    """Whatever texels the vertices have: in the scene and alone."""
    asset = complete(
        on_a_plane(make_asset(k=4, height=2, width=8, encoding="half")), receiver={"kind": "vertices", "object": "Table", "count": 12}
    )
    asset.images["coverage"] = np.ones((2, 8), np.float32)
    asset.stored[:] = np.abs(asset.stored.astype(np.float32)) * 0.3 + 0.1
    asset.save(tmp_path / "asset")
    a, b, z = HALF_EXTENT
    vertices = np.array([9, 2, 4, 9, 4, 11])  # of the corners
    uv = np.stack([(vertices % 8 + 0.5) / 8, (vertices // 8 + 0.5) / 2], axis=1)
    plain = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0, "baseColorFactor": [*ALBEDO, 1]}}
    post = ("Post", quad([-2.2, -0.3, z], [-1.7, -0.3, z], [-1.7, 0.3, z], [-2.2, 0.3, z]), plain)
    table = ("Table", quad([-a, -b, z], [a, -b, z], [a, b, z], [-a, b, z]), plain)
    (tmp_path / "scene.glb").write_bytes(scene_glb(table, post, uv=("Table", uv)))
    where = f"#{{'eye':[{EYE.tolist()},{TARGET.tolist()}],'selected':-1,'exposure':{EXPOSURE}}}"
    chromium("open", url=serve(tmp_path / "asset", None, tmp_path / "scene.glb") + where, width=WIDTH, height=HEIGHT)
    light = relight(asset, [SUN]).reshape(-1, 3)[vertices].reshape(2, 3, 3)
    in_scene = saved(chromium, tmp_path)
    chromium("press", keys=["t"])
    alone = saved(chromium, tmp_path)
    assert chromium.state()["view"] == "mesh"
    for corners, values in zip(table[1], light, strict=True):
        shares = np.array([0.5, 0.2, 0.3])
        place, mixed = shares @ corners, shares @ values
        assert np.ptp(values, axis=0).max() > 0.1
        np.testing.assert_allclose(at(in_scene, place), shown_as(mixed * ALBEDO / np.pi, EXPOSURE), atol=3)
        np.testing.assert_allclose(at(alone, place), shown_as(mixed, EXPOSURE), atol=3)


def test_light_and_camera_move_together(chromium: Any, table: Asset, page: str, tmp_path: Path) -> None:
    """The light goes round while the camera does; both are in the address, and the picture is that of where they are."""
    where = f"#{{'eye':[{EYE.tolist()},{TARGET.tolist()}],'exposure':{EXPOSURE},'path':'turn','seconds':2,'turntable':true,'playing':true}}"
    chromium("open", url=page + where, width=WIDTH, height=HEIGHT, moving=True)
    chromium("run", script="new Promise((done) => setTimeout(done, 1500))")
    chromium("press", keys=[" "])
    state = chromium.state()
    assert not state["playing"]
    eye, target = (np.array(v) for v in state["eye"])
    assert np.linalg.norm(eye - EYE) > 0.05
    assert eye[2] == pytest.approx(EYE[2], abs=1e-3)
    assert np.linalg.norm(eye - target) == pytest.approx(np.linalg.norm(EYE - TARGET), abs=1e-3)
    direction = tuple(state["lights"][0]["direction"])
    assert direction != SUN.direction
    expected = relight(table, [DirectionalLight(direction)])[6, 8] * ALBEDO / np.pi
    x, y = orbit_pixel(np.array([-0.6, 0.1, HALF_EXTENT[2]]), eye, target)
    np.testing.assert_allclose(saved(chromium, tmp_path)[int(y), int(x)], shown_as(expected, EXPOSURE), atol=2)
