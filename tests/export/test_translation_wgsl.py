"""The pack in WGSL: every file compiles in Chromium, and its pixels there are numpy's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from chromium import ask, browser, encoded
from pixels import ALL, FLOAT, LIGHTS, images_of, magnitude, weights_of

from srbf import methods
from srbf.asset import Asset
from srbf.errors import ShaderError
from srbf.export import wgsl
from srbf.export.preprocessing import preprocess
from srbf.export.translation import (
    library_paths,
    parse,
)
from srbf.gl.uniforms import packed_point_lights, point_light_uniforms
from srbf.lights import PointLight

needs_chromium = pytest.mark.skipif(browser() is None, reason="needs chromium (Debian)")

NAMES = ["relighting-map", "eigen-map", "clustered-eigen-map"]
COUNTS = {"SRBF_K": 25, "SRBF_COMPONENTS": 9, "SRBF_POINT_LIGHTS": 4, "SRBF_UNIT_VECTORS": 2}
STAGE = """
@group(0) @binding(0) var layers: texture_2d_array<f32>;
@group(0) @binding(1) var positions: texture_2d<f32>;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var clusters: texture_2d<f32>;
@group(0) @binding(4) var weightRows: texture_2d<f32>;
@group(0) @binding(5) var nearest: sampler;
@group(0) @binding(6) var<uniform> values: array<vec4f, COUNT>;

