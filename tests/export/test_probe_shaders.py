"""Assets of probes in the engines' HLSL: from the picture of their facets to irradiance between them, beside numpy."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from closed_forms import quad
from made_probes import grid_in
from made_tables import made
from passes import Passes

from srbf.asset import Asset
from srbf.export import spirv, unity, unreal
from srbf.export.hlsl import asset_include
from srbf.io.image import read_image
from srbf.relighting.probe_light import harmonics, light_at
from srbf.sphere import normalize

pytestmark = pytest.mark.engines

CLOSE = 2e-4  # of the largest: `STEEP` of tests/gl/probe_twins.py, and sums of floats
MAIN = """
Texture2D facets, places, light, nearness, points, normals;

float4 harmonicsMain(float4 at : SV_Position) : SV_Target { return srbfAssetProbeHarmonics(facets, places, int2(at.xy)); }

float4 irradianceMain(float4 at : SV_Position) : SV_Target {
    int3 texel = int3(int2(at.xy), 0);
    return float4(srbfAssetProbeIrradiance(light, places, nearness, points.Load(texel).xyz, normals.Load(texel).xyz), 1.0);
}
"""


@pytest.fixture(scope="module")
def asset() -> Asset:
    low, high = np.zeros(3), np.array([3.0, 2.0, 2.2])
    grid = grid_in(low, high, quad([1.4, -1, -1], [1.4, 1.5, -1], [1.4, 1.5, 3], [1.4, -1, 3]))
    width, height = grid.image_size
    base = made("light-mix", ambient=False, height=height, width=width)
    return replace(base, manifest=base.manifest | {"receiver": grid.described()}, probes=grid)


@pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")
@pytest.mark.parametrize("target", ["unity", "unreal"])
def test_what_moves_is_lit_as_numpy_has_it(asset: Asset, target: str, tmp_path: Path) -> None:
    (unity if target == "unity" else unreal).write(asset, tmp_path)
    exported = Asset.open(tmp_path)  # finds the files of its probes
    told = json.loads((tmp_path / "asset.json").read_text())["receiver"]
    text = (tmp_path / "SrbfAsset.hlsl").read_text() if target == "unity" else next((tmp_path / "Shaders").iterdir()).read_text()
    text = text.split("#include")[0] + MAIN
    assert exported.probes is not None
    rng = np.random.default_rng(5)
    picture = rng.uniform(0, 2, (asset.height, asset.width, 3)).astype(np.float32)
    points = rng.uniform([0, 0, 0], [3, 2, 2.2], (20, 30, 3)).astype(np.float32)
    normals = normalize(rng.normal(size=(20, 30, 3))).astype(np.float32)
    given = {"points": points, "normals": normals, "facets": picture}
    given |= {key: read_image(tmp_path / told[key]) for key in ("places", "nearness")}
    x, y, z = exported.probes.counts
    with Passes() as passes:
        images = {key: passes.texture(value) for key, value in given.items()}
        images["light"] = passes.texture(np.zeros((y * z, 7 * x, 4)))
        passes.draw(passes.program(text, "harmonicsMain"), images["light"], images, {})
        target_ = passes.texture(np.zeros((20, 30, 4)))
        passes.draw(passes.program(text, "irradianceMain"), target_, images, {})
        found = passes.read(target_)[..., :3]
    expected = light_at(exported, harmonics(exported, picture), points.reshape(-1, 3), normals.reshape(-1, 3)).reshape(found.shape)
    np.testing.assert_allclose(found, expected, atol=CLOSE * expected.max())
    assert expected.min() >= 0 and np.ptp(expected) > 1


def test_other_receivers_have_no_such_functions() -> None:
    assert "srbfAssetProbe" not in asset_include(made("light-mix"))
