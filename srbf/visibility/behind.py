"""Light that passes through translucent surfaces, as if a second surface lay in each, which takes light from behind and sends it ahead.

B = rho E + tau E', E' the irradiance from behind: the second surfel of a translucent one has its place and area, the opposite normal and
the albedo tau; rays that meet the one meet both. So pool, links and lights need nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.receivers import Receivers
from srbf.visibility.surface_cells import DARK, Cells
from srbf.visibility.surfels import Surfels

if TYPE_CHECKING:
    from scipy.sparse import csr_array


@dataclass(frozen=True, eq=False)
class Behind:
    """The backs of some surfels of a pool: `surfels` (B,), whose second ones follow those of the pool in this order."""

    surfels: Int[ndarray, " B"]
    transmission: Float32[ndarray, "B 3"]

    @staticmethod
    def of(pool: Surfels) -> Behind:
        """Of those that let light through."""
        if pool.transmission is None:
            return Behind(np.zeros(0, np.int64), np.zeros((0, 3), np.float32))
        found = np.flatnonzero(pool.transmission.max(axis=1, initial=0) >= DARK)
        return Behind(found, pool.transmission[found])

    def with_backs(self, cells: Cells) -> Cells:
        """The cells of a pool and those behind."""
        if not len(self.surfels):
            return cells
        own = cells.at(self.surfels)
        every = (cells, replace(own, normals=-own.normals, albedo=self.transmission))
        return Cells(*(np.concatenate([getattr(part, name) for part in every]) for name in Cells.__dataclass_fields__))

    def met(self, shares: csr_array) -> csr_array:
        """(n, S + B) from the shares (n, S) of rays that meet each surfel: what meets the front of a sheet sees what passes, too."""
        from scipy.sparse import hstack

        return hstack([shares, shares[:, self.surfels]], format="csr") if len(self.surfels) else shares


def points_behind(receivers: Receivers) -> PixelPoints | None:
    """Points of the pixels of a view that show translucent surfaces, facing away from the camera; None where there are none."""
    back = receivers.behind()
    if back is None:
        return None
    points = PixelPoints.of_view(back)
    return points if len(points.points) else None
