"""Free places for lights: off surfaces, in no solid, not outside of a closed building; blue noise; streams that do not move each other."""

from __future__ import annotations

import json
import time
from typing import Any

import numpy as np
import pytest
from bpy_process import in_blender

pytestmark = pytest.mark.blender

ASKED = {"box": None, "count": 40, "spacing": None, "random": 20, "places": 60, "seed": 5}
Box = tuple[tuple[float, float, float], tuple[float, float, float]]
ROOMS: list[Box] = [((0, 0, 0), (3, 3, 2)), ((3.4, 0, 0), (6, 1.2, 2))]  # m; not joined
THICK = 0.4  # of the walls, which the rooms are carved out of
HULL: Box = ((-THICK, -THICK, -THICK), (6 + THICK, 3 + THICK, 2 + THICK))


def add_box(name: str, low: Any, high: Any, inwards: bool = False, without: Any = (), apart: bool = False) -> None:
    """A box whose faces point out or in; `without` some; `apart`: every face an object, so that none is closed."""
    import bpy

    corners = [[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)]
    faces = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]  # -x, x, -y, y, -z, z, outwards
    faces = [face[::-1] if inwards else face for i, face in enumerate(faces) if i not in without]
    for i, group in enumerate([[face] for face in faces] if apart else [faces]):
        mesh = bpy.data.meshes.new(f"{name} {i}")
        mesh.from_pydata(corners, [], group)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(mesh.name, mesh))


def building(lid: bool) -> None:
    """Two rooms in an L, in one L of walls: no mesh but a crate's is closed, and where the L has its notch is outside."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_box("Crate", (1, 1, 0.5), (2, 2, 1.5))
    for i in range(2):
        add_box(f"Room {i}", *ROOMS[i], inwards=True, without=[] if lid else [5], apart=True)
    middle, side = ROOMS[0][1][0] + THICK / 2, ROOMS[1][1][1] + THICK
    top = [] if lid else [5]
    add_box("West", HULL[0], (middle, *HULL[1][1:]), without=[1, *top], apart=True)
    add_box("East", (middle, *HULL[0][1:]), (HULL[1][0], side, HULL[1][2]), without=[0, *top], apart=True)
    add_box("Notch", (0, side, HULL[0][2]), (middle, *HULL[1][1:]), without=[0, 2, 3, 4, 5], apart=True)


def room(inwards: bool) -> None:
    """One room, its faces all objects of their own."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_box("Room", *ROOMS[0], inwards, apart=True)


def found(changes: dict[str, Any], scenery: str = "building") -> dict[str, Any]:
    import bpy

    from blender_bake import free_places
    from blender_bake.ipc import WorkerError

    {
        "building": lambda: building(lid=True),
        "open": lambda: building(lid=False),
        "outwards": lambda: room(inwards=False),
        "furnished": furnished,
        "block": block,
    }[scenery]()
    started = time.perf_counter()
    try:
        facts = free_places.places(bpy.context.scene, {**ASKED, **changes})
    except WorkerError as error:
        facts = {"error": str(error)}
    return {"facts": json.dumps(facts), "seconds": time.perf_counter() - started}


def ask(scenery: str = "building", **changes: Any) -> dict[str, Any]:
    facts: dict[str, Any] = json.loads(str(in_blender(found, changes, scenery)["facts"]))
    return facts


def depth(points: np.ndarray, low: Any, high: Any) -> np.ndarray:
    """How deep points lie in a box, m; below 0 outside of it."""
    return np.minimum(points - np.array(low), np.array(high) - points).min(axis=1)


def test_places_are_in_the_rooms_off_their_walls() -> None:
    facts = ask()
    np.testing.assert_allclose(facts["box"], [*HULL[0], *HULL[1]], atol=1e-6)
    assert [len(facts[key]) for key in ("train", "random", "places")] == [40, 20, 60] and facts["warnings"] == []
    for key, off in (("train", 0.06), ("random", 0.1), ("places", 0.06)):
        points = np.array(facts[key])
        assert (np.max([depth(points, *room) for room in ROOMS], axis=0) >= off - 1e-6).all(), key  # not in walls, not outside
        assert (depth(points, (1, 1, 0.5), (2, 2, 1.5)) <= -off / np.sqrt(3)).all(), key
        assert all((depth(points, *room) > 0).any() for room in ROOMS), key
    assert facts["open_share"] == 0


