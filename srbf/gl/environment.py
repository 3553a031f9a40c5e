"""Environment lights integrated on the GPU: their projected weights, in a texture."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.gl.programs import Programs
from srbf.gl.textures import AssetTextures
from srbf.gl.uniforms import padded
from srbf.lights import EnvironmentLight

if TYPE_CHECKING:
    import moderngl

SPHERE, HEMISPHERE, TURNED_HEMISPHERE = range(3)  # SRBF_SPHERE, ...


class EnvironmentWeights:
    """Weights of environments for one asset, by shaders: one texel per map or light function, one row per cluster.

    Relighting maps read the table, as numpy does; light functions are computed from their basis, not from the w table.
    """

    def __init__(self, context: moderngl.Context, asset: Asset, programs: Programs, textures: AssetTextures, resources: ExitStack) -> None:
        self._context, self._asset, self._programs, self._textures = context, asset, programs, textures
        self._resources = resources
        self._maps = "r_table" in asset.tables
        if self._maps:
            basis = asset.basis
            self._size = (asset.k, 1)
            centers = np.column_stack([basis.centers, np.full(asset.k, 0.5 / basis.spread**2)])
        else:
            functions = asset.light_functions
            spreads, which = np.unique(functions.spreads, return_inverse=True)
            self._size = (asset.components + 1, asset.clusters)
            centers = np.concatenate([np.pad(functions.centers, ((0, 0), (0, 1)), constant_values=0.5 / spread**2) for spread in spreads])
            coefficients = np.pad(functions.coefficients, ((0, 0), (0, 0), (0, 1)))
            coefficients[..., 3] = which[:, None]
            self._coefficients = textures.kept(coefficients.astype(np.float32))
            self._gaussians, self._gaussians_buffer = self._target((len(centers), 1))
        self._count = len(centers)
        self._centers = textures.kept(centers[None].astype(np.float32))
        self._weights, self._weights_buffer = self._target(self._size)

    def weights(self, suns: Float64[ndarray, "F 3"], environments: Sequence[EnvironmentLight]) -> moderngl.Texture:
        """A texture of the directional lights' weights, which are `suns`, plus the environments'."""
        self._weights.write(np.pad(suns.reshape(self._size[1], self._size[0], 3), ((0, 0), (0, 0), (0, 1))).astype(np.float32))
        for light in environments:
            self._add(light)
        return self._weights

    def read(self) -> Float32[ndarray, "F 3"]:
        """The texture's current weights."""
        data = self._weights_buffer.read(components=4, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(-1, 4)[:, :3].copy()

    def _add(self, light: EnvironmentLight) -> None:
        rotation = light.rotation
        domain = SPHERE
        if self._asset.domain == "hemisphere":
            domain = HEMISPHERE if np.allclose(rotation[2], [0, 0, 1]) else TURNED_HEMISPHERE
        uniforms: dict[str, Any] = {"environment": 0, "centers": 1, "domain": domain}
        uniforms["assetFromMap"] = padded(rotation)
        with ExitStack() as passing:
            rows = self._context.texture((self._count, len(light.image)), 4, dtype="f4")
            passing.callback(rows.release)
            buffer = self._context.framebuffer([rows])
            passing.callback(buffer.release)
            passing.enter_context(self._textures.passing(light.image)).use(0)
            self._centers.use(1)
            if self._maps:
                self._textures.r_pairs().use(2)
                uniforms["rTable"] = 2
            self._onto(buffer, blend=False)
            self._programs.run("environment_rows.frag", {"SRBF_PAIRS" if self._maps else "SRBF_FORMULA": 1}, uniforms)
            rows.use(0)
            self._onto(self._weights_buffer if self._maps else self._gaussians_buffer, blend=self._maps)
            self._programs.run("environment_weights.frag", {}, {"rows": 0, "color": light.color})
        if not self._maps:
            self._gaussians.use(0)
            self._coefficients.use(1)
            self._onto(self._weights_buffer, blend=True)
            self._programs.run("environment_functions.frag", {}, {"gaussians": 0, "coefficients": 1, "functions": self._size[0]})

    def _onto(self, buffer: moderngl.Framebuffer, *, blend: bool) -> None:
        buffer.use()
        self._context.enable_only(self._context.BLEND if blend else self._context.NOTHING)
        self._context.blend_func = self._context.ONE, self._context.ONE

    def _target(self, size: tuple[int, int]) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        texture = self._context.texture(size, 4, dtype="f4")
        self._resources.callback(texture.release)
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        buffer = self._context.framebuffer([texture])
        self._resources.callback(buffer.release)
        return texture, buffer
