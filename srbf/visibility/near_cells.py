"""Cells of a pool's surfels, of several widths, each of which receivers see or not as one.

They are fixed in the scene: a light that moves changes how much each sends, never where it is seen, so that no picture jumps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.errors import ImageError
from srbf.lights import AreaLight, Light, PointLight
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.received import starts_of
from srbf.visibility.surface_cells import Cells

FINEST = 2.0  # width of the finest cells, in sides of the median surfel
SHIFT = 0.377  # of the widest cells: where their grid begins, so that no surface along the axes lies on its lines
OFF = 0.25  # sides of a cell, how far from its surface it is seen, where nothing is nearer
LEAST_LEVELS = 2
ROUNDS = 8  # in which surfels that do not see the place of their cell get one of their own
WIDE = 1.0  # width of the cells that count, in distances to the light, or in diameters of what it lights
BLENDED = 0.5  # of the step from one width to the next, over which both count


@dataclass(frozen=True, eq=False)
class NearCells:
    """L levels of cells, each twice as wide as the one before; `finest`: width of the first, m.

    `labels` (L, S): the cell of each surfel; `places` (C, 3): where each is seen, m, a little above one of its surfels.
    """

    finest: float
    labels: Int[ndarray, "L S"]
    places: Float32[ndarray, "C 3"]

    @staticmethod
    def of(cells: Cells, occluders: EmbreeTriangles) -> NearCells:
        """Of all surfels of a pool, by a grid; surfels of a cell face one way, and none is parted from where it is seen."""
        places, normals = cells.places.astype(np.float64), cells.normals.astype(np.float64)
        extent = float(np.ptp(places, axis=0).max(initial=0))
        finest = max(FINEST * float(np.median(np.sqrt(cells.areas))), 1e-6 * extent, 1e-9)
        levels = max(LEAST_LEVELS, int(np.ceil(np.log2(max(extent / finest, 1)))))
        origin = places.min(axis=0) - SHIFT * finest * 2**levels
        axis = np.abs(normals).argmax(axis=1)
        facing = 2 * axis + (normals[np.arange(len(axis)), axis] > 0)
        labels = np.zeros((levels, len(places)), np.int64)
        seen: list[ndarray] = []
        for level in range(levels):
            square = np.floor((places - origin) / (finest * 2**level)).astype(np.int64)
            number = np.unique(np.column_stack([square, facing]), axis=0, return_inverse=True)[1].ravel()
            first = sum(len(own) for own in seen)
            labels[level], own = _seen_as_one(number, places, normals, cells.areas.astype(np.float64), occluders)
            labels[level] += first
            seen.append(own)
        return NearCells(finest, labels, np.concatenate(seen).astype(np.float32))

    def tables(self) -> dict[str, ndarray]:
        """As an asset stores them: labels (L, S, 1), and places (1, 1 + C, 3) after (`finest`, 0, 0)."""
        first = np.array([[self.finest, 0, 0]], np.float32)
        return {"near_labels": self.labels[..., None].astype(np.float32), "near_places": np.concatenate([first, self.places])[None]}

    @staticmethod
    def of_asset(asset: Asset) -> NearCells:
        """From `tables`; ImageError where a cell has no place."""
        finest, places = asset.tables["near_places"][0, 0, 0], asset.tables["near_places"][0, 1:]
        labels = np.round(asset.tables["near_labels"][..., 0]).astype(np.int64)
        if len(labels) < LEAST_LEVELS or labels.min() < 0 or labels.max() >= len(places):
            found = f"{len(labels)} levels of {labels.min()} to {labels.max()}"
            raise ImageError(
                f"expected {LEAST_LEVELS} levels or more of cells 0 to {len(places) - 1} in `near_labels`, found {found}; fit again"
            )
        return NearCells(float(finest), labels, places)

    def seen(
        self, light: Light, surfels: Int[ndarray, " n"], places: Float64[ndarray, "n 3"], flux: Float64[ndarray, " n"]
    ) -> tuple[Int[ndarray, "n 2"], Float32[ndarray, "n 2"]]:
        """(two cells by which each lit surfel is seen, the share of its light by each): as wide as it is far from the light.

        They are at most as wide as what is lit, by the spread of the surfels' flux; all of it changes gradually with the light.
        """
        middle = np.average(places, axis=0, weights=flux)
        spread = float(np.sqrt(np.average(((places - middle) ** 2).sum(axis=1), weights=flux)))
        width = np.full(len(places), 2 * spread)
        if isinstance(light, (PointLight, AreaLight)):
            width = np.minimum(width, np.linalg.norm(places - np.array(light.position), axis=1))
        levels = len(self.labels)
        level = np.clip(np.log2(np.maximum(WIDE * width / self.finest, 1e-9)), 0, levels - 1)
        lower = np.minimum(level.astype(np.int64), levels - 2)
        upper = np.clip(((level - lower) - 0.5) / BLENDED + 0.5, 0, 1).astype(np.float32)
        cells = np.column_stack([self.labels[lower, surfels], self.labels[lower + 1, surfels]])
        return cells, np.column_stack([1 - upper, upper])


def _seen_as_one(
    number: Int[ndarray, " S"],
    places: Float64[ndarray, "S 3"],
    normals: Float64[ndarray, "S 3"],
    areas: Float64[ndarray, " S"],
    occluders: EmbreeTriangles,
) -> tuple[Int[ndarray, " S"], Float64[ndarray, "C 3"]]:
    """Cells of surfels that see the place of their cell, of those that a grid puts together by `number`: (cells, places, m)."""
    found, seen = np.zeros(len(number), np.int64), []
    left, count = np.arange(len(number)), 0
    starts = starts_of(places, normals).astype(np.float64)
    for last in [False] * (ROUNDS - 1) + [True]:
        if not len(left):
            break
        group = np.unique(number[left], return_inverse=True)[1].ravel()
        area = np.bincount(group, areas[left])
        middle = np.stack([np.bincount(group, areas[left] * places[left, k]) for k in range(3)], axis=1) / area[:, None]
        away = ((places[left] - middle[group]) ** 2).sum(axis=1)
        order = np.lexsort((away, group))
        chosen = left[order[np.unique(group[order], return_index=True)[1]]]
        hit, free, _ = occluders.first_hit(starts[chosen].astype(np.float32), normals[chosen].astype(np.float32))
        above = np.minimum(OFF * np.sqrt(area), np.where(hit >= 0, free / 2, np.inf))
        place = starts[chosen] + above[:, None] * normals[chosen]
        found[left] = count + group
        seen.append(place)
        count += len(place)
        if last:
            break
        hidden = occluders.between(starts[left], place[group])
        hidden[np.isin(left, chosen)] = False
        left = left[hidden]
    return found, np.concatenate(seen) if seen else np.zeros((0, 3))
