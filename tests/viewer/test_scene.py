"""Point lights in the scene, meshes under the orbit camera, and the capture beside what is relit."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_page import HEIGHT, PANEL, STEP, WIDTH, ZOOM, lights_of, shown_as
from typer.testing import CliRunner, Result
from view_assets import project, seen_room
from web_assets import complete, on_a_plane

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.cli import app
from srbf.export.gltf import model
from srbf.io.glb import Glb
from srbf.io.image import read_image
from srbf.lights import DirectionalLight
from srbf.methods import relight

CANVAS = (WIDTH - PANEL, HEIGHT)
TURN = np.radians(38) / 2  # half the orbit camera's field of view, upwards


def test_a_point_light_is_pulled_up_by_its_handle(
    chromium: Any, make_asset: Callable[..., Asset], serve: Callable[..., str], tmp_path: Path
) -> None:
    """In a view: the handles are where the fitted camera sees the point light."""
    asset = seen_room(make_asset(k=4, height=18, width=28))
    asset.save(tmp_path / "asset")
    point_light = [0.2, 0.5, 0.9]
    light = (
        f"{{'kind':'point','on':true,'color':'%23ffd0a0','intensity':1,'position':{point_light},'a0':1,'falloff':'linear','radius':0.01}}"
    )
    where = f"#{{'lights':[{light}],'selected':0,'zoom':{ZOOM},'middle':[14,9],'exposure':-1}}"
    chromium("open", url=serve(tmp_path / "asset") + where, width=WIDTH, height=HEIGHT)

    def on_canvas(place: list[float]) -> np.ndarray:
        return np.array(CANVAS) / 2 + (project(np.array(place)) - 0.5) * [28 * ZOOM, 18 * ZOOM]

    x, y = on_canvas(point_light).tolist()
    grip = y - 0.178 * CANVAS[1] / 2  # half the arrow's length, of half the picture's height
    chromium("drag", path=[[x, grip], [x, grip - 20], [x, grip - 40]])
    moved = chromium.state()["lights"][0]["position"]
    assert moved[:2] == pytest.approx(point_light[:2], abs=1e-4)
    assert moved[2] > point_light[2] + 0.1
    assert on_canvas(moved)[1] == pytest.approx(y - 40, abs=3)
    (lights,) = lights_of(chromium, tmp_path)
    (tmp_path / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
    saved = read_image(tmp_path / "saved.png", 3) * 255
    assert (np.abs(saved - shown_as(relight(asset, lights), -1)) <= STEP).all()


@pytest.fixture
def lightmap(make_asset: Callable[..., Asset]) -> Asset:
    """A plane whose coefficients change slowly over it, so that a pixel's width does not matter; brightest in one corner."""
    made = make_asset(k=4, height=40, width=60)
    u, v = np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 40))
    ramp = 0.05 + 0.5 * np.stack([u, v, 0.3 + 0.4 * u * v], axis=2)
    stored = np.stack([ramp * (1 + 0.2 * i) for i in range(4)]).astype(np.float32)
    asset = on_a_plane(replace(made, stored=stored))
    asset.images["coverage"] = np.ones((40, 60), np.float32)
    return complete(asset, source={"receiver": {"kind": "lightmap", "object": "Table"}})


