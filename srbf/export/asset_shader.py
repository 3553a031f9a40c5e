"""What an engine's shader calls for one asset: the pack's functions with the asset's own numbers, in any dialect.

`srbfAssetDirectional`, `srbfAssetPoint` and `srbfAssetLights` are written once, in the pack's GLSL, and translated with it. Counts,
centers, scale and bias are constants of the shader, floats that need no decoding are not decoded, and an engine passes weights and
point lights alone. Where lights are named, or stand in a cloud, all of them enter through the weights, and only `srbfAssetDirectional`
is there. Assets of probes have `srbfAssetProbeHarmonics` and `srbfAssetProbeIrradiance`, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.basis.irradiance_harmonics import FACETS, HARMONICS, facet_weights
from srbf.export.translation import PackFile, pack_files, parse
from srbf.lights import PointLight
from srbf.methods import method_of
from srbf.probe_grid import ProbeGrid

LAST = ["combine/finish.glsl", "combine/mip_level.glsl"]
# By stem of the pack: the file and the function for assets all of whose lights are in the weights, which are a texture.
WEIGHTED = {
    "relighting_map": "combine/weighted.glsl",
    "eigen_map": "combine/components_directional.glsl",
    "clustered_eigen_map": "methods/clustered_eigen_map.glsl",
}
_WEIGHTED_GLSL = {
    "relighting_map": """
/* All lights of this asset: one row of weights, one texel for each map. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, vec2 uv, float level, highp sampler2D weights) {
    return srbfCombineWeighted(layers, uv, level, 0, weights, srbfScale, srbfBias);
}
""",
    "eigen_map": """
/* All lights of this asset: a row of weights, of the mean and of each component. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, vec2 uv, highp sampler2D weights) {
    return srbfCombineComponentsDirectional(layers, uv, 0, weights, 0, srbfScale, srbfBias);
}
""",
    "clustered_eigen_map": """
/* All lights of this asset: a row of weights a cluster, bilinear between texels. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, highp sampler2D clusters, vec2 uv, highp sampler2D weights) {
    return srbfClusteredDirectionalFiltered(layers, clusters, uv, 0, weights, srbfScale, srbfBias);
}
""",
}
PROBES = ["probes/probe_harmonics.glsl", "probes/probe_irradiance.glsl"]
PROBE_TEXELS = 7  # of a probe's harmonics: 27 numbers, four per texel
_PROBES_GLSL = """
/* The light of this asset's probes, PROBE_COLUMNS x PROBE_ROWS texels, from the finished picture of their facets. */
vec4 srbfAssetProbeHarmonics(highp sampler2D facets, highp sampler2D places, ivec2 at) {
    return srbfProbeHarmonics(facets, places, srbfProbeWeights, WIDTH, at);
}

/* Irradiance at a place (m) and unit normal of the asset's frame. */
vec3 srbfAssetProbeIrradiance(highp sampler2D light, highp sampler2D places, highp sampler2D nearness, vec3 place, vec3 normal) {
    return srbfProbeIrradiance(light, places, nearness, GRID, COUNTS, place, normal);
}
"""


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


def by_weights_alone(asset: Asset) -> bool:
    """Whether every light enters through the weights of a frame, so that the cost per texel is the same under any number of lights."""
    return not method_of(asset).local_lights([PointLight((0.0, 0.0, 0.0))])


def counts(asset: Asset, pairs: bool = False) -> dict[str, int]:
    """What the pack asks for by `#define`, of one asset; InputError on one that no shader relights.

    `pairs`: relighting maps find the R table as values and differences, one fetch in place of two.
    """
    defines = method_of(asset).shader_parts(asset, pairs).defines | ({} if asset.probes is None else {"SRBF_PROBE_WEIGHTS": 84})
    return {key: count for key, count in defines.items() if not (key == "SRBF_POINT_LIGHTS" and by_weights_alone(asset))}


def asset_shader(asset: Asset, defines: dict[str, int], prepare: Callable[[str, str], str]) -> AssetShader:
    """The shader of one asset with its `counts`, its files by `pack_files`."""
    method = method_of(asset)
    parts = method.shader_parts(asset)
    stem = method.shader_stem(asset)
    if by_weights_alone(asset):
        needed, functions = [WEIGHTED[stem]], _WEIGHTED_GLSL[stem]
    else:
        needed, functions = [f"methods/{stem}.glsl", f"methods/{stem}_lights.glsl"], parts.functions
    arrays = parts.arrays
    if asset.probes is not None:
        needed, functions = [*needed, *PROBES], functions + _probe_functions(asset.probes)
        arrays = arrays | {"srbfProbeWeights": ("SRBF_PROBE_WEIGHTS", probe_weights())}
    return AssetShader(defines, arrays, [*pack_files([*needed, *LAST], None, prepare), parse(functions, "asset")])


def probe_weights() -> Float64[ndarray, "84 4"]:
    """What `srbfProbeHarmonics` takes: of texel t and facet f at 12 t + f, the last number unused."""
    numbers = np.repeat(facet_weights(), 3, axis=1)  # (12, 27)
    padded = np.pad(numbers, ((0, 0), (0, 4 * PROBE_TEXELS - 3 * HARMONICS)))
    return padded.reshape(FACETS, PROBE_TEXELS, 4).swapaxes(0, 1).reshape(-1, 4)


def _probe_functions(grid: ProbeGrid) -> str:
    x, y, z = grid.counts
    numbers = ", ".join(_decimal(np.float32(value)) for value in (*grid.origin, grid.spacing))
    words = {
        "PROBE_COLUMNS": PROBE_TEXELS * x,
        "PROBE_ROWS": y * z,
        "WIDTH": x,
        "GRID": f"vec4({numbers})",
        "COUNTS": f"ivec3({x}, {y}, {z})",
    }
    text = _PROBES_GLSL
    for word, value in words.items():
        text = text.replace(word, str(value))
    return text


def rows_of(values: ndarray, row: Callable[[str], str]) -> str:
    """The rows of an array, each of the shortest decimals that give back the same float32."""
    return ",\n".join("    " + row(", ".join(_decimal(value) for value in vector)) for vector in np.asarray(values, np.float32))


def _decimal(value: np.float32) -> str:
    text = np.format_float_positional(value, unique=True, trim="0") if value == 0 or abs(value) > 1e-6 else repr(float(value))
    return text + "0" if text.endswith(".") else text
