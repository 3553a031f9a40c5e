"""Bakes of deep framebuffers: what a capture holds, bounces and direct light against Cycles, a bake that is resumed, wrong input."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from building import SCENES
from light_set_commands import done, refused, scenes_in, srbf

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.io.image import read_image
from srbf.lights import PointLight
from srbf.methods import linear_response
from srbf.relighting.direct_light import Added, Direct
from srbf.visibility.gather_operator import GATHER_FILE, GatherOperator
from srbf.visibility.gathered_samples import SAMPLES_FILE, GatheredSamples

pytestmark = pytest.mark.blender

VIEW = ["--receiver", "view", "--size", "24x24", "--light-set", "gather", "--pool", "600", "--view-clusters", "200", "--seed", "77"]
LOBES = 0.05  # of 300 clusters of pixels with a detailed stone among them
CLOTH, WHOLE = 0.08, 0.05  # of the light of some 20 pixels, and of the picture: references of 128 samples, surfels of a pool of 8000


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return scenes_in(tmp_path_factory)


@pytest.fixture(scope="module")
def floor_scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room with a glossy floor."""
    path = tmp_path_factory.mktemp("floor") / "floor.blend"
    subprocess.run([sys.executable, str(SCENES / "glossy_floor.py"), str(path)], check=True, capture_output=True, timeout=120)
    return path


def test_a_view_is_baked_fitted_relit_and_resumed(scene, tmp_path: Path) -> None:
    folder, asset = tmp_path / "capture", tmp_path / "asset"
    assert "pool of surfels" in done("bake", scene("unlit"), "-o", folder, *VIEW, "--holdout", "0", "--dry-run").output
    said = done("bake", scene("unlit"), "-o", folder, *VIEW, "--holdout", "0").stderr
    assert "almost nothing" not in said and "in or near geometry" not in said
    made = (folder / GATHER_FILE).stat().st_mtime_ns
    done("bake", scene("unlit"), "-o", folder, *VIEW, "--holdout", "0")
    assert (folder / GATHER_FILE).stat().st_mtime_ns == made and not Capture.open(folder).lights
    done("bake", scene("unlit"), "-o", folder, *VIEW, "--holdout", "2", "--holdout-samples", "256", "--force")
    capture, operator = Capture.open(folder), GatherOperator.read(folder)
    assert capture.kind == "pool" and capture.transport == "indirect" and capture.quantity == "radiance"
    assert [(light.role, light.kind, light.direct is not None) for light in capture.lights] == [("holdout", "point", True)] * 2
    assert operator.view.rows == 200 and 500 < len(operator.cells.places) <= 600 and capture.manifest["gather"]["bounces"] == 4
    done("fit", folder, "-o", asset)
    for direct, most in (("none", 0.2), ("ray", 0.1), ("shadow-map", 0.15)):
        errors = json.loads(done("evaluate", asset, folder, "--direct", direct, "--json").stdout)
        assert errors["holdout"]["relative_rmse"] < most, (direct, errors["holdout"])  # most of it the noise of 256 samples
    frames = {"frames": [{"lights": [{"kind": "point", "position": [1.5, 1, 1.2]}]}, {"lights": []}]}
    (tmp_path / "frames.json").write_text(json.dumps(frames))
    done("relight", asset, "--lights", tmp_path / "frames.json", "-o", tmp_path / "shown", "--direct", "ray")
    assert len(list((tmp_path / "shown").iterdir())) == 2


def test_gather_samples_are_baked_fitted_relit_and_resumed(scene, tmp_path: Path) -> None:
    """The paper's form: one bounce, so less energy than Cycles' four, and as much of the direct light."""
    folder, asset, bake = tmp_path / "capture", tmp_path / "asset", [*VIEW[:6], "--view-clusters", "200", "--seed", "77", "--gather"]
    told = done("bake", scene("unlit"), "-o", folder, *bake, "24", "--holdout", "0", "--dry-run").output
    assert "gather samples of view clusters" in told and "not estimated" not in told
    done("bake", scene("unlit"), "-o", folder, *bake, "24", "--holdout", "1", "--holdout-samples", "256")
    made = (folder / SAMPLES_FILE).stat().st_mtime_ns
    done("bake", scene("unlit"), "-o", folder, *bake, "24", "--holdout", "1", "--holdout-samples", "256")
    assert (folder / SAMPLES_FILE).stat().st_mtime_ns == made and not (folder / GATHER_FILE).exists()
    assert "another" in refused(["bake", scene("unlit"), "-o", folder, *bake, "25", "--holdout", "1", "--holdout-samples", "256"], 1)
    assert Capture.open(folder).manifest["source"]["settings"]["light_set"]["gather"] == 24
    assert GatheredSamples.read(folder).places.shape == (200, 24, 3)
    done("fit", folder, "-o", asset)
    opened, capture = Asset.open(asset), Capture.open(folder)
    x, y, z = capture.positions([0])[0].tolist()
    once = linear_response(opened, [PointLight((x, y, z), falloff="inverse-square")])
    assert opened.method == "gather-samples" and 0.3 < once.sum() / capture.image(0).sum() < 0.95
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": [{"kind": "point", "position": [x, y, z]}]}]}))
    done("relight", asset, "--lights", tmp_path / "frames.json", "-o", tmp_path / "shown", "--direct", "ray")
    assert len(list((tmp_path / "shown").iterdir())) == 1


