"""Pixels that mix the light of view clusters: the layers of bytes that say which, and pictures from the clusters' light."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.channels import THROUGH
from srbf.encode.dilation import dilate
from srbf.errors import ImageError, InputError

MOST_NEAREST = 10
NEIGHBOR_BYTES = 3  # of a pixel, for each of its clusters
BEHIND, GLOSS_NEIGHBORS = "behind_neighbors", "gloss_neighbors"


def check_nearest(nearest: int) -> None:
    """InputError on a number of clusters that is out of range."""
    if not 1 <= nearest <= MOST_NEAREST:
        raise InputError(f"expected 1 to {MOST_NEAREST} `nearest` clusters, found {nearest}")


def neighbors(clusters: Int[ndarray, "P K"], weights: Float32[ndarray, "P K"]) -> ndarray:
    """(K, P, 3) bytes: low and high byte of the cluster, weight by the pixel's largest."""
    share = weights / np.maximum(weights.max(axis=1, keepdims=True), 1e-30)
    return np.stack([clusters & 255, clusters >> 8, np.round(255 * share)], axis=2).astype(np.uint8).transpose(1, 0, 2)


def neighbor_layers(
    capture: Capture, clusters: Int[ndarray, "P K"], weights: Float32[ndarray, "P K"], nearest: Int[ndarray, "H W"] | None
) -> ndarray:
    """(K, H, W, 3) bytes of the pixels of a capture; `nearest`: from which uncovered ones take theirs. ImageError where they do not fit."""
    pixels = capture.width * capture.height
    if len(clusters) != pixels:
        raise ImageError(f"expected clusters of {pixels} pixels in {capture.folder}, found {len(clusters)}; bake again")
    shape = (capture.height, capture.width, 3)
    layers = (dilate(layer.reshape(shape).astype(np.float32), nearest) for layer in neighbors(clusters, weights))
    return np.stack([np.round(layer).astype(np.uint8) for layer in layers])


def read_further_neighbors(reader: AssetReader) -> dict[str, ndarray]:
    """Neighbors of lobes and of backs, where an asset has any."""
    tables = {}
    for name, what in ((GLOSS_NEIGHBORS, "lobes"), (BEHIND, "clusters behind")):
        if name not in reader.manifest:
            continue
        pixels = reader.pixels(reader.manifest[name]["file"], 3)
        if pixels.shape[1] != reader.manifest["width"] or len(pixels) % reader.manifest["height"]:
            raise ImageError(f"expected {what} of every pixel in {reader.folder}, found {pixels.shape[1]}x{len(pixels)}; fit again")
        tables[name] = np.round(pixels * 255).astype(np.uint8)
    return tables


def pictures(asset: Asset, weights: Float64[ndarray, "b C 3"]) -> Float32[ndarray, "b H W 3"]:
    """b pictures from the irradiance of the view clusters, and after these of pi times the radiance of lobes over their reflectance."""
    light = weights.transpose(1, 0, 2).astype(np.float32)  # (C, b, 3)
    clusters = asset.manifest["gather"]["clusters"]
    found = mixed(asset.stored, light[:clusters])
    if asset.quantity == "radiance":
        found = found * (_albedo(asset) / np.float32(np.pi))
    further: Any = ((GLOSS_NEIGHBORS, "glossy", light[clusters:]), (BEHIND, THROUGH, light[:clusters]))
    for name, reflectance, own in further:
        if name in asset.tables and len(own):
            layers = asset.tables[name].reshape(-1, asset.height, asset.width, 3)
            found = found + mixed(layers, own) * (asset.images[reflectance] / np.float32(np.pi))
    return np.ascontiguousarray(found)


def mixed(layers: ndarray, light: Float32[ndarray, "C b 3"]) -> Float32[ndarray, "b H W 3"]:
    """The mean over the clusters of each pixel, of layers (K, H, W, 3) as `neighbors` has them; 0 of pixels without."""
    total = np.zeros((*layers.shape[1:3], *light.shape[1:]), np.float32)
    share = np.zeros((*layers.shape[1:3], 1, 1), np.float32)
    for layer in layers:
        own = layer[:, :, 2, None, None].astype(np.float32)
        total += own * light[layer[:, :, 0].astype(np.int64) + 256 * layer[:, :, 1].astype(np.int64)]
        share += own
    return (total / np.maximum(share, 1)).transpose(2, 0, 1, 3)


def size(asset: Asset) -> int:
    """Bytes of what clusters gather, and of pixels."""
    return sum(table.nbytes for table in asset.tables.values()) + asset.stored.nbytes


def _albedo(asset: Asset) -> Float32[ndarray, "H W 3"]:
    if "albedo" not in asset.images:
        raise InputError("expected the albedo of the pixels in the asset, found none; relight all of it")
    return asset.images["albedo"]
