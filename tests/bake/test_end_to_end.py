"""From a .blend to a relit image through the commands, true point lights included."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from light_set_commands import srbf

from srbf.asset import Asset
from srbf.bake.point_reference import compare_with_point_lights
from srbf.capture import Capture
from srbf.io.image import read_image
from srbf.sphere import mean_spacing

pytestmark = pytest.mark.blender


SMALL = ["--size", "32x16", "--lights", 60, "--samples", 1, "--validation", 2, "--holdout", 3, "--holdout-samples", 4]


def test_scene_to_image(blend, tmp_path: Path) -> None:
    scene = blend("plane")
    dry = srbf("bake", scene, "-o", tmp_path / "capture", "--receiver", "lightmap:Plane", *SMALL, "--dry-run")
    assert dry.exit_code == 0, dry.stderr
    for words in ("lightmap: object Plane", "32x16", "60 train", "2 validation", "3 holdout", "MB", "time"):
        assert words in dry.stdout
    assert not (tmp_path / "capture").exists()
    baked = srbf("bake", scene, "-o", tmp_path / "capture", "--receiver", "lightmap:Plane", *SMALL)
    assert baked.exit_code == 0 and baked.stdout == "", baked.stderr
    capture = Capture.open(tmp_path / "capture")
    assert (capture.width, capture.height) == (32, 16) and capture.quantity == "irradiance"
    assert [len(capture.indices(role)) for role in ("train", "validation", "holdout")] == [60, 2, 3]
    assert srbf("fit", tmp_path / "capture", "-o", tmp_path / "asset", "-k", 20).exit_code == 0
    assert Asset.open(tmp_path / "asset").manifest["error"]["holdout"]["relative_rmse"] < 0.1
    for renderer in ("numpy", "gl"):
        out = tmp_path / f"{renderer}.exr"
        # A point light 2 m above the middle of the square, whose center is (10, 5, 0).
        done = srbf("relight", tmp_path / "asset", "-o", out, "--point", "10,5,2", "--renderer", renderer)
        assert done.exit_code == 0, done.stderr
        assert read_image(out)[7:9, 15:17].mean() == pytest.approx(0.5, rel=0.05)


def test_a_user_light_list_and_the_sphere(blend, tmp_path: Path) -> None:
    (tmp_path / "l.lp").write_text("3\na 0 0 2\nb 1 0 1\nc 0 -1 1\n")
    common = ["--receiver", "lightmap:Plane", "--size", 8, "--samples", 1, "--validation", 0, "--holdout", 2, "--holdout-samples", 1]
    assert srbf("bake", blend("plane"), "-o", tmp_path / "a", *common, "--light-list", tmp_path / "l.lp").exit_code == 0
    capture = Capture.open(tmp_path / "a")
    half = np.sqrt(0.5)
    np.testing.assert_allclose(capture.directions(capture.indices("train")), [[0, 0, 1], [half, 0, half], [0, -half, half]], atol=1e-9)
    assert srbf("bake", blend("plane"), "-o", tmp_path / "b", *common, "--lights", 12, "--domain", "sphere").exit_code == 0
    sphere = Capture.open(tmp_path / "b")
    assert (sphere.directions()[:, 2] < 0).any()
    below = [i for i, light in enumerate(sphere.lights) if light.direction[2] < 0]
    assert not sphere.image(below[0]).any()


def test_a_sun_as_large_as_the_spacing_of_the_lights(blend, tmp_path: Path) -> None:
    (tmp_path / "one.lp").write_text("3\na 1 0 1\nb 1 0.1 1\nc 1 -0.1 1\n")
    common = ["--receiver", "lightmap:Plane", "--size", 64, "--samples", 64, "--validation", 0, "--holdout", 0, "--holdout-samples", 1]
    common += ["--light-list", tmp_path / "one.lp"]
    partly_lit = {}
    for angle in ("0", "auto"):
        done = srbf("bake", blend("occluder"), "-o", tmp_path / angle, *common, "--sun-angle", angle)
        assert done.exit_code == 0, done.stderr
        assert ("a sun of" in done.stderr) == (angle == "auto")
        capture = Capture.open(tmp_path / angle)
        lit = capture.image(0)[..., 0] / np.sqrt(0.5)
        partly_lit[angle] = int(((lit > 0.2) & (lit < 0.8)).sum())
        assert capture.manifest["source"]["settings"]["sun_angle"] == (mean_spacing(capture.directions()) if angle == "auto" else 0)
    # The disc of 0.09 rad smears the top of the wall over 0.5 * 2 * 0.09 = 0.09 m, three texels, for its meter of width: 32 rows.
    assert partly_lit["auto"] > partly_lit["0"] + 32
    again = srbf("bake", blend("occluder"), "-o", tmp_path / "auto", *common, "--sun-angle", "auto")
    assert again.exit_code == 0 and "complete already" in again.stderr


def test_true_point_lights_over_an_empty_plane(blend, bake, tmp_path: Path) -> None:
    """With nothing to cast a shadow, the point relighter is the truth up to the fit: inverse-square at a0 = 1."""
    from srbf.methods.relighting_map import RelightingMap

    asset = RelightingMap(k=60).encode(bake("plane", "lightmap:Plane", lights=300).capture)
    # Samples are spread over the texel; their mean is near enough to what the relighter says of its center, close to a point light too.
    result = compare_with_point_lights(asset, blend("plane"), count=3, samples=16)
    assert result["all"]["inverse-square"]["relative_rmse"] < 0.03
    assert result["best_scale"]["inverse-square"] == pytest.approx(1, abs=0.01)
    assert result["all"]["linear"]["relative_rmse"] > result["all"]["inverse-square"]["relative_rmse"]
    assert sum(row["texels"] for row in result["by_distance"]) == 3 * 32 * 32


def test_point_reference_command(blend, bake, tmp_path: Path) -> None:
    folder = bake("occluder", "lightmap:Plane", lights=40).job.folder
    assert srbf("fit", folder, "-o", tmp_path / "asset", "-k", 9).exit_code == 0
    done = srbf("evaluate", tmp_path / "asset", blend("occluder"), "--point-reference", 2, "--samples", 4, "--json")
    assert done.exit_code == 0, done.stderr
    assert len(json.loads(done.stdout)["point_lights"]) == 2
    assert "distance" in srbf("evaluate", tmp_path / "asset", blend("occluder"), "--point-reference", 1, "--samples", 4).stdout


@pytest.mark.parametrize(
    ("scene", "receiver", "words"),
    [("plane", "lightmap:Nobody", "Nobody"), ("no camera", "view", "camera"), ("damaged", "view", "damaged.blend")],
)
def test_bad_scenes_are_one_line(blend, tmp_path: Path, scene: str, receiver: str, words: str) -> None:
    path = tmp_path / "damaged.blend"
    path.write_bytes(b"BLENDER-v405 but no more")
    done = srbf("bake", path if scene == "damaged" else blend(scene), "-o", tmp_path / "capture", "--receiver", receiver, *SMALL)
    assert done.exit_code == 1 and done.stdout == "" and len(done.stderr.strip().splitlines()) == 1 and words in done.stderr
    assert not (tmp_path / "capture" / "capture.json").exists()


def test_no_blender_at_that_path(blend, tmp_path: Path) -> None:
    done = srbf("bake", blend("plane"), "-o", tmp_path / "c", "--receiver", "view", "--blender", tmp_path / "none", *SMALL)
    assert done.exit_code == 1 and "cannot start Blender" in done.stderr


@pytest.mark.parametrize("name", ["caustics", "house"])
def test_demo_scenes_build_and_bake(name: str, tmp_path: Path) -> None:
    from srbf.bake.run import Bake, Reporter
    from srbf.bake.settings import BakeSettings
    from srbf.demo import SCENES, build_scene

    build_scene(name, tmp_path / "scene.blend")
    demo = SCENES[name]
    settings = BakeSettings(demo.receiver, 24, 18, lights=6, samples=1, validation=0, holdout=0, quantity=demo.quantity)
    said: list[str] = []
    Bake(tmp_path / "scene.blend", tmp_path / "capture", settings).run(Reporter(say=said.append))
    assert said == []
    capture = Capture.open(tmp_path / "capture")
    assert capture.coverage().mean() > 0.85
    assert all(capture.image(i).max() > 0.1 for i in range(6))
