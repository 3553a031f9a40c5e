"""What is planned before Blender starts: a sun as wide as the light spacing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer

from srbf.bake.estimate import _time
from srbf.bake.folder import STATE
from srbf.bake.gather_set import GatherSet
from srbf.bake.job import base_job
from srbf.bake.light_sets import CloudSet
from srbf.bake.openjd import arguments
from srbf.bake.run import Bake
from srbf.bake.scene_query import size_of_begun, with_frame
from srbf.bake.settings import BakeSettings, Receiver, captures_of, folder_names
from srbf.cli.values import AUTO_OR_ANGLE
from srbf.errors import InputError
from srbf.receiver_images import MANIFEST
from srbf.sphere import point_set


@pytest.mark.parametrize(("domain", "degrees"), [("sphere", 10.3), ("hemisphere", 7.4)])
def test_the_matched_sun_of_400_lights(domain: str, degrees: float) -> None:
    settings = BakeSettings(Receiver("view"), domain=domain, validation=3).with_matched_sun()
    assert np.degrees(settings.sun_angle) == pytest.approx(degrees, abs=0.05)
    assert settings.with_matched_sun() == settings
    assert json.loads(json.dumps(settings.record()))["sun_angle"] == settings.sun_angle  # bit for bit, so that a bake goes on


def test_the_matched_sun_of_a_list_looks_at_its_own_lights(tmp_path: Path) -> None:
    around_the_zenith = point_set("fibonacci", 4000, "sphere")[:100]  # as dense as 4000, where 100 of a hemisphere stand 14 degrees apart
    lines = [f"{i}.png {x} {y} {z}" for i, (x, y, z) in enumerate(around_the_zenith)]
    (tmp_path / "dense.lp").write_text("\n".join(["100", *lines]))
    settings = BakeSettings(Receiver("view"), light_list=tmp_path / "dense.lp").with_matched_sun()
    assert settings.sun_angle == pytest.approx(np.sqrt(4 * np.pi / 4000), rel=0.1)


def test_a_lone_light_gets_the_largest_sun() -> None:
    assert BakeSettings(Receiver("view"), lights=1).with_matched_sun().sun_angle == pytest.approx(np.pi)


def test_sun_angle_as_text() -> None:
    assert AUTO_OR_ANGLE("auto") == "auto" and AUTO_OR_ANGLE("0.1") == 0.1
    with pytest.raises(typer.BadParameter, match="auto or a number .*found 'wide'"):
        AUTO_OR_ANGLE("wide")
    with pytest.raises(InputError, match="sun angle"):
        BakeSettings(Receiver("view"), sun_angle=float("nan"))


def test_lightmaps_share_an_atlas_and_others_stand_alone() -> None:
    words = ["lightmap:A", "view:Eye", "lightmap:B", "vertices:A", "lightmap:C"]
    atlas, *others = captures_of([Receiver.parse(word, None if word[0] != "l" else "UV") for word in words])
    assert atlas == Receiver("lightmap", "A", "UV", ("B", "C"))
    assert others == [Receiver("view", "Eye"), Receiver("vertices", "A")]
    assert len(captures_of([Receiver.parse(word) for word in words], separate=True)) == 5
    with pytest.raises(InputError, match="found lightmap:A 2 times"):
        captures_of([Receiver("lightmap", "A"), Receiver("lightmap", "A")])
    with pytest.raises(InputError, match="found view 2 times"):
        captures_of([Receiver("view"), Receiver("view")])


def test_captures_of_one_bake_have_folders_of_their_own() -> None:
    names = ["Eye", "../up", "eye", "a/b", "..", "Üben 1.5"]
    folders = folder_names([Receiver("view", name) for name in names])
    assert folders == ["Eye", "_up", "eye~2", "a_b", "view", "Üben 1.5"]
    assert folder_names([Receiver("view", "."), Receiver("view", None), Receiver("view", "view")]) == ["view", "view~2", "view~3"]


def test_a_dry_run_tells_of_rays_that_come_on_top(tmp_path: Path) -> None:
    surfels = BakeSettings(Receiver("lightmap", "A"), transport="indirect", light_set=CloudSet("surfels", 100))
    gather = BakeSettings(Receiver("view"), transport="indirect", quantity="radiance", light_set=GatherSet())
    plain, traced, linked = (Bake(tmp_path, tmp_path, own) for own in (BakeSettings(Receiver("view")), surfels, gather))
    assert _time(plain, 5, True) == "about 5 s on this machine as loaded now"
    assert _time(traced, 5, True) == "about 5 s on this machine as loaded now, and that of form factors by rays, which is not estimated"
    assert _time(linked, 0, False) == "that of links by rays, which is not estimated"


def test_what_was_recorded_before_there_was_a_choice_stays() -> None:
    record = BakeSettings(Receiver("lightmap", "A")).record()
    assert record["receiver"] == {"kind": "lightmap", "name": "A", "uv_layer": None}
    assert not {"no_shadow", "denoise", "transport", "scene"} & set(record)
    chosen = BakeSettings(Receiver("lightmap", "A", also=("B",), unwrap="keep"), no_shadow=("C",)).record()
    assert chosen == json.loads(json.dumps(chosen))  # a bake that goes on compares it with what was written
    assert chosen["receiver"] == {"kind": "lightmap", "name": "A", "uv_layer": None, "also": ["B"], "unwrap": "keep"}
    assert chosen["no_shadow"] == ["C"]


def test_a_receiver_comes_back_from_its_manifest() -> None:
    one = {"kind": "lightmap", "object": "A", "uv_layer": "UV"}
    assert Receiver.of_manifest([one]) == Receiver("lightmap", "A", "UV")
    assert Receiver.of_manifest([one, {**one, "object": "B"}]) == Receiver("lightmap", "A", "UV", ("B",))
    assert Receiver.of_manifest([one, {**one, "object": "B", "uv_layer": "other"}]).uv_layer is None
    assert Receiver.of_manifest([{"kind": "view", "camera": "Eye"}]) == Receiver("view", "Eye")
    assert Receiver.of_manifest([{"kind": "vertices", "object": "A", "count": 9}]) == Receiver("vertices", "A")


@pytest.mark.parametrize(
    ("word", "layer", "words"),
    [
        ("surfel:A", None, r"lightmap:OBJECT, vertices:OBJECT, view\[:CAMERA\] or probes"),
        ("vertices:", None, "vertices:OBJECT"),
        ("vertices:A", "UV", "expected `uv_layer` with a lightmap receiver, found it with vertices"),
    ],
)
def test_receivers_that_no_bake_has(word: str, layer: str | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Receiver.parse(word, layer)


def test_what_only_some_receivers_can() -> None:
    with pytest.raises(InputError, match="vertices with transport combined"):
        BakeSettings(Receiver("vertices", "A"), transport="indirect")
    for receiver, transport in ((Receiver("lightmap", "A"), "combined"), (Receiver("view"), "indirect")):
        with pytest.raises(InputError, match="a view of combined transport.*`denoise`"):
            BakeSettings(receiver, transport=transport, denoise=True)


def test_a_chosen_scene_is_recorded_and_goes_to_farms_and_workers(tmp_path: Path) -> None:
    settings = BakeSettings(Receiver("lightmap", "A"), scene="Night shot")
    assert settings.record()["scene"] == "Night shot"
    assert "--scene=Night shot" in arguments(settings)
    assert not [flag for flag in arguments(replace(settings, scene=None)) if flag.startswith("--scene")]
    assert base_job(tmp_path / "a.blend", settings, tmp_path)["scene_name"] == "Night shot"


def test_a_capture_that_is_begun_keeps_its_size(tmp_path: Path) -> None:
    assert size_of_begun(tmp_path) is None
    settings = BakeSettings(Receiver("view"), width=64, height=36).record()
    (tmp_path / MANIFEST).write_text(json.dumps({"source": {"settings": settings}}))
    assert size_of_begun(tmp_path) == (64, 36)
    (tmp_path / STATE).write_text(json.dumps({"settings": settings | {"height": 64}}))
    assert size_of_begun(tmp_path) == (64, 64)  # what is under way, not what it replaces
    (tmp_path / STATE).write_text("{")
    assert size_of_begun(tmp_path) == (64, 36)
    job = Bake(tmp_path / "no.blend", tmp_path, BakeSettings(Receiver("view")))
    assert with_frame(job, 256, replacing=False).settings.height == 36  # no Blender is asked
    with pytest.raises(InputError, match="expected a .blend"):
        with_frame(job, 256, replacing=True)
