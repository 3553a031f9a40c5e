"""The scenes of rooms: free space is closed and faces look into it, and every object has lightmap coordinates without overlap."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from bpy_process import run
from building import SCENES

pytestmark = pytest.mark.blender


def facts(tmp_path: Path, script: str, box: tuple[str, str], *options: str) -> dict[str, Any]:
    """Of the scene that a script builds, see room_in_blender.py."""
    blend = tmp_path / "scene.blend"
    run(SCENES / f"{script}.py", blend, *options).check_returncode()
    done = run(Path(__file__).with_name("room_in_blender.py"), blend, *box)
    done.check_returncode()
    return json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))


CLOSED = {
    "cornell_box": (("-1,-1,0", "1,1,2"), (), ["Room", "Short block", "Tall block"]),
    "cornell_box with a hole": (("-2.5,-1,0", "1,1,2"), ("--hole",), ["Anteroom", "Room", "Short block", "Tall block"]),
    "maze": (("0,0,0", "6,6,2"), (), ["Ceiling", "Floor", "Walls"]),
    "studio": (("0,0,0", "4,3,2.5"), (), ["Block", "Picture", "Room", "Screen", "Table", "Television", "Tube"]),
    "glossy_figure": (("-1.5,-1.5,0", "1.5,1.5,2.4"), (), ["Pedestal", "Rabbit", "Room"]),
}


@pytest.mark.parametrize("name", CLOSED)
def test_free_space_is_closed_and_faces_look_into_it(tmp_path: Path, name: str) -> None:
    box, options, receivers = CLOSED[name]
    found = facts(tmp_path, name.split()[0], box, *options)
    assert found["front"] > 4000 and found["back"] == found["escaped"] == 0
    assert found["overlap"] == 0 and found["receivers"] == receivers


def test_the_box_with_a_window_opens_there_alone(tmp_path: Path) -> None:
    found = facts(tmp_path, "cornell_box", ("-1,-1,0", "1,1,2"), "--window")
    assert found["back"] == 0 and 0.01 < found["escaped"] / (found["front"] + found["escaped"]) < 0.04
    assert found["overlap"] == 0 and found["receivers"] == ["Outside", "Room", "Short block", "Tall block"]


def test_the_loft_opens_at_its_windows_alone(tmp_path: Path) -> None:
    found = facts(tmp_path, "loft", ("0,0,0", "8,5,3"))
    assert found["back"] == 0 and 0.01 < found["escaped"] / found["front"] < 0.06
    assert found["overlap"] == 0
    assert len(found["lights"]) == 24 - 1 - 7  # without the world and the objects that emit
    emissive = {"TV", "Neon sign", "Shelf strip", "Paper globe", "Stove", "Alarm clock", "Aquarium"}
    assert emissive | {"Floor", "Ceiling", "Walls", "Partition", "Sofa"} <= set(found["receivers"])


def test_a_maze_of_a_number_of_triangles(tmp_path: Path) -> None:
    found = facts(tmp_path, "maze", ("0,0,0", "8,8,2"), "--rooms", "4", "--triangles", "8000")
    assert found["triangles"] == pytest.approx(8000, rel=0.1)
    assert found["back"] == found["escaped"] == 0


def test_the_atrium_is_of_the_size_of_the_article_s(tmp_path: Path) -> None:
    found = facts(tmp_path, "atrium", ("-11,-7,0", "11,7,8.4"))
    assert found["triangles"] == pytest.approx(120_000, rel=0.05)
    assert found["escaped"] > 0 and found["overlap"] == 0
