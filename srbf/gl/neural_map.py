"""Passes over a neural map: lights at infinity by direction and color, point and spot lights by receiver."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.errors import InputError, ShaderError
from srbf.gl.context import Limits
from srbf.gl.passes import Passes
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import VECTORS_PER_POINT_LIGHT, packed_point_lights, padded, point_light_groups, vectors_free
from srbf.light_domain.distant_lights import distant_lights
from srbf.lights import Light, PointLight

if TYPE_CHECKING:
    import moderngl

MOST_DISTANT, MOST_POINTS = 32, 8  # lights of a pass


class NeuralPasses(Passes):
    """Passes over a neural map; each adds to the target in use. ShaderError where the GPU's uniforms do not hold the network."""

    def __init__(self, asset: Asset, programs: Programs, textures: AssetTextures, limits: Limits, formula: bool = False) -> None:
        self._asset, self._programs, self._textures = asset, programs, textures
        self._network = network_vectors(asset.tables["network"])
        needed = len(self._network) + 2 * len(asset.scale) + VECTORS_PER_POINT_LIGHT * MOST_POINTS + 2 * MOST_DISTANT
        if needed > vectors_free(limits):
            raise ShaderError(
                f"expected a network of this GPU's {vectors_free(limits)} vectors of uniforms, found {needed}; fit a smaller one"
            )
        unit_vectors = asset.manifest["network"]["hidden"] // 4
        self._defines = {"SRBF_COMPONENTS": asset.components, "SRBF_UNIT_VECTORS": unit_vectors}
        self._defines |= {"SRBF_PLAIN": 1} if textures.plain() else {}

    def check_point_lights(self) -> None:
        """Accepts all: the network knows every direction."""

    def prepare(self, lights: Sequence[Light]) -> Callable[[], None]:
        """All lights at infinity, MOST_DISTANT in a pass; point and spot lights have passes of their own."""
        return partial(self._distant, *distant_lights(self._asset.manifest, lights))

    def distant(self, weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """Nothing is left to project."""

    def weighted(self, weights: moderngl.Texture) -> None:
        """InputError: no environment has its weights on the GPU."""
        raise InputError(f"expected environments on the host for a {self._asset.method} asset, found weights on the GPU")

    def point_lights(self, lights: Sequence[PointLight], weights: Float64[ndarray, "F 3"], units: int | None) -> None:
        """Point and spot lights, MOST_POINTS in a pass."""
        where, values = self._textures.receivers(1)
        for group, places in point_light_groups(lights, MOST_POINTS):
            values |= {"pointLights": packed_point_lights(group, places), "pointLightCount": len(group)}
            self._run("neural_map_points.frag", {"SRBF_POINT_LIGHTS": places} | where, values)

    def _distant(self, directions: Float64[ndarray, "n 3"], colors: Float64[ndarray, "n 3"]) -> None:
        for first in range(0, len(colors), MOST_DISTANT):
            part = slice(first, first + MOST_DISTANT)
            count = len(colors[part])
            places = 1 << (count - 1).bit_length()  # few programs serve any number
            distant = np.zeros((places, 2, 4), np.float32)
            distant[:count, 0], distant[:count, 1] = padded(directions[part]), padded(colors[part])
            self._run("neural_map_distant.frag", {"SRBF_DISTANT": places}, {"distant": distant.reshape(-1, 4), "distantCount": count})

    def _run(self, stage: str, defines: dict[str, int], values: dict[str, Any]) -> None:
        self._textures.layers().use(0)
        own = {"planes": 0, "network": self._network, "scale": self._asset.scale, "bias": self._asset.bias}
        self._programs.run(stage, self._defines | defines, own | values)


def network_vectors(table: Float32[ndarray, "R W"]) -> Float32[ndarray, "V 4"]:
    """The rows of a network's table as vec4; of the last, which holds three biases, the first."""
    vectors = table.reshape(-1, 4)
    return np.ascontiguousarray(vectors[: len(vectors) - table.shape[1] // 4 + 1])
