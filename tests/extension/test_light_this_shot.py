"""Light This Shot: bake, fit and page one after the other; and lights taken back from the page."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from npm_package import npm, viewer_page
from typer.main import get_command

from srbf.cli import app

sys.path.append(str(Path(__file__).parents[1] / "bake"))
from light_set_commands import scenes_in

__all__ = ["npm", "viewer_page"]  # fixtures
pytestmark = pytest.mark.blender
ROOT = Path(__file__).parents[2]

# A stand-in for the library: reports its arguments; its page serves until it is stopped.
DOUBLE = """
import json, pathlib, sys, time
with open({asked!r}, "a") as file:
    file.write(json.dumps(sys.argv[1:]) + "\\n")
if sys.argv[1] == {failing!r}:
    print("srbf: expected something else", file=sys.stderr)
    sys.exit(1)
if sys.argv[1] == "view":
    print("http://127.0.0.1:1/", flush=True)
    time.sleep(60)
"""


def asked(tmp_path: Path, in_blender, failing: str = "") -> tuple[dict, list[list[str]]]:
    path = tmp_path / "double.py"
    path.write_text(DOUBLE.format(asked=str(tmp_path / "asked.json"), failing=failing))
    found = in_blender("light_shot", folder=str(tmp_path / "srbf"), host=str(path))
    return found, [json.loads(line) for line in (tmp_path / "asked.json").read_text().splitlines()]


def test_bake_fit_and_page_follow_each_other(in_blender, tmp_path) -> None:
    found, (bake, fit, view) = asked(tmp_path, in_blender)
    assert found["refused"] and found["results"] == [["FINISHED"]] and found["page"] and "http://127.0.0.1" in found["told"]
    folder = tmp_path / "srbf" / "Shot__1 shot"
    assert (folder / "scene.blend").is_file()
    assert bake[:8] == [
        "bake",
        str(folder / "scene.blend"),
        "--output",
        str(folder / "capture"),
        "--receiver",
        "view:Shot: 1",
        "--size",
        "24x14",
    ]
    assert bake[bake.index("--light-set") + 1] == "gather" and fit[:2] == ["fit", str(folder / "capture")]
    assert view[:4] == ["view", str(folder / "asset"), "--scene", str(folder / "scene.blend")]
    commands: Any = vars(get_command(app))["commands"]
    for name, *words in (bake, fit, view):
        known = {flag for parameter in commands[name].params for flag in parameter.opts}
        assert {word for word in words if word.startswith("--")} <= known


def test_a_bake_that_fails_opens_no_page(in_blender, tmp_path) -> None:
    found, commands = asked(tmp_path, in_blender, failing="bake")
    assert len(commands) == 1 and not found["page"] and found["last"] == "Bake: expected something else"


@pytest.mark.slow
@pytest.mark.usefixtures("built")
def test_a_true_shot_is_served(in_blender, tmp_path, tmp_path_factory) -> None:
    pytest.importorskip("embreex")
    scene = scenes_in(tmp_path_factory)("room")
    host = tmp_path / "host.py"
    more = "import sys\nsys.argv += {'view': ['--no-browser'], 'bake': ['--pool', '600']}.get(sys.argv[1], [])\n"
    host.write_text(more + (ROOT / "blender_extension" / "host.py").read_text())
    found = in_blender("light_shot", folder=str(tmp_path / "srbf"), host=str(host), scene=str(scene))
    assert found["page"] and "http://127.0.0.1" in found["told"], found
    told = json.loads((tmp_path / "srbf" / "Camera shot" / "asset" / "asset.json").read_text())
    assert [one["name"] for one in told["scene_lights"]]


LINKS = ("receivers", "blockers")


def test_lights_are_taken_back_by_name(in_blender, tmp_path) -> None:
    entries: list[dict[str, Any]] = [
        {
            **{"name": "Key", "kind": "point", "position": [1, 2, 0.5], "color": [1, 0.5, 0.25], "a0": 2},
            **{"receivers": {"without": ["Box"]}, "blockers": {"only": ["Box", "Gone"]}},
        },
        {"name": "Globe", "kind": "sphere", "position": [0, 1, 1], "size": 0.2, "color": [0.5, 0.5, 0.5], "blockers": {"only": []}},
        {
            "name": "Spot",
            "kind": "spot",
            "position": [0, 0, 2],
            "direction": [0.6, 0, -0.8],
            "inner": 0.3,
            "outer": 0.5,
            "color": [2, 2, 2],
        },
        {"name": "Panel", "kind": "area", "position": [0, 0, 2], "u": [0.5, 0, 0], "v": [0, -0.3, 0], "color": [1, 1, 1]},
        {"name": "Disk", "kind": "area", "position": [0, 0, 2], "u": [0.5, 0, 0], "v": [0, -0.5, 0], "color": [1, 1, 1]},
        {"name": "Sun", "kind": "directional", "direction": [0.6, 0, 0.8], "color": [3, 3, 1.5]},
        {"name": "Nobody", "kind": "point", "position": [0, 0, 0]},
        {"kind": "point", "position": [0, 0, 0]},
    ]
    rig = tmp_path / "FRAMES.json"
    rig.write_text(json.dumps({"frames": [{"lights": entries, "off": ["Fill"]}]}))
    plain = tmp_path / "PLAIN.json"
    plain.write_text(
        json.dumps({"frames": [{"lights": [{key: value for key, value in entry.items() if key not in LINKS} for entry in entries]}]})
    )
    found = in_blender("take_lights", rig=str(rig), plain=str(plain))
    key, globe, spot, panel, disk, sun, fill = (found["after"][name] for name in ("Key", "Globe", "Spot", "Panel", "Disk", "Sun", "Fill"))
    assert found["result"] == ["FINISHED"]
    energies = [key["energy"], globe["energy"], spot["energy"], panel["energy"], sun["energy"]]
    assert energies == pytest.approx([16 * np.pi, 2 * np.pi, 8 * np.pi, np.pi, 3], rel=1e-5)
    assert (
        key["color"] == pytest.approx([1, 0.5, 0.25]) and key["shadow_soft_size"] == 0 and globe["shadow_soft_size"] == pytest.approx(0.2)
    )
    assert spot["exposure"] == 0 and spot["spot_size"] == pytest.approx(1)
    edge = np.cos(0.5)
    assert spot["spot_blend"] == pytest.approx((np.cos(0.3) - edge) / (1 - edge), rel=1e-5)
    assert (panel["shape"], panel["size"], panel["size_y"]) == ("RECTANGLE", pytest.approx(0.5), pytest.approx(0.3))
    assert (disk["shape"], disk["size"]) == ("DISK", pytest.approx(1 / np.sqrt(np.pi)))
    for light, axis in ((spot, [-0.6, 0, 0.8]), (panel, [0, 0, 1]), (sun, [0.6, 0, 0.8])):
        np.testing.assert_allclose(np.array(light["matrix"])[:3, 2], axis, atol=1e-6)
        assert np.linalg.det(np.array(light["matrix"])[:3, :3]) == pytest.approx(1, abs=1e-5)
    assert np.array(sun["matrix"])[2, 3] == 3 and [key["hidden"], fill["hidden"]] == [False, True]
    assert "'Nobody' is no light of this scene" in found["stdout"] + found["stderr"]
    assert found["undone"] == found["before"]
    artist = {"Wall": "INCLUDE"}
    assert found["linked_before"] == {"Key": {"blockers": artist}, "Globe": {}, "Sun": {"receivers": artist}}
    assert found["linked"] == {
        "Key": {"receivers": {"Box": "EXCLUDE"}, "blockers": {"Box": "INCLUDE"}},
        "Globe": {"blockers": {"srbf nothing": "INCLUDE"}},
        "Sun": {"receivers": artist},
    }
    assert "'Key' is linked to 'Gone', which this scene lacks" in found["stdout"] + found["stderr"]
    assert found["again"] == [["FINISHED"]] * 2
    assert found["left"] == {"Key": {}, "Globe": {}, "Sun": {"receivers": artist}}, "a rig without choices takes those of the former back"
