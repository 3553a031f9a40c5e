"""Nested shadow maps of a sun over a large view: the nearer receivers are to the camera, the finer is their map."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.visibility.shadow import SunFrame

MOST = 5  # maps
STEPS = 8  # of distances that are tried for them
RATIO = 2.5  # of the distances that two maps reach to
FINENESS = 0.5  # texels of a map, over pixels at the nearest receivers, from which on a map is fine enough
NEAREST = 0.005  # quantile of the distances
LEAST_GAIN = 0.8  # of the side of a map, to which a finer one comes down at least
FEWEST = 64  # receivers in a map of their own


class Cascades:
    """The maps of suns over the receivers of a view, by their distances from its camera; one map where nobody knows these.

    Parameters
    ----------
    points
        (n, 3) receivers, m.
    camera
        Of the view, or None; `width` its pixels.
    center
        The origin of `points` in the camera's frame, m.
    """

    def __init__(self, points: Float[ndarray, "n 3"], camera: dict[str, Any] | None, width: int, center: Float64[ndarray, " 3"]) -> None:
        self._points = points
        self._distances: Float64[ndarray, " n"] | None = None
        if camera is not None and camera["type"] == "PERSP":
            corners = np.array(camera["frame"], np.float64)  # top right, bottom right, bottom left, top left
            self._pixel = np.linalg.norm(corners[0] - corners[3]) / width / max(float(abs(corners[0, 2])), 1e-30)
            self._distances = np.linalg.norm(points + center - np.array(camera["matrix_world"], np.float64)[:3, 3], axis=1)

    @functools.cached_property
    def _nearest(self) -> float:
        """The distance of the nearest receivers, m."""
        assert self._distances is not None
        return float(np.quantile(self._distances, NEAREST)) if len(self._distances) else 0.0

    @functools.cached_property
    def _nested(self) -> list[Float[ndarray, "n 3"]]:
        """The receivers that are nearer than each fraction of the largest distance: parts of one array, the nearest first."""
        assert self._distances is not None
        order = np.argsort(self._distances)
        points, distances = self._points[order], self._distances[order]
        counts = np.searchsorted(distances, distances.max(initial=0) / RATIO ** np.arange(1, STEPS + 1), side="right")
        return [points[:count] for count in counts if count >= FEWEST]

    def frames(self, direction: Float64[ndarray, " 3"], size: int) -> list[SunFrame]:
        """The frames of maps of `size` texels per side, the finest first; the last one holds all receivers."""
        found = [SunFrame.around(self._points, direction)]
        if self._distances is None:
            return found
        for near in self._nested:
            if len(found) == MOST or found[0].extent / size <= FINENESS * self._pixel * self._nearest:
                break
            frame = SunFrame.around(near, direction)
            if frame.extent < LEAST_GAIN * found[0].extent:
                found.insert(0, frame)
        return found


def uniforms_of(frames: list[SunFrame], number: int) -> dict[str, Any]:
    """What a shader knows of one of several frames: its axes and square, the squares of finer ones, whether there are coarser ones."""
    frame = frames[number]
    finer = np.zeros((MOST - 1, 3), np.float32)
    for i, other in enumerate(frames[:number]):
        finer[i] = (*other.low, other.extent)
    axes = {"across": frame.across, "up": frame.up, "toLight": frame.to_light}
    return {**axes, "low": frame.low, "extent": frame.extent, "finer": finer, "bounded": number < len(frames) - 1}
