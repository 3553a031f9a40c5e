"""Lights with profiles against Cycles: a scene's own IES lights, taken along and relit, and a projected picture."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from light_set_commands import done, refused, scenes_in
from made_profiles import picture
from test_scene_lights import baked, each_by_cycles, relative

from srbf.asset import Asset
from srbf.bake.given_reference import render_given
from srbf.io.image import read_image, write_image
from srbf.lights import PointLight, SpotLight
from srbf.relighting.scene_lights import scene_lights

pytest.importorskip("embreex")
pytestmark = pytest.mark.blender

SAMPLES = 256
PICTURE = 0.05  # relative RMSE of a picture with all bounces
PROJECTOR = {
    "kind": "spot",
    "position": [0.6, 0.7, 1.0],
    "direction": [1, 0.25, -0.1],
    "inner": 0.5,
    "outer": 0.55,
    "a0": 1.5,
    "falloff": "inverse-square",
    "roll": 0.4,
    "profile": "slide.exr",
}
LANTERN = {
    "kind": "point",
    "position": [1.6, 1.2, 1.1],
    "falloff": "inverse-square",
    "direction": [0.3, 1, -0.2],
    "roll": -0.7,
    "profile": "downlight.ies",
}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scenes_in(tmp_path_factory)("luminaires")


@pytest.fixture(scope="module")
def shot(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shot")
    baked(scene, folder)
    return folder


def test_a_scenes_ies_lights_are_taken_and_others_named(shot: Path) -> None:
    downlight, washer = scene_lights(Asset.open(shot / "asset")).values()
    assert type(downlight) is PointLight and isinstance(washer, SpotLight)
    assert downlight.profile is not None and downlight.profile == washer.profile  # of one text
    np.testing.assert_allclose(washer.color, 8 * 1.5 / (4 * np.pi) * np.array([1, 0.6, 0.3]), rtol=1e-5)
    told = json.loads((shot / "asset" / "asset.json").read_text())
    assert list(told["scene_profiles"]) == ["Downlight.ies"]
    left = {one["name"]: one["reason"] for one in told["scene_lights_left_out"]}
    assert set(left) == {"Type B", "No file", "Panel", "Turned", "Missing"}
    assert "type B" in left["Type B"] and "no file" in left["No file"] and "nowhere.ies" in left["Missing"] and "turn" in left["Turned"]


@pytest.mark.parametrize("renderer", ["numpy", "gl"])
def test_relighting_by_them_is_what_cycles_renders(shot: Path, scene: Path, tmp_path: Path, renderer: str) -> None:
    words = ["--direct", "shadow-map"] if renderer == "gl" else []
    done("relight", shot / "asset", "--scene-lights", "--renderer", renderer, *words, "-o", tmp_path / "relit.exr")
    relit = read_image(tmp_path / "relit.exr")[:, :, :3]
    reference = sum(each_by_cycles(scene, ["Downlight", "Washer"], SAMPLES))
    assert relative(relit, np.asarray(reference)) < PICTURE


def test_frames_light_a_room_as_cycles_does(shot: Path, scene: Path, tmp_path: Path) -> None:
    """A tilted luminaire and a projected picture from files beside FRAMES.json."""
    write_image(tmp_path / "slide.exr", 3 * picture(), "float")
    (tmp_path / "downlight.ies").write_text(json.loads((shot / "asset" / "asset.json").read_text())["scene_profiles"]["Downlight.ies"])
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": [PROJECTOR]}, {"lights": [LANTERN]}]}))
    done("relight", shot / "asset", "--lights", tmp_path / "frames.json", "-o", tmp_path / "relit")
    asset = Asset.open(shot / "asset")
    for number, light in enumerate((PROJECTOR, LANTERN)):
        made = render_given(asset, scene, [light], SAMPLES, profiles=tmp_path).image
        assert relative(read_image(tmp_path / "relit" / f"{number:04d}.exr")[:, :, :3], made) < PICTURE


def test_a_picture_beside_cycles_takes_the_profiles_along(shot: Path, scene: Path, tmp_path: Path) -> None:
    words = ["relight", shot / "asset", "--scene-lights", "-o", tmp_path / "shot.exr", "--reference", scene, "--samples", 64]
    assert float(done(*words).stderr.split("relative rmse ")[1].split("%")[0]) / 100 < 2 * PICTURE


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("none.ies", None, "none.ies"),
        ("bad.ies", "TILT=NONE 1 2", "cut off"),
        ("none.png", None, "none.png"),
        ("bad.exr", "words", "bad.exr"),
    ],
)
def test_bad_files_say_so_in_one_line(shot: Path, tmp_path: Path, name: str, content: str | None, line: str) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": [{**PROJECTOR, "profile": name}]}]}))
    assert line in refused(["relight", shot / "asset", "--lights", tmp_path / "frames.json", "-o", tmp_path / "relit"])
