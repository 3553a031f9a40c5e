"""Assets exported with their shader's text: hlsl, metal, wgsl, each still an asset and of its own numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.export import hlsl, metal, spirv, wgsl
from srbf.export.settings import Settings

MODULES = {"hlsl": hlsl, "metal": metal, "wgsl": wgsl}
needs_spirv = pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")


@pytest.mark.parametrize(("target", "file"), [("hlsl", "srbf.hlsl"), ("wgsl", "srbf.wgsl")])
def test_an_asset_carries_its_shader(make_planes: Callable[..., Asset], target: str, file: str, tmp_path: Path) -> None:
    asset = make_planes(9, 5, "uint8", patches=True)
    MODULES[target].write(asset, tmp_path, Settings(encoding="float"))
    again = Asset.open(tmp_path)
    np.testing.assert_allclose(again.coefficients(), asset.coefficients(), rtol=1e-6, atol=1e-6)
    text = (tmp_path / file).read_text()
    assert "srbfClusteredLightsFiltered" in text and "srbfAssetLights" in text and "srbfRelightLights" not in text
    assert text == (hlsl.asset_include if target == "hlsl" else wgsl.asset_module)(again)  # the numbers of the files, not of the source


@needs_spirv
@pytest.mark.parametrize("method", ["relighting-map", "eigen-map", "clustered-eigen-map"])
def test_metal_has_a_stage_a_pass(make_asset: Callable[..., Asset], make_planes: Callable[..., Asset], method: str, tmp_path: Path) -> None:
    asset = make_asset(7) if method == "relighting-map" else make_planes(9, 5 if method == "clustered-eigen-map" else None)
    metal.write(asset, tmp_path)
    assert Asset.open(tmp_path).method == method
    texts = {path.name: path.read_text() for path in tmp_path.glob("*.metal")}
    assert len(texts) == 4
    assert all("#include <metal_stdlib>" in text and "main0" in text for text in texts.values())
    assert sum("texture2d_array<float>" in text for text in texts.values()) == 2


@pytest.mark.parametrize("target", MODULES)
def test_functions_that_no_shader_knows_are_refused_and_nothing_written(
    make_asset: Callable[..., Asset], target: str, tmp_path: Path
) -> None:
    asset = make_asset(4)
    asset.manifest["basis"] = {"kind": "hsh"}
    with pytest.raises(InputError, match="expected relighting maps of Gaussians, found hsh"):
        MODULES[target].write(asset, tmp_path)
    assert not list(tmp_path.iterdir())
