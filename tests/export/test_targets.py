"""Every target writes an asset that opens again and relights as it says."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.errors import ImageError, InputError, ManifestError, OutputExistsError
from srbf.evaluation.errors_by_role import MAX_PSNR
from srbf.export import TARGETS, Report, Settings, export
from srbf.export.loss import relit_psnr
from srbf.io.containers import read_texture_array, write_texture_array
from srbf.lights import DirectionalLight, PointLight
from srbf.methods import relight

LIGHTS = [DirectionalLight((0.3, -0.4, 1), (1, 0.7, 0.4)), PointLight((0.2, 0.1, 0.9))]
ARRAYS = ("dds", "ktx2")
LEAST = {"half": 60.0, "uint8": 30.0, "bc7": 8.0}  # dB on random maps, where nothing is like its neighbor


@pytest.fixture(params=["maps", "planes", "clusters"])
def asset(request: pytest.FixtureRequest, make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> Asset:
    if request.param == "maps":
        return make_asset(ambient=True)
    return make_planes(clusters=5 if request.param == "clusters" else None, patches=True)


def smooth(make_asset: Callable[..., Asset], height: int = 24, width: int = 32, k: int = 7) -> Asset:
    """Maps that vary slowly and overlap, as fitted ones do."""
    y, x = np.mgrid[:height, :width] / 8
    maps = np.stack([np.stack([np.sin(x + 0.7 * i + c) * np.cos(y - 0.3 * i * c) for c in range(3)], axis=2) for i in range(k)])
    return make_asset(k, height=height, width=width, coefficients=maps.astype(np.float32), spread=0.9)


@pytest.mark.parametrize(
    ("target", "encoding"),
    [("exr", "half"), ("png", "uint8"), *((target, form) for target in ARRAYS for form in ("half", "uint8", "bc7"))],
)
def test_a_target_opens_again_as_the_asset(asset: Asset, tmp_path: Path, target: str, encoding: str) -> None:
    report = export(asset, target, tmp_path / "out", Settings(encoding))
    found = Asset.open(tmp_path / "out")
    assert found.method == asset.method and found.encoding == encoding == report.encoding
    assert relit_psnr(asset, found) == pytest.approx(report.psnr) and LEAST[encoding] < report.psnr <= MAX_PSNR
    for name, image in asset.images.items():
        np.testing.assert_array_equal(found.images[name], image)
    for name, table in asset.tables.items():
        np.testing.assert_array_equal(found.tables[name], table)
    assert relight(found, LIGHTS).shape == (9, 14, 3)
    assert found.bytes_per_texel()["point"] == report.bytes_per_texel
    assert json.loads((tmp_path / "out" / "asset.json").read_text())["source"]["export"]["psnr"] == round(report.psnr, 3)


def test_halves_and_bytes_that_are_there_stay_as_they_are(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    for encoding, targets in (("half", ("exr", *ARRAYS)), ("uint8", ("png", *ARRAYS))):
        asset = make_asset(encoding=encoding)
        for target in targets:
            assert export(asset, target, tmp_path / f"{encoding}-{target}", Settings(encoding, levels=1)).psnr == MAX_PSNR
            np.testing.assert_array_equal(Asset.open(tmp_path / f"{encoding}-{target}").stored, asset.stored)


def test_overlapping_maps_make_up_for_what_blocks_lose(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    """Against blocks of the bytes themselves, as another tool would make them, in the same ranges."""
    from srbf.export.layers import byte_ranges
    from srbf.export.rounding import blocks_alone
    from srbf.io.containers.texture_array import TextureArray

    asset = smooth(make_asset, k=16)
    together = export(asset, "dds", tmp_path / "out", Settings(levels=1)).psnr
    scale, bias = byte_ranges(asset, asset.coefficients())
    blocks = TextureArray("bc7", asset.width, asset.height, (blocks_alone(asset.coefficients(), scale, bias, "bc7"),))
    alone = replace(asset, stored=blocks.pixels()[..., :3], scale=scale, bias=bias)
    assert together > relit_psnr(asset, alone) + 3


@pytest.mark.parametrize(("form", "texel"), [("bc7", 7.0), ("bc1", 3.5), ("uint8", 28.0), ("half", 56.0)])
def test_bytes_are_those_of_the_file(make_asset: Callable[..., Asset], tmp_path: Path, form: str, texel: float) -> None:
    asset = smooth(make_asset)
    report = export(asset, "ktx2", tmp_path / "out", Settings(form, levels=3))
    assert report.bytes_per_texel == texel and report.levels == 3
    texture = read_texture_array(tmp_path / "out" / "maps.ktx2")
    assert report.layer_bytes == sum(level.nbytes for level in texture.levels)
    assert report.bytes_per_texel_resident == pytest.approx(texel * (1 + 1 / 4 + 1 / 16), rel=0.02)  # begun blocks are whole
    one = export(asset, "ktx2", tmp_path / "one", Settings(form, levels=1))
    assert one.bytes_per_texel_resident == texel and one.layer_bytes < report.layer_bytes
    assert report.resident_bytes - one.resident_bytes == report.layer_bytes - one.layer_bytes


@pytest.mark.lengthy
def test_a_loss_past_the_bound_is_refused_and_leaves_nothing(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    asset = make_asset()
    found = export(asset, "dds", tmp_path / "out").psnr
    with pytest.raises(InputError, match=f"at least {found + 1:g} dB .* found {found:.2f}"):
        export(asset, "dds", tmp_path / "refused", min_psnr=found + 1)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    with pytest.raises(OutputExistsError):
        export(asset, "dds", tmp_path / "out")
    assert isinstance(export(asset, "dds", tmp_path / "out", force=True, min_psnr=found - 1), Report)


def test_bad_input_is_one_line(make_asset: Callable[..., Asset], make_planes: Callable[..., Asset], tmp_path: Path) -> None:
    asset, out = make_asset(), tmp_path / "out"
    with pytest.raises(InputError, match=f"a target of {', '.join(TARGETS)}, found 'gif'"):
        export(asset, "gif", out)
    with pytest.raises(InputError, match="half or float for EXR"):
        export(asset, "exr", out, Settings("bc7"))
    with pytest.raises(InputError, match="uint8 for PNG"):
        export(asset, "png", out, Settings("half"))
    with pytest.raises(InputError, match="bc7, bc1, uint8, half for a texture array"):
        export(asset, "dds", out, Settings("float"))
    with pytest.raises(InputError, match="no mip levels in EXR"):
        export(asset, "exr", out, Settings(levels=3))
    with pytest.raises(InputError, match="0 to 4 mip levels of 14x9"):
        export(asset, "dds", out, Settings(levels=5))
    with pytest.raises(InputError, match="clustered"):
        export(make_planes(clusters=4), "dds", out, Settings(levels=2))
    with pytest.raises(InputError, match="bc7 for scalar coefficient maps"):
        export(make_planes(), "dds", out, Settings("bc1"))
    asset.stored[1, 2, 3, 0] = np.nan
    for target in ("exr", "png", "dds"):
        with pytest.raises(InputError, match="layer 1, found NaN"):
            export(asset, target, out)
    dark = make_asset()
    dark.images["coverage"][:] = 0
    with pytest.raises(InputError, match="covered texels"):
        export(dark, "exr", out)
    assert not list(tmp_path.iterdir())


def test_an_asset_without_coverage_and_one_of_a_single_texel(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    bare = make_asset(height=1, width=1)
    del bare.images["coverage"]
    for target in ("exr", "png", *ARRAYS):  # a mesh needs three texels
        export(bare, target, tmp_path / target)
        assert Asset.open(tmp_path / target).stored.shape[1:3] == (1, 1)


def test_an_array_that_is_not_what_the_manifest_says_is_refused(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    folder = tmp_path / "out"
    export(smooth(make_asset), "dds", folder, Settings("uint8", levels=2))
    manifest = json.loads((folder / "asset.json").read_text())
    texture = read_texture_array(folder / "maps.dds")
    whole = (folder / "maps.dds").read_bytes()

    def opened(**change: object) -> Asset:
        told = {**manifest, "maps": [{**entry, **change} for entry in manifest["maps"]], "sha256": {}}
        (folder / "asset.json").write_text(json.dumps(told))
        return Asset.open(folder)

    assert opened().levels == 2
    for change in ({"layer": 7}, {"encoding": "bc7"}, {"levels": 1}):
        with pytest.raises(ManifestError, match="maps.dds"):
            opened(**change)
    smaller = replace(texture, width=16, height=12, levels=(texture.levels[1],))
    write_texture_array(folder / "maps.dds", smaller)
    with pytest.raises(ImageError, match="32x24 texels .* found 16x12"):
        opened()
    (folder / "maps.dds").write_bytes(whole[:-8])
    with pytest.raises(ImageError, match="export again"):
        opened()
    (folder / "asset.json").write_text(json.dumps(manifest))
    with pytest.raises(ImageError, match="another checksum"):
        Asset.open(folder)


def test_a_decoded_export_is_saved_as_plain_images(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    export(smooth(make_asset), "ktx2", tmp_path / "out")
    found = Asset.open(tmp_path / "out")
    found.save(tmp_path / "plain")
    plain = Asset.open(tmp_path / "plain")
    assert plain.encoding == "uint8" and not list((tmp_path / "plain").glob("*.ktx2"))
    np.testing.assert_array_equal(relight(plain, LIGHTS), relight(found, LIGHTS))


def test_code_beside_the_asset_is_the_exports_own(
    make_asset: Callable[..., Asset], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A target may fill folders; --force replaces them with the export, but not what a user has put there."""
    from srbf.export import exr
    from srbf.export.settings import PLAIN, Written

    def with_code(asset: Asset, folder: Path, settings: Settings = PLAIN) -> Written:
        exr.write(asset, folder, settings)
        (folder / "Editor" / "deep").mkdir(parents=True)
        (folder / "Editor" / "deep" / "Importer.cs").write_text("class Importer {}")
        return Written(("code beside it",))

    monkeypatch.setitem(sys.modules, "an_engine", SimpleNamespace(write=with_code))
    monkeypatch.setitem(TARGETS, "engine", "an_engine")
    out = tmp_path / "out"
    assert export(make_asset(), "engine", out).notes == ("code beside it",)
    assert "Editor/deep/Importer.cs" in json.loads((out / "asset.json").read_text())["sha256"]
    export(make_asset(), "engine", out, force=True)
    (out / "Editor" / "mine.cs").write_text("class Mine {}")
    with pytest.raises(OutputExistsError, match="'Editor'"):
        export(make_asset(), "engine", out, force=True)
    assert (out / "Editor" / "mine.cs").is_file()
