"""Light linking of a deep framebuffer on the page: direct light and bounces are numpy's, and lists of objects in the panel change them."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from made_rooms import Room
from made_views import view_of_room
from test_gloss import APART, MEAN, saved
from test_page import HEIGHT, WIDTH, lights_of, shown_as
from view_assets import with_objects

from srbf import relight
from srbf.asset import Asset
from srbf.light_linking import Objects
from srbf.lights import Light, PointLight
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.relighting.scene_lights import scene_lights

sys.path.append(str(Path(__file__).parents[1] / "bake"))
from light_set_commands import done, scenes_in

pytest.importorskip("embreex")

WALL = 1.5  # m: where it stands
EXPOSURE = 2.0
AWAY = 1.5  # times the mean error: pictures of lights without their links
KEY = {
    "kind": "point",
    "position": [0.8, 0.7, 1.1],
    "color": [1, 1, 1],
    "falloff": "inverse-square",
    "radius": 0.001,
    "receivers": {"without": ["Red"]},
    "blockers": {"without": ["Wall"]},
}
IN_BLENDER = """
import json, sys, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
def made(name, data=None):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj
things = [made(name, bpy.data.meshes.new(name)) for name in ("Gray", "Red", "Wall")]
own = bpy.data.collections.new("Own")
own.objects.link(things[2])
for name in ("Key", "Fill"):
    made(name, bpy.data.lights.new(name, "POINT")).light_linking.blocker_collection = own
for _ in range(2):
    exec(open(sys.argv[1]).read())
def links(collection):
    pairs = zip(collection.objects, collection.collection_objects)
    return {obj.name: member.light_linking.link_state for obj, member in pairs}
told = {}
for name in ("Key", "Fill"):
    linking = bpy.data.objects[name].light_linking
    told[name] = [one and links(one) for one in (linking.receiver_collection, linking.blocker_collection)]
print("TOLD" + json.dumps(told))
"""
PLAIN = PointLight((0.8, 0.7, 1.1), falloff="inverse-square", radius=0.001)


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """Of a room with a wall across that has a door, and one light, which passes the wall and leaves out the red one."""
    room = Room.box((3, 2, 2), 0.25, 0.6, wall=(WALL, 0.6, 1.4))
    view = view_of_room(tmp_path_factory.mktemp("view") / "capture", room, 2000, 150, tested=0)
    made = with_objects(DeepFramebuffer().encode(view), room, WALL)
    return replace(
        made, manifest={**made.manifest, "scene_lights": [{"name": "Key", "light": KEY}], "direct": {"sun_angle": 0.0, "footprint": 1e-3}}
    )


def apart(chromium: Any, asset: Asset, folder: Path, light: Light) -> np.ndarray:
    """How far the page's picture is from that of rays, bytes of covered pixels."""
    found, expected = saved(chromium, folder), shown_as(relight(asset, [light], direct="ray"), EXPOSURE)
    return np.abs(found - expected)[asset.images["coverage"] > 0.5]


def agrees(chromium: Any, asset: Asset, folder: Path, light: Light) -> bool:
    error = apart(chromium, asset, folder, light)
    return bool(np.quantile(error, 0.9) <= APART and error.mean() <= MEAN)


def ticked(chromium: Any, title: str, name: str) -> None:
    """Click an object's box in one of the panel's lists, or a button of that list."""
    found = f"[...document.querySelectorAll('.links')].find((list) => list.textContent.startsWith({json.dumps(title)}))"
    chromium("run", script=f"[...{found}.querySelectorAll('label, button')].find((one) => one.textContent === {json.dumps(name)}).click()")
    chromium("press", keys=[])


def lines(chromium: Any) -> list[str]:
    return chromium("run", script="[...document.querySelectorAll('.links summary')].map((line) => line.textContent)")


def test_a_light_shines_by_its_links_which_the_panel_changes(
    chromium: Any, asset: Asset, serve: Callable[..., str], tmp_path: Path
) -> None:
    asset.save(tmp_path / "asset")
    url = serve(tmp_path / "asset")
    chromium("open", url=f"{url}#{quote(json.dumps({'exposure': EXPOSURE}))}", width=WIDTH, height=HEIGHT)
    key = scene_lights(asset)["Key"]
    assert agrees(chromium, asset, tmp_path, key) and not agrees(chromium, asset, tmp_path, PLAIN)
    assert lines(chromium) == ["Shines onall but Red", "Shadowed byall but Wall"]
    ticked(chromium, "Shadowed by", "All")
    ticked(chromium, "Shines on", "Gray")
    assert lines(chromium) == ["Shines onWall", "Shadowed byall"]
    (light,) = chromium.state()["lights"]
    assert light["links"] == {"receivers": {"only": ["Wall"]}}
    on_wall = replace(PLAIN, receivers=Objects(only=("Wall",)))
    assert agrees(chromium, asset, tmp_path, on_wall)
    assert lights_of(chromium, tmp_path) == [[on_wall]]
    chromium("open", url=chromium("address"), width=WIDTH, height=HEIGHT)
    assert agrees(chromium, asset, tmp_path, on_wall)
    ticked(chromium, "Shines on", "All")
    assert "links" not in chromium.state()["lights"][0] and agrees(chromium, asset, tmp_path, PLAIN)
    chromium("run", script="new Promise((done) => setTimeout(done, 600))")
    chromium("press", keys=["Control+z"])
    assert lines(chromium)[0] == "Shines onWall" and agrees(chromium, asset, tmp_path, on_wall)
    chromium("run", script="[...document.querySelectorAll('.lil-gui button')].find((one) => one.textContent === 'As designed').click()")
    chromium("press", keys=[])
    assert agrees(chromium, asset, tmp_path, key)


