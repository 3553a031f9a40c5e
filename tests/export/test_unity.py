"""The Unity export: its HLSL through pixels, its C# compiled and run beside numpy. Unity itself runs nowhere here."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pixels import FLOAT, LIGHTS, images_of, magnitude, run, weights_of
from unity_programs import ENGINE_FREE, Said

from srbf import methods
from srbf.asset import Asset
from srbf.export import spirv, unity
from srbf.export.engine_folder import engine_root
from srbf.export.settings import Settings
from srbf.gl.textures import pairs_of
from srbf.gl.uniforms import packed_point_lights
from srbf.io.containers import read_texture_array
from srbf.io.containers.dds_header import DXGI
from srbf.lights import DirectionalLight, PointLight, SpotLight
from srbf.methods.protocol import MOST_POINT_LIGHTS

needs_spirv = pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")
needs_mono = pytest.mark.skipif(not (shutil.which("mcs") and shutil.which("mono")), reason="needs mono-mcs and mono-runtime (Debian)")

NAMES = ["relighting-map", "eigen-map", "clustered-eigen-map"]
HERE = Path(__file__).parent / "unity"
AXES = np.array([[-1, 0, 0], [0, 0, -1], [0, 1, 0]], np.float64)  # of the asset from Unity's, written down once more
OFFSET = np.array([0.2, -0.4, 0.3])  # of the imported scene's root, in the asset's axes
FARS = [DirectionalLight((0.3, 0.5, 0.8), (1.0, 0.8, 0.3)), DirectionalLight((-0.6, 0.1, 0.4), (0.2, 0.5, 0.9))]
MAIN = """
Texture2D positions;

float4 main(float4 at : SV_Position) : SV_Target {
    float2 size = float2(srbfTextureSize(positions));
    float2 uv = float2(at.x / size.x, 1.0 - at.y / size.y);
    float3 unityPosition = positions.Load(int3(int2(at.xy), 0)).xyz;
    float3 relit;
    SrbfRelight_float(uv, unityPosition, relit);
    return float4(relit, 1.0);
}
"""
UNITY_CG = """
float4x4 unity_ObjectToWorld, unity_MatrixVP;
float4 UnityObjectToClipPos(float3 place) { return mul(unity_MatrixVP, mul(unity_ObjectToWorld, float4(place, 1.0))); }
#define TRANSFORM_TEX(uv, name) (uv * name##_ST.xy + name##_ST.zw)
"""


@pytest.fixture(scope="module")
def assets(make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> dict[str, Asset]:
    return {
        "relighting-map": make_asset(7, "half", ambient=True),
        "eigen-map": make_planes(9, None, "half", ambient=True),
        "clustered-eigen-map": make_planes(9, 5, "half", ambient=True, patches=True),
    }


@pytest.fixture(scope="module")
def folders(assets: dict[str, Asset], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    made = {}
    for name, asset in assets.items():
        made[name] = tmp_path_factory.mktemp(name)
        unity.write(asset, made[name])
    return made


def shader_of(folder: Path) -> str:
    """SrbfAsset.hlsl with its one include in place, as Unity's preprocessor would have it."""
    line = '#include "Srbf/Shaders/SrbfUnity.hlsl"\n'
    text = (folder / "SrbfAsset.hlsl").read_text()
    assert text.count(line) == 1
    return text.replace(line, (folder / "Srbf/Shaders/SrbfUnity.hlsl").read_text())


@pytest.mark.parametrize("method", NAMES)
def test_an_export_is_an_asset(assets: dict[str, Asset], folders: dict[str, Path], method: str) -> None:
    again = Asset.open(folders[method])
    lights = [*FARS, LIGHTS["spot"]]
    np.testing.assert_allclose(methods.relight(again, lights), methods.relight(assets[method], lights), atol=1e-6)
    assert not list(folders[method].glob("*.exr"))  # Unity would import them as pictures


