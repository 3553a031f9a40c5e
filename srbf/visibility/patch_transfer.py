"""Transfer between clusters of surfels by a few coefficients of the direct light on each: patch-to-patch matrices.

The direct light of examples on a cluster spans few dimensions. Their axes are its basis; the light that each axis sends to all surfels,
all bounces included, is a column of the matrices, so that indirect light at a surfel is a dot product with the coefficients of each
cluster. The mean of the examples is not subtracted, as it is by most who compress so: light has to be linear, and no light 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.lights import PointLight
from srbf.solve.pca import principal_axes
from srbf.solve.radiosity import SERIES, Bounces, reciprocal
from srbf.visibility.patches import PLACE_WEIGHT, group
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells

if TYPE_CHECKING:
    from scipy.sparse import csr_array

EXAMPLES = 1000  # point lights whose direct light the bases are made of
SURFELS_PER_CLUSTER, CLUSTERS = 1000, 48  # of few surfels as many clusters, but smaller ones
MOST_DENSE = 10_000  # surfels whose form factors are solved as a dense matrix
ROWS = 1 << 12  # of matrices thinned at a time


@dataclass(frozen=True, eq=False)
class PatchTransfer:
    """S surfels in K clusters, the first `sizes[0]` of them in the first, and so on.

    Coefficient j of a light on a cluster is the sum of `bases` (d, S) times its irradiance there; coefficient d k + j is that of cluster k.
    Indirect irradiance on the surfels is the sum over coefficients of `matrices` (K d, S, 3). `strengths` (K d,): rms of the examples'.
    """

    sizes: Int[ndarray, " K"]
    bases: Float32[ndarray, "d S"]
    matrices: Float32[ndarray, "M S 3"]
    strengths: Float64[ndarray, " M"]


def surfel_clusters(cells: Cells, size: int | None, seed: int = 0) -> Int[ndarray, " S"]:
    """The cluster of each surfel, about `size` surfels to one: near each other, and facing about the same way."""
    each = min(SURFELS_PER_CLUSTER, len(cells.places) / CLUSTERS) if size is None else size
    count = min(len(cells.places), max(1, round(len(cells.places) / each)))
    extent = max(float(np.ptp(cells.places, axis=0).max(initial=0)), 1e-9)
    features = np.concatenate([PLACE_WEIGHT * cells.places / extent, cells.normals], axis=1)
    return group(features, np.ones(len(cells.places)), count, seed)


def example_light(
    received: ReceivedLight, areas: Float32[ndarray, " S"], free: Float64[ndarray, "F 3"], seed: int = 0
) -> Float32[ndarray, "S V"]:
    """Irradiance on the surfels under EXAMPLES point lights at random free places, each of the same norm over all surfels.

    Without the norms, the few lights that are close to a surface would make all the axes.
    """
    rng = np.random.default_rng(seed)
    places = free[rng.permutation(len(free))[:EXAMPLES]]
    lights = [PointLight((x, y, z), falloff="inverse-square") for x, y, z in places.tolist()]
    found = np.stack([received.irradiance(light)[:, 0] for light in lights], axis=1).astype(np.float32)
    norms = np.sqrt(areas @ found**2)
    return found / np.maximum(norms, 1e-6 * norms.max())


def patch_transfer(
    exchange: csr_array,
    cells: Cells,
    clusters: Int[ndarray, " S"],
    examples: Float32[ndarray, "S V"],
    count: int,
    most_bounces: int | None = None,
) -> PatchTransfer:
    """Bases of `count` coefficients a cluster, and the light that they send.

    `clusters`: ascending, so that surfels of one cluster follow each other. `exchange`: form factors between the surfels. Bases are
    orthonormal where surfels count by their area. A cluster of fewer surfels than `count` has coefficients of 0.
    Cost: `most_bounces` products of the form factors with K d columns, for each color.
    """
    sizes = np.bincount(clusters)
    root = np.sqrt(np.maximum(cells.areas, 1e-30)).astype(np.float32)
    bases = np.zeros((count, len(clusters)), np.float32)
    columns = np.zeros((len(clusters), len(sizes) * count), np.float32)
    strengths = np.zeros((len(sizes), count))
    for number, start in enumerate(np.cumsum(sizes) - sizes):
        own = slice(start, start + sizes[number])
        axes, values = principal_axes((root[own, None] * examples[own]).T.astype(np.float64), count)
        bases[:, own] = axes * root[own]
        columns[own, number * count : (number + 1) * count] = (axes / root[own]).T
        strengths[number] = values / np.sqrt(examples.shape[1])
    matrices = np.empty((columns.shape[1], len(clusters), 3), np.float32)
    for c in range(3):
        matrices[:, :, c] = indirect(exchange, cells, c, columns, most_bounces).T
    return PatchTransfer(sizes, bases, matrices, strengths.ravel())


def indirect(
    exchange: csr_array, cells: Cells, channel: int, irradiance: Float32[ndarray, "S n"], most_bounces: int | None = None
) -> Float32[ndarray, "S n"]:
    """F (sum over k of (rho F)^k) rho E: what direct irradiance E on the surfels makes of indirect irradiance there, of one color."""
    if exchange.shape[0] <= MOST_DENSE:
        factors = reciprocal(exchange.toarray(), cells.areas)
        return factors @ Bounces(factors, cells.albedo[:, channel].astype(np.float64), most_bounces).radiosity(irradiance)
    most = SERIES - 1 if most_bounces is None else min(most_bounces, SERIES - 1)
    factors = reciprocal(exchange, cells.areas)
    return factors @ Bounces(factors, cells.albedo[:, channel].astype(np.float64), most).radiosity(irradiance)


def thinned(found: PatchTransfer, share: float) -> Float32[ndarray, "M S 3"]:
    """The matrices with small entries 0: those that hold at most `share` of a surfel's light together, rms over the examples."""
    result = np.empty_like(found.matrices)
    for first in range(0, result.shape[1], ROWS):
        part = found.matrices[:, first : first + ROWS]
        energy = (part**2).sum(axis=2) * (found.strengths**2).astype(np.float32)[:, None]  # (M, n)
        order = np.argsort(energy, axis=0)
        below = np.cumsum(np.take_along_axis(energy, order, axis=0), axis=0, dtype=np.float64)
        kept = np.empty(energy.shape, bool)
        np.put_along_axis(kept, order, below > share**2 * below[-1:], axis=0)
        result[:, first : first + ROWS] = np.where(kept[:, :, None], part, 0)
    return result
