"""Motion of a light inside rooms: the path leads through the door, and an asset without compression moves as its images do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_names import capture_of_names
from made_rooms import Room, room_of_patches, room_of_points

from srbf.errors import InputError
from srbf.evaluation.motion_inside import CLEARANCE, move_inside, path_through_opening
from srbf.methods.light_cloud import LightCloud
from srbf.methods.named_maps import NamedMaps

pytest.importorskip("embreex")
DOOR = (2.0, 1.0, 1.8)  # a wall at x, open from y to y


@pytest.fixture(scope="module")
def room() -> Room:
    return Room.box((4, 3, 2.5), 0.5, 0.6, DOOR)


def test_the_path_leads_through_the_door(room: Room) -> None:
    path, apart = path_through_opening(room.free, room.sees, 50)
    start, end = path[0], path[-1]
    assert (start[0] - DOOR[0]) * (end[0] - DOOR[0]) < 0 and apart > 0.3
    at = start + (end - start) * (DOOR[0] - start[0]) / (end[0] - start[0])
    assert DOOR[1] + CLEARANCE * 0.7 < at[1] < DOOR[2] - CLEARANCE * 0.7
    steps = np.diff(path, axis=0)
    assert np.allclose(steps, steps[0]) and room.sees(path[:-1], path[1:]).all()


def test_in_a_convex_room_the_ends_see_the_same() -> None:
    box = Room.box((3, 2, 2), 0.5)
    path, apart = path_through_opening(box.free, box.sees)
    assert apart == 0 and np.linalg.norm(path[-1] - path[0]) > 0.8 * np.linalg.norm(np.ptp(box.free, axis=0))
    with pytest.raises(InputError, match="see each other"):
        path_through_opening(box.free, lambda a, b: np.zeros(len(a), bool))


@pytest.mark.slow
def test_an_asset_of_as_many_components_as_patches_moves_as_the_reference(room: Room, tmp_path: Path) -> None:
    capture = room_of_patches(tmp_path / "room", room, 24, tested=1)
    asset = LightCloud(clusters=1, components=72, smooth=False, encoding="float").encode(capture)
    texels = np.arange(len(room.places))
    found = move_inside(asset, capture, texels, 40)
    assert found.largest_step == pytest.approx(1, abs=0.02) and found.error < 0.02
    assert found.table_error < 0.4 and np.allclose(found.relit_brightness, found.reference_brightness, rtol=0.02)
    assert len(found.relit_change) == 39 and found.length > 1
    frozen = replace(asset, tables={**asset.tables, "position_basis": 0 * asset.tables["position_basis"]})
    assert move_inside(frozen, capture, texels, 10).table_step == 0


@pytest.mark.slow
def test_captured_point_lights_have_a_reference_too(room: Room, tmp_path: Path) -> None:
    capture = room_of_points(tmp_path / "room", room, 60, tested=1)
    asset = LightCloud(clusters=2, components=8, interpolation="fingerprint").encode(capture)
    found = move_inside(asset, capture, np.arange(0, len(room.places), 2), 30)
    assert found.error < 0.3 and 0.5 < found.largest_step < 2


def test_other_lights_are_refused(tmp_path: Path) -> None:
    capture = capture_of_names(tmp_path / "names")
    with pytest.raises(InputError, match="patches or of point lights"):
        move_inside(NamedMaps().encode(capture), capture, np.arange(4))
