"""Coefficient maps: component maps whose functions are smooth in the direction of the light.

What eigen maps and clustered ones share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, ClassVar, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.basis.light_functions import LightFunctions
from srbf.basis.octahedral_table import lookup, octahedral_table
from srbf.capture import Capture
from srbf.encode.clustered_components import ClusteredComponents
from srbf.encode.dilation import nearest_covered
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError, ManifestError
from srbf.io.image import Encoding
from srbf.light_domain import LightDomain, domain_of_asset
from srbf.lights import Light
from srbf.methods.carried import carried_images, carried_scene, common_manifest
from srbf.methods.component_maps import ComponentMaps, check_layers, components_of, first_function, stored_components
from srbf.methods.over_lights import sum_over_lights
from srbf.methods.protocol import ShaderParts
from srbf.methods.seam_report import seam_report

MOST_COMPONENTS = 1024


class CoefficientMaps(ComponentMaps):
    """Component maps whose functions are smooth in the direction of the light: sums of spherical Gaussians, and a table of them."""

    tables: ClassVar[dict[str, str]] = {"light_coefficients": "light_coefficients.exr", "w_table": "w_table.exr"}

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        """The light functions and their octahedral table."""
        manifest, path = reader.manifest, reader.path
        functions = check_layers(reader)
        basis = manifest["light_basis"]
        reader.check_unit(basis["centers"])
        if len(basis["spreads"]) != functions:
            raise ManifestError(f"expected a spread for each of {functions} light functions in {path}, found {len(basis['spreads'])}")
        size, columns = manifest["w_table"]["size"], manifest["w_table"]["columns"]
        return {
            "light_coefficients": reader.stored_table("light_coefficients", (functions, len(basis["centers"])), 3),
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
        return cls.weighted(asset, asset.light_functions.evaluate(coordinates))

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        weights = np.zeros((asset.clusters * (asset.components + 1), 3))
        functions = asset.light_functions
        for coordinates, colors in domain_of_asset(asset.manifest).shared(lights):
            weights += functions.project(coordinates, colors)
        return weights

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        own = {"light_basis": len(asset.manifest["light_basis"]["centers"]), "table": asset.manifest["w_table"]["size"]}
        return {**super().describe(asset), **own}

    @classmethod
    def shader_parts(cls, asset: Asset, pairs: bool = False) -> ShaderParts:
        parts = super().shader_parts(asset, pairs)
        return replace(parts, defines={**parts.defines, "SRBF_TABLE_SIZE": asset.manifest["w_table"]["size"]})


def check_settings(components: int, spread: float | str, ridge: float | str, encoding: str) -> None:
    """InputError on settings that no coefficient maps can have."""
    if not 1 <= components <= MOST_COMPONENTS:
        raise InputError(f"expected 1 to {MOST_COMPONENTS} `components`, found {components}")
    for name, value in (("spread", spread), ("ridge", ridge)):
        if value != "auto" and not (isinstance(value, (int, float)) and np.isfinite(value) and value > 0):
            raise InputError(f"expected `{name}` auto or a number above 0 for light functions, found {value}")
    if encoding not in get_args(Encoding):
        raise InputError(f"expected an encoding of half, float, uint8, found {encoding!r}")


def coefficient_maps_asset(
    method: CoefficientMaps,
    capture: Capture,
    domain: LightDomain,
    components: Float32[ndarray, "S P"],
    functions: LightFunctions,
    fit: dict[str, Any],
    found: ClusteredComponents | None = None,
    stitch: Stitch | None = None,
) -> Asset:
    """An asset of components, dilated, stored four to a layer; `found` where there are clusters of texels.

    `stitch` closes the seams of the dilated components before they are rounded; those of clusters are of a stitched capture.
    """
    own = stored_components(capture, method.encoding, components, found, stitch)
    images = carried_images(capture, nearest_covered(capture.coverage()))
    table = octahedral_table(functions, domain.manifest()["domain"])
    manifest = common_manifest(capture, method.name, domain, images, asdict(method), fit)  # type: ignore[call-overload]
    manifest |= own.entries(len(functions.spreads) // (own.count + 1))
    manifest["light_basis"] = {"kind": "gaussian", "centers": functions.centers.tolist(), "spreads": functions.spreads.tolist()}
    manifest["light_coefficients"] = {"file": "light_coefficients.exr"}
    manifest["w_table"] = {
        "file": "w_table.exr",
        "size": table.size,
        "columns": table.columns,
        "mapping": "octahedral",
        "error": table.error,
    }
    tables = {"light_coefficients": _narrowest(functions.coefficients), "w_table": table.atlas, **own.tables()}
    asset = Asset(manifest, own.stored, own.scale, own.bias, tables, images, carried_scene(capture))
    if stitch is not None and own.unstitched is not None:
        manifest["seams"] = seam_report(asset, capture, stitch, own.unstitched, method.captured_responses, own.unstitched_index)
    return asset


def _narrowest(coefficients: Float32[ndarray, "F B 3"]) -> Float[ndarray, "F B 3"]:
    """As half floats, where these are the same numbers."""
    with np.errstate(over="ignore"):
        half = coefficients.astype(np.float16)
    return half if np.array_equal(half, coefficients) else coefficients
