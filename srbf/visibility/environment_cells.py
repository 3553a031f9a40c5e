"""The environment as cells, squares of the octahedral map of directions: how much of a hemisphere each fills, and what a map has in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.io.scene_glb import Triangles
from srbf.light_geometry import environment_samples
from srbf.lights import EnvironmentLight
from srbf.sphere import octahedral_encode
from srbf.visibility.shadow_rays import ShadowRays

if TYPE_CHECKING:
    from scipy.sparse import csr_array

SIDE = 24  # cells per side of the map: 8 degrees each
WIDE = 8  # per side of the map, of the parts of the environment that shapes are made for
ROWS = 8  # in which a map is read at least, per side of a cell; twice as many columns


def cell_of(directions: Float64[ndarray, "n 3"], side: int = SIDE) -> Int[ndarray, " n"]:
    """The cell of each direction, row by row of the octahedral map: the row is of v, the column of u [Cigolle2014]."""
    u, v = octahedral_encode(directions)
    column, row = (np.clip(np.floor((x + 1) / 2 * side), 0, side - 1).astype(np.int64) for x in (u, v))
    return row * side + column


def cell_radiance(light: EnvironmentLight, side: int = SIDE) -> Float64[ndarray, "N 3"]:
    """The mean radiance of an environment map in every cell, by solid angle, times the light's color."""
    height, width = light.image.shape[:2]
    image = light.image.repeat(-(-ROWS * side // height), axis=0).repeat(-(-2 * ROWS * side // width), axis=1)
    directions, solid_angle = environment_samples(image, "sphere", light.rotation)
    cell, weight = cell_of(directions.reshape(-1, 3), side), solid_angle.ravel()
    count = side**2
    whole = np.maximum(np.bincount(cell, weight, count), 1e-30)
    flux = np.stack([np.bincount(cell, weight * image[..., c].ravel(), count) for c in range(3)], axis=1)
    return flux / whole[:, None] * np.array(light.color)


@dataclass(frozen=True, eq=False)
class EnvironmentRows:
    """Shares of n hemispheres, weighted by the cosine, that the cells of the environment send light through, in sparse rows.

    Row i has `cells` and `shares` from starts[i] to starts[i + 1]; shares (Z, 1), or (Z, 3) where panes are colored. Irradiance is pi
    times the shares times the cells' radiance: an open plane has shares of sum 1.
    """

    starts: Int[ndarray, " m"]
    cells: Int[ndarray, " Z"]
    shares: Float32[ndarray, "Z c"]
    side: int = SIDE

    def matrix(self, channel: int = 0) -> csr_array:
        """(n, N) float32 of a color's channel."""
        from scipy.sparse import csr_array

        own = self.shares[:, min(channel, self.shares.shape[1] - 1)]
        return csr_array((own, self.cells, self.starts), shape=(len(self.starts) - 1, self.side**2))

    def irradiance(self, radiance: Float64[ndarray, "N 3"]) -> Float64[ndarray, "n 3"]:
        """Of an environment of this radiance in its cells."""
        return np.pi * np.stack([self.matrix(c) @ radiance[:, c] for c in range(3)], axis=1)

    @property
    def seen(self) -> Int[ndarray, " K"]:
        """The cells that any row has, in order."""
        return np.unique(self.cells)

    def parts(self) -> Float32[ndarray, "n V"]:
        """What the cells of each part of the environment that any row sees, WIDE of them per side, send together, in gray."""
        row, column = np.divmod(self.cells, self.side)
        part = row * WIDE // self.side * WIDE + column * WIDE // self.side
        own = np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))
        count = WIDE**2
        sums = np.bincount(own * count + part, self.shares.mean(axis=1), (len(self.starts) - 1) * count).reshape(-1, count)
        return sums[:, sums.any(axis=0)].astype(np.float32)

    @staticmethod
    def none(count: int, channels: int = 1, side: int = SIDE) -> EnvironmentRows:
        """`count` rows without environment."""
        return EnvironmentRows(np.zeros(count + 1, np.int64), np.zeros(0, np.int64), np.zeros((0, channels), np.float32), side)

    @staticmethod
    def stacked(parts: Sequence[EnvironmentRows]) -> EnvironmentRows:
        """The rows of all, one after the other; at least one."""
        sizes = np.concatenate([np.diff(part.starts) for part in parts])
        cells, shares = (np.concatenate([getattr(part, name) for part in parts]) for name in ("cells", "shares"))
        return EnvironmentRows(np.concatenate([[0], np.cumsum(sizes)]), cells, shares, parts[0].side)


class Openings:
    """What rays see of the environment: past all that casts shadows, through panes. MissingLibraryError without embreex."""

    def __init__(self, triangles: Triangles, side: int = SIDE) -> None:
        self._rays, self._side = ShadowRays(triangles), side
        self._all = bool((~triangles.casts & ~triangles.translucent).any())  # light passes some opaque surfaces
        self.channels = 3 if self._rays.has_panes else 1

    def rows(
        self,
        count: int,
        row: Int[ndarray, " n"],
        weight: Float64[ndarray, " n"],
        origins: ndarray,
        directions: ndarray,
        met: Bool[ndarray, " n"],
    ) -> EnvironmentRows:
        """(count, N) shares, by rays of a `weight` in a `row`; `met`: those that meet a surface."""
        free = np.arange(len(met)) if self._all else np.flatnonzero(~met)
        passed = self._rays.passed(origins[free].astype(np.float32), directions[free].astype(np.float32), None)[:, : self.channels]
        lit = passed.any(axis=1)
        free, passed = free[lit], passed[lit]
        cells = self._side**2
        key, entry = np.unique(row[free] * cells + cell_of(directions[free], self._side), return_inverse=True)
        shares = [np.bincount(entry.ravel(), weight[free] * passed[:, c], len(key)) for c in range(self.channels)]
        starts = np.searchsorted(key, np.arange(count + 1) * cells)
        return EnvironmentRows(starts, key % cells, np.stack(shares, axis=1).astype(np.float32), self._side)
