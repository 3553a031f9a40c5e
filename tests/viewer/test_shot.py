"""A deep framebuffer on the page: its picture is numpy's; lights alone, by temperature, taken back, made in Blender."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from made_rooms import Room
from made_views import view_of_room, with_backs, with_lobes
from test_page import HEIGHT, STEP, WIDTH, ZOOM, lights_of, shown_as

from srbf.asset import Asset
from srbf.io.image import write_image
from srbf.lights import AreaLight, EnvironmentLight, Light, PointLight
from srbf.methods import relight
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.viewer import page_manifest
from srbf.viewer.contents import contents_of, read

pytest.importorskip("embreex")

CLOSE = 2e-3  # of the largest value
AROUND_APART = 2.0  # bytes: hundreds of shadow maps beside rays
EXPOSURE = 3.0
COMMON: dict[str, Any] = {"on": True, "color": "#ffffff", "intensity": 1, "falloff": "inverse-square", "radius": 0.001}
POINT: dict[str, Any] = {"kind": "point", **COMMON, "position": [0.8, 0.7, 1.1], "a0": 0.5}
SPOT: dict[str, Any] = {"kind": "spot", **COMMON, "position": [2, 1, 1.5], "target": [2.2, 1, 0.5], "a0": 1, "inner": 20, "outer": 35}
AREA: dict[str, Any] = {
    "kind": "area",
    **COMMON,
    "position": [1.5, 1, 1.7],
    "target": [1.5, 1, 0],
    "width": 0.6,
    "height": 0.3,
    "turn": 0,
    "a0": 1,
}
AREA = {key: value for key, value in AREA.items() if key not in ("falloff", "radius")}
OF_POINT = PointLight((0.8, 0.7, 1.1), a0=0.5, falloff="inverse-square", radius=0.001)
OF_AREA = AreaLight((1.5, 1, 1.7), u=(-0.6, 0, 0), v=(0, 0.3, 0))
READ_BACK = """
import json, sys, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
exec(open(sys.argv[1]).read())
bpy.context.view_layer.update()
told = [
    [o.name, o.data.type, o.data.energy, list(o.data.color), [list(row) for row in o.matrix_world], o.hide_render]
    for o in bpy.data.objects
]
spot = bpy.data.objects["srbf spot 2"].data
print("TOLD" + json.dumps([told, spot.spot_size, spot.spot_blend]))
"""


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    room = Room.box((3, 2, 2), 0.25, 0.6)
    return DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("view") / "capture", room, 700, 150, tested=0))


@pytest.fixture
def page(chromium: Any, asset: Asset, serve: Callable[..., str], tmp_path: Path) -> Callable[..., None]:
    asset.save(tmp_path / "asset")
    url = serve(tmp_path / "asset")

    def open_it(*lights: dict[str, Any]) -> None:
        state: dict[str, Any] = {"zoom": ZOOM, "middle": [asset.width / 2, asset.height / 2], "terms": "indirect", "exposure": EXPOSURE}
        hashed = json.dumps(state | ({"lights": lights, "selected": 0} if lights else {}))
        chromium("open", url=f"{url}#{quote(hashed)}", width=WIDTH, height=HEIGHT)

    return open_it


def shows(chromium: Any, asset: Asset, lights: list[Light]) -> bool:
    linear = relight(asset, lights)
    error = CLOSE * linear.max()
    assert np.ptp(shown_as(linear, EXPOSURE)) > 60
    found = chromium.texels(asset.width, asset.height, ZOOM)
    least, most = (shown_as(linear + sign * error, EXPOSURE) + sign * STEP for sign in (-1, 1))
    covered = asset.images["coverage"] > 0.5
    return bool(((least <= found) & (found <= most))[covered].all())


def test_it_opens_with_a_light_in_free_space_which_moves(chromium: Any, asset: Asset, page: Callable[..., None]) -> None:
    page()
    (light,) = chromium.state()["lights"]
    assert light["kind"] == "point" and light["position"] in np.round(asset.manifest["free_places"], 5).tolist()
    page(POINT)
    assert shows(chromium, asset, [OF_POINT])
    chromium("number", name="Position x (m)", value=1.9)
    assert shows(chromium, asset, [PointLight((1.9, 0.7, 1.1), a0=0.5, falloff="inverse-square", radius=0.001)])
    assert "Coefficient map" not in chromium("run", script="document.getElementById('controls').textContent")


def test_lights_are_heard_alone_colored_by_temperature_and_taken_back(
    chromium: Any, asset: Asset, page: Callable[..., None], tmp_path: Path
) -> None:
    page(POINT, AREA)
    both = chromium.texels(asset.width, asset.height, ZOOM)
    assert shows(chromium, asset, [OF_POINT, OF_AREA])
    chromium("press", keys=["s"])
    assert shows(chromium, asset, [OF_POINT])
    assert [light.get("solo") for light in chromium.state()["lights"]] == [True, None]
    assert len(lights_of(chromium, tmp_path)[0]) == 1
    chromium("run", script="new Promise((done) => setTimeout(done, 600))")
    chromium("number", name="Temperature (K)", value=2700)
    warm = chromium.state()["lights"][0]
    assert warm["kelvin"] == 2700 and warm["color"] == "#ffad59"  # of a black body: 1, 0.42, 0.10 linear
    chromium("press", keys=["Control+z"])
    assert chromium.state()["lights"][0]["color"] == "#ffffff"
    chromium("press", keys=["Control+z"])
    assert (chromium.texels(asset.width, asset.height, ZOOM) == both).all()
    chromium("press", keys=["Control+y"])
    assert shows(chromium, asset, [OF_POINT])


@pytest.mark.slow
@pytest.mark.blender
def test_the_script_makes_the_lights_in_blender(chromium: Any, page: Callable[..., None], tmp_path: Path) -> None:
    """Where they are, where they shine, how much: a point light of P watts gives P / 4 pi r^2, a Lambertian area P / pi r^2 on its axis."""
    page(POINT, SPOT, {**AREA, "on": False, "color": "#ff0000", "intensity": 3})
    script = tmp_path / "lights.py"
    script.write_bytes(chromium.file("Lights for Blender (Python)"))
    done = subprocess.run([sys.executable, "-c", READ_BACK, str(script)], capture_output=True, text=True, check=True)
    told, size, blend = json.loads(done.stdout.split("TOLD")[1].splitlines()[0])
    point, spot, area = sorted(told, key=lambda one: one[0].split()[-1])
    assert [one[1] for one in (point, spot, area)] == ["POINT", "SPOT", "AREA"] and [one[5] for one in (point, spot, area)] == [
        False,
        False,
        True,
    ]
    assert [point[2], spot[2], area[2]] == pytest.approx([4 * np.pi * 0.25, 4 * np.pi, 3 * np.pi], rel=1e-5)
    np.testing.assert_allclose(area[3], [1, 0, 0], atol=1e-6)
    for one, state in ((point, POINT), (spot, SPOT), (area, AREA)):
        np.testing.assert_allclose(np.array(one[4])[:3, 3], state["position"], atol=1e-5)
    for one, state in ((spot, SPOT), (area, AREA)):
        toward = np.subtract(state["target"], state["position"])
        np.testing.assert_allclose(-np.array(one[4])[:3, 2], toward / np.linalg.norm(toward), atol=1e-5)
        assert np.linalg.det(np.array(one[4])[:3, :3]) == pytest.approx(1, abs=1e-5)
    inner, outer = np.cos(np.radians([20, 35]))
    assert size == pytest.approx(np.radians(70), rel=1e-5) and blend == pytest.approx((inner - outer) / (1 - outer), rel=1e-5)


def test_the_page_is_served_the_places_that_bright_surfels_light(asset: Asset, tmp_path: Path) -> None:
    asset.save(tmp_path / "asset")
    assert "asset/view_points.exr" in contents_of([tmp_path / "asset"])


@pytest.mark.slow
def test_an_environment_that_is_dropped_bounces(
    chromium: Any, serve: Callable[..., str], tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """In a room without a lid; the other light goes off."""
    room = Room.box((3, 2, 2), 0.25, 0.6, lid=False)
    asset = DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("open") / "capture", room, 400, 100, tested=0))
    asset.save(tmp_path / "asset")
    state = {"zoom": ZOOM, "middle": [asset.width / 2, asset.height / 2], "terms": "indirect", "exposure": 1.0, "lights": [POINT]}
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{quote(json.dumps(state | {'selected': 0}))}", width=WIDTH, height=HEIGHT)
    image = np.random.default_rng(3).uniform(0, 3, (8, 16, 3)).astype(np.float32)
    write_image(tmp_path / "around.exr", image, "float")
    chromium("drop", name="around.exr", bytes=base64.b64encode((tmp_path / "around.exr").read_bytes()).decode())
    assert [light["on"] for light in chromium.state()["lights"]] == [False, True]
    apart = np.abs(chromium.texels(asset.width, asset.height, ZOOM) - shown_as(relight(asset, [EnvironmentLight(image)]), 1.0))
    covered = asset.images["coverage"] > 0.5
    assert np.quantile(apart[covered], 0.99) <= AROUND_APART and np.ptp(shown_as(relight(asset, [EnvironmentLight(image)]), 1.0)) > 60


def test_the_page_is_served_what_lobes_and_backs_need(asset: Asset, tmp_path: Path) -> None:
    for name, one in {"plain": asset, "shiny": with_lobes(asset), "thin": with_backs(asset)}.items():
        one.save(tmp_path / name)
    found = {name: contents_of([tmp_path / name]) for name in ("plain", "shiny", "thin")}
    told = {name: json.loads(read(contents[page_manifest.NAME])) for name, contents in found.items()}
    assert not any(one["notes"] for one in told.values())
    assert told["shiny"]["assets"][0]["lobe_albedo"] in found["shiny"] and "lobe_albedo" not in told["plain"]["assets"][0]
    assert {"asset/glossy.exr", "asset/gloss_neighbors.png"} <= found["shiny"].keys() and "asset/transmission.exr" in found["thin"]
