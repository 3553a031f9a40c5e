"""The pack in HLSL: every file compiles, reads as its source does, and gives the pixels of numpy after a round trip through SPIR-V."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pixels import ALL, FLOAT, LIGHTS, images_of, magnitude, point_light_members, run, weights_of

from srbf import methods
from srbf.asset import Asset
from srbf.errors import ShaderError
from srbf.export import hlsl, spirv
from srbf.export.translation import library_paths, pack_files, parse, render_plain, tokens
from srbf.gl.includes import shader_root
from srbf.gl.uniforms import packed_point_lights
from srbf.lights import PointLight
from srbf.methods.protocol import MOST_POINT_LIGHTS

pytestmark = pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")

COUNTS = "#define SRBF_K 25\n#define SRBF_COMPONENTS 9\n#define SRBF_POINT_LIGHTS 4\n#define SRBF_UNIT_VECTORS 2\n"
ENTRY = "\nfloat4 main() : SV_Target { return 0.0; }\n"
SPIRV = bytes.fromhex("03022307")  # the magic number, little-endian
NAMES = ["relighting-map", "eigen-map", "clustered-eigen-map"]
STAGE = """
Texture2DArray layers;
SamplerState layersSampler;
Texture2D clusters, positions, table, weightRows;
cbuffer Values {
    float4 weights[COUNT];
    SrbfPointLight pointLight;
    float4 pointLights[4 * SRBF_POINT_LIGHTS];
};