@needs_spirv
@pytest.mark.parametrize("quantity", ["irradiance", "radiance"])
@pytest.mark.parametrize("method", NAMES)
def test_the_custom_function_gives_numpys_pixels(assets: dict[str, Asset], folders: dict[str, Path], method: str, quantity: str) -> None:
    asset = Asset.open(folders[method])
    text = shader_of(folders[method])
    if quantity == "radiance":
        asset.manifest["quantity"] = "radiance"
        text = unity.unity_include(asset).split("#include")[0] + (folders[method] / "Srbf/Shaders/SrbfUnity.hlsl").read_text()
    lights = [*FARS, LIGHTS["point"], LIGHTS["spot"], LIGHTS["inverse-square"]]
    position = asset.images["position"].astype(np.float64)
    placed = (position + OFFSET) @ AXES  # Unity's world: AXES is orthogonal, so that its transpose turns back
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = AXES, -OFFSET
    weights = weights_of(asset, FARS)
    images = images_of(asset)
    table = pairs_of(asset.table)[None] if method == "relighting-map" else images["table"]
    images |= {"_SrbfTable": table, "_SrbfAmbient": asset.images["ambient"], "positions": placed.astype(np.float32)}
    images |= {"_SrbfWeightRows": weights} if method != "relighting-map" else {}
    images |= {"_SrbfClusters": images["clusters"]} if "clusters" in images else {}
    found = run(spirv.cross_compile(spirv.compile_hlsl(text + MAIN), "glsl"), asset, images, uniforms_of(lights, weights, matrix))[..., :3]
    scale = math.pi if quantity == "radiance" else 1
    expected = (np.maximum(methods.linear_response(asset, lights), 0) + asset.images["ambient"] / math.pi) * scale
    # the receiver's place rounds once more on its way through Unity's space, which the weights follow
    allowed = scale * (3 * FLOAT * sum(magnitude(asset, light) for light in lights) + 1e-6)
    assert expected.max() > 0.5
    assert (np.abs(found - expected) <= allowed).all()


def uniforms_of(lights: list[Any], weights: np.ndarray, matrix: np.ndarray) -> dict[str, Any]:
    """What SrbfRelitRenderer sets, by its own layout; the matrix by rows, as spirv-cross hands HLSL's to GLSL."""
    point_lights = [light for light in lights if isinstance(light, PointLight)]
    packed = packed_point_lights(point_lights, MOST_POINT_LIGHTS)
    return {
        "_SrbfWeights": weights,
        "_SrbfPointLightCount": len(point_lights),
        "_SrbfPointLights": packed,
        "_SrbfAssetFromWorld": matrix.astype(np.float32),
    }


@needs_spirv
@pytest.mark.parametrize("method", NAMES)
def test_the_sample_shader_compiles(folders: dict[str, Path], method: str) -> None:
    shader = (folders[method] / "Relit.shader").read_text()
    assert "@ID@" not in shader
    code = shader.split("HLSLPROGRAM")[1].split("ENDHLSL")[0]
    code = code.replace('#include "UnityCG.cginc"', UNITY_CG).replace('#include "SrbfAsset.hlsl"', shader_of(folders[method]))
    code = "\n".join(line for line in code.splitlines() if "#pragma" not in line)
    spirv.compile_hlsl(code, "vert", "Vertex")
    spirv.compile_hlsl(code, "frag", "Fragment")


@needs_spirv
def test_the_graph_version_takes_a_texture_array_and_a_sampler(folders: dict[str, Path]) -> None:
    structures = "#define UNITY_TEXTURE_INCLUDED\nstruct UnityTexture2DArray { Texture2DArray tex; SamplerState samplerstate; };\n"
    structures += "struct UnitySamplerState { SamplerState samplerstate; };\n"
    text = structures + shader_of(folders["relighting-map"])
    assert "SrbfRelightFrom_float" in text
    spirv.compile_hlsl(text + "\nfloat4 main() : SV_Target { return 0.0; }\n")


@pytest.fixture(scope="module")
def responses(ask: Callable[[Path, list[float]], Said]) -> Callable[[Path], Said]:
    """The same under distant lights."""
    numbers = [float(value) for light in FARS for value in (*light.direction, *light.color)]
    return lambda folder: ask(folder, numbers)


@needs_mono
@pytest.mark.parametrize("method", NAMES)
def test_c_sharp_reads_the_files_and_weighs_lights_as_numpy(folders: dict[str, Path], responses: Callable[..., Any], method: str) -> None:
    asset, said = Asset.open(folders[method]), responses(folders[method])
    maps = method == "relighting-map"
    size = asset.manifest["r_table" if maps else "w_table"]["size"]
    assert said["size"] == [[asset.width, asset.height, len(asset.stored), 0 if maps else 9, asset.clusters, size]]
    for i, layer in enumerate(asset.stored):
        assert said[f"layer{i}shape"] == [[*layer.shape, 1]]
        np.testing.assert_array_equal(np.array(said[f"layer{i}"][0]).reshape(layer.shape), layer)
    table = asset.table[None, :, None] if maps else asset.tables["w_table"]
    np.testing.assert_array_equal(np.array(said["table"][0]).reshape(table.shape).astype(np.float32), table)
    if maps:
        np.testing.assert_array_equal(np.array(said["pairs"][0]).reshape(-1, 2).astype(np.float32), pairs_of(asset.table))
    if asset.clusters > 1:
        np.testing.assert_array_equal(np.array(said["clusters"][0]).reshape(asset.height, asset.width), asset.tables["cluster_index"])
    expected = methods.projected_weights(asset, FARS)
    found = np.array(said["weights"][0]).reshape(-1, 4)
    np.testing.assert_allclose(found[:, :3], expected, atol=2e-6 * np.abs(expected).max())
    assert (found[:, 3] == 1).all()