def orbit_pixel(place: np.ndarray, eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Where an orbit camera sees a place, canvas pixels."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    seen = np.stack([right, np.cross(right, forward), forward]) @ (place - eye)
    return np.array(CANVAS) / 2 + seen[:2] / seen[2] * [1, -1] * CANVAS[1] / 2 / np.tan(TURN)


def test_a_lightmap_is_shown_on_its_mesh(chromium: Any, lightmap: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    """Pixel by pixel through the camera that the address names; then the camera is turned, and a point light put above what is clicked."""
    lightmap.save(tmp_path / "asset")
    eye, target = np.array([0.8, -3.6, 3.8]), np.array([0.1, 0.0, 0.2])
    where = f"#{{'eye':[{eye.tolist()},{target.tolist()}],'selected':-1,'exposure':-1.5}}"
    chromium("open", url=serve(tmp_path / "asset") + where, width=WIDTH, height=HEIGHT)
    (tmp_path / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
    shown = read_image(tmp_path / "saved.png", 3) * 255  # as the canvas has it, without the sun's marker
    assert shown.shape[:2] == CANVAS[::-1]
    bare = (np.abs(chromium.canvas().astype(float) - shown) <= 1).all(axis=2)
    assert bare.mean() > 0.95
    expected = shown_as(relight(lightmap, [DirectionalLight((-0.45, -0.5, 0.74))]), -1.5)
    places = [(5, 7), (20, 50), (33, 12), (34, 52), (8, 44)]
    for row, column in places:
        x, y = orbit_pixel(lightmap.images["position"][row, column], eye, target)
        assert 0 < x < CANVAS[0]
        assert 0 < y < CANVAS[1]
        assert np.abs(shown[int(y), int(x)] - expected[row, column]).max() <= 3, (row, column)
    x, y = orbit_pixel(lightmap.images["position"][33, 12], eye, target)
    chromium("click", at=[x, y], count=2)
    point_light = chromium.state()["lights"][-1]
    assert point_light["kind"] == "point"
    assert point_light["position"][:2] == pytest.approx(lightmap.images["position"][33, 12, :2].tolist(), abs=0.02)
    assert point_light["position"][2] > lightmap.images["position"][33, 12, 2] + 0.1
    chromium("drag", path=[[30, 400], [90, 380]])
    turned = np.array(chromium.state()["eye"][0])
    assert np.linalg.norm(turned - eye) > 0.2
    assert np.linalg.norm(turned - target) == pytest.approx(np.linalg.norm(eye - target), rel=1e-3)


def test_a_camera_among_the_receivers_stays_where_a_window_is_narrow(
    chromium: Any, lightmap: Asset, serve: Callable[..., str], tmp_path: Path
) -> None:
    """A wider angle shows as much of the scene's width as a usual window does: a camera in a room does not go back through its wall."""
    position = lightmap.images["position"].reshape(-1, 3)
    target = (position.min(axis=0) + position.max(axis=0)) / 2
    eye = target + np.array([0.1, -0.8, 0.2])
    document = Glb.parse(model(lightmap))
    camera = document.add("cameras", {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}})
    node = document.add("nodes", {"camera": camera, "translation": [float(eye[0]), float(eye[2]), float(-eye[1])]})
    document.json["scenes"][0]["nodes"].append(node)
    (tmp_path / "scene.glb").write_bytes(document.pack())
    lightmap.save(tmp_path / "asset")
    chromium("open", url=serve(tmp_path / "asset", mesh=tmp_path / "scene.glb") + "#{'selected':-1,'exposure':-1.5}", width=390, height=844)
    shown = chromium.canvas().astype(float)
    height, width, _ = shown.shape
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1]) / np.linalg.norm(np.cross(forward, [0, 0, 1]))
    axes = np.stack([right, np.cross(right, forward), forward])
    expected = shown_as(relight(lightmap, [DirectionalLight((-0.45, -0.5, 0.74))]), -1.5)
    equal = []
    for row, column in np.ndindex(lightmap.height, lightmap.width):
        x, y, away = axes @ (lightmap.images["position"][row, column] - eye)
        at = np.array([width, height]) / 2 + np.array([x, -y]) / away * width / 2 / 1.15 / np.tan(TURN)
        if away <= 0 or not (0 <= at[0] < width and 0.25 * height < at[1] < 0.75 * height):
            continue  # beside the page's own text
        equal.append(np.abs(shown[int(at[1]), int(at[0])] - expected[row, column]).max() <= 3)
    assert len(equal) > 100
    assert np.mean(equal) > 0.9


