"""What an engine's shader calls for one asset: the pack's functions with the asset's own numbers, in any dialect.

`srbfAssetDirectional`, `srbfAssetPoint` and `srbfAssetLights` are written once, in the pack's GLSL, and translated with it. Counts,
centers, scale and bias are constants of the shader, floats that need no decoding are not decoded, and an engine passes weights and
point lights alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.export.translation import PackFile, pack_files, parse
from srbf.gl.uniforms import padded

MOST_POINT_LIGHTS = 8  # that srbfAssetLights takes at once
_MAPS = """
/* All directional and environment lights of this asset: weights of srbf.methods.projected_weights. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, vec2 uv, vec4 weights[SRBF_K]) {
    return srbfRelightDirectional(layers, uv, 0, weights, srbfScale, srbfBias);
}

/* One point or spot light of this asset; table is r_table.exr, or pairs of it where SRBF_PAIRS is defined. */
vec3 srbfAssetPoint(highp sampler2DArray layers, vec2 uv, highp sampler2D table, vec3 receiver,
        SrbfPointLight pointLight) {
    return srbfRelightPoint(layers, uv, 0, table, srbfCenters, srbfScale, srbfBias, receiver, pointLight);
}

/* All lights of this asset at once, each texel fetched once: weights as above or 0, point lights in fours
   as srbfUnpackPointLight takes them. */
vec3 srbfAssetLights(highp sampler2DArray layers, vec2 uv, float level, vec4 weights[SRBF_K], highp sampler2D table, vec3 receiver,
                     vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    return srbfRelightLights(layers, uv, level, 0, weights, table, srbfCenters, srbfScale, srbfBias, receiver, pointLights,
        pointLightCount);
}
"""
_PLANES = """
/* All directional and environment lights of this asset: weights (SRBF_COMPONENTS + 1) x 1 texels of srbf.methods.projected_weights. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, vec2 uv, highp sampler2D weights) {
    return srbfEigenMapDirectional(layers, uv, 0, weights, srbfScale, srbfBias);
}

/* One point or spot light of this asset; table is w_table.exr. */
vec3 srbfAssetPoint(highp sampler2DArray layers, vec2 uv, highp sampler2D table, vec3 receiver,
        SrbfPointLight pointLight) {
    return srbfEigenMapPoint(layers, uv, 0, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLight);
}

/* All lights of this asset at once, each texel fetched once: weights as above or 0, point lights in fours
   as srbfUnpackPointLight takes them. */
vec3 srbfAssetLights(highp sampler2DArray layers, vec2 uv, float level, highp sampler2D weights, highp sampler2D table,
                     vec3 receiver, vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    return srbfEigenMapLights(layers, uv, level, 0, weights, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLights,
        pointLightCount);
}
"""
_CLUSTERED = """
/* All directional and environment lights of this asset: a row of weights a cluster, bilinear between texels. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, highp sampler2D clusters, vec2 uv, highp sampler2D weights) {
    return srbfClusteredDirectionalFiltered(layers, clusters, uv, 0, weights, srbfScale, srbfBias);
}

/* One point or spot light of this asset, bilinear between texels; table is w_table.exr. */
vec3 srbfAssetPoint(highp sampler2DArray layers, highp sampler2D clusters, vec2 uv, highp sampler2D table, vec3 receiver,
        SrbfPointLight pointLight) {
    return srbfClusteredPointFiltered(layers, clusters, uv, 0, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLight);
}

/* All lights of this asset at once, bilinear between texels: weights as above or 0, point lights in fours
   as srbfUnpackPointLight takes them. */
vec3 srbfAssetLights(highp sampler2DArray layers, highp sampler2D clusters, vec2 uv, highp sampler2D weights, highp sampler2D table,
                     vec3 receiver, vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    return srbfClusteredLightsFiltered(layers, clusters, uv, 0, weights, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLights,
                                       pointLightCount);
}
"""
_FUNCTIONS = {"relighting-map": _MAPS, "eigen-map": _PLANES, "clustered-eigen-map": _CLUSTERED}


@dataclass(frozen=True, eq=False)
class AssetShader:
    """Parts of an asset's shader: `defines` are counts, `arrays` name -> (a define, (n, 4) values), `files` the pack's and its own last."""

    defines: dict[str, int]
    arrays: dict[str, tuple[str, ndarray]]
    files: list[PackFile]

    @property
    def pack(self) -> list[PackFile]:
        return self.files[:-1]

    @property
    def own(self) -> PackFile:
        return self.files[-1]


def counts(asset: Asset, pairs: bool = False) -> dict[str, int]:
    """What the pack asks for by `#define`, of one asset; InputError on one that no shader relights.

    `pairs`: relighting maps find the R table as values and differences, one fetch in place of two.
    """
    if asset.method not in _FUNCTIONS:
        raise InputError(f"expected an asset of {', '.join(_FUNCTIONS)}, found {asset.method}: no shader relights it")
    plain = {"SRBF_PLAIN": 1} if _is_plain(asset) else {}
    if asset.method == "relighting-map":
        return {"SRBF_K": len(asset.basis.centers), "SRBF_POINT_LIGHTS": MOST_POINT_LIGHTS} | plain | ({"SRBF_PAIRS": 1} if pairs else {})
    size = asset.manifest["w_table"]["size"]
    return {
        "SRBF_COMPONENTS": asset.scalars,
        "SRBF_LAYERS": len(asset.scale),
        "SRBF_TABLE_SIZE": size,
        "SRBF_POINT_LIGHTS": MOST_POINT_LIGHTS,
    } | plain


def _is_plain(asset: Asset) -> bool:
    """Whether what is stored needs no decoding: scale 1 and bias 0, unused channels 0."""
    unused = asset.scale == 0
    return bool(((asset.scale == 1) | unused).all() and not asset.bias.any() and not asset.stored.transpose(0, 3, 1, 2)[unused].any())


def asset_shader(asset: Asset, defines: dict[str, int], prepare: Callable[[str, str], str]) -> AssetShader:
    """The shader of one asset with its `counts`, its files by `pack_files`."""
    stem = asset.method.replace("-", "_")
    needed = [f"methods/{stem}.glsl", f"methods/{stem}_lights.glsl", "combine/mip_level.glsl"]
    files = [*pack_files(needed, None, prepare), parse(_FUNCTIONS[asset.method], "asset")]
    if asset.method == "relighting-map":
        arrays = {"srbfCenters": padded(asset.basis.centers), "srbfScale": padded(asset.scale), "srbfBias": padded(asset.bias)}
        return AssetShader(defines, {name: ("SRBF_K", rows) for name, rows in arrays.items()}, files)
    return AssetShader(defines, {"srbfScale": ("SRBF_LAYERS", asset.scale), "srbfBias": ("SRBF_LAYERS", asset.bias)}, files)


def rows_of(values: ndarray, row: Callable[[str], str]) -> str:
    """The rows of an array, each of the shortest decimals that give back the same float32."""
    return ",\n".join("    " + row(", ".join(_decimal(value) for value in vector)) for vector in np.asarray(values, np.float32))


def _decimal(value: np.float32) -> str:
    text = np.format_float_positional(value, unique=True, trim="0") if value == 0 or abs(value) > 1e-6 else repr(float(value))
    return text + "0" if text.endswith(".") else text
