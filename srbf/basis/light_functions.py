"""Smooth RGB functions of light direction: combinations of a dense set of spherical Gaussians."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64
from srbf.basis.gaussian import weight

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MANY_CENTERS, NARROW = 1024, 0.15  # centers from which on, and spreads (rad) below which, weights are sparse
REACH = 5.5  # spreads from a center, beyond which its weight is below 3e-7


@dataclass(frozen=True, eq=False)
class LightFunctions:
    """F functions w_f(L, c) = sum_b coefficient[f, b, c] exp(-acos(L . Q_b)^2 / (2 spread_f^2)) over B shared centers.

    Each function has one of a few spreads: slow changes with the light are averaged over many images, and fast ones are not
    blurred. The functions are defined for every unit direction.
    """

    centers: Float64[ndarray, "B 3"]
    spreads: Float64[ndarray, " F"]
    coefficients: Float32[ndarray, "F B 3"]

    def evaluate(self, directions: Float[ndarray, "N 3"]) -> Float64[ndarray, "N F 3"]:
        """All functions at unit directions: N B exponentials for each distinct spread."""
        values = np.empty((len(directions), len(self.spreads), 3))
        for coefficients, (chosen, weights) in zip(self._by_color, self._by_spread(directions), strict=True):
            for c in range(3):
                values[:, chosen, c] = weights @ coefficients[c]
        return values

    def project(self, directions: Float[ndarray, "N 3"], colors: Float[ndarray, "N 3"]) -> Float64[ndarray, "F 3"]:
        """sum_n color_n w_f(direction_n): the total weights of many lights, or of the texels of an environment map.

        Summed over the centers in single precision.
        """
        projected = np.empty((len(self.spreads), 3))
        for coefficients, (chosen, weights) in zip(self._by_color, self._by_spread(directions), strict=True):
            for c, sums in enumerate((weights.T @ colors).T.astype(np.float32)):
                projected[chosen, c] = sums @ coefficients[c]
        return projected

    @cached_property
    def _by_color(self) -> list[Float32[ndarray, "3 B f"]]:
        """Coefficients of the functions of each spread, a center in a row: single precision and this order are several times as fast."""
        groups = (self.coefficients[self.spreads == spread] for spread in np.unique(self.spreads))
        return [np.ascontiguousarray(own.transpose(2, 1, 0)) for own in groups]

    def _by_spread(self, directions: Float[ndarray, "N 3"]) -> Iterator[tuple[Bool[ndarray, " F"], Float64[ndarray, "N B"] | csr_array]]:
        if len(self.centers) >= MANY_CENTERS and (self.spreads < NARROW).all():
            for spread in np.unique(self.spreads):
                yield self.spreads == spread, nearby_weights(directions, self.centers, float(spread))
            return
        cosines = np.asarray(directions, np.float64) @ self.centers.T
        for spread in np.unique(self.spreads):
            yield self.spreads == spread, weight(cosines, float(spread))


def nearby_weights(directions: Float[ndarray, "N 3"], centers: Float64[ndarray, "B 3"], spread: float) -> csr_array:
    """(N, B) float64: the weights of centers within REACH spreads of each unit direction; those farther away are 0."""
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    farthest = 2 * np.sin(min(REACH * spread, np.pi) / 2)  # chords find them in a tenth of the time of all cosines
    pairs = cKDTree(directions).sparse_distance_matrix(cKDTree(centers), farthest, output_type="ndarray")
    weights = np.exp(-2 * np.square(np.arcsin(np.minimum(pairs["v"] / 2, 1)) / spread))
    return csr_array((weights, (pairs["i"], pairs["j"])), shape=(len(directions), len(centers)))
