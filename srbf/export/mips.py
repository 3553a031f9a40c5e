"""Mip levels of coefficients: relighting is linear, so a relit level equals the filtered level-0 picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.compute.threads import each
from srbf.encode.dilation import dilate, nearest_covered
from srbf.io.containers.texture_array import level_size
from srbf.methods import method_of

if TYPE_CHECKING:
    from scipy import sparse

GUTTER = 2.5  # of a level's texels between two charts: so that bilinear samples of one chart never read the other


def smaller_levels(
    layers: Float32[ndarray, "N H W C"], coverage: Float32[ndarray, "H W"], levels: int
) -> list[Float32[ndarray, "N h w C"]]:
    """`layers` and `levels` - 1 smaller ones: means of the covered texels, weighted by area and coverage.

    Texels without covered ones take the nearest value, so that no level has a hole beside a chart.
    """
    height, width = coverage.shape
    found = [layers]
    for level in range(1, levels):
        across, down = level_size(width, height, level)
        rows, columns = shares(height, down), shares(width, across)
        weight = np.asarray(rows @ (columns @ coverage.T).T, np.float32)  # (h, w)
        nearest = nearest_covered(weight)
        smaller = np.empty((len(layers), down, across, layers.shape[3]), np.float32)

        def fill(
            i: int,
            rows: sparse.csr_matrix = rows,
            columns: sparse.csr_matrix = columns,
            weight: ndarray = weight,
            nearest: ndarray | None = nearest,
            out: ndarray = smaller,
        ) -> None:
            for c in range(layers.shape[3]):
                total = rows @ (columns @ (layers[i, :, :, c] * coverage).T).T
                out[i, :, :, c] = total / np.where(weight > 0, weight, 1)
            out[i] = dilate(out[i], nearest)

        each(fill, len(layers))
        found.append(smaller)
    return found


def shares(size: int, smaller: int) -> sparse.csr_matrix:
    """(smaller, size): the share of each texel in each smaller one, which covers size / smaller of them."""
    from scipy import sparse

    edges = np.arange(smaller + 1) * (size / smaller)
    rows, columns, shares = [], [], []
    for i in range(smaller):
        first, last = int(edges[i]), min(size, int(np.ceil(edges[i + 1] - 1e-9)))
        texels = np.arange(first, last)
        rows += [i] * len(texels)
        columns += texels.tolist()
        shares += (np.minimum(texels + 1, edges[i + 1]) - np.maximum(texels, edges[i])).tolist()
    return sparse.csr_matrix((np.array(shares, np.float32), (rows, columns)), (smaller, size))


def coverage_of(asset: Asset) -> Float32[ndarray, "H W"]:
    """Coverage of each texel; 1 where the asset does not say."""
    return asset.images.get("coverage", np.ones((asset.height, asset.width), np.float32))


def levels_without_bleeding(asset: Asset) -> int:
    """The most levels, full size included, with GUTTER of their own texels between any two charts, so that bilinear samples of one chart
    never read another; 1 where neighboring texels are not neighbors on the surface (vertices, probes) or differ in meaning (clusters).
    """
    kind = asset.receiver.get("kind")
    if not method_of(asset).filterable or kind in ("vertices", "probes"):
        return 1
    levels = max(asset.width, asset.height).bit_length()
    gap = chart_gap(coverage_of(asset))
    if gap is None:
        return levels
    for level in range(1, levels):
        across, down = level_size(asset.width, asset.height, level)
        if gap < GUTTER * max(asset.width / across, asset.height / down):
            return level
    return levels


def chart_gap(coverage: Float32[ndarray, "H W"]) -> int | None:
    """The fewest uncovered texels, across, down or aslant, between two charts (connected covered texels); None of fewer than two."""
    from scipy import ndimage

    covered = coverage > 0
    labels, count = ndimage.label(covered, np.ones((3, 3)))
    if count < 2:
        return None
    distance, nearest = ndimage.distance_transform_cdt(~covered, "chessboard", return_indices=True)
    chart = labels[nearest[0], nearest[1]]
    height, width = chart.shape
    least = height + width
    for down, across in ((0, 1), (1, 0), (1, 1), (1, -1)):
        one = np.s_[: height - down, max(0, -across) : width - max(0, across)]
        other = np.s_[down:, max(0, across) : width - max(0, -across)]
        between = chart[one] != chart[other]
        if between.any():
            least = min(least, int((distance[one] + distance[other])[between].min()))
    return least
