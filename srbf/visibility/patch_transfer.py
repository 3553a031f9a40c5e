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
from srbf.solve.radiosity import MOST_REFLECTED, Bounces, reciprocal
from srbf.visibility.patches import PLACE_WEIGHT, group
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells

if TYPE_CHECKING:
    from scipy.sparse import csr_array

EXAMPLES = 1000  # point lights whose direct light the bases are made of
SURFELS_PER_CLUSTER, CLUSTERS = 1000, 48  # of few surfels as many clusters, but smaller ones
MOST_DENSE = 10_000  # surfels whose form factors are solved as a dense matrix; of more, by groups:
GROUPS = 1500
ROWS = 1 << 12  # of matrices thinned at a time


@dataclass(frozen=True, eq=False)
class PatchTransfer:
    """S surfels in K clusters, the first `sizes[0]` of them in the first, and so on.

    Coefficient j of a light on a cluster is the sum of `bases` (d, S) times its irradiance there; coefficient d k + j is that of cluster k.
    Indirect irradiance on the surfels is the sum over coefficients of `matrices` (K d, S, 3). `strengths` (K d,): rms of the
    coefficients of the examples, as many as `examples`.
    """

    sizes: Int[ndarray, " K"]
    bases: Float32[ndarray, "d S"]
    matrices: Float32[ndarray, "M S 3"]
    strengths: Float64[ndarray, " M"]
    examples: int


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
    exchange: Exchange, cells: Cells, clusters: Int[ndarray, " S"], examples: Float32[ndarray, "S V"], count: int
) -> PatchTransfer:
    """Bases of `count` coefficients a cluster, and the light that they send.

    `clusters`: ascending, so that surfels of one cluster follow each other. Bases are orthonormal where surfels count by their area. A
    cluster of fewer surfels than `count` has coefficients of 0.
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
        matrices[:, :, c] = exchange.indirect(c, columns).T
    return PatchTransfer(sizes, bases, matrices, strengths.ravel(), examples.shape[1])


class Exchange:
    """What direct irradiance on surfels makes of indirect irradiance there: F (sum over k of (rho F)^k) rho E.

    Of up to MOST_DENSE surfels exactly. Of more, light bounces twice between surfels, and from then on between GROUPS of them, which is
    what a last gather does [Goral1984]: two sparse products in place of one for each bounce.
    """

    def __init__(self, exchange: csr_array, cells: Cells, most_bounces: int | None = None, seed: int = 0) -> None:
        self._cells, self._most = cells, most_bounces
        self._groups: Int[ndarray, " S"] | None = None
        if len(cells.places) <= MOST_DENSE:
            self._factors = reciprocal(exchange.toarray(), cells.areas)
            return
        self._factors = reciprocal(exchange, cells.areas)
        extent = max(float(np.ptp(cells.places, axis=0).max()), 1e-9)
        features = np.concatenate([PLACE_WEIGHT * cells.places / extent, cells.normals, cells.albedo], axis=1)
        self._groups = group(features, cells.areas, GROUPS, seed)

    def indirect(self, channel: int, irradiance: Float32[ndarray, "S n"]) -> Float32[ndarray, "S n"]:
        """Of n lights, in one color."""
        albedo = self._cells.albedo[:, channel].astype(np.float64)
        if self._groups is None:
            return self._factors @ Bounces(self._factors, albedo, self._most).radiosity(irradiance)
        once = self._factors @ Bounces(self._factors, albedo, 1 if self._most is None else min(1, self._most)).radiosity(irradiance)
        if self._most is not None and self._most < 2:
            return once
        rho = np.clip(albedo, 0, MOST_REFLECTED).astype(np.float32)[:, None]
        return once + self._factors @ (rho * (once + self._later(albedo, once)))

    def _later(self, albedo: Float64[ndarray, " S"], once: Float32[ndarray, "S n"]) -> Float32[ndarray, "S n"]:
        """Irradiance from the second bounce on, even over each group."""
        from scipy.sparse import csr_array

        groups, count = self._groups, len(albedo)
        member = csr_array((np.ones(count, np.float32), (groups, np.arange(count))))  # (G, S)
        area = self._cells.areas.astype(np.float64)
        share = member * (area / np.maximum(member.T @ (member @ area), 1e-30)).astype(np.float32)
        factors = np.ascontiguousarray((share @ self._factors @ member.T).toarray(), np.float32)
        most = None if self._most is None else self._most - 2
        received = share @ once
        return member.T @ (factors @ Bounces(factors, share @ albedo, most).radiosity(np.ascontiguousarray(received)))


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
