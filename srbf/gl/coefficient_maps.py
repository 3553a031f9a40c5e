"""Passes over coefficient maps, clustered or not: all lights at once, distant lights by projected weights, or few layers per pass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.gl.context import Limits
from srbf.gl.passes import Passes
from srbf.gl.programs import Programs, ranges
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import (
    VECTORS_PER_POINT_LIGHT,
    packed_point_lights,
    point_light_groups,
    point_light_uniforms,
    point_lights_per_pass,
    vectors_free,
)
from srbf.lights import PointLight
from srbf.registry import method_named

if TYPE_CHECKING:
    import moderngl

VECTORS_PER_LAYER = 2  # scale, bias
VECTORS_PROJECTED = 3  # the weights of four components, one vector per color


class ComponentPasses(Passes):
    """Passes over an asset of coefficient maps; each adds to the target in use. Their light functions have no formula."""

    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, limits: Limits, formula: bool = False) -> None:
        self._asset, self._programs, self._textures = asset, programs, textures
        self._method = method_named(asset.method).shader_stem(asset)
        self._clustered = "cluster_index" in asset.tables
        self._free = vectors_free(limits)
        self._point_lights = point_lights_per_pass(self._free, VECTORS_PER_LAYER)
        self._defines = {"SRBF_PLAIN": 1} if textures.plain() else {}

    def check_point_lights(self) -> None:
        """Accepts all: coefficient maps have light functions for every direction."""

    def layers_per_pass(self, point_lights: int) -> int:
        """How many layers of four components fit into the uniforms of a pass with that many point lights."""
        vectors = VECTORS_PER_LAYER if point_lights else VECTORS_PROJECTED
        return max(1, (self._free - VECTORS_PER_POINT_LIGHT * point_lights) // vectors)

    def distant(self, weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """All directional and environment lights; `units` layers per pass as plain textures, or as many as the uniforms hold."""
        rows = projected_rows(self._asset, weights)
        if self._clustered:
            with self._textures.passing(rows) as texture:
                texture.use(0)
                self._textures.clusters().use(1)
                self._projected_clusters(units)
            return
        for first, count in ranges(len(self._asset.scale), units or self.layers_per_pass(0)):
            offset = rows[0, 0, :3] if first == 0 else np.zeros(3)
            values = {"firstLayer": first, "weights": rows[0, 1 + 3 * first :][: 3 * count], "offset": tuple(offset.tolist())}
            self._run_projected(first, count, units, values)

    def weighted(self, weights: moderngl.Texture) -> None:
        """All directional and environment lights, by weights on the GPU."""
        weights.use(2)
        self._over_layers("directional.frag", {}, {"weights": 2}, self.layers_per_pass(1))

    def point_lights(self, lights: Sequence[PointLight], weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """Point and spot lights, and the distant lights' `weights` with the first of them; `units` layers per pass."""
        self._textures.w_table().use(2)
        where, values = self._textures.receivers(3)
        values |= {"wTable": 2, "tableSize": self._asset.manifest["w_table"]["size"]}
        if len(lights) == 1 and not weights.any() and not where:
            values |= {f"pointLight.{name}": value for name, value in point_light_uniforms(lights[0]).items()}
            self._over_layers("point.frag", {}, values, units or self.layers_per_pass(1))
            return
        far = np.ones((self._asset.clusters, self._asset.components + 1, 4), np.float32)
        far[..., :3] = weights.reshape(*far.shape[:2], 3)
        for group, places in point_light_groups(lights, self._point_lights):
            values |= {"pointLights": packed_point_lights(group, places), "pointLightCount": len(group), "weights": 4}
            with self._textures.passing(far) as texture:
                texture.use(4)
                self._over_layers("lights.frag", {"SRBF_POINT_LIGHTS": places} | where, values, units or self.layers_per_pass(places))
            far = np.zeros_like(far)

    def _projected_clusters(self, units: int | None) -> None:
        for first, count in ranges(len(self._asset.scale), units or len(self._asset.scale)):
            self._run_projected(first, count, units, {"weights": 0, "clusters": 1, "firstLayer": first})

    def _run_projected(self, first: int, count: int, units: int | None, values: dict[str, Any]) -> None:
        if units is None:
            self._textures.layers().use(2)
            defines = {"SRBF_COMPONENTS": self._asset.components, "SRBF_LAYERS": count}
            self._programs.run(f"{self._method}_projected.frag", defines, values | {"planes": 2})
            return
        for unit in range(count):
            self._textures.layer(first + unit).use(2 + unit)
        samplers = np.arange(2, 2 + count, dtype=np.int32)
        self._programs.run(f"{self._method}_accumulate.frag", {"SRBF_UNITS": count}, values | {"planes": samplers})

    def _over_layers(self, lights: str, defines: dict[str, int], values: dict[str, Any], size: int) -> None:
        self._textures.layers().use(0)
        values["planes"] = 0
        if self._clustered:
            self._textures.clusters().use(1)
            values["clusters"] = 1
        scale, bias = self._asset.scale, self._asset.bias
        for first, count in ranges(len(scale), size):
            own = {"firstLayer": first, "scale": scale[first : first + count], "bias": bias[first : first + count]}
            counts = {"SRBF_COMPONENTS": self._asset.components, "SRBF_LAYERS": count}
            self._programs.run(f"{self._method}_{lights}", counts | defines | self._defines, values | own)


def projected_rows(asset: Asset, weights: Float64[ndarray, "F 3"]) -> Float32[ndarray, "C n 4"]:
    """Projected weights, one row per cluster: the offset w_0 + sum w_j bias_j, then three vec4 per layer, w_j times the channel's scale.

    n = 3 layers + 1; the three are the red, green and blue weights of the layer's four components.
    """
    by_cluster = weights.reshape(asset.clusters, asset.components + 1, 3)
    layers = len(asset.scale)
    own = np.zeros((asset.clusters, layers * 4, 3))
    own[:, : asset.components] = by_cluster[:, 1:]
    rows = np.ones((asset.clusters, 3 * layers + 1, 4), np.float32)
    rows[:, 0, :3] = by_cluster[:, 0] + np.einsum("mjc,j->mc", own, asset.bias.ravel().astype(np.float64))
    projected = own * asset.scale.ravel().astype(np.float64)[:, None]
    rows[:, 1:] = projected.reshape(asset.clusters, layers, 4, 3).transpose(0, 1, 3, 2).reshape(asset.clusters, -1, 4)
    return rows
