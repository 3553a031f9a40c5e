"""Square maps of the hemisphere above a surface: equal areas of the map are equal solid angles.

The square goes to the disc by concentric squares [Shirley1997], the disc to the hemisphere by equal areas [Lambert1772]. In the frame of a
point, x and y lie across its normal and z is along it.
"""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64, Int
from srbf.visibility.surface_cells import frames

SIDE = 45  # of a map: 2025 depths
STEPS = 4096.0  # normals are rounded to one over this, so that rounding errors do not turn the frame of a wall


Axes = tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]


def hemisphere_frames(normals: Float[ndarray, "n 3"]) -> Axes:
    """The axes x, y and z of the map at each normal [Duff2017], orthonormal up to the rounding of the normal."""
    rounded = np.round(np.asarray(normals, np.float64) * STEPS) / STEPS
    return (*frames(rounded), rounded)


def directions(side: int) -> Float64[ndarray, "d 3"]:
    """Unit vectors to the middles of the texels of a map of `side` x `side`, row by row."""
    steps = (np.arange(side) + 0.5) / side * 2 - 1
    a, b = (grid.ravel() for grid in np.meshgrid(steps, steps))
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    part = np.where(wide, b, a) / np.where(radius == 0, 1, radius) * (np.pi / 4)
    turn = np.where(wide, part, np.pi / 2 - part)
    across = radius * np.sqrt(np.maximum(2 - radius**2, 0))
    return np.stack([across * np.cos(turn), across * np.sin(turn), 1 - radius**2], axis=1)


def places(local: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 2"]:
    """Where on the map, in [0, 1]^2, unit vectors in the frame of a point fall; what is below the horizon falls on the border."""
    height = np.maximum(local[:, 2], 0)
    x, y = (local[:, k] / np.sqrt(1 + height) for k in range(2))
    radius = np.minimum(np.hypot(x, y), 1)
    wide = np.abs(x) > np.abs(y)
    leading = np.where(wide, x, y)
    turn = np.where(wide, y, x) / np.where(leading == 0, 1, leading)
    along = radius * np.where(leading < 0, -1.0, 1.0)
    across = along * np.arctan(turn) * (4 / np.pi)
    return 0.5 + 0.5 * np.stack([np.where(wide, along, across), np.where(wide, across, along)], axis=1)


def place_of(toward: Float[ndarray, "n 3"], normals: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 2"]:
    """Where on the maps of points with these normals unit vectors fall."""
    return places(local_vectors(toward, hemisphere_frames(normals)))


def local_vectors(vectors: Float[ndarray, "n 3"], axes: Axes) -> Float64[ndarray, "n 3"]:
    """Vectors in frames of axes (n, 3) each."""
    return np.stack([np.einsum("nc,nc->n", axis, vectors) for axis in axes], axis=1)


def four_around(place: Float[ndarray, "n 2"], side: int) -> tuple[Int[ndarray, "n 4"], Float64[ndarray, "n 4"]]:
    """(the texels whose middles are around each place, their bilinear weights); at the border two of them are the same texel."""
    at = place * side - 0.5
    low = np.floor(at)
    part = at - low
    columns = np.clip(low[:, :1] + [0, 1, 0, 1], 0, side - 1)
    rows = np.clip(low[:, 1:] + [0, 0, 1, 1], 0, side - 1)
    right, down = part[:, :1], part[:, 1:]
    weights = np.concatenate([(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down], axis=1)
    return (rows * side + columns).astype(np.int64), weights
