"""The extension in Blender: it comes and goes, its operators refuse and start, and its command is the library's."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from srbf.cli import app

pytestmark = pytest.mark.blender
ROOT = Path(__file__).parents[2]

# A stand-in for the library: reports its arguments, prints what a bake prints, and ends like one.
DOUBLE = """
import json, pathlib, sys, time
pathlib.Path({asked!r}).write_text(json.dumps(sys.argv[1:]))
try:
    for i in range({lights}):
        print(json.dumps({{"done": i + 1, "total": {lights}, "what": "light", "seconds_left": 1}}), file=sys.stderr, flush=True)
        time.sleep(0.2)
except KeyboardInterrupt:
    print("srbf: stopped", file=sys.stderr)
    sys.exit(1)
"""


@pytest.fixture
def double(tmp_path):
    def write(lights):
        path = tmp_path / "double.py"
        path.write_text(DOUBLE.format(asked=str(tmp_path / "asked.json"), lights=lights))
        return str(path)

    return write


def test_registers_and_unregisters_twice(in_blender) -> None:
    found = in_blender("twice")
    registered, panel, handlers = found["before"]
    assert registered and panel
    assert found["gone"] == [False, False, [count - 1 for count in handlers]]
    assert found["again"]


def test_what_is_refused_and_when(in_blender, make_asset, tmp_path) -> None:
    make_asset("moved", asset_from_world=[[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    make_asset("view", receiver={"kind": "view", "camera": "Camera"})  # its own key, before what the source says
    make_asset("other layer", source={"receiver": {"kind": "lightmap", "object": "Plane", "uv_layer": "gone"}})
    make_asset("outside")
    manifest = json.loads((tmp_path / "outside" / "asset.json").read_text())
    manifest["maps"][0]["file"] = "../secret.exr"
    (tmp_path / "outside" / "asset.json").write_text(json.dumps(manifest))
    (tmp_path / "scene").mkdir()
    names = ["moved", "view", "other layer", "outside", "nowhere"]
    found = in_blender("refusals", folder=str(tmp_path / "scene"), assets=[str(tmp_path / name) for name in names])
    nothing, unsaved, saved, baked = found["polls"]
    assert nothing == unsaved == [False] * 5
    assert saved == [True, False, False, False, False]
    assert baked == [True, False, True, False, False]
    expected = ["moved by asset_from_world", "found a view", "expected the UV layer 'gone'", "expected files inside", "found no asset.json"]
    for words, part in zip(found["words"], expected, strict=True):
        assert part in words


def test_bake_starts_the_library_on_a_copy_of_the_scene(in_blender, double, tmp_path) -> None:
    found = in_blender("bake", folder=str(tmp_path), host=double(5))
    assert found["results"] == [["FINISHED"]]
    assert found["refused"] and found["copy"]
    assert found["seen"][-1] == 5 and len(set(found["seen"])) > 1
    assert found["last"] == "Bake: done"
    asked = json.loads((tmp_path / "asked.json").read_text())
    folder = tmp_path / "srbf" / "Plane"
    assert asked[:6] == ["bake", str(folder / "scene.blend"), "--output", str(folder / "capture"), "--receiver", "lightmap:Plane"]
    known = {flag for parameter in get_command(app).commands["bake"].params for flag in parameter.opts}
    assert {word for word in asked if word.startswith("--")} <= known


def test_a_true_bake_is_heard_and_fits(in_blender, tmp_path) -> None:
    host = ROOT / "blender_extension" / "host.py"
    found = in_blender(
        "bake", folder=str(tmp_path), host=str(host), settings={"width": 8, "height": 8, "lights": 3, "samples": 1}, fit=True
    )
    assert found["results"] == [["FINISHED"], ["FINISHED"]]
    assert found["last"] == "Fit: done", found
    assert found["seen"] == sorted(found["seen"]) and found["seen"][-1] > 0
    assert (tmp_path / "srbf" / "Plane" / "asset" / "asset.json").is_file()
    assert found["state"] == "done"


def test_stop_asks_the_bake_to_end(in_blender, double, tmp_path) -> None:
    found = in_blender("bake", folder=str(tmp_path), host=double(50), stop=True)
    assert found["results"] == [["FINISHED"], ["FINISHED"]]
    assert found["seen"][-1] < 50
    assert found["last"] == "Bake: stopped"


def test_show_and_hide_leave_nothing_behind(in_blender, make_asset, tmp_path) -> None:
    make_asset(k=2)
    found = in_blender("round_trip", asset=str(tmp_path / "asset"))
    assert found["before"] == found["after"]
    shown, twin, baked, again, hidden = found["states"][:5]
    assert found["states"][5:] == found["states"][:5]
    assert shown == again == ["srbf Paint", "srbf Plane"]
    assert twin == baked == hidden == ["Paint", None]
    assert found["links"] == ["DATA", "DATA"]
    assert found["bare"] == 0
    assert found["images"] == 3  # two maps and the ambient, read from their files; no atlas


def test_the_command_bakes_the_open_file(in_blender, tmp_path) -> None:
    scene = tmp_path / "scene.blend"
    subprocess.run(
        [sys.executable, str(ROOT / "data" / "scenes" / "closed_form_scenes.py"), "plane", str(scene)],
        check=True,
        capture_output=True,
        timeout=60,
    )
    asked = ["bake", "-o", str(tmp_path / "capture"), "--receiver", "lightmap:Plane", "--size", "8", "--lights", "2"]
    asked += ["--validation", "0", "--holdout", "0", "--samples", "1"]
    found = in_blender("command", scene=str(scene), arguments=asked)
    assert found["status"] == 0, found["stderr"]
    assert (tmp_path / "capture" / "capture.json").is_file()
    assert in_blender("command", arguments=["fit", str(tmp_path / "none"), "-o", str(tmp_path / "asset")])["status"] == 1
    assert in_blender("command", arguments=["fit"])["status"] == 2


def test_what_the_command_adds(in_blender) -> None:
    rest = ["-o", "capture", "--receiver", "view", "--dry-run"]
    cases = [
        ["bake", *rest],
        ["bake", *rest, "other.blend"],
        ["bake", "--blender=/mine", *rest],
        ["fit", "capture", "-o", "asset"],
        [],
        ["--version"],
        ["bake", "--help"],
    ]
    found = in_blender("completions", cases=cases)
    assert found["completed"] == [
        ["bake", "open.blend", "--blender", "/blender", *rest],
        ["bake", "--blender", "/blender", *rest, "other.blend"],
        ["bake", "open.blend", "--blender=/mine", *rest],
        *cases[3:],
    ]
