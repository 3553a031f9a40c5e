"""How much of a light passes along rays: 0 behind opaque surfaces, else the transmittance of the panes on the way."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.io.scene_glb import Triangles
from srbf.vectors import lengths
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.shadow import transmittance

RAY_OFFSET = 1e-5  # m, plus this share of the distance from the origin: between a surface and the start of its shadow rays
MAX_WALLS = 32


class ShadowRays:
    """Shadow rays through a scene's triangles. MissingLibraryError without embreex."""

    def __init__(self, triangles: Triangles) -> None:
        self._occluders = EmbreeTriangles(triangles.corners[triangles.occluders])
        self._filters = EmbreeTriangles(triangles.corners[triangles.filters])
        self._transmittance = triangles.transmittance
        self._filter_material = triangles.material[triangles.filters]
        self._filter_normals = triangles.normals[triangles.filters]

    @property
    def has_panes(self) -> bool:
        """Whether anything transmits part of the light."""
        return len(self._filter_material) > 0

    def passed(self, origin: ndarray, direction: ndarray, distance: ndarray | None) -> Float32[ndarray, "n 3"]:
        """Transmittance of each ray up to `distance` (m; None: endless), from `origin` along the unit vector `direction`."""
        free = ~self._occluders.occluded(origin, direction, distance)
        passed = np.repeat(free.astype(np.float32)[:, None], 3, axis=1)
        if not self.has_panes:
            return passed
        active = np.flatnonzero(free)
        start = origin[active].copy()
        left = None if distance is None else distance[active].copy()
        for _ in range(MAX_WALLS):
            hit, far, bary = self._filters.first_hit(start, direction[active])
            meets = (hit >= 0) if left is None else (hit >= 0) & (far < left)
            active, start, far, hit, bary = active[meets], start[meets], far[meets], hit[meets], bary[meets]
            if not len(active):
                break
            passed[active] *= self._wall(hit, bary, direction[active])
            step = far + RAY_OFFSET * (1 + np.abs(start).max(axis=1))
            start = start + direction[active] * step[:, None]
            left = None if left is None else left[meets] - step
        return passed

    def _wall(self, wall: Int[ndarray, " n"], bary: Float32[ndarray, "n 3"], direction: Float32[ndarray, "n 3"]) -> Float32[ndarray, "n 3"]:
        """Transmittance of one wall at the angle of each ray."""
        normal = np.einsum("nk,nkc->nc", bary, self._filter_normals[wall])
        normal /= np.maximum(lengths(normal), 1e-20)[:, None]
        return transmittance(self._transmittance[self._filter_material[wall]], np.einsum("nc,nc->n", normal, direction))