@needs_mono
def test_c_sharp_turns_axes_and_rounds_halves(folders: dict[str, Path], responses: Callable[..., Any]) -> None:
    said = responses(folders["eigen-map"])
    axes = np.array(said["axis"])
    np.testing.assert_array_equal(axes[:, :3].T, AXES)
    np.testing.assert_array_equal(axes[:, 3:], np.eye(3))
    assert np.linalg.det(AXES) == -1  # left-handed to right-handed
    np.testing.assert_array_equal(np.array(said["axes"]).reshape(4, 4)[:3, :3], AXES)
    np.testing.assert_allclose(said["versines"][0], [5e-7, 1 - math.cos(0.3), 1 - math.cos(2)], rtol=1e-6)
    spot = SpotLight(
        (0.4, -0.3, 1.1), (0.5, 1, 2), a0=0.8, radius=0.05, falloff="inverse-square", direction=(0, 0.6, -0.8),
        inner=math.radians(20), outer=math.radians(35),
    )  # fmt: skip
    point = PointLight((0.4, -0.3, 1.1), (0.5, 1, 2), a0=0.7, radius=0.01)
    np.testing.assert_allclose(np.reshape(said["pointLight"], (8, 4)), packed_point_lights([spot, point], 2), rtol=2e-7)
    assert said["wronghalves"] == [[]]
    values = np.array([1.00048828125, 1.0009766, -0.3333333, 65519, 65520, 3e-8, 0.99999], np.float32)
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(said["halves"][0], values.astype(np.float16).view(np.uint16))


@needs_mono
@pytest.mark.parametrize("encoding", ["float", "half"])
def test_c_sharp_reads_large_images_of_either_kind(
    make_asset: Callable[..., Asset], responses: Callable[..., Any], encoding: Any, tmp_path: Path
) -> None:
    asset = make_asset(2, "float", height=70, width=33)  # several blocks of scan lines
    unity.write(asset, tmp_path, Settings(encoding=encoding))
    layer = Asset.open(tmp_path).stored[1]
    found = np.array(responses(tmp_path)["layer1"][0]).reshape(layer.shape)
    np.testing.assert_array_equal(found.astype(np.float32), layer.astype(np.float32))


@needs_mono
@pytest.mark.parametrize("encoding", ["bc7", "bc1", "uint8"])
def test_c_sharp_reads_texture_arrays_level_by_level(
    make_asset: Callable[..., Asset], responses: Callable[..., Any], encoding: Any, tmp_path: Path
) -> None:
    unity.write(make_asset(3, "float", height=20, width=36), tmp_path, Settings(encoding=encoding, levels=3))
    texture = read_texture_array(tmp_path / "images~" / "maps.dds")
    said = responses(tmp_path)
    assert said["blocks"] == [[36, 20, 3, 3, DXGI[encoding]]]
    for level, data in enumerate(texture.levels):
        np.testing.assert_array_equal(said[f"level{level}"], data)


@needs_mono
def test_c_sharp_tells_of_a_file_that_is_cut_short(make_asset: Callable[..., Asset], responses: Callable[..., Any], tmp_path: Path) -> None:
    unity.write(make_asset(3, "float", height=20, width=36), tmp_path, Settings(encoding="bc7"))
    path = tmp_path / "images~" / "maps.dds"
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(AssertionError, match=r"expected \d+ bytes in .*maps.dds, found \d+"):
        responses(tmp_path)


@needs_mono
@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"version": 2}, "expected version 1"),
        ({"format": "other"}, "expected an asset.json"),
        ({"width": "wide"}, 'expected a number for "width"'),
    ],
)
def test_c_sharp_says_what_is_wrong_with_a_manifest(
    folders: dict[str, Path], responses: Callable[..., Any], change: dict[str, Any], complaint: str, tmp_path: Path
) -> None:
    manifest = json.loads((folders["relighting-map"] / "asset.json").read_text())
    (tmp_path / "asset.json").write_text(json.dumps(manifest | change))
    with pytest.raises(ValueError, match=complaint):
        responses(tmp_path)


@needs_mono
def test_the_files_that_use_unity_compile_against_its_interfaces(tmp_path: Path) -> None:
    sources = sorted((engine_root("unity") / "Srbf").rglob("*.cs"))
    assert len(sources) == len(ENGINE_FREE) + 6
    command = [
        "mcs",
        "-langversion:7",
        "-target:library",
        f"-out:{tmp_path / 'all.dll'}",
        *map(str, sources),
        str(HERE / "UnityDeclarations.cs"),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_component_sets_as_many_point_lights_as_the_shader_has() -> None:
    code = (engine_root("unity") / "Srbf" / "Runtime/SrbfRelitRenderer.cs").read_text()
    assert f"MostPointLights = {MOST_POINT_LIGHTS};" in code
