"""Passes that relight relighting maps: all lights at once, distant lights by projected weights, or the article's few maps per pass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.basis.gaussian import TABLE_TOLERANCE, WeightCurve, weight_curve
from srbf.errors import InputError
from srbf.gl.context import Limits
from srbf.gl.includes import Defines
from srbf.gl.passes import Passes
from srbf.gl.programs import Programs, ranges
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import (
    VECTORS_PER_POINT_LIGHT,
    packed_point_lights,
    padded,
    point_light_groups,
    point_light_uniforms,
    point_lights_per_pass,
    vectors_free,
)
from srbf.lights import PointLight

if TYPE_CHECKING:
    import moderngl

VECTORS_PER_MAP = 4  # weight, center, scale, bias
CURVE_ERROR = TABLE_TOLERANCE / 4  # of R, up to which a curve stands for it: with wide spreads the formula does


class MapPasses(Passes):
    """Passes over an asset of relighting maps; each adds to the target in use."""

    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, limits: Limits, formula: bool = False) -> None:
        self._asset, self._programs, self._textures = asset, programs, textures
        self._scale, self._bias = padded(asset.scale), padded(asset.bias)
        self._free = vectors_free(limits)
        self._point_lights = point_lights_per_pass(self._free, VECTORS_PER_MAP)
        self._defines: Defines = {"SRBF_PLAIN": 1} if textures.plain() else {}
        self._functions: Defines = self._formula() if formula else {"SRBF_PAIRS": 1} | ({"SRBF_SAMPLED": 1} if limits.software else {})
        self._loops = {} if limits.software else {"SRBF_UNROLLED": 1}  # software skips lights that do not shine on a receiver

    def _formula(self) -> Defines:
        """R without the table: by the curve of the spread, or where it has none that is as good, by its own formula."""
        basis = self._asset.manifest["basis"]
        if basis["kind"] != "gaussian":
            return {}
        told = basis.get("curve")
        curve = weight_curve(basis["spread"]) if told is None else WeightCurve(np.array(told["coefficients"]), told["error"])
        if curve.error > CURVE_ERROR:
            return {"SRBF_FORMULA": 1}
        *first, last = (f"{coefficient:.9e}" for coefficient in curve.coefficients)
        return {"SRBF_CURVE": f"vec4({', '.join(first)})", "SRBF_CURVE_LAST": last}

    def check_point_lights(self) -> None:
        """InputError where the shaders have no formula for the functions of a point light's direction."""
        kind = self._asset.manifest["basis"]["kind"]
        if kind != "gaussian":
            raise InputError(f"expected Gaussians for point and spot lights on the GPU, found {kind}; relight them by numpy")

    def layers_per_pass(self, point_lights: int) -> int:
        """How many maps fit into the uniforms of a pass with that many point lights."""
        vectors = VECTORS_PER_MAP if point_lights else 1
        return max(1, (self._free - VECTORS_PER_POINT_LIGHT * point_lights) // vectors)

    def distant(self, weights: Float64[ndarray, "K 3"], units: int | None) -> None:
        """All directional and environment lights; `units` maps per pass as plain textures, or as many of an array as uniforms hold."""
        if units is not None:
            self._accumulate(weights, units)
            return
        self._textures.layers().use(0)
        projected, offset = padded(weights * self._asset.scale), (weights * self._asset.bias).sum(axis=0)
        for first, count in ranges(self._asset.k, self.layers_per_pass(0)):
            values = {"firstMap": first, "maps": 0, "weights": projected[first : first + count]}
            values["offset"] = tuple((offset if first == 0 else 0 * offset).tolist())
            self._programs.run("projected.frag", {"SRBF_K": count}, values)

    def weighted(self, weights: moderngl.Texture) -> None:
        """All directional and environment lights, by weights on the GPU."""
        weights.use(1)
        self._textures.layers().use(0)
        values = {"maps": 0, "weights": 1}
        self._over_maps("weighted.frag", {}, values, {}, self.layers_per_pass(1))

    def point_lights(self, lights: Sequence[PointLight], weights: Float64[ndarray, "K 3"], units: int | None) -> None:
        """Point and spot lights, and the distant lights' `weights` with the first of them; `units` maps per pass."""
        self._textures.layers().use(0)
        where, values = self._textures.receivers(1)
        self._textures.r_pairs().use(2)
        centers = padded(self._asset.basis.centers)
        if "SRBF_FORMULA" in self._functions:
            centers[:, 3] = 0.5 / self._asset.basis.spread**2
        values |= {"maps": 0, "rTable": 2}
        if len(lights) == 1 and not weights.any() and not where:
            values |= {f"pointLight.{name}": value for name, value in point_light_uniforms(lights[0]).items()}
            self._over_maps("point.frag", self._functions, values, {"centers": centers}, units or self.layers_per_pass(1))
            return
        far = padded(weights)
        for group, places in point_light_groups(lights, self._point_lights):
            values |= {"pointLights": packed_point_lights(group, places), "pointLightCount": len(group)}
            arrays = {"centers": centers, "weights": far}
            self._over_maps(
                "lights.frag",
                {"SRBF_POINT_LIGHTS": places, **where, **self._loops, **self._functions},
                values,
                arrays,
                units or self.layers_per_pass(places),
            )
            far = np.zeros_like(far)

    def _over_maps(self, stage: str, defines: Defines, values: dict[str, Any], arrays: dict[str, ndarray], size: int) -> None:
        defines = {**defines, **self._defines}
        for first, count in ranges(self._asset.k, size):
            own = {name: array[first : first + count] for name, array in arrays.items()} | self._decoding(first, count)
            self._programs.run(stage, {"SRBF_K": count, **defines}, values | {"firstMap": first} | own)

    def _accumulate(self, weights: Float64[ndarray, "K 3"], units: int) -> None:
        for first, count in ranges(self._asset.k, units):
            for unit in range(count):
                self._textures.layer(first + unit).use(unit)
            values = {"maps": np.arange(count, dtype=np.int32), "weights": padded(weights[first : first + count])}
            self._programs.run("accumulate.frag", {"SRBF_UNITS": count}, values | self._decoding(first, count))

    def _decoding(self, first: int, count: int) -> dict[str, Any]:
        return {"scale": self._scale[first : first + count], "bias": self._bias[first : first + count]}
