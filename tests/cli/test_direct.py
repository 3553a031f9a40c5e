"""--direct as a user has it: on an indirect asset of a lit plane that also bounces a fifth of its light."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from closed_forms import glb, quad
from made_captures import write_capture
from test_commands import misused, ok, refused, srbf

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.io import files
from srbf.io.image import read_image, write_image
from srbf.lights import AreaLight, DirectionalLight, NamedLight, PointLight
from srbf.methods import relight
from srbf.relighting.direct_light import Added, Direct
from srbf.unshadowed import irradiance_from

BOUNCE = np.array([0.2, 0.1, 0.05])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, plane_positions: np.ndarray) -> Path:
    """A folder of an indirect capture and of an asset fitted to it, to be copied.

    What bounces is in `lights/`, the cosine in `direct/`, and the plane in scene.glb.
    """
    folder = tmp_path_factory.mktemp("made")
    up = np.zeros_like(plane_positions)
    up[..., 2] = 1
    capture = write_capture(folder / "capture", lambda d: np.full((10, 14, 3), d[2]) * BOUNCE, position=plane_positions, normal=up)
    (capture.folder / "direct").mkdir()
    for light in capture.manifest["lights"]:
        light["direct"] = light["file"].replace("lights", "direct")
        write_image(capture.folder / light["direct"], np.full((10, 14, 3), light["direction"][2], np.float32), "float")
    (capture.folder / "scene.glb").write_bytes(glb(quad([-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0])))
    capture.manifest.update(transport="indirect", scene="scene.glb", direct={"sun_angle": 0.0, "footprint": 0.5})
    files.write_json(capture.folder / "capture.json", capture.manifest)
    ok("fit", capture.folder, "-o", folder / "asset", "-k", 16, "--spread", "mean", "--ridge", 0)
    return folder


@pytest.fixture
def capture(made: Path, tmp_path: Path) -> Capture:
    return Capture.open(shutil.copytree(made / "capture", tmp_path / "capture"))


@pytest.fixture
def asset(made: Path, tmp_path: Path) -> Path:
    return shutil.copytree(made / "asset", tmp_path / "asset")


@pytest.mark.lengthy
def test_an_indirect_asset_carries_its_scene(capture: Capture, asset: Path) -> None:
    opened = Asset.open(asset)
    assert opened.transport == "indirect" and opened.scene == capture.scene()
    assert opened.manifest["direct"] == {"sun_angle": 0.0, "footprint": 0.5} and "scene.glb" in opened.manifest["sha256"]
    data = bytearray((asset / "scene.glb").read_bytes())
    data[-1] ^= 1
    (asset / "scene.glb").write_bytes(bytes(data))
    assert "damaged" in refused("relight", asset, "-o", asset.parent / "x.exr", "--directional", "0,0,1")


@pytest.mark.slow
def test_a_budget_is_found_for_indirect_light(capture: Capture, tmp_path: Path) -> None:
    pytest.importorskip("sklearn")
    ok("fit", capture.folder, "-o", tmp_path / "small", "--method", "auto", "--budget", 8)
    opened = Asset.open(tmp_path / "small")
    assert opened.transport == "indirect" and opened.scene == capture.scene()
    assert opened.bytes_per_texel()["directional"] <= 8


@pytest.mark.parametrize("renderer", ["numpy", "gl"])
@pytest.mark.parametrize("direct", [None, "ray", "shadow-map", "none"])
def test_relight_adds_direct_light_and_says_so(asset: Path, tmp_path: Path, direct: str | None, renderer: str) -> None:
    flags = [] if direct is None else ["--direct", direct]
    done = srbf("relight", asset, "-o", tmp_path / "lit.exr", "--directional", "0.6,0,0.8,2,1,1", "--renderer", renderer, *flags)
    assert done.exit_code == 0, done.stderr
    assert {"none": "wrote", "shadow-map": "by shadow maps"}.get(direct or "ray", "exact direct light by rays") in done.stderr
    alone = relight(Asset.open(asset), [DirectionalLight((0.6, 0.0, 0.8), (2.0, 1.0, 1.0))])
    added = 0.0 if direct == "none" else 0.8 * np.array([2, 1, 1])
    np.testing.assert_allclose(read_image(tmp_path / "lit.exr", 3), alone + added, rtol=1e-4, atol=1e-5)


def test_frames_and_point_lights_take_rays(asset: Path, tmp_path: Path) -> None:
    point_light = {"kind": "point", "position": [0, 0, 1]}
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"lights": [point_light]}, {"lights": []}]}))
    done = srbf("relight", asset, "-o", tmp_path / "frames", "--lights", tmp_path / "frames.json")
    assert done.exit_code == 0 and "exact direct light by rays" in done.stderr
    position = Asset.open(asset).images["position"]
    distance = np.sqrt((position**2).sum(axis=2) + 1)
    lit = read_image(tmp_path / "frames" / "0000.exr", 3)
    assert (lit[..., 0] > 0.99 / distance**2).all()
    assert (read_image(tmp_path / "frames" / "0001.exr", 3) == 0).all()


PLACED = {
    "point": ("--point", "0.1,0.2,1"),
    "spot": ("--spot", "0.1,0.2,1,0,0,-1,0.3,0.5"),
    "sphere": ("--sphere", "0.1,0.2,1,0.2"),
}


@pytest.mark.lengthy
@pytest.mark.parametrize("kind", PLACED)
def test_lights_inside_the_scene_light_it_by_rays_and_by_shadow_maps(asset: Path, tmp_path: Path, kind: str) -> None:
    found = {}
    for direct in ("none", "ray", "shadow-map"):
        out = tmp_path / f"{direct}.exr"
        ok("relight", asset, "-o", out, *PLACED[kind], "--falloff", "inverse-square", "--direct", direct)
        found[direct] = read_image(out, 3)
    assert found["ray"].max() > found["none"].max() + 0.2
    np.testing.assert_allclose(found["shadow-map"], found["ray"], rtol=2e-2, atol=2e-3)
    if kind == "point":
        images = Asset.open(asset).images
        light = PointLight((0.1, 0.2, 1.0), falloff="inverse-square")
        expected = irradiance_from(light, *(images[name].reshape(-1, 3) for name in ("position", "normal")))
        np.testing.assert_allclose((found["ray"] - found["none"])[..., 1].ravel(), expected, rtol=2e-2, atol=2e-3)


@pytest.mark.parametrize(("flag", "kind"), [("--area=0.1,0.2,1,0.4,0,0,0,-0.4,0", "an area"), ("--light=Window=1", "a named")])
def test_an_asset_of_directions_has_no_bounces_of_such_lights(asset: Path, tmp_path: Path, flag: str, kind: str) -> None:
    done = srbf("relight", asset, "-o", tmp_path / "lit.exr", flag)
    assert done.exit_code == 1 and f"found {kind} light; capture patches" in done.stderr and not (tmp_path / "lit.exr").exists()


@pytest.mark.parametrize("kind", ["ray", "shadow-map"])
def test_an_area_light_lights_the_receivers_of_a_scene(asset: Path, kind: Direct) -> None:
    opened = Asset.open(asset)
    light = AreaLight((0.1, 0.2, 1), u=(0.4, 0, 0), v=(0, -0.4, 0))
    with Added(opened, kind) as added:
        found = added.response([light])
    assert found is not None
    expected = irradiance_from(light, *(opened.images[name].reshape(-1, 3) for name in ("position", "normal")))
    np.testing.assert_allclose(found[..., 1].ravel(), expected, rtol=2e-2, atol=2e-3)


def test_a_named_light_has_no_direct_light_of_its_own(asset: Path) -> None:
    with Added(Asset.open(asset), "ray") as added:
        assert (added.response([NamedLight("Window")]) == 0).all()  # type: ignore[union-attr]
        assert added.notes([NamedLight("Window")]) == [
            "a named light's direct light is not added: the picture holds only what it reflects on"
        ]
        assert len(added.notes([NamedLight("Window"), PointLight((0.0, 0.0, 1.0))])) == 2
        assert added.notes([]) == []


def test_objects_that_emit_need_an_editable_asset(asset: Path, tmp_path: Path) -> None:
    line = refused("relight", asset, "-o", tmp_path / "lit.exr", "--emissive", "Window=1,1,1")
    assert "expected a transfer asset fitted with --editable for --emissive objects, found a relighting-map one" in line


def test_an_environments_direct_light_is_added_by_rays(asset: Path, tmp_path: Path) -> None:
    write_image(tmp_path / "environment.exr", np.ones((4, 8, 3), np.float32), "float")
    done = srbf("relight", asset, "-o", tmp_path / "lit.exr", "--environment", tmp_path / "environment.exr")
    assert done.exit_code == 0 and "added exact direct light by rays" in done.stderr and "not added" not in done.stderr


@pytest.mark.slow
def test_evaluate_compares_with_what_was_asked_for(asset: Path, capture: Capture, make_capture, plane_positions: np.ndarray) -> None:
    alone = json.loads(ok("evaluate", asset, capture.folder, "--json"))["holdout"]
    highest = capture.directions(capture.indices("train"))[:, 2].max()
    assert alone["peak"] == pytest.approx(1.2 * highest, rel=0.01)  # of the combined response
    whole = make_capture(lambda d: np.full((10, 14, 3), d[2]) * (1 + BOUNCE), name="combined", position=plane_positions)
    for direct in ("ray", "shadow-map"):
        for reference in (capture, whole):
            error = json.loads(ok("evaluate", asset, reference.folder, "--direct", direct, "--json"))["holdout"]
            assert error["rmse"] == pytest.approx(alone["rmse"], rel=0.01)  # direct light adds no error of its own here
            assert error["relative_rmse"] < alone["relative_rmse"]
    assert "--direct ray" in refused("evaluate", asset, whole.folder)


@pytest.mark.lengthy
def test_a_combined_asset_takes_no_direct_light(capture: Capture, make_capture, tmp_path: Path) -> None:
    whole = make_capture(lambda d: np.full((10, 14, 3), d[2]), name="combined")
    ok("fit", whole.folder, "-o", tmp_path / "combined asset", "-k", 9)
    combined = tmp_path / "combined asset"
    for command in (("relight", combined, "-o", tmp_path / "x.exr", "--ambient-only"), ("evaluate", combined, whole.folder)):
        assert "holds the direct light already" in refused(*command, "--direct", "ray")


def test_without_embreex_a_shadow_map_stands_in(asset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("embreex", "embreex.mesh_construction", "embreex.rtcore_scene"):
        monkeypatch.setitem(sys.modules, name, None)
    assert "pip install embreex" in refused("relight", asset, "-o", tmp_path / "x.exr", "--directional", "0,0,1", "--direct", "ray")
    assert "by shadow maps" in srbf("relight", asset, "-o", tmp_path / "y.exr", "--directional", "0,0,1").stderr


def test_what_the_asset_lacks_is_named(asset: Path, tmp_path: Path) -> None:
    manifest = files.read_json(asset / "asset.json")
    del manifest["normal"]
    files.write_json(asset / "asset.json", manifest)
    assert "normal" in refused("relight", asset, "-o", tmp_path / "x.exr", "--directional", "0,0,1")
    del manifest["scene"]
    files.write_json(asset / "asset.json", manifest)
    assert "scene.glb" in refused("relight", asset, "-o", tmp_path / "x.exr", "--directional", "0,0,1", "--direct", "ray")


def test_a_capture_without_direct_images_has_no_combined_response(asset: Path, capture: Capture) -> None:
    del capture.manifest["lights"][3]["direct"]
    files.write_json(capture.folder / "capture.json", capture.manifest)
    assert "direct image" in refused("evaluate", asset, capture.folder, "--direct", "ray")
    ok("evaluate", asset, capture.folder)


def test_compressed_depths_are_asked_for_in_words_that_exist(asset: Path, capture: Capture, tmp_path: Path) -> None:
    """Each a line that names the flag."""
    for text in ("pca:0", "pca:5000", "rays"):
        line = misused("fit", capture.folder, "-o", tmp_path / "new", "--method", "transfer", "--visibility", text)
        assert "expected --visibility none or pca:COUNT with 1 to 256 coefficients" in line and text in line
    assert "--visibility pca:50" in misused("fit", capture.folder, "-o", tmp_path / "new", "--method", "transfer", "--receiver-visibility")
    command = ("relight", asset, "-o", tmp_path / "x.exr", "--directional", "0,0,1")
    assert "expected an asset with compressed depths for --shadows pca" in refused(*command, "--shadows", "pca")
    assert "keeps what its receivers see for --direct pca" in refused(*command, "--direct", "pca")
    misused(*command, "--shadows", "map")
    assert not (tmp_path / "new").exists() and not (tmp_path / "x.exr").exists()
