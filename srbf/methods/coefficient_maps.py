"""Relighting by scalar planes: T(p, L) ~ w_0(L) + sum_j a_j(p) w_j(L), one number a plane and texel, RGB light functions w."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset, layer_entries
from srbf.basis.light_functions import LightFunctions
from srbf.basis.octahedral_table import lookup, octahedral_table
from srbf.capture import Capture
from srbf.encode.dilation import dilate, nearest_covered
from srbf.encode.quantization import quantize
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.lights import Light
from srbf.methods.receivers import (
    CHUNK,
    carried_images,
    carried_scene,
    common_manifest,
    distant_lights,
    finish,
    inside,
    seam_report,
    sum_over_lights,
)
from srbf.sphere import Domain

CHANNELS = 4  # planes to an image
MOST_COMPONENTS = 1024


def check_plane_settings(scalars: int, spread: float | str, ridge: float | str, encoding: str) -> None:
    """InputError on settings that no set of planes can have."""
    if not 1 <= scalars <= MOST_COMPONENTS:
        raise InputError(f"expected 1 to {MOST_COMPONENTS} scalars, found {scalars}")
    for name, value in (("spread", spread), ("ridge", ridge)):
        if value != "auto" and not (isinstance(value, (int, float)) and np.isfinite(value) and value > 0):
            raise InputError(f"expected a {name} of auto or a number above 0 for light functions, found {value}")
    if encoding not in get_args(Encoding):
        raise InputError(f"expected an encoding of half, float, uint8, found {encoding!r}")


def relight(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights) + ambient, for any number of lights of any kind at once."""
    return finish(asset, linear_response(asset, lights))


