"""Cubemaps of directions: six faces of side x side texels about a point, the lights of all-frequency transport [Ng2003]."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.errors import InputError

LEAST_SIDE, MOST_SIDE = 2, 64


@dataclass(frozen=True)
class Cubemap:
    """6 N^2 directions, N = `side`: the middles of the texels of a cube's faces +x, -x, +y, -y, +z, -z.

    Direction (face, row, column) has index face N^2 + row N + column. On a face of the axes a, the sign s and the next two axes b = a + 1,
    c = a + 2 (x after z), it is the unit vector along s e_a + (2 (column + 1/2) / N - 1) e_b + (2 (row + 1/2) / N - 1) e_c, in Blender's
    world: z up.

    Parameters
    ----------
    side
        2 to 64.

    Raises
    ------
    InputError
        On another side.

    Examples
    --------
    >>> from srbf.cubemap import Cubemap
    >>> Cubemap(32).count
    6144
    >>> bool((Cubemap(4).texel_of(Cubemap(4).directions) == np.arange(96)).all())
    True
    """

    side: int

    def __post_init__(self) -> None:
        if not LEAST_SIDE <= self.side <= MOST_SIDE:
            raise InputError(f"expected a cubemap of {LEAST_SIDE} to {MOST_SIDE} texels a side, found {self.side}")

    @property
    def count(self) -> int:
        """How many directions."""
        return 6 * self.side**2

    @cached_property
    def directions(self) -> Float64[ndarray, "N 3"]:
        """Unit vectors from the surface to the lights."""
        x, y = np.meshgrid(self._middles, self._middles)
        return np.concatenate([self._on_face(face, x.ravel(), y.ravel()) for face in range(6)])

    @cached_property
    def solid_angles(self) -> Float64[ndarray, " N"]:
        """Of the texels, sr; their sum is 4 pi."""
        x, y = np.meshgrid(*[2 * np.arange(self.side + 1) / self.side - 1] * 2)
        corner = np.arctan2(x * y, np.sqrt(x**2 + y**2 + 1))  # of the rectangle from the face's middle
        face = corner[1:, 1:] - corner[1:, :-1] - corner[:-1, 1:] + corner[:-1, :-1]
        return np.tile(face.ravel(), 6)

    def texel_of(self, directions: Float[ndarray, "n 3"]) -> Int[ndarray, " n"]:
        """The index of the texel that each direction, of any length but 0, falls into."""
        axis = np.abs(directions).argmax(axis=1)
        n = np.arange(len(directions))
        along = directions[n, axis]
        scale = np.maximum(np.abs(along), 1e-300)
        x, y = directions[n, (axis + 1) % 3] / scale, directions[n, (axis + 2) % 3] / scale
        column, row = (np.clip(((v + 1) / 2 * self.side).astype(np.int64), 0, self.side - 1) for v in (x, y))
        return ((2 * axis + (along < 0)) * self.side + row) * self.side + column

    @cached_property
    def coarse(self) -> Bool[ndarray, " N"]:
        """The regular grid of half the resolution, a quarter of the directions: every other row and column."""
        other = np.arange(self.side) % 2 == 0
        return np.tile((other[:, None] & other[None, :]).ravel(), 6)

    def window(self, radius: int) -> Int[ndarray, "N W"]:
        """Indices of the W = (2 radius + 1)^2 texels around each, itself included; beyond its face those that lie there."""
        steps = np.arange(-radius, radius + 1) * 2 / self.side
        x, y = (v.ravel() for v in np.meshgrid(self._middles, self._middles))
        dx, dy = (v.ravel() for v in np.meshgrid(steps, steps))
        wide_x, wide_y = (x[:, None] + dx).ravel(), (y[:, None] + dy).ravel()
        faces = [self.texel_of(self._on_face(face, wide_x, wide_y)).reshape(len(x), -1) for face in range(6)]
        return np.concatenate(faces)

    def bilinear(self, directions: Float[ndarray, "n 3"]) -> tuple[Int[ndarray, "n 4"], Float32[ndarray, "n 4"]]:
        """(texels, weights that sum to 1) by which values at the texels are interpolated at directions: the four around each."""
        axis = np.abs(directions).argmax(axis=1)
        n = np.arange(len(directions))
        along = directions[n, axis]
        face = 2 * axis + (along < 0)
        place = [directions[n, (axis + k) % 3] / np.abs(along) for k in (1, 2)]
        low = [np.floor((v + 1) / 2 * self.side - 0.5) for v in place]
        part = [(v + 1) / 2 * self.side - 0.5 - w for v, w in zip(place, low, strict=True)]
        texels, weights = np.empty((len(directions), 4), np.int64), np.empty((len(directions), 4), np.float32)
        for k, (right, down) in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
            x, y = (2 * (w + step + 0.5) / self.side - 1 for w, step in zip(low, (right, down), strict=True))
            found = np.empty((len(directions), 3))
            for number in range(6):
                own = face == number
                found[own] = self._on_face(number, x[own], y[own])
            texels[:, k] = self.texel_of(found)
            weights[:, k] = np.where(right, part[0], 1 - part[0]) * np.where(down, part[1], 1 - part[1])
        return texels, weights

    @property
    def _middles(self) -> Float64[ndarray, " side"]:
        return 2 * (np.arange(self.side) + 0.5) / self.side - 1

    @staticmethod
    def _on_face(face: int, x: Float64[ndarray, " n"], y: Float64[ndarray, " n"]) -> Float64[ndarray, "n 3"]:
        axis = face // 2
        found = np.empty((len(x), 3))
        found[:, axis], found[:, (axis + 1) % 3], found[:, (axis + 2) % 3] = 1 - 2 * (face % 2), x, y
        return found / np.linalg.norm(found, axis=1, keepdims=True)