@pytest.mark.parametrize(
    ("name", "flags", "status", "words"),
    [
        ("open_air", [], 1, "camera"),
        ("unlit", ["--gather", "60"], 2, "--gather without --pool"),
        ("unlit", ["--pool", "3"], 2, "16 to 65536"),
        ("unlit", ["--transport", "combined"], 2, "indirect"),
        ("unlit", ["--receiver", "lightmap:Floor"], 2, "view"),
        ("unlit", ["--quantity", "irradiance"], 2, "radiance"),
        ("black", [], 1, "reflect light"),
    ],
)
def test_wrong_input_is_one_line(scene, tmp_path: Path, name: str, flags: list[str], status: int, words: str) -> None:
    assert words in refused(["bake", scene(name), "-o", tmp_path / "no", *VIEW, *flags, "--holdout", "0"], status)
    assert not (tmp_path / "no").exists()


@pytest.mark.parametrize(
    ("receiver", "light_set", "words"),
    [("view:Nowhere", "gather", "a camera 'Nowhere'"), ("lightmap:Nothing", "surfels", "an object 'Nothing'")],
)
def test_a_missing_receiver_is_said_before_surfaces_are_looked_at(scene, tmp_path: Path, receiver: str, light_set: str, words: str) -> None:
    flags = ["--receiver", receiver, "--size", "8", "--light-set", light_set, "--transport", "indirect"]
    said = srbf("bake", scene("unlit"), "-o", tmp_path / "no", *flags).stderr.splitlines()
    assert len(said) == 1 and f"expected {words}" in said[0]


def test_a_camera_in_an_object_is_said(scene, tmp_path: Path) -> None:
    boxed = "import bpy, sys; bpy.ops.wm.open_mainfile(filepath=sys.argv[1]); at = bpy.context.scene.camera.location; "
    boxed += "bpy.ops.mesh.primitive_cube_add(size=0.3, location=at); bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2])"
    subprocess.run([sys.executable, "-c", boxed, str(scene("unlit")), str(tmp_path / "boxed.blend")], check=True, timeout=120)
    said = done("bake", tmp_path / "boxed.blend", "-o", tmp_path / "capture", *VIEW, "--holdout", "0").stderr
    assert "the camera of the view sees almost nothing that light reaches" in said


def test_gloss_is_relit_as_cycles_renders_it(floor_scene: Path, tmp_path: Path) -> None:
    """Direct light of lobes by rays and by shadow maps, what they reflect of the room, and the energy of both."""
    folder, asset = tmp_path / "capture", tmp_path / "asset"
    done(
        "bake",
        floor_scene,
        "-o",
        folder,
        *VIEW[:3],
        "32x32",
        "--light-set",
        "gather",
        "--pool",
        "8000",
        "--seed",
        "77",
        "--holdout",
        "2",
        "--holdout-samples",
        "256",
    )
    done("fit", folder, "-o", asset)
    capture, opened = Capture.open(folder), Asset.open(asset)
    lobes = capture.channel("lobe")
    assert lobes is not None and opened.manifest["gather"]["lobes"] == int((lobes[:, :, 2] > 0).sum())
    glossy = lobes[:, :, 2] > 0
    floor = (np.abs(lobes[:, :, 0] - 0.2) < 1e-3) & (opened.images["normal"][:, :, 2] > 0.999)  # bumps are smaller than these pixels
    assert glossy.mean() > 0.3 and lobes[:, :, 1][glossy].min() == 0  # a group's lobe has no Fresnel term
    for index in capture.indices("holdout"):
        x, y, z = capture.positions([index])[0].tolist()
        light = PointLight((x, y, z), falloff="inverse-square")
        file = capture.lights[index].direct
        assert file is not None
        indirect, direct = capture.image(index), read_image(folder / file, 3)
        own = linear_response(opened, [light])
        # the scene has no caustics: what lobes see of other lobes is left out
        np.testing.assert_allclose(own[glossy].sum() / indirect[glossy].sum(), 1, atol=0.05)
        kinds: tuple[tuple[Direct, float], ...] = (("ray", 0.12), ("shadow-map", 0.6))  # highlights smaller than a pixel
        for kind, most in kinds:
            with Added(opened, kind) as added:
                near = np.asarray(added.response([light]))
            assert np.sqrt(((near - direct)[floor] ** 2).sum() / (direct[floor] ** 2).sum()) < most, kind


