"""Surfaces that suit a bake of surfels badly: one line each, of made meshes, without Blender."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from made_rooms import Room, divided, room_of_surfels

from srbf.bake import surface_checks
from srbf.bake.gather_set import GatherSet
from srbf.bake.light_sets import CloudSet
from srbf.bake.scene_query import _with_places
from srbf.bake.surface_checks import warn_of_dark_view, warn_of_receivers
from srbf.errors import InputError, MissingLibraryError
from srbf.methods.transfer import Transfer
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.transfer_operator import TransferOperator

pytest.importorskip("embreex")

BOX = Room.box((2, 1.5, 1.5), 0.5)


def facts(corners: np.ndarray = BOX.corners, albedo: float = 0.5, open_share: float = 0.0, **arrays: Any) -> dict[str, Any]:
    """Of a scene as the worker tells them."""
    small = divided(corners, 0.5)
    count = len(small)
    told = {
        "corners": small,
        "albedo": np.full((count, 3), albedo, np.float32),
        "object": np.zeros(count, np.float32),
        "transparent": np.zeros(count, np.float32),
        "emission": np.zeros((count, 3), np.float32),
        "one_sided": np.zeros(count, np.float32),
        "occluders": corners.astype(np.float32),
    }
    places = {"box": [0, 0, 0, 2, 1.5, 1.5], "places": BOX.free.tolist(), "train": [], "random": [], "skipped": 0, "open_share": open_share}
    return {"arrays": {**told, **arrays}, "places": places, "surface_objects": ["Walls"], "bounces": 4}


def gathered(**changes: Any) -> dict[str, Any]:
    """The same for a gather."""
    told = facts(**changes)
    return {**told, "arrays": {**told["arrays"], "transmission": np.zeros_like(told["arrays"]["albedo"])}}


def baked(**changes: Any) -> tuple[CloudSet, list[str]]:
    said: list[str] = []
    return _with_places(CloudSet("surfels", 200), facts(**changes), 0, said.append), said


def test_a_sound_room_has_one_line() -> None:
    found, said = baked()
    assert len(said) == 1 and said[0].endswith("surfels in the box 0,0,0 to 2,1.5,1.5 m")
    assert found.found is not None and found.found.surfels is not None


def test_places_in_geometry_are_counted_where_lights_are_looked_for() -> None:
    said: list[str] = []
    _with_places(CloudSet("cloud", 1), facts(), 0, said.append)
    assert "0 places are in or near geometry" in said[0]
    said.clear()
    GatherSet().with_facts(gathered(), said.append)
    assert said == [f"{len(gathered()['arrays']['corners'])} fragments of surfaces; lights in the box 0,0,0 to 2,1.5,1.5 m"]


def test_without_embreex_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("embreex", "embreex.mesh_construction", "embreex.rtcore_scene"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingLibraryError, match=r"^rays need embreex, found it missing; pip install srbf\[ray\]$"):
        baked()


def test_an_inside_out_room_has_the_same_surfels() -> None:
    """Both sides of a surface count, and free places tell which light reaches."""
    one, other = (baked(corners=corners)[0].found for corners in (BOX.corners, BOX.corners[:, ::-1]))
    assert one is not None and other is not None and one.surfels is not None and other.surfels is not None
    assert one.surfels.count == pytest.approx(other.surfels.count, rel=0.1)
    assert one.surfels.cells.areas.sum() == pytest.approx(other.surfels.cells.areas.sum(), rel=1e-4) == pytest.approx(16.5, rel=1e-4)


def test_triangles_without_area_are_left_out_with_a_line() -> None:
    flat = np.repeat(BOX.corners[:3, :1], 3, axis=1)
    found, said = baked(corners=np.concatenate([BOX.corners, flat]))
    assert any(line.startswith("3 of ") and "no area" in line for line in said)
    assert found.found is not None and found.found.surfels is not None
    assert np.isfinite(found.found.surfels.cells.normals).all() and (found.found.surfels.cells.areas > 0).all()
    GatherSet().with_facts(gathered(corners=np.concatenate([BOX.corners, flat])), said.append)
    assert said[-2] == said[0] and "fragments of surfaces" in said[-1]


def test_fewer_surfels_than_were_asked_for_are_said() -> None:
    said: list[str] = []
    _with_places(CloudSet("surfels", 200, 0.01), facts(), 0, said.append)
    assert said[0].startswith("`surfels_per_m2=10000` asks for about 165,000 surfels, more than the 200 that are made at most: there are ")
    said.clear()
    _with_places(CloudSet("surfels", 200, 0.5), facts(), 0, said.append)
    assert len(said) == 1


def test_an_open_scene_is_said() -> None:
    assert any(line.startswith("the scene is open: 60%") for line in baked(open_share=0.6)[1])


def test_very_many_triangles_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface_checks, "MANY", 100)
    assert any("triangles: surfels of more than 100 take minutes" in line for line in baked()[1])


def test_more_surfels_than_can_be_solved_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface_checks, "MOST_SURFELS", 50)
    with pytest.raises(InputError, match="expected at most 50 surfels, found .*: the surfaces are of very many small pieces"):
        baked()


def test_black_surfaces_that_emit_are_enough_and_without_they_are_refused() -> None:
    with pytest.raises(InputError, match="expected surfaces that reflect light around the free places, found none"):
        baked(albedo=0.0)
    count = len(divided(BOX.corners, 0.5))
    found, _ = baked(albedo=0.0, emission=np.ones((count, 3), np.float32))
    assert found.found is not None and found.found.surfels is not None
    np.testing.assert_allclose(found.found.surfels.emission, 1.0)


def test_what_no_free_place_sees_is_refused() -> None:
    outside = facts()
    outside["places"]["places"] = [[9.0, 9.0, z] for z in (0.5, 0.7)]
    outside["arrays"]["corners"] = outside["arrays"]["corners"] * [0.1, 0.1, 0.1] + [0.5, 0.5, 0.5]
    outside["arrays"]["occluders"] = np.concatenate([outside["arrays"]["occluders"], outside["arrays"]["corners"]])
    outside["arrays"] = {name: np.asarray(array, np.float32) for name, array in outside["arrays"].items()}
    with pytest.raises(InputError, match="choose another `light_bounds`"):
        _with_places(CloudSet("surfels", 200), outside, 0, lambda line: None)


def test_a_view_from_inside_an_object_is_said() -> None:
    """Of a block that stands in the room: its faces, seen from inside; from outside they are lit."""
    block = Room.box((0.4, 0.4, 0.4), 0.1)
    free = BOX.free[(BOX.free > 0.5).any(axis=1)]
    corners = np.concatenate([BOX.corners, block.corners]).astype(np.float32)
    surfaces = Fragments(corners, np.full((len(corners), 3), 0.5, np.float32))
    said: list[str] = []
    places, normals = block.places.astype(np.float64), block.normals.astype(np.float64)
    warn_of_dark_view(places, normals, surfaces, EmbreeTriangles(corners), free, 0, said.append)
    assert said == ["the camera of the view sees almost nothing that light reaches: is it inside an object?"]
    warn_of_dark_view(BOX.places, BOX.normals, surfaces, EmbreeTriangles(corners), free, 0, said.append)
    assert len(said) == 1


@pytest.mark.lengthy
def test_receivers_that_see_nothing_are_said_and_refused_when_they_are_all(tmp_path) -> None:
    """As where their normals point out of a room."""
    capture = room_of_surfels(tmp_path / "capture", BOX, 100, tested=1)
    operator, covered = TransferOperator.read(capture.folder), capture.coverage().ravel() > 0.5
    said: list[str] = []
    warn_of_receivers(operator, covered, said.append)
    assert not said
    blind = operator.receivers.tolil()
    blind[: int(0.4 * covered.sum())] = 0
    half = TransferOperator(operator.cells, operator.objects, operator.emission, blind.tocsr(), operator.exchange)
    warn_of_receivers(half, covered, said.append)
    assert len(said) == 1 and said[0].startswith("39% of the receivers") and "inside out" in said[0]
    none = TransferOperator(operator.cells, operator.objects, operator.emission, operator.receivers * 0, operator.exchange)
    none.receivers.eliminate_zeros()
    with pytest.raises(InputError, match="expected receivers that see surfaces which light reaches, found none"):
        warn_of_receivers(none, covered, said.append)
    none.write(capture.folder, "made")
    with pytest.raises(InputError, match="expected receivers in .* that see lit surfaces, found none"):
        Transfer().encode(capture)
