"""A shot's own lights on the page: their names and values, as designed again, and what is saved of them."""

from __future__ import annotations

import base64
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
from made_profiles import UNEVEN
from made_rooms import Room
from made_views import view_of_room
from test_page import HEIGHT, WIDTH, ZOOM
from test_shot import EXPOSURE, shows

from srbf.asset import Asset
from srbf.cli.light_arguments import read_frames
from srbf.light_profile import axes_of
from srbf.lights import AreaLight, PointLight
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.relighting.scene_lights import scene_lights

pytest.importorskip("embreex")

LIGHTS: list[dict[str, Any]] = [
    {"name": "Key", "light": {"kind": "point", "position": [0.8, 0.7, 1.1], "color": [0.5, 0.25, 0.1], "falloff": "inverse-square"}},
    {
        "name": "Fill <b>",
        "light": {
            "kind": "spot",
            "position": [2, 1, 1.5],
            "direction": [0.196116, 0, -0.980581],
            "inner": 0.35,
            "outer": 0.6,
            "color": [0.6, 0.6, 0.6],
            "falloff": "inverse-square",
            "size": 0.02,
        },
    },
    {"name": "Panel", "light": {"kind": "area", "position": [1.5, 1, 1.7], "u": [-0.6, 0, 0], "v": [0, 0.3, 0], "color": [0.3, 0.3, 0.5]}},
    {"name": "Globe", "light": {"kind": "sphere", "position": [1, 1.4, 0.6], "size": 0.1, "color": [0.2, 0.3, 0.2]}},
]
IN_BLENDER = """
import json, sys, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
def light(name, kind, **values):
    made = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
    for key, value in values.items():
        setattr(made.data, key, value)
    bpy.context.scene.collection.objects.link(made)
light("Key", "POINT", energy=1, exposure=2)
light("Panel", "AREA", shape="DISK")
light("Globe", "POINT")
light("Fill <b>", "SPOT", shadow_soft_size=0.3)
exec(open(sys.argv[1]).read())
exec(open(sys.argv[1]).read())
bpy.context.view_layer.update()
print("TOLD" + json.dumps({
    o.name: [o.data.energy * 2**o.data.exposure, list(o.data.color), [list(row) for row in o.matrix_world], o.hide_render,
             [c.name for c in o.users_collection], getattr(o.data, "size", 0), getattr(o.data, "shape", ""),
             getattr(o.data, "shadow_soft_size", 0)]
    for o in bpy.data.objects
}))
"""

TEXTURED = """
import json, sys, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
made = bpy.data.objects.new("Washer", bpy.data.lights.new("Washer", "POINT"))
bpy.context.scene.collection.objects.link(made)
made.data.use_nodes = True
tree = made.data.node_tree
shader = next(node for node in tree.nodes if node.type == "EMISSION")
texture = tree.nodes.new("ShaderNodeTexIES")
texture.inputs["Strength"].default_value = 2
shader.inputs["Color"].default_value = (0.5, 0.2, 0.1, 1)
tree.links.new(texture.outputs["Fac"], shader.inputs["Strength"])
exec(open(sys.argv[1]).read())
bpy.context.view_layer.update()
told = made.data
from_nodes = [link.from_node.type for link in tree.links if link.to_socket == shader.inputs["Strength"]]
print("TOLD" + json.dumps([told.energy, list(told.color), [list(row) for row in made.matrix_world], from_nodes,
                           list(shader.inputs["Color"].default_value), told.use_nodes]))
"""


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    room = Room.box((3, 2, 2), 0.25, 0.6)
    made = DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("view") / "capture", room, 700, 150, tested=0))
    made.manifest |= {"scene_lights": LIGHTS, "scene_lights_left_out": [{"name": "Door", "reason": "a portal shows the world"}]}
    return made


@pytest.fixture
def page(chromium: Any, asset: Asset, serve: Callable[..., str], tmp_path: Path) -> Callable[..., None]:
    asset.save(tmp_path / "asset")
    url = serve(tmp_path / "asset")

    def open_it(**state: Any) -> None:
        hashed = {"zoom": ZOOM, "middle": [asset.width / 2, asset.height / 2], "terms": "indirect", "exposure": EXPOSURE, **state}
        chromium("open", url=f"{url}#{quote(json.dumps(hashed))}", width=WIDTH, height=HEIGHT)

    return open_it


def names(chromium: Any) -> list[str]:
    return chromium("run", script="[...document.querySelectorAll('#chips button')].map((chip) => chip.textContent)")


def pressed(chromium: Any, name: str) -> None:
    """Click a button of the panel."""
    chromium("run", script=f"[...document.querySelectorAll('.lil-gui button')].find((b) => b.textContent === {json.dumps(name)}).click()")
    chromium("press", keys=[])