def test_gather_samples_of_lobes_are_one_bounce_of_links(floor_scene: Path, tmp_path: Path) -> None:
    """The paper's form on a glossy floor against ours with one bounce: lobes share the clusters by energy, and gather as much light."""
    size, own = [*VIEW[:4], "--light-set", "gather", "--seed", "77", "--holdout", "0"], {}
    for form, flags in (("samples", ["--gather", "400", "--view-clusters", "300"]), ("links", ["--pool", "8000"])):
        done("bake", floor_scene, "-o", tmp_path / f"{form}-capture", *size, *flags)
        done("fit", tmp_path / f"{form}-capture", "-o", tmp_path / form)
        own[form] = Asset.open(tmp_path / form)
    found, capture = GatheredSamples.read(tmp_path / "samples-capture"), Capture.open(tmp_path / "samples-capture")
    specular, diffuse = (np.asarray(capture.channel(name), np.float64).sum() for name in ("glossy", "albedo"))
    assert abs(found.lobes - 300 * specular / (specular + diffuse)) < 2 and found.lobes + found.diffuse == 300
    x, y, z = capture.manifest["free_places"][0]
    light = PointLight((x, y, z), falloff="inverse-square")
    once = replace(own["links"], manifest={**own["links"].manifest, "gather": {**own["links"].manifest["gather"], "bounces": 1}})
    shiny = own["links"].images["glossy"].max(axis=2) > 0.01
    pictures = linear_response(own["samples"], [light])[shiny], linear_response(once, [light])[shiny]
    np.testing.assert_allclose(pictures[0].sum() / pictures[1].sum(), 1, atol=LOBES)


def test_light_passes_through_cloth_as_cycles_renders_it(tmp_path: Path) -> None:
    """Direct light and bounces on the curtain of a studio, lit from the side of the camera and from behind."""
    scene, folder, asset = tmp_path / "studio.blend", tmp_path / "capture", tmp_path / "asset"
    made = [sys.executable, str(SCENES / "studio.py"), str(scene), "--unlit", "--shiny"]
    subprocess.run(made, check=True, capture_output=True, timeout=120)
    size = [*VIEW[:3], "32x32", "--light-set", "gather", "--pool", "8000", "--seed", "77"]
    done("bake", scene, "-o", folder, *size, "--holdout", "6", "--holdout-samples", "128")
    done("fit", folder, "-o", asset)
    capture, opened, operator = Capture.open(folder), Asset.open(asset), GatherOperator.read(folder)
    transmission, albedo = capture.channel("transmission"), capture.channel("albedo")
    assert transmission is not None and albedo is not None and operator.behind is not None
    pure = (np.abs(transmission - [0.4, 0.4, 0.35]) < 1e-3).all(axis=2)
    assert pure.sum() > 20
    np.testing.assert_allclose(albedo[pure], transmission[pure], atol=1e-3)  # this cloth reflects as much as it lets through
    cells = operator.cells
    second = np.flatnonzero((np.abs(cells.albedo - [0.4, 0.4, 0.35]) < 1e-3).all(axis=1))
    assert np.abs(cells.places[second, 0] - 2.7).max() < 1e-3 and cells.normals[second, 0].sum() == 0  # two of either side
    whole, sides = np.zeros(2), set()
    for index in capture.indices("holdout"):
        x, y, z = capture.positions([index])[0].tolist()
        light, file = PointLight((x, y, z), falloff="inverse-square"), capture.lights[index].direct
        assert file is not None
        with Added(opened, "ray") as added:
            own = linear_response(opened, [light]) + added.response([light])
        expected = capture.image(index) + read_image(folder / file, 3)
        np.testing.assert_allclose(own[pure].sum() / expected[pure].sum(), 1, atol=CLOTH)
        whole += own.sum(), expected.sum()
        sides.add(x > 2.7)
    assert sides == {False, True}
    np.testing.assert_allclose(whole[0] / whole[1], 1, atol=WHOLE)
