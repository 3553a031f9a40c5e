"""Passes that relight scalar planes, of eigen maps and clustered ones: all far lights in one, and one for each lamp."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.gl.context import Limits
from srbf.gl.programs import Programs, ranges
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import VECTORS_KEPT_FREE, lamp_uniforms
from srbf.lights import PointLight

VECTORS_A_LAYER = 2  # scale, bias


class PlanePasses:
    """Passes over an asset of scalar planes; each adds to the target in use."""

    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, limits: Limits) -> None:
        self._asset, self._programs, self._textures = asset, programs, textures
        self._stage = asset.method.replace("-", "_")
        self.layers_a_pass = max(1, (limits.fragment_vectors - VECTORS_KEPT_FREE) // VECTORS_A_LAYER)

    def check_lamps(self) -> None:
        """Scalar planes have light functions for every direction."""

    def far(self, weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """All directional and environment lights; `units` layers of four scalars a pass, or all that uniforms hold."""
        rows = np.ones((self._asset.clusters, self._asset.scalars + 1, 4), np.float32)
        rows[..., :3] = weights.reshape(*rows.shape[:2], 3)
        with self._textures.passing(rows) as texture:
            texture.use(2)
            self._over_layers("directional.frag", {"weights": 2}, units)

    def lamp(self, light: PointLight, units: int | None) -> None:
        """One point or spot light."""
        self._textures.w_table().use(2)
        self._textures.positions().use(3)
        values = {"wTable": 2, "positions": 3, "tableSize": self._asset.manifest["w_table"]["size"]}
        self._over_layers("point.frag", values | {f"lamp.{name}": value for name, value in lamp_uniforms(light).items()}, units)

    def _over_layers(self, lights: str, values: dict[str, Any], units: int | None) -> None:
        self._textures.layers().use(0)
        values["planes"] = 0
        if "cluster_index" in self._asset.tables:
            self._textures.clusters().use(1)
            values["clusters"] = 1
        scale, bias = self._asset.scale, self._asset.bias
        for first, count in ranges(len(scale), units or self.layers_a_pass):
            own = {"firstLayer": first, "scale": scale[first : first + count], "bias": bias[first : first + count]}
            defines = {"SRBF_SCALARS": self._asset.scalars, "SRBF_LAYERS": count}
            self._programs.run(f"{self._stage}_{lights}", defines, values | own)
