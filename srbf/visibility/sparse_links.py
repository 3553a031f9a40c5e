"""Sparse links: which surfels the rays of a row meet, and how many of them each; their light is one sparse product."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MOST_BOUNCES, NEGLIGIBLE = 512, 1e-5  # of all light, that a bounce adds and is the last


@dataclass(frozen=True, eq=False)
class SparseLinks:
    """Of n rows, row i has the links `starts[i]` to `starts[i + 1]`: a surfel (16 bits), and how many of the row's `rays` rays meet it."""

    starts: Int[ndarray, " m"]
    surfels: ndarray
    counts: ndarray
    rays: int
    surfel_count: int

    @staticmethod
    def of_shares(shares: csr_array, rays: int) -> SparseLinks:
        """From shares of `rays` rays, (n, S)."""
        counts = np.round(shares.data * rays).astype(np.uint16)
        return SparseLinks(shares.indptr.astype(np.int64), shares.indices.astype(np.uint16), counts, rays, shares.shape[1])

    @property
    def rows(self) -> int:
        """How many rows."""
        return len(self.starts) - 1

    def matrix(self) -> csr_array:
        """(n, S) float32: what share of each row's light comes from each surfel."""
        from scipy.sparse import csr_array

        values = self.counts.astype(np.float32) / np.float32(self.rays)
        return csr_array((values, self.surfels.astype(np.int32), self.starts), shape=(self.rows, self.surfel_count))

    def thinned(self, share: float, seed: int = 0) -> SparseLinks:
        """As if fewer rays had been traced: each is kept by chance, exactly `share` of each row's; light is kept in the mean."""
        if share >= 1:
            return self
        rng = np.random.default_rng(seed)
        row = np.repeat(np.arange(self.rows), np.diff(self.starts))
        order = np.lexsort((rng.random(len(row)), row))
        before = np.cumsum(self.counts[order], dtype=np.int64)
        first = np.concatenate([[0], before])[self.starts[:-1]]
        shift = rng.random(self.rows)
        ends = np.floor((before - first[row[order]]) * share + shift[row[order]]).astype(np.int64)
        begins = np.floor((before - self.counts[order] - first[row[order]]) * share + shift[row[order]]).astype(np.int64)
        kept = np.zeros(len(row), np.int64)
        kept[order] = ends - begins
        left = np.flatnonzero(kept)
        starts = np.concatenate([[0], np.cumsum(np.bincount(row[left], minlength=self.rows))])
        return SparseLinks(starts, self.surfels[left], kept[left].astype(np.uint16), max(1, round(self.rays * share)), self.surfel_count)

    def arrays(self, name: str) -> dict[str, ndarray]:
        """As a file holds them."""
        return {
            f"{name}_sizes": np.diff(self.starts).astype(np.uint16),
            f"{name}_surfels": self.surfels.astype(np.uint16),
            f"{name}_counts": self.counts.astype(np.uint16),
            f"{name}_rays": np.array(self.rays),
        }

    @staticmethod
    def of_arrays(stored: Mapping[str, ndarray], name: str, surfel_count: int) -> SparseLinks:
        """From `arrays`; ValueError where they do not fit each other."""
        sizes, surfels, counts = (stored[f"{name}_{part}"] for part in ("sizes", "surfels", "counts"))
        starts = np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])
        if starts[-1] != len(surfels) or len(surfels) != len(counts) or int(surfels.max(initial=0)) >= max(1, surfel_count):
            raise ValueError(f"expected {starts[-1]} links to {surfel_count} surfels, found {len(surfels)} to {surfels.max(initial=0)}")
        return SparseLinks(starts, surfels, counts, int(stored[f"{name}_rays"]), surfel_count)


def radiosity_of(
    exchange: csr_array, albedo: Float32[ndarray, "S 3"], irradiance: Float32[ndarray, "S 3"], bounces: int | None
) -> Float32[ndarray, "S 3"]:
    """The radiosity that `irradiance` on the surfels leaves after up to `bounces` reflections: sum_k (rho F)^k rho e, k < `bounces`.

    None: all of them, until one adds next to nothing.
    """
    last = albedo * irradiance
    if bounces == 0:
        return np.zeros_like(last)
    total = last.copy()
    most = MOST_BOUNCES if bounces is None else bounces
    for _ in range(1, most):
        last = albedo * (exchange @ last)
        total += last
        if float(np.abs(last).sum(dtype=np.float64)) <= NEGLIGIBLE * float(np.abs(total).sum(dtype=np.float64)):
            break
    return total
