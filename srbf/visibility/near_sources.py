"""Light from few surfels that reflect much of it, as beside a wall that a light is close to: in closed form, where few rays meet them.

Rays from a view cluster meet a small bright surfel once or not at all, so that its light would come in blotches. It is taken out of the
links, and lit from instead: F = cos cos A / (pi d^2 + A) V, a disc's form factor times what a receiver sees of its cell of such surfels.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Int
from srbf.compute.threads import each, one_blas_thread
from srbf.lights import Light
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.near_cells import NearCells
from srbf.visibility.received import starts_of
from srbf.visibility.surface_cells import Cells, frames

BRIGHT = 32.0  # of the mean radiosity, from which a surfel's light is taken out in part; from twice as much on, the whole
MOST = 256  # surfels, the brightest
CLOSE, PARTS = 8.0, 4  # sides of a surfel, closer than which to a receiver it counts as so many parts a side
LIFT = 1e-3  # of the extent of receivers
ROWS = 1 << 10  # receivers at a time
KEPT = 1024  # cells of which it is known what sees them


@dataclass(frozen=True, eq=False)
class NearSources:
    """n surfels of a pool, and which part of the light of each is taken out of the links, `parts`.

    `geometry` (n) of them, the `radiosity` (n, 3) of these parts; the two `cells` by which each is seen, and the share by each.
    """

    surfels: Int[ndarray, " n"]
    parts: Float32[ndarray, " n"]
    geometry: Cells
    radiosity: Float32[ndarray, "n 3"]
    cells: Int[ndarray, "n 2"]
    shares: Float32[ndarray, "n 2"]

    @property
    def count(self) -> int:
        """How many surfels."""
        return len(self.surfels)

    def taken(self, values: Float32[ndarray, "S 3"]) -> Float32[ndarray, "S 3"]:
        """The parts that are taken out, of values on all surfels of the pool; 0 on others."""
        found = np.zeros_like(values)
        found[self.surfels] = self.parts[:, None] * values[self.surfels]
        return found

    def by_cell(self) -> list[tuple[int, Int[ndarray, " m"], Float32[ndarray, "m 3"]]]:
        """(cell, which of the n surfels are seen by it, the radiosity of each that is) of every cell that sends light."""
        if not self.count:
            return []
        at, side = np.nonzero(self.shares)
        cell = self.cells[at, side]
        order = np.argsort(cell, kind="stable")
        each_cell, first = np.unique(cell[order], return_index=True)
        return [
            (int(number), at[own], self.shares[at[own], side[own], None] * self.radiosity[at[own]])
            for number, own in zip(each_cell, np.split(order, first[1:]), strict=True)
        ]


class NearReceivers:
    """What receivers, points (m) and unit normals, see of cells of near sources; kept from light to light."""

    def __init__(self, points: Float[ndarray, "R 3"], normals: Float[ndarray, "R 3"], cells: NearCells, occluders: EmbreeTriangles) -> None:
        self._points, self._normals = np.asarray(points, np.float32), np.asarray(normals, np.float32)
        self._starts = starts_of(points, normals, lift_above(points))
        self._cells, self._occluders = cells, occluders
        self._known: OrderedDict[int, ndarray] = OrderedDict()
        self.traced = 0  # cells that rays were sent to

    def irradiance(self, near: NearSources) -> Float32[ndarray, "R 3"]:
        """What near sources lay on the receivers, (R, 3)."""
        sending = near.by_cell()
        seen = self.seen([cell for cell, _, _ in sending])
        found = np.zeros((len(self._points), 3), np.float32)
        rows = range(0, len(found), ROWS)

        def part(number: int) -> None:
            own = slice(rows[number], rows[number] + ROWS)
            factors = disc_factors(self._points[own], self._normals[own], near.geometry)
            for (_, members, radiosity), visible in zip(sending, seen, strict=True):
                found[own] += visible[own, None] * (factors[:, members] @ radiosity)

        with one_blas_thread():
            each(part, len(rows))
        return found

    def seen(self, cells: list[int]) -> list[Bool[ndarray, " R"]]:
        """Which receivers see each cell."""
        new = [cell for cell in cells if cell not in self._known]
        found: list[ndarray] = [np.zeros(0)] * len(new)

        def trace(number: int) -> None:
            found[number] = np.packbits(~self._occluders.between(self._starts, self._cells.places[new[number]]))

        each(trace, len(new))
        self.traced += len(new)
        self._known.update(zip(new, found, strict=True))
        for cell in cells:
            self._known.move_to_end(cell)
        seen = [np.unpackbits(self._known[cell], count=len(self._starts)).view(bool) for cell in cells]
        while len(self._known) > max(KEPT, len(cells)):
            self._known.popitem(last=False)
        return seen


class NearPool:
    """The surfels of a pool that may be near sources: none of two in one place, as of cloth."""

    def __init__(self, surfels: Cells, cells: NearCells) -> None:
        self._surfels, self._cells = surfels, cells
        self._area = max(float(surfels.areas.sum(dtype=np.float64)), 1e-30)
        _, number, counts = np.unique(surfels.places, axis=0, return_inverse=True, return_counts=True)
        self._alone = counts[number.ravel()] == 1

    def sources(self, radiosity: Float32[ndarray, "S 3"], light: Light) -> NearSources:
        """The brightest surfels, where they are far brighter than the mean, of the first reflection of a light."""
        brightness = radiosity.mean(axis=1).astype(np.float64)
        least = BRIGHT * float((brightness * self._surfels.areas).sum()) / self._area
        if len(brightness) > MOST:
            least = max(least, float(np.partition(brightness, -MOST - 1)[-MOST - 1]))
        bright = np.flatnonzero((brightness > least) & self._alone)
        parts = np.clip(brightness[bright] / max(least, 1e-30) - 1, 0, 1).astype(np.float32)
        own = self._surfels.at(bright)
        cells, shares = np.zeros((0, 2), np.int64), np.zeros((0, 2), np.float32)
        if len(bright):
            cells, shares = self._cells.seen(light, bright, own.places.astype(np.float64), brightness[bright] * own.areas)
        return NearSources(bright, parts, own, parts[:, None] * radiosity[bright], cells, shares)


def lift_above(points: Float[ndarray, "R 3"]) -> float:
    """How far above receivers their shadows are looked up, m: more than direct light's, so that maps of shadows agree with rays."""
    return LIFT * float(np.ptp(points, axis=0).max(initial=0))


