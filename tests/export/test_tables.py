"""Named lights and light clouds through every target: each is an asset again, and relights as before."""

from __future__ import annotations

import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from made_rooms import Room, room_of_patches
from made_tables import INSIDE, KINDS, MIX, NAMES, linear, made

from srbf import methods
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import MAX_PSNR
from srbf.export import Settings, export, spirv
from srbf.export.asset_shader import by_weights_alone, counts
from srbf.export.gltf import under_white
from srbf.export.light_tables import MAGIC, first_weights, table_file
from srbf.lights import DirectionalLight, Light
from srbf.methods.light_cloud import LightCloud

TARGETS = ["exr", "png", "dds", "ktx2", "gltf", "godot", "unity", "unreal", "hlsl", "wgsl"]
KEPT = {"exr", "godot", "unity", "unreal", "hlsl", "wgsl"}  # halves as they are


def lights_of(asset: Asset) -> list[Light]:
    return list(MIX if asset.manifest["light_domain"] == "named" else INSIDE)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_target_opens_again_as_the_asset(kind: str, target: str, tmp_path: Path) -> None:
    asset = made(kind)
    report = export(asset, target, tmp_path / "out")
    found = Asset.open(tmp_path / "out")
    assert found.method == asset.method and found.manifest["source"]["export"]["target"] == target
    assert report.psnr == MAX_PSNR if target in KEPT else report.psnr > 10
    for name, table in asset.tables.items():
        np.testing.assert_array_equal(found.tables[name], table)
    for name, image in asset.images.items():
        np.testing.assert_array_equal(found.images[name], image)
    assert found.scene == asset.scene
    if target in KEPT:
        lights = lights_of(asset)
        np.testing.assert_allclose(methods.relight(found, lights), methods.relight(asset, lights), atol=1e-6)
    again = export(found, "exr", tmp_path / "again", Settings("half"))  # whose files lay elsewhere
    assert again.psnr > 50 and (tmp_path / "again" / "asset.json").is_file()


@pytest.mark.lengthy
@pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")
@pytest.mark.parametrize("kind", KINDS)
def test_metal_has_one_stage_for_all_lights(kind: str, tmp_path: Path) -> None:
    export(made(kind), "metal", tmp_path / "out")
    texts = [path.read_text() for path in (tmp_path / "out").glob("*.metal")]
    assert len(texts) == 3 and sum("texture2d_array<float>" in text for text in texts) == 1


@pytest.mark.lengthy
@pytest.mark.parametrize("kind", KINDS)
def test_the_shader_takes_weights_alone(kind: str, tmp_path: Path) -> None:
    asset = made(kind)
    assert by_weights_alone(asset) and "SRBF_POINT_LIGHTS" not in counts(asset)
    for target, file in (("hlsl", "srbf.hlsl"), ("wgsl", "srbf.wgsl")):
        export(asset, target, tmp_path / target)
        text = (tmp_path / target / file).read_text()
        assert "srbfAssetDirectional" in text and "srbfFinish" in text and "srbfAssetLights" not in text and "SrbfPointLights" not in text


@pytest.mark.lengthy
def test_a_fitted_cloud_keeps_its_tables(tmp_path: Path) -> None:
    capture = room_of_patches(tmp_path / "capture", Room.box((2, 1.5, 1.2), 0.4), 8, tested=2)
    asset = LightCloud(clusters=2, components=3).encode(capture)
    assert export(asset, "png", tmp_path / "png").psnr == MAX_PSNR
    assert export(asset, "dds", tmp_path / "dds").psnr > 20
    assert Asset.open(tmp_path / "dds").manifest["position_table"] == asset.manifest["position_table"]


def test_the_fallback_picture_is_of_the_scenes_own_lights_or_of_the_whole_cloud() -> None:
    for kind in ("named-maps", "light-mix"):
        asset = made(kind, ambient=False)
        every = np.ones((1, len(NAMES), 3)) if kind == "named-maps" else None
        ours = linear(asset, every[0] if every is not None else _sum_of_columns(asset))
        np.testing.assert_allclose(under_white(asset), np.maximum(ours, 0), rtol=1e-5, atol=1e-5)
    assert under_white(made("light-cloud", ambient=False)).max() > 0


def _sum_of_columns(asset: Asset) -> np.ndarray:
    return asset.tables["light_values"].astype(np.float64).sum(axis=1) * asset.manifest["light_values"]["scale"]


def test_other_lights_are_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="expected lights by name .* found a directional light"):
        methods.relight(made("named-maps"), [DirectionalLight((0, 0, 1))])


def test_the_tables_of_plain_numbers_are_those_of_the_asset() -> None:
    data = table_file(made("named-maps"))
    assert data.startswith(MAGIC) and struct.unpack_from("<4i", data, 8) == (0, 1, len(NAMES), len(NAMES))
    assert data.endswith(NAMES[-1].encode() + struct.pack("<i", 0))
    cloud = made("light-cloud")
    data = table_file(cloud)
    assert struct.unpack_from("<3i", data, 8) == (1, 5, 7)
    np.testing.assert_array_equal(np.frombuffer(data, "<f8", 16, 20).reshape(4, 4), np.eye(4))
    assert data.endswith(cloud.tables["position_visibility"].tobytes())
    assert first_weights(cloud).shape == (5, 7, 3) and np.isfinite(first_weights(cloud)).all()


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed (Debian: glslang-tools)")
@pytest.mark.parametrize("stage", ["canvas", "spatial"])
@pytest.mark.parametrize("kind", KINDS)
def test_godots_shaders_are_sound(kind: str, stage: str, tmp_path: Path) -> None:
    from test_godot import checked

    asset = made(kind)
    export(asset, "godot", tmp_path / "out")
    name = {"named-maps": "RELIGHTING_MAP"}.get(kind, "EIGEN_MAP" if "one" in kind else "CLUSTERED_EIGEN_MAP")
    count = "SRBF_K 4" if kind == "named-maps" else "SRBF_COMPONENTS 6"
    defines = f"#define SRBF_WEIGHTED\n#define SRBF_{name}\n#define {count}\n#define SRBF_LAYERS {len(asset.stored)}\n"
    checked(defines, stage, tmp_path / "out", tmp_path)
