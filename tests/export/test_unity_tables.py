"""Unity's weights of named lights and of clouds: C# beside numpy, and pixels of the HLSL from them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_tables import INSIDE, KINDS, MIX, NAMES, by_places, linear, made, size_of_terms
from pixels import FLOAT, run
from test_unity import MAIN, UNITY_CG, needs_mono, needs_spirv, shader_of

from srbf import methods
from srbf.asset import Asset
from srbf.errors import ShaderError
from srbf.export import spirv, unity
from srbf.export.light_tables import weights_shape
from srbf.lights import SpotLight

pytestmark = pytest.mark.engines


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    found = {}
    for kind in KINDS:
        found[kind] = tmp_path_factory.mktemp("unity") / "out"
        found[kind].mkdir()
        unity.write(made(kind), found[kind])
    return found


def numbers_of(asset: Asset) -> list[float]:
    """The lights as Responses.cs takes them."""
    if asset.manifest["light_domain"] == "named":
        colors = {light.name: light.color for light in MIX}
        return [value for name in NAMES for value in colors.get(name, (0.0, 0.0, 0.0))]
    rows = []
    for light in INSIDE:
        cone = [math.degrees(2 * light.inner), math.degrees(2 * light.outer)] if isinstance(light, SpotLight) else [-1.0, -1.0]
        rows += [*light.position, *(np.array(light.color) * light.a0**2).tolist(), *cone]
    return rows


def weights_of(asset: Asset) -> np.ndarray:
    return methods.projected_weights(asset, MIX) if asset.manifest["light_domain"] == "named" else by_places(asset, INSIDE)


@needs_mono
@pytest.mark.parametrize("kind", KINDS)
def test_c_sharp_weighs_lights_as_numpy(folders: dict[str, Path], ask: Any, kind: str) -> None:
    asset = Asset.open(folders[kind])
    said = ask(folders[kind], numbers_of(asset))
    expected = weights_of(asset)
    found = np.array(said["weights"][0]).reshape(-1, 4)
    np.testing.assert_allclose(found[:, :3], expected, atol=2e-6 * np.abs(expected).max())
    assert (found[:, 3] == 1).all()
    if kind in ("named-maps", "light-mix"):
        assert said["index"] == [[i] for i in range(len(NAMES))] and said["told"][0][0] > 50
    if "cloud" in kind:
        assert said["outside"] == [[0]]


@needs_spirv
@pytest.mark.parametrize("kind", KINDS)
def test_the_custom_function_gives_numpys_pixels(folders: dict[str, Path], kind: str) -> None:
    asset = Asset.open(folders[kind])
    weights = weights_of(asset)
    rows = np.concatenate([weights, np.ones((len(weights), 1))], axis=1).reshape(*weights_shape(asset), 4).astype(np.float32)
    images = {"_SrbfWeightRows": rows, "_SrbfAmbient": asset.images["ambient"], "positions": asset.images["position"]}
    images |= {"_SrbfClusters": asset.tables["cluster_index"][..., None] / 255} if "cluster_index" in asset.tables else {}
    text = spirv.cross_compile(spirv.compile_hlsl(shader_of(folders[kind]) + MAIN), "glsl")
    found = run(text, asset, images, {})[..., :3]
    expected = np.maximum(linear(asset, weights), 0) + asset.images["ambient"] / math.pi
    assert expected.max() > 0.3
    assert (np.abs(found - expected) <= FLOAT * size_of_terms(asset, weights) + 1e-6).all()


@needs_spirv
@pytest.mark.parametrize("kind", KINDS)
def test_the_sample_shader_compiles(folders: dict[str, Path], kind: str) -> None:
    code = (folders[kind] / "Relit.shader").read_text().split("HLSLPROGRAM")[1].split("ENDHLSL")[0]
    code = code.replace('#include "UnityCG.cginc"', UNITY_CG).replace('#include "SrbfAsset.hlsl"', shader_of(folders[kind]))
    code = "\n".join(line for line in code.splitlines() if "#pragma" not in line)
    assert spirv.compile_hlsl(code, "vert", "Vertex") and spirv.compile_hlsl(code, "frag", "Fragment")
    with pytest.raises(ShaderError):
        spirv.compile_hlsl(code.replace("return", "retrun", 1), "frag", "Fragment")