def test_it_opens_with_the_lights_of_the_scene(chromium: Any, asset: Asset, page: Callable[..., None]) -> None:
    page()
    assert names(chromium) == ["Key", "Fill <b>", "Panel", "Globe"]
    assert shows(chromium, asset, list(scene_lights(asset).values()))
    assert "lights left out: Door" in chromium("run", script="document.getElementById('status').textContent")
    state = chromium.state()
    page(**state)
    assert names(chromium) == ["Key", "Fill <b>", "Panel", "Globe"] and chromium.state()["lights"] == state["lights"]


def test_lights_are_muted_changed_and_set_as_designed_again(chromium: Any, asset: Asset, page: Callable[..., None]) -> None:
    page()
    before = chromium.state()["lights"]
    key = scene_lights(asset)["Key"]
    chromium("press", keys=["s"])  # the first alone
    assert shows(chromium, asset, [key])
    chromium("press", keys=["s"])
    chromium("number", name="Position x (m)", value=1.9)
    chromium("choose", selector="#chips select", value="directional")
    chromium("press", keys=["2", "Delete"])
    chromium("run", script="new Promise((done) => setTimeout(done, 600))")
    assert names(chromium) == ["Key", "Panel", "Globe", "Directional"] and chromium.state()["lights"][0]["position"][0] == 1.9
    chromium("press", keys=["4"])
    chromium("number", name="Elevation (°)", value=60)
    chromium("number", name="Azimuth (°)", value=0)
    chromium("number", name="Intensity", value=0)
    assert chromium.state()["lights"][3]["direction"] == pytest.approx([0.5, 0, 0.86603], abs=1e-4)
    pressed(chromium, "As designed")
    assert names(chromium) == ["Key", "Fill <b>", "Panel", "Globe", "Directional"]
    assert chromium.state()["lights"][:4] == before
    assert shows(chromium, asset, list(scene_lights(asset).values()))
    chromium("run", script="new Promise((done) => setTimeout(done, 600))")
    chromium("press", keys=["Control+z"])
    assert names(chromium) == ["Key", "Panel", "Globe", "Directional"]


def test_more_lights_than_the_page_takes_are_named(chromium: Any, asset: Asset, serve: Callable[..., str], tmp_path: Path) -> None:
    many = [{"name": f"Bulb {i:02d}", "light": LIGHTS[0]["light"]} for i in range(18)]
    before, asset.manifest["scene_lights"] = asset.manifest["scene_lights"], many
    asset.save(tmp_path / "many")
    asset.manifest["scene_lights"] = before
    chromium("open", url=serve(tmp_path / "many"), width=WIDTH, height=HEIGHT)
    assert len(names(chromium)) == 16
    assert "lights past 16: Bulb 16, Bulb 17" in chromium("run", script="document.getElementById('status').textContent")


@pytest.fixture
def shaped(asset: Asset, tmp_path: Path) -> Path:
    """An asset one of whose scene's lights has an IES file."""
    washer = {**LIGHTS[0]["light"], "profile": "Downlight.ies", "direction": [0.6, 0.0, -0.8], "roll": 0.5}
    own = {"scene_lights": [{"name": "Washer", "light": washer}, *LIGHTS[1:]], "scene_profiles": {"Downlight.ies": UNEVEN}}
    replace(asset, manifest={**asset.manifest, **own}).save(tmp_path / "shaped")
    return tmp_path / "shaped"


def test_frames_take_profiles_of_the_scene_alone(chromium: Any, shaped: Path, serve: Callable[..., str]) -> None:
    chromium("open", url=serve(shaped), width=WIDTH, height=HEIGHT)
    assert names(chromium)[0] == "Washer"
    for profile, said in (("Downlight.ies", ""), ("Other.ies", "expected a profile of Downlight.ies")):
        frames = json.dumps({"frames": [{"lights": [{**LIGHTS[0]["light"], "profile": profile, "roll": 0.25}]}]})
        chromium("drop", name="FRAMES.json", bytes=base64.b64encode(frames.encode()).decode())
        toast = chromium("run", script="document.getElementById('toast').textContent")
        assert said in toast if said else "expected" not in toast
    (light,) = chromium.state()["lights"]
    assert light["profile"] == "Downlight.ies" and light["roll"] == pytest.approx(np.degrees(0.25), abs=1e-4)


