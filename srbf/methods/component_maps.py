"""Component maps: T(p, l) ~ w_0(l) + sum_j a_j(p) w_j(l), one number per component and texel, RGB functions w of the light.

What all methods of components share, whatever their lights are: layers of four components, clusters of texels, products, shaders.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.encode.clustered_components import ClusteredComponents
from srbf.encode.dilation import dilate, nearest_covered
from srbf.encode.quantization import quantize
from srbf.encode.uv_seams import Stitch
from srbf.errors import ManifestError
from srbf.io.image import Encoding
from srbf.methods.over_lights import row_chunks
from srbf.methods.protocol import MOST_POINT_LIGHTS, Method, ShaderParts
from srbf.stored_layers import layer_entries

if TYPE_CHECKING:
    from srbf.gl.passes import Passes

CHANNELS = 4  # components to a layer


class ComponentMaps(Method):
    """A method whose assets hold components; where there are clusters of texels, each has functions of its own."""

    layers: ClassVar[str] = "planes"
    functions_text: ClassVar[str] = ""  # GLSL of an asset's own functions; none where all lights are weights

    components: int
    encoding: Encoding

    @classmethod
    def weighted(cls, asset: Asset, weights: Float64[ndarray, "b F 3"]) -> Float32[ndarray, "b H W 3"]:
        """b pictures from the weights of all functions: one (n, S + 1) x (S + 1, 3 b) product per cluster."""
        size = asset.components + 1
        count = len(weights)
        by_cluster = weights.astype(np.float32).transpose(1, 0, 2).reshape(asset.clusters, size, -1)  # (C, S + 1, 3 b)
        images = np.empty((count, asset.height, asset.width, 3), np.float32)
        for rows in row_chunks(asset):
            components = components_of(asset.coefficients(rows), asset.components)
            ones = np.concatenate([np.ones_like(components[:1]), components]).reshape(size, -1)  # (S + 1, n)
            cluster = (first_function(asset, rows) // size).ravel()
            part = np.empty((ones.shape[1], by_cluster.shape[2]), np.float32)
            for number in np.unique(cluster):
                chosen = slice(None) if asset.clusters == 1 else np.flatnonzero(cluster == number)
                part[chosen] = ones[:, chosen].T @ by_cluster[number]
            images[:, rows] = part.reshape(components.shape[1], components.shape[2], -1, 3).transpose(2, 0, 1, 3)
        return images

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return asset.components

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.components} components" + (f", {asset.clusters} clusters" if asset.clusters > 1 else "")

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        return {
            "components": asset.components,
            "scalars": asset.components,  # the former key, for one version
            "clusters": asset.clusters,
        }

    @classmethod
    def gl_passes(cls) -> type[Passes]:
        if not cls.has_shader:
            return super().gl_passes()
        from srbf.gl.coefficient_maps import ComponentPasses

        return ComponentPasses

    @classmethod
    def shader_parts(cls, asset: Asset, pairs: bool = False) -> ShaderParts:
        if not cls.has_shader:
            return super().shader_parts(asset, pairs)
        defines = {
            "SRBF_COMPONENTS": asset.components,
            "SRBF_LAYERS": len(asset.scale),
            "SRBF_POINT_LIGHTS": MOST_POINT_LIGHTS,
        } | ({"SRBF_PLAIN": 1} if asset.is_plain() else {})
        arrays = {"srbfScale": ("SRBF_LAYERS", asset.scale), "srbfBias": ("SRBF_LAYERS", asset.bias)}
        return ShaderParts(cls.functions_text, defines, arrays, f"{cls.shader_stem(asset)}_")


def check_layers(reader: AssetReader) -> int:
    """How many functions the components of an asset.json have; ManifestError where they do not fill the images it lists."""
    manifest = reader.manifest
    components = manifest["scalars"]
    if len(manifest["planes"]) != -(-components // CHANNELS):
        found = f"{len(manifest['planes'])} images"
        raise ManifestError(f"expected {components} components four to an image in {reader.path}, found {found}")
    return int(manifest.get("clusters", 1) * (components + 1))


def read_cluster_index(reader: AssetReader) -> ndarray:
    """(H, W) uint8, the cluster of every texel; ManifestError where there is none of that number."""
    manifest = reader.manifest
    clusters = manifest.get("clusters", 1)
    index = np.round(reader.table("cluster_index", (manifest["height"], manifest["width"]), 1)[:, :, 0] * 255).astype(np.uint8)
    if index.max() >= clusters:
        raise ManifestError(f"expected cluster indices below {clusters} in {reader.path}, found {index.max()}")
    return index


def components_of(layers: Float32[ndarray, "N h W 4"], components: int) -> Float32[ndarray, "S h W"]:
    """Components out of the layers that hold four each."""
    maps = layers.transpose(0, 3, 1, 2)
    return maps.reshape(-1, *maps.shape[2:])[:components]


def first_function(asset: Asset, rows: slice) -> Int[ndarray, "h W"]:
    """Index of the mean's function in every texel's cluster; component j has that plus j."""
    if "cluster_index" in asset.tables:
        return asset.tables["cluster_index"][rows].astype(np.int64) * (asset.components + 1)
    height = len(range(*rows.indices(asset.height)))
    return np.zeros((height, asset.width), np.int64)


@dataclass(frozen=True, eq=False)
class StoredComponents:
    """Components as an asset stores them, four to a layer, dilated and stitched; `index` (H, W) uint8 the cluster of every texel, or None.

    `nearest`: what dilation fills a texel from. `unstitched` (N, n, 4), `unstitched_index` (n,): the texels of a stitch without it.
    """

    count: int
    encoding: Encoding
    stored: ndarray
    scale: Float32[ndarray, "N 4"]
    bias: Float32[ndarray, "N 4"]
    index: ndarray | None
    unstitched: Float32[ndarray, "N n 4"] | None
    unstitched_index: Int[ndarray, " n"] | None

    def entries(self, clusters: int) -> dict[str, Any]:
        """The keys of asset.json that describe them."""
        own: dict[str, Any] = {"scalars": self.count, "planes": layer_entries("plane", self.encoding, self.scale, self.bias)}
        if self.index is not None:
            own |= {"clusters": clusters, "cluster_index": {"file": "cluster_index.png"}}
        return own

    def tables(self) -> dict[str, ndarray]:
        """What goes along with the layers."""
        return {} if self.index is None else {"cluster_index": self.index}


def stored_components(
    capture: Capture,
    encoding: Encoding,
    components: Float32[ndarray, "S P"],
    found: ClusteredComponents | None = None,
    stitch: Stitch | None = None,
) -> StoredComponents:
    """`components` dilated, stitched and rounded; `found` where there are clusters, whose components are stitched already."""
    count, shape = len(components), (capture.height, capture.width)
    nearest = nearest_covered(capture.coverage())
    if nearest is not None and stitch is not None and found is not None:
        nearest = nearest.copy()
        nearest.flat[stitch.texels] = stitch.texels
    layers = np.zeros((-(-count // CHANNELS), *shape, CHANNELS), np.float32)
    for j, component in enumerate(components):
        layers[j // CHANNELS, :, :, j % CHANNELS] = dilate(component.reshape(*shape, 1), nearest)[:, :, 0]
    unstitched = None
    if stitch is not None:
        unstitched = layers.reshape(len(layers), -1, CHANNELS)[:, stitch.texels]
        if found is None:
            stitch.apply(layers)
        elif found.unstitched is not None:
            for j, component in enumerate(found.unstitched):
                unstitched[j // CHANNELS, :, j % CHANNELS] = component
    stored, scale, bias = quantize(layers, encoding)
    unused = range(count % CHANNELS or CHANNELS, CHANNELS)
    scale[-1, unused], bias[-1, unused] = 0, 0
    index = None if found is None else dilate(found.index.reshape(*shape, 1), nearest)[:, :, 0].astype(np.uint8)
    return StoredComponents(count, encoding, stored, scale, bias, index, unstitched, None if found is None else found.unstitched_index)
