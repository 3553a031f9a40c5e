"""Passes that relight relighting maps: all far lights in one, or the article's few maps a pass, and one for each lamp."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.gl.context import Limits
from srbf.gl.programs import Programs, ranges
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import VECTORS_KEPT_FREE, lamp_uniforms, padded
from srbf.lights import PointLight

VECTORS_A_MAP = 3  # weight or center, scale, bias


class MapPasses:
    """Passes over an asset of relighting maps; each adds to the target in use."""

    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, limits: Limits) -> None:
        self._asset, self._programs, self._textures = asset, programs, textures
        self._scale, self._bias = padded(asset.scale), padded(asset.bias)
        self.layers_a_pass = max(1, (limits.fragment_vectors - VECTORS_KEPT_FREE) // VECTORS_A_MAP)

    def check_lamps(self) -> None:
        """InputError where the shaders know no formula for the functions of a lamp's direction."""
        kind = self._asset.manifest["basis"]["kind"]
        if kind != "gaussian":
            raise InputError(f"expected Gaussians for point and spot lights on the GPU, found {kind}; relight them by numpy")

    def far(self, weights: Float64[ndarray, "K 3"], units: int | None) -> None:
        """All directional and environment lights; `units` maps a pass as plain textures, or all that uniforms hold from an array."""
        if units is not None:
            self._accumulate(weights, units)
            return
        self._textures.layers().use(0)
        for first, count in ranges(self._asset.k, self.layers_a_pass):
            values = {"firstMap": first, "maps": 0, "weights": padded(weights[first : first + count])}
            self._programs.run("directional.frag", {"SRBF_K": count}, values | self._decoding(first, count))

    def lamp(self, light: PointLight, units: int | None) -> None:
        """One point or spot light."""
        self._textures.layers().use(0)
        self._textures.positions().use(1)
        self._textures.r_table().use(2)
        centers = padded(self._asset.basis.centers)
        values: dict[str, Any] = {"maps": 0, "positions": 1, "rTable": 2}
        values |= {f"lamp.{name}": value for name, value in lamp_uniforms(light).items()}
        for first, count in ranges(self._asset.k, units or self.layers_a_pass):
            values |= {"firstMap": first, "centers": centers[first : first + count]}
            self._programs.run("point.frag", {"SRBF_K": count}, values | self._decoding(first, count))

    def _accumulate(self, weights: Float64[ndarray, "K 3"], units: int) -> None:
        for first, count in ranges(self._asset.k, units):
            for unit in range(count):
                self._textures.layer(first + unit).use(unit)
            values = {"maps": np.arange(count, dtype=np.int32), "weights": padded(weights[first : first + count])}
            self._programs.run("accumulate.frag", {"SRBF_UNITS": count}, values | self._decoding(first, count))

    def _decoding(self, first: int, count: int) -> dict[str, Any]:
        return {"scale": self._scale[first : first + count], "bias": self._bias[first : first + count]}