@vertex fn corners(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment fn relit(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let uv = at.xy / vec2f(textureDimensions(layers));
    let receiver = textureLoad(positions, vec2i(at.xy), 0).xyz;
    BODY
}
"""
POINT_LIGHT = """let pointLight = SrbfPointLight(values[0].xyz, values[1].xyz, values[2].xyz, values[3].xyz,
                        values[4].x, values[4].y, values[4].z, values[4].w, i32(values[5].x));
    return vec4f(srbfAssetPoint(layers, nearest, CLUSTERS uv, table, receiver, pointLight), 1.0);"""

MANY = """var pointLights: array<vec4f, 4 * SRBF_POINT_LIGHTS>;
    for (var i = 0; i < 12; i++) { pointLights[i] = values[i]; }
    var weights: array<vec4f, WEIGHTS>;
    for (var i = 0; i < WEIGHTS; i++) { weights[i] = values[12 + i]; }
    return vec4f(srbfAssetLights(layers, nearest, CLUSTERS uv, LEVEL CHOSEN, table, receiver, pointLights, 3), 1.0);"""


def picture(asset: Asset, method: str, light: Any) -> dict[str, Any]:
    """A case of the page: textures in the order of their bindings, and the uniforms as vec4s."""
    clusters = "clusters," if method == "clustered-eigen-map" else ""
    images = images_of(asset)
    values, body = np.zeros((6, 4), np.float32), POINT_LIGHT.replace("CLUSTERS", clusters)
    rows = np.zeros((1, 1, 4), np.float32)
    if light is ALL:
        rows = weights = weights_of(asset, ALL[:1])
        chosen = "weights" if method == "relighting-map" else "weightRows"
        body = (
            MANY.replace("CLUSTERS", clusters)
            .replace("LEVEL", "" if clusters else "0.0,")
            .replace("CHOSEN", chosen)
            .replace("WEIGHTS", str(len(weights)))
        )
        values = np.concatenate([packed_point_lights(ALL[1:], 3), weights.reshape(-1, 4)])  # type: ignore[arg-type]
        rows = np.zeros((1, 1, 4), np.float32) if chosen == "weights" else rows
    elif isinstance(light, PointLight):
        point_light = point_light_uniforms(light)
        for i, name in enumerate(("position", "positionLow", "color", "axis")):
            values[i, :3] = point_light[name]
        values[4] = [point_light[name] for name in ("a0", "radius", "versineInner", "versineOuter")]
        values[5, 0] = point_light["falloff"]
    elif method == "relighting-map":
        values = weights_of(asset, [light])
        body = "return vec4f(srbfAssetDirectional(layers, nearest, uv, values), 1.0);"
    else:
        rows = weights_of(asset, [light])
        body = f"return vec4f(srbfAssetDirectional(layers, nearest, {clusters} uv, weightRows), 1.0);"
    textures = [asset.stored, images["positions"], images["table"], images.get("clusters", rows), rows]
    return {
        "code": wgsl.asset_module(asset) + STAGE.replace("COUNT", str(len(values))).replace("BODY", body),
        "width": asset.width,
        "height": asset.height,
        "images": [texels_of(pixels) for pixels in textures],
        "values": encoded(values),
    }


def texels_of(pixels: np.ndarray) -> dict[str, Any]:
    layers = pixels if pixels.ndim == 4 else pixels[None]
    four = np.ones((*layers.shape[:3], 4), np.float32)
    four[..., : layers.shape[3]] = layers
    return {"pixels": encoded(four), "size": [four.shape[2], four.shape[1]], "layers": len(four)}


@pytest.fixture(scope="module")
def assets(make_asset: Callable[..., Asset], make_planes: Callable[..., Asset]) -> dict[str, Asset]:
    return {
        "relighting-map": make_asset(7),
        "eigen-map": make_planes(9),
        "clustered-eigen-map": make_planes(9, 5, patches=True),
    }


@pytest.fixture(scope="module")
def responses(assets: dict[str, Asset]) -> dict[str, Any]:
    """Everything that the tests ask of Chromium, in one start of it."""
    pictures = {f"{method} {light}": picture(assets[method], method, LIGHTS[light]) for method in NAMES for light in LIGHTS}
    pictures |= {f"{method} all": picture(assets[method], method, ALL) for method in NAMES}
    modules = {path: wgsl.module([path], COUNTS) for path in library_paths()} | {"all": wgsl.module(library_paths(), COUNTS)}
    modules["broken"] = modules["all"].replace("-> vec3f {", "-> vec2f {", 1)
    return ask({"pictures": pictures, "modules": modules})


@needs_chromium
@pytest.mark.parametrize("path", [*library_paths(), "all"])
def test_every_file_of_the_pack_compiles_as_wgsl(responses: dict[str, Any], path: str) -> None:
    assert responses[path]["errors"] == []


@needs_chromium
def test_chromium_tells_of_errors(responses: dict[str, Any]) -> None:
    assert responses["broken"]["errors"]


@needs_chromium
@pytest.mark.parametrize("light", [*LIGHTS, "all"])
@pytest.mark.parametrize("method", NAMES)
def test_wgsl_gives_the_pixels_of_numpy(assets: dict[str, Asset], responses: dict[str, Any], method: str, light: str) -> None:
    asset, response = assets[method], responses[f"{method} {light}"]
    assert "error" not in response, response["error"]
    found = np.array(response["pixels"], np.float32).reshape(asset.height, asset.width, 4)[..., :3]
    lights = ALL if light == "all" else [LIGHTS[light]]
    expected = methods.linear_response(asset, lights)
    assert np.abs(expected).max() > 0.1
    assert (np.abs(found - expected) <= FLOAT * sum(magnitude(asset, each) for each in lights)).all()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("float f(float a) { a += 1.0; return a; }", "leave its parameters"),
        ("float f(float a) { if (a > 0.0) return a; return 0.0; }", "put it in braces"),
        ("float f(float a) { float b = a, c = a; return b + c; }", "one variable per declaration"),
    ],
)
def test_glsl_that_wgsl_has_no_form_for_is_refused(text: str, complaint: str) -> None:
    writer = wgsl.WgslWriter([parse(text, "mine.glsl")])
    with pytest.raises(ShaderError, match=complaint):
        writer.file(writer.files[0])


@pytest.mark.parametrize(("known", "response"), [({}, "3"), ({"A"}, "1"), ({"B"}, "2"), ({"A", "B"}, "1")])
def test_conditions_are_taken_as_a_compiler_takes_them(known: set[str], response: str) -> None:
    text = "#ifdef A\n1\n#elif defined(B)\n2\n#else\n3\n#ifndef A\n#define C 4\n#endif\n#endif\n"
    seen = set(known)
    expected = [response] + (["C is 4"] if response == "3" else [])
    assert preprocess(text, "mine.glsl", seen, "{} is {}".format).split("\n")[:-1] == expected
    assert ("C" in seen) == (response == "3")


def test_a_missing_count_is_told_of_as_the_pack_does() -> None:
    with pytest.raises(ShaderError, match="define SRBF_K"):
        wgsl.module(["combine/directional.glsl"], {})