float4 main(float4 at : SV_Position) : SV_Target {
    float2 uv = at.xy / float2(srbfTextureSize(layers).xy);
    float3 receiver = positions.Load(int3(int2(at.xy), 0)).xyz;
    return float4(CALL, 1.0);
}
"""
CALLS = {
    ("relighting-map", False): "srbfAssetDirectional(layers, layersSampler, uv, weights)",
    ("eigen-map", False): "srbfAssetDirectional(layers, layersSampler, uv, weightRows)",
    ("clustered-eigen-map", False): "srbfAssetDirectional(layers, layersSampler, clusters, uv, weightRows)",
    ("relighting-map", True): "srbfAssetPoint(layers, layersSampler, uv, table, receiver, pointLight)",
    ("eigen-map", True): "srbfAssetPoint(layers, layersSampler, uv, table, receiver, pointLight)",
    ("relighting-map", None): "srbfAssetLights(layers, layersSampler, uv, 0.0, weights, table, receiver, pointLights, 3)",
    ("eigen-map", None): "srbfAssetLights(layers, layersSampler, uv, 0.0, weightRows, table, receiver, pointLights, 3)",
    ("clustered-eigen-map", None): "srbfAssetLights(layers, layersSampler, clusters, uv, weightRows, table, receiver, pointLights, 3)",
    ("clustered-eigen-map", True): "srbfAssetPoint(layers, layersSampler, clusters, uv, table, receiver, pointLight)",
}


@pytest.fixture
def make(make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> Callable[..., Asset]:
    def asset_of(method: str, encoding: str = "float") -> Asset:
        if method == "relighting-map":
            return make_asset(7, encoding)
        return make_planes(9, 5 if method == "clustered-eigen-map" else None, encoding, patches=True)

    return asset_of


def test_the_library_is_what_the_packs_readme_lists() -> None:
    readme = (shader_root() / "README.md").read_text()
    assert library_paths() == sorted(re.findall(r"^\| `(\w+/\w+\.glsl)` \|", readme, re.MULTILINE))


@pytest.mark.parametrize("path", library_paths())
def test_every_file_of_the_pack_compiles_as_hlsl(path: str) -> None:
    assert spirv.compile_hlsl(COUNTS + hlsl.include([path]) + ENTRY).startswith(SPIRV)


def test_all_files_compile_together_however_often_they_are_included() -> None:
    both = hlsl.include(library_paths())
    assert spirv.compile_hlsl(COUNTS + both + both + ENTRY).startswith(SPIRV)


@pytest.mark.parametrize("path", library_paths())
def test_a_file_taken_apart_is_the_file(path: str) -> None:
    text = (shader_root() / path).read_text()
    assert "".join(token.text for token in tokens(text)) == text
    for function in pack_files([path])[-1].functions:
        assert render_plain([function.body]) in text


@pytest.mark.parametrize("path", library_paths())
def test_what_ships_keeps_names_comments_and_citations(path: str) -> None:
    text, file = hlsl.include([path]), pack_files([path])[-1]
    source = (shader_root() / path).read_text()
    assert f"// from glsl/{path}\n" in text
    assert all(re.search(rf"\b{function.name}\(", text) for function in file.functions)
    assert re.search(r"cite: .+", source)[0] in text  # type: ignore[index]
    assert all(note in text for note in re.findall(r"// .+", source) if "SPDX" not in note)
    code = "".join(token.text for token in tokens(text) if token.kind != "comment")
    assert not re.search(r"\b[iub]?vec[234]\b|\bhighp\b|texelFetch|textureLod|#\s*include", code)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("float f(float a) { return mod(a, 2.0); }", "found mod"),
        ("uniform float x;", "found uniform"),
        ("bvec2 f(vec2 a) { return lessThan(a, a.yx); }", "found lessThan"),
        ("float f(float a) { return (a; }", "brackets in pairs"),
        ("float x;", "a function, a struct or a constant"),
    ],
)
def test_glsl_past_the_subset_is_refused_by_name(text: str, complaint: str) -> None:
    with pytest.raises(ShaderError, match=complaint):
        parse(text, "mine.glsl")


def test_a_matrix_times_a_vector_is_hlsls_mul_and_nothing_else() -> None:
    file = parse("vec3 f(mat3 m, vec4 v) { return 2.0 * (m * v.xyz) + m * vec3(1.0, v.xy); }", "mine.glsl")
    text = hlsl.HlslWriter([file]).file(file)
    assert "return 2.0 * (mul(m, v.xyz)) + mul(m, float3(1.0, v.xy));" in text
    spirv.compile_hlsl(text + ENTRY)
    other = parse("vec3 f(mat3 m) { return m[0]; }", "mine.glsl")
    with pytest.raises(ShaderError, match="expected m times a vector"):
        hlsl.HlslWriter([other]).file(other)


def test_what_software_renderers_want_stays_in_the_pack() -> None:
    path = "basis/weight_pairs.glsl"
    assert "#ifdef SRBF_SAMPLED" in (shader_root() / path).read_text()
    text = hlsl.include([path])
    assert "#ifdef SRBF_SAMPLED" not in text and "SampleLevel" not in text and "#else" not in text
    assert "float srbfWeightPairs(Texture2D pairs, float versine)" in text


def test_words_that_hlsl_keeps_to_itself_are_renamed() -> None:
    assert "float3 point_" in hlsl.include(["shadow/shadow_place.glsl"])
    spirv.compile_hlsl(hlsl.include(["shadow/shadow_place.glsl"]) + ENTRY)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("method", NAMES)
@pytest.mark.parametrize("encoding", ["float", "uint8"])
def test_hlsl_gives_the_pixels_of_numpy(make: Callable[..., Asset], method: str, light: str, encoding: str) -> None:
    asset, chosen = make(method, encoding), LIGHTS[light]
    point_light = isinstance(chosen, PointLight)
    stage = STAGE.replace("COUNT", str(asset.k)).replace("CALL", CALLS[method, point_light])
    text = hlsl.asset_include(asset) + stage
    if point_light:
        uniforms = point_light_members(chosen)
        images = images_of(asset)
    else:
        weights = weights_of(asset, [chosen])
        uniforms = {"weights": weights} if method == "relighting-map" else {}
        images = {**images_of(asset), "weightRows": weights}
    found = run(spirv.cross_compile(spirv.compile_hlsl(text), "glsl"), asset, images, uniforms)[..., :3]
    expected = methods.linear_response(asset, [chosen])
    assert np.abs(expected).max() > 0.1
    assert (np.abs(found - expected) <= FLOAT * magnitude(asset, chosen)).all()


@pytest.mark.parametrize("method", NAMES)
def test_hlsl_gives_the_pixels_of_all_lights_at_once(make: Callable[..., Asset], method: str) -> None:
    asset = make(method, "half")
    text = hlsl.asset_include(asset) + STAGE.replace("COUNT", str(asset.k)).replace("CALL", CALLS[method, None])
    weights = weights_of(asset, ALL[:1])
    uniforms = {"pointLights": packed_point_lights(ALL[1:], MOST_POINT_LIGHTS)} | (
        {"weights": weights} if method == "relighting-map" else {}
    )  # type: ignore[arg-type]
    found = run(spirv.cross_compile(spirv.compile_hlsl(text), "glsl"), asset, images_of(asset) | {"weightRows": weights}, uniforms)
    expected = methods.linear_response(asset, ALL)
    assert (np.abs(found[..., :3] - expected) <= FLOAT * sum(magnitude(asset, light) for light in ALL)).all()


@pytest.mark.parametrize("name", sorted(path.name for path in (shader_root() / "stages").iterdir()))
def test_every_stage_crosses_to_every_language(name: str, tmp_path: Path) -> None:
    counts = {"SRBF_K": 25, "SRBF_COMPONENTS": 9, "SRBF_POINT_LIGHTS": 4, "SRBF_UNIT_VECTORS": 2, "SRBF_DISTANT": 4}
    code = spirv.compile_stage(name, counts)
    texts = {language: spirv.cross_compile(code, language) for language in spirv.ARGUMENTS}
    assert texts["es"].startswith("#version 300 es") and texts["glsl"].startswith("#version 330")
    assert "main0" in texts["metal"]  # no Metal compiler runs outside a Mac
    for language in ("es", "glsl"):
        path = tmp_path / f"{language}{Path(name).suffix}"
        path.write_text(texts[language])
        done = subprocess.run(["glslangValidator", str(path)], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout
    spirv.compile_hlsl(texts["hlsl"], "vert" if name.endswith(".vert") else "frag")