def linear_response(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """The sum over lights before the clamp and without ambient: linear in every light's color.

    Directional and environment lights weigh by the functions themselves; a point or spot light reads each receiver's own
    weights from the octahedral table.
    """
    weights = projected_weights(asset, lights).astype(np.float32)
    table, entry = asset.tables["w_table"], asset.manifest["w_table"]

    def projected(layers: ndarray, rows: slice) -> ndarray:
        first = first_function(asset, rows)  # (h, W)
        total = weights[first]
        for j, plane in enumerate(planes_of(layers, asset.scalars), start=1):
            total += plane[..., None] * weights[first + j]
        return total

    def response(layers: ndarray, rows: slice, unit: ndarray) -> ndarray:
        first = first_function(asset, rows)
        total = lookup(table, entry["size"], entry["columns"], first, unit)
        for j, plane in enumerate(planes_of(layers, asset.scalars), start=1):
            total += plane[..., None] * lookup(table, entry["size"], entry["columns"], first + j, unit)
        return total

    return sum_over_lights(asset, lights, projected if weights.any() else None, response)


def directional_responses(asset: Asset, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
    """`linear_response` to a white light from each of many unit directions: one (n, S + 1) x (S + 1, 3 b) product a cluster."""
    size = asset.scalars + 1
    weights = asset.light_functions.evaluate(inside(asset, directions)).astype(np.float32)  # (b, F, 3)
    weights = weights.transpose(1, 0, 2).reshape(asset.clusters, size, -1)  # (C, S + 1, 3 b)
    images = np.empty((len(directions), asset.height, asset.width, 3), np.float32)
    rows_per_chunk = max(1, CHUNK // asset.width)
    for start in range(0, asset.height, rows_per_chunk):
        rows = slice(start, start + rows_per_chunk)
        planes = planes_of(asset.coefficients(rows), asset.scalars)
        ones = np.concatenate([np.ones_like(planes[:1]), planes]).reshape(size, -1)  # (S + 1, n)
        cluster = (first_function(asset, rows) // size).ravel()
        part = np.empty((ones.shape[1], weights.shape[2]), np.float32)
        for number in np.unique(cluster):
            chosen = slice(None) if asset.clusters == 1 else np.flatnonzero(cluster == number)
            part[chosen] = ones[:, chosen].T @ weights[number]
        images[:, rows] = part.reshape(planes.shape[1], planes.shape[2], -1, 3).transpose(2, 0, 1, 3)
    return images


def projected_weights(asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
    """One weight a light function and color for all directional and environment lights together."""
    weights = np.zeros((asset.clusters * (asset.scalars + 1), 3))
    functions = asset.light_functions
    for directions, colors in distant_lights(asset, lights):
        weights += functions.fold(directions, colors)
    return weights


def planes_of(layers: Float32[ndarray, "N h W 4"], scalars: int) -> Float32[ndarray, "S h W"]:
    """Scalar planes out of the images that hold four each."""
    planes = layers.transpose(0, 3, 1, 2)
    return planes.reshape(-1, *planes.shape[2:])[:scalars]


def first_function(asset: Asset, rows: slice) -> Int[ndarray, "h W"]:
    """Index of the mean's function in every texel's cluster; plane j has that plus j."""
    if "cluster_index" in asset.tables:
        return asset.tables["cluster_index"][rows].astype(np.int64) * (asset.scalars + 1)
    height = len(range(*rows.indices(asset.height)))
    return np.zeros((height, asset.width), np.int64)


@dataclass(frozen=True, eq=False)
class StitchedComponents:
    """What planes `loose` (S, n) and clusters `loose_index` (n,) the texels of a stitch would have had without it."""

    loose: Float32[ndarray, "S n"]
    loose_index: Int[ndarray, " n"]


def coefficient_maps_asset(
    capture: Capture,
    method: str,
    domain: Domain,
    planes: Float32[ndarray, "S P"],
    functions: LightFunctions,
    encoding: Encoding,
    settings: dict[str, Any],
    fit: dict[str, Any],
    index: Int[ndarray, " P"] | None = None,
    stitch: Stitch | None = None,
    stitched: StitchedComponents | None = None,
) -> Asset:
    """An asset of scalar planes, dilated, stored four to an image; `index` the cluster of every texel where there are clusters.

    `stitch` closes the seams of the dilated planes before they are rounded. Where there are clusters they must be `sewn`: planes and index
    of a stitched capture, its gutter included.
    """
    scalars, shape = len(planes), (capture.height, capture.width)
    nearest = nearest_covered(capture.coverage())
    images = carried_images(capture, nearest)
    if nearest is not None and stitch is not None and stitched is not None:
        nearest = nearest.copy()
        nearest.flat[stitch.texels] = stitch.texels
    layers = np.zeros((-(-scalars // CHANNELS), *shape, CHANNELS), np.float32)
    for j, plane in enumerate(planes):
        layers[j // CHANNELS, :, :, j % CHANNELS] = dilate(plane.reshape(*shape, 1), nearest)[:, :, 0]
    loose = None
    if stitch is not None:
        loose = layers.reshape(len(layers), -1, CHANNELS)[:, stitch.texels]
        if stitched is None:
            stitch.apply(layers)
        else:
            for j, plane in enumerate(stitched.loose):
                loose[j // CHANNELS, :, j % CHANNELS] = plane
    stored, scale, bias = quantize(layers, encoding)
    unused = range(scalars % CHANNELS or CHANNELS, CHANNELS)
    scale[-1, unused], bias[-1, unused] = 0, 0
    table = octahedral_table(functions, domain)
    manifest = common_manifest(capture, method, domain, images, settings, fit)
    manifest["scalars"] = scalars
    manifest["planes"] = layer_entries("plane", encoding, scale, bias)
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
        manifest["clusters"] = len(functions.spreads) // (scalars + 1)
        manifest["cluster_index"] = {"file": "cluster_index.png"}
        tables["cluster_index"] = dilate(index.reshape(*shape, 1), nearest)[:, :, 0].astype(np.uint8)
    asset = Asset(manifest, stored, scale, bias, tables, images, carried_scene(capture))
    if stitch is not None and loose is not None:
        manifest["seams"] = seam_report(
            asset, capture, stitch, loose, directional_responses, None if stitched is None else stitched.loose_index
        )
    return asset
