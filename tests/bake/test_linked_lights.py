"""Light linking against Cycles: a scene's own links, taken along and relit, and links of a FRAMES.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_set_commands import done, refused, scenes_in
from test_scene_lights import baked, by_cycles, each_by_cycles, relative

from srbf import relight
from srbf.asset import Asset
from srbf.bake.given_reference import render_given
from srbf.io.image import read_image
from srbf.light_linking import Objects
from srbf.relighting.scene_lights import scene_lights

pytest.importorskip("embreex")
pytestmark = pytest.mark.blender

SAMPLES = 256
PICTURE = 0.05  # relative RMSE of a picture with all bounces, of Cycles' noise most
ONE_LIGHT = 0.1  # under one light, which shines on a part of the view
POINT = {"kind": "point", "position": [1.3, 1.0, 1.5], "falloff": "inverse-square"}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scenes_in(tmp_path_factory)("linked")


@pytest.fixture(scope="module")
def shot(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shot")
    baked(scene, folder)
    return folder


def test_a_scenes_links_are_taken_by_the_names_of_objects(shot: Path) -> None:
    asset = Asset.open(shot / "asset")
    assert {"Floor", "Walls", "Crate", "Box", "Tile"} == set(asset.manifest["gather"]["objects"])
    lights: dict[str, Any] = dict(scene_lights(asset))
    assert lights["Things alone"].receivers == Objects(only=("Box", "Tile")) and lights["Things alone"].blockers is None
    assert lights["Not the crate"].receivers == Objects(without=("Crate",))
    assert lights["No shadow of things"].blockers == Objects(without=("Box", "Tile"))
    assert lights["Floor by the crate"].receivers == Objects(only=("Box", "Floor"))
    assert lights["Floor by the crate"].blockers == Objects(only=("Crate",))
    assert lights["All"].receivers is None and lights["Nothing"].receivers == Objects(only=())
    assert "scene_lights_left_out" not in asset.manifest


@pytest.mark.parametrize("words", [["--direct", "ray"], ["--direct", "shadow-map", "--renderer", "gl"]], ids=["rays", "maps"])
def test_relighting_by_them_is_what_cycles_renders(shot: Path, scene: Path, tmp_path: Path, words: list[str]) -> None:
    done("relight", shot / "asset", "--scene-lights", *words, "-o", tmp_path / "relit.exr")
    relit = read_image(tmp_path / "relit.exr")[:, :, :3]
    reference = by_cycles(scene, SAMPLES)
    assert relative(relit, reference) < PICTURE
    np.testing.assert_allclose(relit.mean(axis=(0, 1)), reference.mean(axis=(0, 1)), rtol=0.02)


@pytest.mark.slow
def test_each_light_is_what_cycles_renders_and_made_again_there(shot: Path, scene: Path) -> None:
    asset = Asset.open(shot / "asset")
    lights = scene_lights(asset)
    for (name, light), own in zip(lights.items(), each_by_cycles(scene, list(lights), SAMPLES), strict=True):
        relit = relight(asset, [light], direct="ray")
        if name == "Nothing":
            assert not own.any() and not relit.any()
            continue
        entry = next(one["light"] for one in asset.manifest["scene_lights"] if one["name"] == name)
        made = render_given(asset, scene, [entry], SAMPLES).image
        np.testing.assert_allclose(made.mean(axis=(0, 1)), own.mean(axis=(0, 1)), rtol=0.03, err_msg=name)
        assert relative(relit, own) < ONE_LIGHT, (name, relative(relit, own))


def test_frames_link_lights_and_name_what_there_is(shot: Path, scene: Path, tmp_path: Path) -> None:
    linked = {**POINT, "receivers": {"only": ["Floor"]}, "blockers": {"without": ["Crate"]}}
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": [linked]}]}))
    done("relight", shot / "asset", "--lights", tmp_path / "frames.json", "-o", tmp_path / "relit")
    made = render_given(Asset.open(shot / "asset"), scene, [linked], SAMPLES).image
    assert relative(read_image(tmp_path / "relit" / "0000.exr")[:, :, :3], made) < ONE_LIGHT
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": [{**POINT, "blockers": {"only": ["Vase"]}}]}]}))
    line = refused(["relight", shot / "asset", "--lights", tmp_path / "frames.json", "-o", tmp_path / "other"])
    assert "among a light's blockers, found 'Vase'; it has 'Box', 'Crate', 'Floor', 'Tile', 'Walls'" in line


def test_an_older_bake_says_so(shot: Path, tmp_path: Path) -> None:
    asset = Asset.open(shot / "asset")
    del asset.manifest["gather"]["objects"]
    asset.save(tmp_path / "older")
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": [{**POINT, "receivers": {"only": ["Floor"]}}]}]}))
    for way in ("ray", "none"):
        line = refused(["relight", tmp_path / "older", "--direct", way, "--lights", tmp_path / "frames.json", "-o", tmp_path / "relit"])
        assert "bake again" in line
    done("relight", tmp_path / "older", "--point", "1,1,1", "-o", tmp_path / "plain.exr")