def test_an_open_scene_keeps_what_sees_no_surface() -> None:
    facts = ask("open", places=300)
    points = np.array(facts["places"])
    assert (points[:, 2] > 2).any() and ((points[:, 0] > 3.5) & (points[:, 1] > 1.7)).any()
    assert 0.2 < facts["open_share"] < 0.7


def test_rooms_of_planes_that_point_outwards_are_free() -> None:
    """Normals of separate planes say nothing where no place sees front faces alone."""
    points = np.array(ask("outwards")["places"])
    assert len(points) == 60 and np.ptp(points, axis=0).min() > 1.5


def test_kinds_of_places_do_not_move_each_other() -> None:
    whole = ask()
    again = ask()
    other = ask(random=8, places=80, count=30)
    assert again == whole
    assert other["random"] == whole["random"][:8] and other["places"][:60] == whole["places"]
    assert ask(seed=6)["places"] != whole["places"]


def test_blue_noise_keeps_its_distance() -> None:
    """From the nearest neighbor: at least .6 of the radius of the densest packing, in an empty room as large as the two."""
    points = np.array(ask(count=200)["train"])
    nearest = np.sort(np.linalg.norm(points[:, None] - points[None], axis=2), axis=1)[:, 1]
    volume = sum(float(np.prod(np.subtract(high, low) - 0.12)) for low, high in ROOMS) - 1.12**3
    packed = (np.sqrt(2) * volume / 200) ** (1 / 3)  # between the centers of the densest packing
    assert nearest.min() > 0.5 * packed
    assert nearest.mean() > 0.6 * packed


def test_a_grid_holds_the_free_ones_of_its_places() -> None:
    facts = ask(spacing=0.4, count=0)
    points = np.array(facts["train"])
    steps = np.diff(np.unique(points[:, 0].round(5))) / 0.4
    np.testing.assert_allclose(steps, steps.round(), atol=1e-3)
    assert len(points) + facts["skipped"] == np.prod(np.floor((np.subtract(*HULL[::-1])) / 0.4 + 1e-6))
    assert ask(count=0)["train"] == []


def test_narrow_rooms_shrink_the_clearance_or_refuse() -> None:
    shrunk = ask(box=[0.5, 0.5, 0.0, 0.9, 0.9, 0.05], random=0, places=0, count=5)
    assert len(shrunk["train"]) == 5 and np.array(shrunk["train"])[:, 2].min() >= 0.03 - 1e-6
    assert "train lights are 0.03 m off surfaces in place of 0.06 m" in shrunk["warnings"][0]
    solid = ask(box=[1.2, 1.2, 0.6, 1.8, 1.8, 1.4])
    assert (
        "expected room for 40 train lights in the box 1.2,1.2,0.6 to 1.8,1.8,1.4 m" in solid["error"] and "`light_bounds`" in solid["error"]
    )


def test_a_box_without_room_grows_where_light_comes_from_afar() -> None:
    asked: dict[str, Any] = {"random": 0, "count": 0, "grows": True}
    assert ask("block", **asked | {"grows": False})["error"].startswith("expected room for 60 free places")
    facts = ask("block", **asked)
    np.testing.assert_allclose(facts["box"], [0.5] * 3 + [2.5] * 3, atol=1e-6)
    assert len(facts["places"]) == 60 and (depth(np.array(facts["places"]), (1, 1, 1), (2, 2, 2)) <= -0.06 / np.sqrt(3)).all()
    assert ask(**asked) == ask(**asked | {"grows": False})


def block() -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_box("Block", (1, 1, 1), (2, 2, 2))


def furnished() -> None:
    """A room of 500 closed solids."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_box("Room", (0, 0, 0), (10, 10, 3), inwards=True)
    rng = np.random.default_rng(0)
    for i, place in enumerate(rng.uniform((0.5, 0.5, 0.2), (9.5, 9.5, 2.8), (500, 3))):
        add_box(f"Block {i}", place - 0.1, place + 0.1)


def test_many_solids_take_seconds() -> None:
    result = in_blender(found, {"count": 512, "places": 1024}, "furnished")
    facts = json.loads(str(result["facts"]))
    assert len(facts["train"]) == 512
    assert result["seconds"] < 15, result["seconds"]  # a second or two on two idle cores