def test_a_mesh_of_one_s_own_is_shown(chromium: Any, lightmap: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    """Half of the plane, with the same texels on it: what the file leaves out is not there."""
    half = replace(lightmap, images={**lightmap.images, "coverage": lightmap.images["coverage"].copy()})
    half.images["coverage"][:, 30:] = 0
    (tmp_path / "half.glb").write_bytes(model(half))
    lightmap.save(tmp_path / "asset")
    eye, target = np.array([0.8, -3.6, 3.8]), np.array([0.1, 0.0, 0.2])
    where = f"#{{'eye':[{eye.tolist()},{target.tolist()}],'exposure':-1.5}}"
    chromium("open", url=serve(tmp_path / "asset", None, tmp_path / "half.glb") + where, width=WIDTH, height=HEIGHT)
    (tmp_path / "saved.png").write_bytes(chromium.file("Picture (PNG)"))
    shown = read_image(tmp_path / "saved.png", 3) * 255
    expected = shown_as(relight(lightmap, [DirectionalLight((-0.45, -0.5, 0.74))]), -1.5)
    for row, column, there in ((12, 9, True), (33, 22, True), (20, 40, False), (8, 52, False)):
        x, y = orbit_pixel(lightmap.images["position"][row, column], eye, target)
        seen = shown[int(y), int(x)]
        assert np.abs(seen - (expected[row, column] if there else [15, 17, 20])).max() <= 3, (row, column)


@pytest.fixture
def compared(
    chromium: Any, make_asset: Callable[..., Asset], make_capture: Callable[..., Capture], serve: Callable[..., str], tmp_path: Path
) -> tuple[Asset, Capture, str]:
    asset = complete(on_a_plane(make_asset(k=5, encoding="half")))
    pattern = np.random.default_rng(8).random((9, 14, 3)).astype(np.float32)

    def response(direction: np.ndarray) -> np.ndarray:
        return (pattern * (0.6 + 0.4 * direction[0]) + 0.1 * max(direction[1], 0)).astype(np.float32)

    capture = make_capture(response, lights=12, holdout=3)
    asset.save(tmp_path / "asset")
    return asset, capture, serve(tmp_path / "asset", capture.folder)


def test_the_capture_stands_beside_what_is_relit(chromium: Any, compared: tuple[Asset, Capture, str]) -> None:
    """At the nearest baked light, in the sun's strength: alone, by the slider, and the difference with its sign."""
    asset, capture, url = compared
    sun = np.array([0.7, 0.2, 0.5])
    nearest = int(np.argmax(capture.directions() @ sun))
    light = f"{{'kind':'directional','on':true,'color':'%23ffffff','intensity':0.8,'direction':{sun.tolist()}}}"
    start = f"#{{'lights':[{light}],'zoom':{ZOOM},'middle':[7,4.5],'exposure':-1"
    reference = 0.8 * capture.image(nearest)
    relit = relight(asset, [DirectionalLight(capture.lights[nearest].direction, (0.8, 0.8, 0.8))])
    chromium("open", url=url + start + ",'compare':'reference'}", width=WIDTH, height=HEIGHT)
    assert (np.abs(chromium.texels(14, 9, ZOOM) - shown_as(reference, -1)) <= STEP).all()
    status = chromium("run", script="document.getElementById('status').textContent")
    assert f"baked light {nearest} ({capture.lights[nearest].role})" in status
    rmse = np.sqrt(((relit - reference)[asset.covered] ** 2).mean())
    assert float(status.rsplit("rmse ", 1)[1]) == pytest.approx(rmse, rel=6e-3)
    chromium("press", keys=["c", "c"])  # off, then the slider
    seen = chromium.texels(14, 9, ZOOM)
    assert (np.abs(seen[:, :7] - shown_as(reference, -1)[:, :7]) <= STEP).all()
    assert (np.abs(seen[:, 7:] - shown_as(relit, -1)[:, 7:]) <= STEP).all()
    chromium("drag", path=[[CANVAS[0] / 2, 60], [CANVAS[0] / 2 + 3 * ZOOM, 60]])
    assert chromium.state()["split"] == pytest.approx(0.5 + 3 * ZOOM / CANVAS[0], abs=2e-3)
    chromium("press", keys=["c"])
    difference = (relit - reference) @ np.array([0.2126, 0.7152, 0.0722])
    seen = chromium.texels(14, 9, ZOOM).astype(int)
    sure = np.abs(difference) > 0.05
    assert sure.mean() > 0.5
    assert ((seen[..., 0] > seen[..., 2]) == (difference > 0))[sure].all()


def test_a_saved_folder_compares_on_any_host(
    chromium: Any, compared: tuple[Asset, Capture, str], serve_static: Callable[[Path], str], tmp_path: Path
) -> None:
    """It holds the capture's images and errors; it is replaced if that is asked for, and nothing else is."""
    _, capture, _ = compared
    line = ["view", str(tmp_path / "asset"), str(capture.folder), "--save"]

    def saved(*words: object) -> Result:
        return CliRunner().invoke(app, [*line, *map(str, words)])

    assert saved(tmp_path / "page.html").exit_code == 2, "one file has no capture"
    done = saved(tmp_path / "site")
    assert done.exit_code == 0, done.output
    assert saved(tmp_path / "site").exit_code == 1
    assert saved(tmp_path / "site", "--force").exit_code == 0
    assert saved(tmp_path / "asset", "--force").exit_code == 1
    nearest = int(np.argmax(capture.directions() @ [-0.45, -0.5, 0.74]))
    start = f"#{{'zoom':{ZOOM},'middle':[7,4.5],'exposure':-1,'compare':'reference'}}"
    chromium("open", url=serve_static(tmp_path / "site") + start, width=WIDTH, height=HEIGHT)
    assert (np.abs(chromium.texels(14, 9, ZOOM) - shown_as(capture.image(nearest), -1)) <= STEP).all()
    errors = json.loads((tmp_path / "site" / "capture" / "errors-0.json").read_text())
    assert len(json.dumps(errors)) > 100
