"""Coefficient maps: T(p, L) ~ w_0(L) + sum_j a_j(p) w_j(L), one number per component and texel, RGB light functions w.

What eigen maps and clustered ones share; four components to a stored layer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset, layer_entries
from srbf.asset_reader import AssetReader
from srbf.basis.light_functions import LightFunctions
from srbf.basis.octahedral_table import lookup, octahedral_table
from srbf.capture import Capture
from srbf.encode.dilation import dilate, nearest_covered
from srbf.encode.quantization import quantize
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError, ManifestError
from srbf.io.image import Encoding
from srbf.light_domain import LightDomain, domain_of_asset
from srbf.lights import Light
from srbf.methods.carried import carried_images, carried_scene, common_manifest
from srbf.methods.over_lights import row_chunks, sum_over_lights
from srbf.methods.protocol import MOST_POINT_LIGHTS, Method, ShaderParts
from srbf.methods.seam_report import seam_report

if TYPE_CHECKING:
    from srbf.gl.passes import Passes

CHANNELS = 4  # components to a layer
MOST_COMPONENTS = 1024


class CoefficientMaps(Method):
    """A method whose assets hold components and light functions; where there are clusters of texels, each has functions of its own."""

    layers: ClassVar[str] = "planes"
    tables: ClassVar[dict[str, str]] = {"light_coefficients": "light_coefficients.exr", "w_table": "w_table.exr"}
    functions_text: ClassVar[str]  # GLSL of an asset's own functions

    components: int
    encoding: Encoding

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        """The light functions and their octahedral table."""
        manifest, path = reader.manifest, reader.path
        components, clusters = manifest["scalars"], manifest.get("clusters", 1)
        if len(manifest["planes"]) != -(-components // CHANNELS):
            found = f"{len(manifest['planes'])} images"
            raise ManifestError(f"expected {components} components four to an image in {path}, found {found}")
        functions = clusters * (components + 1)
        basis = manifest["light_basis"]
        reader.check_unit(basis["centers"])
        if len(basis["spreads"]) != functions:
            raise ManifestError(f"expected a spread for each of {functions} light functions in {path}, found {len(basis['spreads'])}")
        size, columns = manifest["w_table"]["size"], manifest["w_table"]["columns"]
        return {
            "light_coefficients": reader.table("light_coefficients", (functions, len(basis["centers"])), 3),
            "w_table": reader.table("w_table", (-(-functions // columns) * size, columns * size), 3).astype(np.float16),
        }

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """Directional and environment lights weigh by the functions themselves; a point or spot light reads each receiver's own weights
        from the octahedral table."""
        weights = cls.projected_weights(asset, lights).astype(np.float32)
        table, entry = asset.tables["w_table"], asset.manifest["w_table"]

        def projected(layers: ndarray, rows: slice) -> ndarray:
            first = first_function(asset, rows)  # (h, W)
            total = weights[first]
            for j, component in enumerate(components_of(layers, asset.components), start=1):
                total += component[..., None] * weights[first + j]
            return total

        def response(layers: ndarray, rows: slice, positions: ndarray, coordinates: ndarray) -> ndarray:
            first = first_function(asset, rows)
            total = lookup(table, entry["size"], entry["columns"], first, coordinates)
            for j, component in enumerate(components_of(layers, asset.components), start=1):
                total += component[..., None] * lookup(table, entry["size"], entry["columns"], first + j, coordinates)
            return total

        return sum_over_lights(asset, lights, projected if weights.any() else None, response)

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b d"]) -> Float32[ndarray, "b H W 3"]:
        """One (n, S + 1) x (S + 1, 3 b) product per cluster."""
        size = asset.components + 1
        weights = asset.light_functions.evaluate(coordinates).astype(np.float32)  # (b, F, 3)
        weights = weights.transpose(1, 0, 2).reshape(asset.clusters, size, -1)  # (C, S + 1, 3 b)
        images = np.empty((len(coordinates), asset.height, asset.width, 3), np.float32)
        for rows in row_chunks(asset):
            components = components_of(asset.coefficients(rows), asset.components)
            ones = np.concatenate([np.ones_like(components[:1]), components]).reshape(size, -1)  # (S + 1, n)
            cluster = (first_function(asset, rows) // size).ravel()
            part = np.empty((ones.shape[1], weights.shape[2]), np.float32)
            for number in np.unique(cluster):
                chosen = slice(None) if asset.clusters == 1 else np.flatnonzero(cluster == number)
                part[chosen] = ones[:, chosen].T @ weights[number]
            images[:, rows] = part.reshape(components.shape[1], components.shape[2], -1, 3).transpose(2, 0, 1, 3)
        return images

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        weights = np.zeros((asset.clusters * (asset.components + 1), 3))
        functions = asset.light_functions
        for coordinates, colors in domain_of_asset(asset.manifest).shared(lights):
            weights += functions.project(coordinates, colors)
        return weights

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return asset.components

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.components} components"

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        return {
            "components": asset.components,
            "scalars": asset.components,  # the former key, for one version
            "clusters": asset.clusters,
            "light_basis": len(asset.manifest["light_basis"]["centers"]),
            "table": asset.manifest["w_table"]["size"],
        }

    @classmethod
    def gl_passes(cls) -> type[Passes]:
        from srbf.gl.coefficient_maps import ComponentPasses

        return ComponentPasses

    @classmethod
    def shader_parts(cls, asset: Asset, pairs: bool = False) -> ShaderParts:
        defines = {
            "SRBF_COMPONENTS": asset.components,
            "SRBF_LAYERS": len(asset.scale),
            "SRBF_TABLE_SIZE": asset.manifest["w_table"]["size"],
            "SRBF_POINT_LIGHTS": MOST_POINT_LIGHTS,
        } | ({"SRBF_PLAIN": 1} if asset.is_plain() else {})
        arrays = {"srbfScale": ("SRBF_LAYERS", asset.scale), "srbfBias": ("SRBF_LAYERS", asset.bias)}
        return ShaderParts(cls.functions_text, defines, arrays, f"{cls.stem()}_")


def check_settings(components: int, spread: float | str, ridge: float | str, encoding: str) -> None:
    """InputError on settings that no coefficient maps can have."""
    if not 1 <= components <= MOST_COMPONENTS:
        raise InputError(f"expected 1 to {MOST_COMPONENTS} `components`, found {components}")
    for name, value in (("spread", spread), ("ridge", ridge)):
        if value != "auto" and not (isinstance(value, (int, float)) and np.isfinite(value) and value > 0):
            raise InputError(f"expected `{name}` auto or a number above 0 for light functions, found {value}")
    if encoding not in get_args(Encoding):
        raise InputError(f"expected an encoding of half, float, uint8, found {encoding!r}")


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
class StitchedComponents:
    """Components `unstitched` (S, n) and clusters `unstitched_index` (n,) that the texels of a stitch have without it."""

    unstitched: Float32[ndarray, "S n"]
    unstitched_index: Int[ndarray, " n"]


def coefficient_maps_asset(
    method: CoefficientMaps,
    capture: Capture,
    domain: LightDomain,
    components: Float32[ndarray, "S P"],
    functions: LightFunctions,
    fit: dict[str, Any],
    index: Int[ndarray, " P"] | None = None,
    stitch: Stitch | None = None,
    stitched: StitchedComponents | None = None,
) -> Asset:
    """An asset of components, dilated, stored four to a layer; `index` the cluster of every texel where there are clusters.

    `stitch` closes the seams of the dilated components before they are rounded. Where there are clusters they must be `stitched`:
    components and index of a stitched capture, its gutter included.
    """
    count, shape = len(components), (capture.height, capture.width)
    nearest = nearest_covered(capture.coverage())
    images = carried_images(capture, nearest)
    if nearest is not None and stitch is not None and stitched is not None:
        nearest = nearest.copy()
        nearest.flat[stitch.texels] = stitch.texels
    layers = np.zeros((-(-count // CHANNELS), *shape, CHANNELS), np.float32)
    for j, component in enumerate(components):
        layers[j // CHANNELS, :, :, j % CHANNELS] = dilate(component.reshape(*shape, 1), nearest)[:, :, 0]
    unstitched = None
    if stitch is not None:
        unstitched = layers.reshape(len(layers), -1, CHANNELS)[:, stitch.texels]
        if stitched is None:
            stitch.apply(layers)
        else:
            for j, component in enumerate(stitched.unstitched):
                unstitched[j // CHANNELS, :, j % CHANNELS] = component
    stored, scale, bias = quantize(layers, method.encoding)
    unused = range(count % CHANNELS or CHANNELS, CHANNELS)
    scale[-1, unused], bias[-1, unused] = 0, 0
    table = octahedral_table(functions, domain.manifest()["domain"])
    manifest = common_manifest(capture, method.name, domain, images, asdict(method), fit)  # type: ignore[call-overload]
    manifest["scalars"] = count
    manifest["planes"] = layer_entries("plane", method.encoding, scale, bias)
    manifest["light_basis"] = {"kind": "gaussian", "centers": functions.centers.tolist(), "spreads": functions.spreads.tolist()}
    manifest["light_coefficients"] = {"file": "light_coefficients.exr"}
    manifest["w_table"] = {
        "file": "w_table.exr",
        "size": table.size,
        "columns": table.columns,
        "mapping": "octahedral",
        "error": table.error,
    }
    tables = {"light_coefficients": functions.coefficients, "w_table": table.atlas}
    if index is not None:
        manifest["clusters"] = len(functions.spreads) // (count + 1)
        manifest["cluster_index"] = {"file": "cluster_index.png"}
        tables["cluster_index"] = dilate(index.reshape(*shape, 1), nearest)[:, :, 0].astype(np.uint8)
    asset = Asset(manifest, stored, scale, bias, tables, images, carried_scene(capture))
    if stitch is not None and unstitched is not None:
        index_before = None if stitched is None else stitched.unstitched_index
        manifest["seams"] = seam_report(asset, capture, stitch, unstitched, method.responses, index_before)
    return asset
