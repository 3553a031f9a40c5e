"""Sparse links as images of bytes, which PNG packs and a shader can fetch."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Int
from srbf.visibility.sparse_links import SparseLinks

COLUMNS = 4096  # of the images
MOST_COUNT = 255  # of rays in a link: more are several links
LINK_BYTES = 3


def packed(links: SparseLinks) -> tuple[ndarray, ndarray]:
    """(links (h, COLUMNS, 3), rows (h, COLUMNS, 3)), bytes: low and high byte of the surfel, count of rays; low and high byte of how many
    links a row has, 0. Entries follow each other row by row; what is behind the last is 0.
    """
    counts = links.counts.astype(np.int64)
    parts = np.maximum(1, -(-counts // MOST_COUNT))
    row = np.repeat(np.arange(links.rows), np.diff(links.starts))
    surfel = np.repeat(links.surfels.astype(np.int64), parts)
    number = np.arange(len(surfel)) - np.repeat(np.cumsum(parts) - parts, parts)
    count = np.minimum(np.repeat(counts, parts) - MOST_COUNT * number, MOST_COUNT)
    sizes = np.bincount(row, parts, links.rows).astype(np.int64)
    return _image(np.stack([surfel & 255, surfel >> 8, count], axis=1)), _image(np.stack([sizes & 255, sizes >> 8, 0 * sizes], axis=1))


def unpacked(links: ndarray, rows: ndarray, row_count: int, rays: int, surfel_count: int) -> SparseLinks:
    """From `packed`; ValueError where the images do not fit each other."""
    sizes = _values(rows.reshape(-1, 3)[:row_count])
    starts = np.concatenate([[0], np.cumsum(sizes)])
    own = links.reshape(-1, 3)[: starts[-1]]
    surfels = _values(own)
    if len(sizes) != row_count or len(own) != starts[-1] or int(surfels.max(initial=0)) >= max(1, surfel_count):
        raise ValueError(f"expected {starts[-1]} links of {row_count} rows to {surfel_count} surfels, found others")
    return SparseLinks(starts, surfels.astype(np.uint16), own[:, 2].astype(np.uint16), rays, surfel_count)


def link_count(links: SparseLinks, share: float = 1.0) -> float:
    """How many links are left, about, of a `share` of the rays: those of many rays stay."""
    return float(np.minimum(1, min(share, 1.0) * links.counts.astype(np.float64)).sum())


def share_within(links: SparseLinks, most: float) -> float:
    """The largest share of the rays that leaves at most `most` links, about."""
    low, high = 0.0, 1.0
    if link_count(links) <= most:
        return 1.0
    for _ in range(20):
        middle = (low + high) / 2
        low, high = (middle, high) if link_count(links, middle) <= most else (low, middle)
    return low


def _values(pairs: ndarray) -> Int[ndarray, " n"]:
    return pairs[:, 0].astype(np.int64) + 256 * pairs[:, 1].astype(np.int64)


def _image(values: Int[ndarray, "n 3"]) -> ndarray:
    rows = max(1, -(-len(values) // COLUMNS))
    image = np.zeros((rows * COLUMNS, 3), np.uint8)
    image[: len(values)] = values
    return image.reshape(rows, COLUMNS, 3)
