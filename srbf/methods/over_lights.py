"""Relit pictures as sums over lights: rows at a time, the clamp and the ambient once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.light_domain import domain_of_asset
from srbf.lights import Light, PointLight

CHUNK = 1 << 16  # receivers weighed at a time: (CHUNK, K) float64 stays in cache-sized memory

Projected = Callable[[ndarray, slice], ndarray]  # (layers (N, h, W, C), rows) -> (h, W, 3)
# (layers, rows, positions (h, W, 3) m, coordinates (h, W, d) of the light as each receiver sees it) -> (h, W, 3) per unit of strength
Response = Callable[[ndarray, slice, ndarray, ndarray], ndarray]


def sum_over_lights(asset: Asset, lights: Sequence[Light], projected: Projected | None, response: Response) -> Float32[ndarray, "H W 3"]:
    """`projected` for all lights that every receiver sees at the same coordinates, `response` for each point or spot light.

    Lights are in the asset's frame. InputError on point and spot lights without a position map.
    """
    total = np.zeros((asset.height, asset.width, 3), np.float32)
    local = [light for light in lights if isinstance(light, PointLight)]
    if local and "position" not in asset.images:
        raise InputError("point and spot lights need a position map, and this asset has none; relight it by directional lights")
    domain = domain_of_asset(asset.manifest)
    rows_per_chunk = max(1, CHUNK // asset.width)
    for start in range(0, asset.height if projected or local else 0, rows_per_chunk):
        rows = slice(start, start + rows_per_chunk)
        layers = asset.coefficients(rows)
        if projected is not None:
            total[rows] += projected(layers, rows)
        for light in local:
            positions = asset.images["position"][rows]
            coordinates, strength = domain.toward(light, positions)
            total[rows] += response(layers, rows, positions, coordinates) * (strength[..., None] * light.color)
    return total


def row_chunks(asset: Asset) -> list[slice]:
    """All rows of an asset, CHUNK receivers at a time."""
    step = max(1, CHUNK // asset.width)
    return [slice(start, min(start + step, asset.height)) for start in range(0, asset.height, step)]


def finish(asset: Asset, total: Float32[ndarray, "H W 3"]) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights) + ambient, in place."""
    np.maximum(total, 0, out=total)
    if "ambient" in asset.images:
        total += asset.images["ambient"]
    return total