def disc_factors(points: Float32[ndarray, "R 3"], normals: Float32[ndarray, "R 3"], sources: Cells) -> Float32[ndarray, "R m"]:
    """The share of the light at each receiver that comes from each source, nothing between: cos cos A / (pi d^2 + A), as of a disc.

    A source closer to it than CLOSE of its sides is taken as a square of PARTS x PARTS discs.
    """
    facing, areas = sources.normals.astype(np.float32), sources.areas.astype(np.float32)
    vector = sources.places.astype(np.float32)[None] - points[:, None]
    squared = np.einsum("rnk,rnk->rn", vector, vector)
    near, far = np.einsum("rnk,rk->rn", vector, normals), -np.einsum("rnk,nk->rn", vector, facing)
    factors = _discs(near, far, squared, areas)
    reach = np.float32(np.sqrt(0.5)) * np.sqrt(areas)
    receiver, source = np.nonzero((squared < CLOSE**2 * areas) & (near > -reach) & (far > 0))
    if len(receiver):
        tangent, bitangent = (axis.astype(np.float32)[source] for axis in frames(sources.normals.astype(np.float64)))
        side, own, total = np.sqrt(areas)[source, None], vector[receiver, source], np.zeros(len(receiver), np.float32)
        steps = ((np.arange(PARTS) + 0.5) / PARTS - 0.5).astype(np.float32)
        for s in steps:
            for t in steps:
                part = own + side * (s * tangent + t * bitangent)
                height = np.einsum("nk,nk->n", part, normals[receiver])
                total += _discs(height, far[receiver, source], np.einsum("nk,nk->n", part, part), areas[source] / PARTS**2)
        factors[receiver, source] = total
    return factors


def _discs(near: ndarray, far: ndarray, squared: ndarray, areas: ndarray) -> ndarray:
    """From the distances along the normals of receivers and sources, the square of the whole, and areas."""
    squared = np.maximum(squared, np.float32(1e-12))
    return np.maximum(near, 0) * np.maximum(far, 0) * areas / (squared * (np.float32(np.pi) * squared + areas))
