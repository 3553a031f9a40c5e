"""Rebinning: the images of a capture as tiles, each an ABRDF over the light directions [Wong2005, fig. 1, 4].

A tile belongs to one receiver or to the mean over a block of them; a sparse `(G, P)` matrix defines it. Its pixels are light
directions: a disc seen from +z with x to the right and y up, or the whole sphere by latitude and longitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.errors import InputError
from srbf.methods import responses as asset_responses

Projection = Literal["equal-area", "orthographic", "latitude-longitude"]
CHUNK = 1 << 16  # receivers; a block has at most 16 times as many responses


def tile_directions(size: int, projection: Projection) -> Float64[ndarray, "h w 3"]:
    """Unit light direction of every pixel of a tile, row 0 at the top; NaN outside the disc.

    `equal-area` (Lambert's azimuthal, preserves solid angle) and `orthographic` show the hemisphere z > 0 on
    (size, size) pixels; `latitude-longitude` the sphere on (size, 2 size), u = 1/2 - atan2(y, x) / 2 pi and +z on top, as
    in environment maps. InputError on another projection or a size below 1.
    """
    if size < 1:
        raise InputError(f"expected a tile of 1 pixel or more, found {size}")
    if projection == "latitude-longitude":
        polar = (np.arange(size) + 0.5) * (np.pi / size)
        azimuth = (0.5 - (np.arange(2 * size) + 0.5) / (2 * size)) * (2 * np.pi)
        sine = np.sin(polar)[:, None]
        z = np.repeat(np.cos(polar)[:, None], 2 * size, axis=1)
        return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z], axis=2)
    x = (2 * np.arange(size) + 1) / size - 1
    x, y = np.meshgrid(x, -x)
    square = np.where(x * x + y * y <= 1, x * x + y * y, np.nan)
    if projection == "orthographic":
        return np.stack([x + 0 * square, y + 0 * square, np.sqrt(1 - square)], axis=2)
    if projection == "equal-area":
        stretch = np.sqrt(2 - square)
        return np.stack([x * stretch, y * stretch, 1 - square], axis=2)
    raise InputError(f"expected a projection of equal-area, orthographic, latitude-longitude, found {projection!r}")


def disc_points(directions: Float64[ndarray, "N 3"]) -> Float64[ndarray, "N 2"]:
    """Coordinates of directions on the equal-area disc of radius 1; directions below the horizon are mirrored up first."""
    directions = np.asarray(directions, np.float64)
    return directions[:, :2] / np.sqrt(1 + np.abs(directions[:, 2:]))


def grid_for(height: int, width: int, tiles: int = 432) -> tuple[int, int]:
    """(rows, columns) of about `tiles` nearly square blocks, at most one per receiver."""
    columns = max(1, round(np.sqrt(tiles * width / height)))
    rows = max(1, round(tiles / columns))
    return min(rows, height), min(columns, width)


def block_means(coverage: Float32[ndarray, "H W"], grid: tuple[int, int]) -> csr_array:
    """(G, P) matrix that averages each of grid = (rows, columns) blocks over its covered receivers, weighted by coverage.

    Block edges fall on whole texels. A block without covered receivers is an empty row. A grid of (H, W) gives one tile per receiver.
    InputError if a block would hold no texel.
    """
    height, width = coverage.shape
    if not (1 <= grid[0] <= height and 1 <= grid[1] <= width):
        raise InputError(f"expected a grid of 1 to {height} rows and 1 to {width} columns, found {grid[0]}x{grid[1]}")
    row = np.arange(height) * grid[0] // height
    column = np.arange(width) * grid[1] // width
    block = (row[:, None] * grid[1] + column).ravel()
    share = np.where(coverage >= COVERED, coverage, 0).ravel().astype(np.float64)
    total = np.bincount(block, share, grid[0] * grid[1])
    receivers = np.flatnonzero(share)
    values = (share[receivers] / total[block[receivers]]).astype(np.float32)
    return csr_array((values, (block[receivers], receivers)), shape=(grid[0] * grid[1], height * width))


def single_receivers(receivers: Sequence[int] | ndarray, count: int) -> csr_array:
    """(G, P) matrix that picks single receivers by their flat index among `count`."""
    receivers = np.asarray(receivers, np.int64)
    return csr_array((np.ones(len(receivers), np.float32), (np.arange(len(receivers)), receivers)), shape=(len(receivers), count))


def tile_count(tiles: csr_array) -> int:
    """G, the rows of a matrix from receivers to tiles."""
    return len(tiles.indptr) - 1


def rebin(capture: Capture, indices: Sequence[int], tiles: csr_array) -> Float32[ndarray, "L G 3"]:
    """Response of each tile to each of the lights `indices`: (G, P) times T, where T is read in blocks of images.

    NaN for a tile without receivers.
    """
    responses = np.empty((len(indices), tile_count(tiles), 3), np.float32)
    for first, block in capture.blocks(indices):
        for i, image in enumerate(block):
            responses[first + i] = tiles @ image
    responses[:, _empty(tiles)] = np.nan
    return responses


def captured_tiles(
    responses: Float32[ndarray, "L G 3"], lights: Float64[ndarray, "L 3"], directions: Float64[ndarray, "h w 3"]
) -> Float32[ndarray, "G h w 3"]:
    """Tiles whose pixels hold the response to the nearest light; NaN outside the disc, where `directions` is NaN [Wong2005, fig. 1]."""
    inside = np.isfinite(directions[..., 0])
    nearest = KDTree(lights).query(directions[inside])[1]  # the shortest chord has the smallest angle
    result = np.full((responses.shape[1], *inside.shape, 3), np.nan, np.float32)
    result[:, inside] = responses[nearest].transpose(1, 0, 2)
    return result


def fitted_tiles(asset: Asset, tiles: csr_array, directions: Float64[ndarray, "h w 3"]) -> Float32[ndarray, "G h w 3"]:
    """The same tiles from the fit: the signed response at each pixel's direction, before the clamp [Wong2005, eq. 1, fig. 4].

    Evaluates the asset's method for every receiver of a tile and every direction, in blocks.
    """
    receivers = np.unique(tiles.indices)
    picked, columns = asset.at(receivers), tiles.tocsc()[:, receivers].tocsr()
    inside = np.isfinite(directions[..., 0])
    asked = directions[inside]
    responses = np.full((len(asked), tile_count(tiles), 3), np.nan, np.float32)
    block = max(1, 16 * CHUNK // max(1, len(receivers)))
    for start in range(0, len(asked) if len(receivers) else 0, block):
        images = asset_responses(picked, asked[start : start + block])[:, 0]  # (b, n, 3)
        means = columns @ images.transpose(1, 0, 2).reshape(len(receivers), -1)
        responses[start : start + block] = means.reshape(len(means), -1, 3).transpose(1, 0, 2)
    responses[:, _empty(tiles)] = np.nan
    result = np.full((tile_count(tiles), *inside.shape, 3), np.nan, np.float32)
    result[:, inside] = responses.transpose(1, 0, 2)
    return result


def mosaic(tiles: Float32[ndarray, "G h w 3"], grid: tuple[int, int], gap: int = 1) -> Float32[ndarray, "H W 3"]:
    """Tiles arranged as their blocks in the image, with `gap` pixels of NaN between them."""
    rows, columns = grid
    _, h, w, _ = tiles.shape
    sheet = np.full((rows, h + gap, columns, w + gap, 3), np.nan, np.float32)
    sheet[:, :h, :, :w] = tiles.reshape(rows, columns, h, w, 3).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(
        sheet.reshape(rows * (h + gap), columns * (w + gap), 3)[: rows * (h + gap) - gap, : columns * (w + gap) - gap]
    )


def _empty(tiles: csr_array) -> ndarray:
    return np.diff(tiles.indptr) == 0