@pytest.mark.slow
@pytest.mark.blender
def test_the_script_keeps_the_texture_of_a_light_with_a_profile(
    chromium: Any, shaped: Path, serve: Callable[..., str], tmp_path: Path
) -> None:
    """Its strength is what the page says over that of the texture; the object is turned so that the profile is."""
    chromium("open", url=serve(shaped), width=WIDTH, height=HEIGHT)
    script = tmp_path / "lights.py"
    script.write_bytes(chromium.file("Lights for Blender (Python)"))
    done = subprocess.run([sys.executable, "-c", TEXTURED, str(script)], capture_output=True, text=True, check=True)
    energy, color, matrix, strength, emission, nodes = json.loads(done.stdout.split("TOLD")[1].splitlines()[0])
    assert nodes and strength == ["TEX_IES"] and emission == [1, 1, 1, 1]
    assert 2 * energy * np.array(color) == pytest.approx(4 * np.pi * np.array(LIGHTS[0]["light"]["color"]), rel=1e-5)
    expected = np.stack(axes_of((0.6, 0.0, -0.8), 0.5), axis=1) * [1, 1, -1]
    np.testing.assert_allclose(np.array(matrix)[:3, :3], expected, atol=1e-5)


def test_frames_have_their_names_and_exact_colors(chromium: Any, asset: Asset, page: Callable[..., None], tmp_path: Path) -> None:
    page()
    chromium("press", keys=["4", "Delete"])
    path = tmp_path / "frames.json"
    path.write_bytes(chromium.file("Lights (FRAMES.json)"))
    (frame,) = json.loads(path.read_text())["frames"]
    assert [light["name"] for light in frame["lights"]] == ["Key", "Fill <b>", "Panel"] and frame["off"] == ["Globe"]
    assert frame["lights"][1]["size"] == 0.02
    assert [light["color"] for light in frame["lights"]] == [one["light"]["color"] for one in LIGHTS[:3]]
    (read,) = read_frames(path)
    for found, own in zip(read, list(scene_lights(asset).values())[:3], strict=True):
        assert isinstance(found, PointLight | AreaLight) and isinstance(own, PointLight | AreaLight)
        np.testing.assert_allclose(found.position, own.position, atol=1e-5)
        np.testing.assert_allclose(found.color, own.color)


def test_a_frame_leaves_nothing_of_the_light_before(chromium: Any, shaped: Path, serve: Callable[..., str]) -> None:
    """Of a point light with a name, a profile and light linking, a bare one."""
    chromium("open", url=serve(shaped), width=WIDTH, height=HEIGHT)
    bare = LIGHTS[0]["light"]
    for own in ({"name": "Washer", "profile": "Downlight.ies", "receivers": {"only": ["Red"]}}, {}):
        frames = json.dumps({"frames": [{"lights": [{**bare, **own}]}]})
        chromium("drop", name="FRAMES.json", bytes=base64.b64encode(frames.encode()).decode())
    (light,) = chromium.state()["lights"]
    assert not {"name", "profile", "links", "direction", "roll"} & light.keys()


@pytest.mark.slow
@pytest.mark.blender
def test_the_script_sets_lights_that_the_scene_has_and_makes_the_others(chromium: Any, page: Callable[..., None], tmp_path: Path) -> None:
    page()
    chromium("press", keys=["4", "Delete", "1"])
    chromium("number", name="Position z (m)", value=0.4)
    chromium("number", name="Intensity", value=1)
    chromium("choose", selector="#chips select", value="sphere")
    script = tmp_path / "lights.py"
    script.write_bytes(chromium.file("Lights for Blender (Python)"))
    done = subprocess.run([sys.executable, "-c", IN_BLENDER, str(script)], capture_output=True, text=True, check=True)
    told = json.loads(done.stdout.split("TOLD")[1].splitlines()[0])
    assert set(told) == {"Key", "Fill <b>", "Panel", "Globe", "srbf sphere 4"}
    key, fill, panel, globe, made = (told[name] for name in ("Key", "Fill <b>", "Panel", "Globe", "srbf sphere 4"))
    assert key[0] == pytest.approx(4 * np.pi, rel=1e-5) and key[2][2][3] == pytest.approx(0.4, abs=1e-5)
    assert panel[0] == pytest.approx(0.5 * np.pi, rel=1e-5) and panel[1] == pytest.approx([0.6, 0.6, 1], abs=1e-5)
    assert panel[5] == pytest.approx(0.6 * 2 / np.sqrt(np.pi), rel=1e-4) and panel[6] == "ELLIPSE"
    assert fill[7] == pytest.approx(0.02)
    assert [one[3] for one in (key, fill, panel, globe, made)] == [False, False, False, True, False]
    assert [one[4] for one in (key, fill, panel, globe, made)] == [
        ["Scene Collection"],
        ["Scene Collection"],
        ["Scene Collection"],
        ["Scene Collection"],
        ["srbf lights"],
    ]
