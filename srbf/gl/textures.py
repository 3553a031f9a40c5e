"""An asset's images as textures: texel (c, r) of every texture is row r, column c of the array, row 0 at the top, never flipped."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.errors import InputError, ShaderError
from srbf.gl.context import Limits
from srbf.gl.depth_buffer import DepthView
from srbf.gl.uniforms import camera_uniforms

if TYPE_CHECKING:
    import moderngl

ON_HOST = {  # tables that no shader reads
    *("light_coefficients", "light_values", "cells", "environment_transfer"),
    *("surfel_transfer", "surfel_gather", "surfel_albedo", "surfel_series"),
    *("surface_gather", "surface_sent", "surface_feedback", "surface_objects", "surface_albedo"),
    *("pool", "view_rows", "view_points", "exchange_rows", "near_labels", "near_places"),  # shaders read them folded
}
_DTYPES = {"float16": "f2", "float32": "f4", "uint8": "f1"}  # moderngl's f1 is a normalized byte


class AssetTextures:
    """Textures of one asset, each made when first asked for; released with `resources`."""

    def __init__(
        self, context: moderngl.Context, asset: Asset, limits: Limits, resources: ExitStack, view: DepthView | None = None
    ) -> None:
        if view is not None and view.samples.shape != (asset.height, asset.width):
            raise InputError(
                f"expected {asset.height} x {asset.width} depth samples, found {view.samples.shape}; render the asset's picture"
            )
        looked_up = [table.shape[:2] for name, table in asset.tables.items() if name not in ON_HOST]
        side = max(asset.width, asset.height, asset.manifest.get("scalars", 0) + 1, *map(max, looked_up))
        if side > limits.texture_size:
            raise ShaderError(f"expected at most {limits.texture_size} texels a side on this GPU, found {side}; shrink the asset")
        self._context, self._asset, self._limits, self._resources, self._view = context, asset, limits, resources, view
        self._made: dict[str, moderngl.Texture] = {}
        self._layers: moderngl.TextureArray | None = None

    def layers(self) -> moderngl.TextureArray:
        """All stored layers, maps or four components each, as an array. ShaderError where the GPU has fewer layers."""
        if self._layers is None:
            stored, most = self._asset.stored, self._limits.array_layers
            if len(stored) > most:
                raise ShaderError(f"expected at most {most} layers on this GPU (array layers), found {len(stored)}; fit with fewer")
            self._layers = self.kept_layers(stored)
        return self._layers

    def kept_layers(self, stored: ndarray) -> moderngl.TextureArray:
        """(N, H, W, C) as an array of textures that lives as long as the asset's."""
        layers, height, width, channels = stored.shape
        pixels, dtype = np.ascontiguousarray(stored), _DTYPES[stored.dtype.name]
        texture = self._context.texture_array((width, height, layers), channels, pixels, alignment=1, dtype=dtype)
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        texture.repeat_x = texture.repeat_y = False
        self._resources.callback(texture.release)
        return texture

    def layer(self, i: int) -> moderngl.Texture:
        """Layer i as a plain 2D texture, for the article's multi-pass variant."""
        return self._plain(f"layer {i}", self._asset.stored[i])

    def r_pairs(self) -> moderngl.Texture:
        """The R table from its end, and the differences of its entries, n x 1, for `srbfWeightPairs`."""
        return self._plain("r_pairs", pairs_of(self._asset.table)[None])

    def plain(self) -> bool:
        """Whether what is stored needs no decoding."""
        return self._asset.is_plain()

    def w_table(self) -> moderngl.Texture:
        """The atlas of light functions over the octahedral square."""
        return self._plain("w_table", self._asset.tables["w_table"])

    def clusters(self) -> moderngl.Texture:
        """The cluster of every texel, R8."""
        return self._plain("cluster_index", self._asset.tables["cluster_index"][..., None])

    def receivers(self, unit: int) -> tuple[dict[str, int], dict[str, Any]]:
        """Where the receivers are, bound to a texture unit, as (defines, uniforms): the position map, or a camera's depth buffer."""
        if self._view is not None:
            self._plain("depth", self._view.samples[..., None]).use(unit)
            camera = {f"camera.{name}": value for name, value in camera_uniforms(self._view.camera).items()}
            return {"SRBF_DEPTH": 1}, {"depths": unit, **camera}
        position = self._asset.images["position"]
        padded = np.concatenate([position, np.ones_like(position[..., :1])], axis=2, dtype=np.float32)
        self._plain("position", padded).use(unit)
        return {}, {"positions": unit}

    def ambient(self) -> moderngl.Texture:
        """The ambient image, or one black texel."""
        return self._plain("ambient", self._asset.images.get("ambient", np.zeros((1, 1, 3), np.float32)))

    def kept(self, pixels: ndarray) -> moderngl.Texture:
        """Numbers or bytes (H, W, C) as a texture that lives as long as the asset's."""
        return self._plain(f"kept {len(self._made)}", pixels)

    @contextmanager
    def passing(self, pixels: ndarray) -> Iterator[moderngl.Texture]:
        """A texture for one pass only, (H, W, C)."""
        height, width, channels = pixels.shape
        texture = self._context.texture((width, height), channels, np.ascontiguousarray(pixels, np.float32), alignment=1, dtype="f4")
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        try:
            yield texture
        finally:
            texture.release()

    def _plain(self, name: str, pixels: ndarray) -> moderngl.Texture:
        if name not in self._made:
            height, width, channels = pixels.shape
            dtype = _DTYPES[pixels.dtype.name]
            texture = self._context.texture((width, height), channels, np.ascontiguousarray(pixels), alignment=1, dtype=dtype)
            texture.filter = (self._context.NEAREST, self._context.NEAREST)
            texture.repeat_x = texture.repeat_y = False
            self._resources.callback(texture.release)
            self._made[name] = texture
        return self._made[name]


def pairs_of(table: Float32[ndarray, " n"]) -> Float32[ndarray, "n 2"]:
    """An R table from its end, so that it begins where cos theta is 1, each entry with the difference to the next; 0 in the last."""
    turned = table[::-1]
    return np.stack([turned, np.diff(turned, append=turned[-1])], axis=1).astype(np.float32)