def test_an_asset_of_a_former_version_says_that_it_shows_no_links_and_hands_them_on(
    chromium: Any, asset: Asset, serve: Callable[..., str], tmp_path: Path
) -> None:
    gather = {name: told for name, told in asset.manifest["gather"].items() if name != "objects"}
    older = replace(asset, manifest={**asset.manifest, "gather": gather})
    older.save(tmp_path / "asset")
    chromium("open", url=f"{serve(tmp_path / 'asset')}#{quote(json.dumps({'exposure': EXPOSURE}))}", width=WIDTH, height=HEIGHT)
    assert "without their links to objects: Key" in chromium("run", script="document.getElementById('status').textContent")
    assert lines(chromium) == [] and agrees(chromium, older, tmp_path, PLAIN)
    (frame,) = json.loads(chromium.file("Lights (FRAMES.json)"))["frames"]
    assert {link: frame["lights"][0][link] for link in ("receivers", "blockers")} == {link: KEY[link] for link in ("receivers", "blockers")}


@pytest.mark.slow
@pytest.mark.blender
def test_the_script_sets_links_that_were_changed(chromium: Any, asset: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    """Those of the key light; the fill light's stay Blender's."""
    lights = [{"name": name, "light": KEY} for name in ("Key", "Fill")]
    replace(asset, manifest={**asset.manifest, "scene_lights": lights}).save(tmp_path / "asset")
    chromium("open", url=serve(tmp_path / "asset"), width=WIDTH, height=HEIGHT)
    ticked(chromium, "Shines on", "None")
    ticked(chromium, "Shadowed by", "Gray")
    script = tmp_path / "lights.py"
    script.write_bytes(chromium.file("Lights for Blender (Python)"))
    ran = subprocess.run([sys.executable, "-c", IN_BLENDER, str(script)], capture_output=True, text=True, check=True)
    told = json.loads(ran.stdout.split("TOLD")[1].splitlines()[0])
    assert [set(one.values()) for one in told["Key"]] == [{"INCLUDE"}, {"INCLUDE"}]
    assert not set(told["Key"][0]) & {"Gray", "Red", "Wall"} and set(told["Key"][1]) == {"Red"}
    assert told["Fill"] == [None, {"Wall": "INCLUDE"}]


@pytest.mark.slow
@pytest.mark.blender
def test_lights_of_a_blend_are_those_of_numpy(
    chromium: Any, serve: Callable[..., str], tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Of a room with two boxes and a crate, one light after the other: point, spot, sphere and area."""
    view = ["--receiver", "view", "--size", "80x45", "--light-set", "gather", "--pool", 2000, "--holdout", 0]
    done("bake", scenes_in(tmp_path_factory)("linked"), "-o", tmp_path / "capture", *view)
    done("fit", tmp_path / "capture", "-o", tmp_path / "asset")
    asset = Asset.open(tmp_path / "asset")
    url, lights = serve(tmp_path / "asset"), dict[str, Any](scene_lights(asset))
    chromium("open", url=f"{url}#{quote(json.dumps({'terms': 'indirect'}))}", width=WIDTH, height=HEIGHT)
    states = chromium.state()["lights"]
    all_ = next(state for state in states if state["name"] == "All")
    low = {"position": [2.6, 0.7, 0.9], "links": {"blockers": {"without": ["Tile"]}}, "name": "No shadow of the tile"}
    lights["No shadow of the tile"] = replace(lights["All"], position=(2.6, 0.7, 0.9), blockers=Objects(without=("Tile",)))
    for state in [*states, all_ | low]:
        name = state["name"]
        hashed = json.dumps({"lights": [state], "selected": 0, "exposure": EXPOSURE})
        chromium("open", url=f"{url}#{quote(hashed)}", width=WIDTH, height=HEIGHT)
        assert agrees(chromium, asset, tmp_path, lights[name]), name
        bare = replace(lights[name], receivers=None, blockers=None)
        hidden = name == "No shadow of things"  # they hide their shadows themselves
        own, other = (apart(chromium, asset, tmp_path, light).mean() for light in (lights[name], bare))
        assert lights[name] == bare or hidden or other > AWAY * own, (name, own, other)
