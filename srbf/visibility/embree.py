"""Ray intersections with triangles, by Embree."""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Int
from srbf.errors import MissingLibraryError
from srbf.vectors import lengths


def has_embree() -> bool:
    """Whether embreex is installed."""
    return importlib.util.find_spec("embreex") is not None


class EmbreeTriangles:
    """A set of triangles. MissingLibraryError without embreex."""

    def __init__(self, corners: Float32[ndarray, "T 3 3"]) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as error:
            raise MissingLibraryError("rays need embreex, found it missing; pip install srbf[ray]") from error
        self._scene: Any = EmbreeScene()
        self._empty = not len(corners)
        if not self._empty:
            self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(corners, np.float32))

    def occluded(self, origin: np.ndarray, direction: np.ndarray, distance: np.ndarray | None) -> Bool[ndarray, " n"]:
        """Whether each ray hits a triangle within `distance` (None: at any distance)."""
        if self._empty or not len(origin):
            return np.zeros(len(origin), bool)
        far = np.full(len(origin), 1e30, np.float32) if distance is None else distance.astype(np.float32)
        hits = self._scene.run(_f(origin), _f(direction), far, query="OCCLUDED")
        return np.asarray(hits) >= 0

    def between(self, starts: np.ndarray, ends: np.ndarray) -> Bool[ndarray, " n"]:
        """Whether a triangle stands between each start and its end, (n, 3) or one of them (3,), m."""
        toward = ends - starts
        distance = lengths(toward)
        origin = np.broadcast_to(starts, toward.shape)
        return self.occluded(origin, toward / np.maximum(distance, 1e-30)[:, None], distance)

    def first_hit(
        self, origin: np.ndarray, direction: np.ndarray
    ) -> tuple[Int[ndarray, " n"], Float32[ndarray, " n"], Float32[ndarray, "n 3"]]:
        """(triangle, distance, barycentric coordinates) of the nearest hit of each ray; triangle -1 without a hit."""
        count = len(origin)
        if self._empty or not count:
            return np.full(count, -1), np.full(count, np.inf, np.float32), np.zeros((count, 3), np.float32)
        hits = self._scene.run(_f(origin), _f(direction), query="INTERSECT", output=1)
        u, v = np.asarray(hits["u"]), np.asarray(hits["v"])
        return np.asarray(hits["primID"]), np.asarray(hits["tfar"]), np.stack([1 - u - v, u, v], axis=1)


def _f(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array, np.float32)
