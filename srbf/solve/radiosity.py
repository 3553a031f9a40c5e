"""Radiosity: light that diffuse surfels exchange, solved for all bounces at once [Goral1984]."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MOST_REFLECTED = 0.99  # share of light that a bounce keeps at most: a closed white room has no solution
ROUNDS = 16  # of balancing rows and columns
SERIES = 24  # reflections from which on all are solved for: the rest is below what rays know


class Bounces:
    """B = sum_k (rho F)^k rho E: the radiosity that irradiance E on the surfels leaves, of one channel.

    `form_factors`: row i are the shares of i's hemisphere that the others fill; `albedo`: rho. `most`: reflections at most, as renderers
    bound them; None: all, (1 - rho F)^-1 rho E, by one factorization of an S by S matrix in float32.
    """

    def __init__(self, form_factors: ndarray | csr_array, albedo: Float64[ndarray, " S"], most: int | None = None) -> None:
        self._albedo = np.clip(albedo, 0, MOST_REFLECTED).astype(np.float32)
        self._form_factors, self._most = form_factors, most if most is None or most < SERIES else None
        if self._most is not None:
            return
        from scipy.linalg import lu_factor

        system = -self._albedo[:, None] * form_factors
        system[np.diag_indices_from(system)] += 1
        self._factors: Any = lu_factor(system, overwrite_a=True, check_finite=False)

    def radiosity(self, irradiance: Float32[ndarray, "S n"]) -> Float32[ndarray, "S n"]:
        """Of n lights."""
        first = self._albedo[:, None] * irradiance
        if self._most is None:
            return self._solved(first, 0)
        total = last = first if self._most else np.zeros_like(first)
        for _ in range(1, self._most):
            last = self._albedo[:, None] * (self._form_factors @ last)
            total = total + last
        return total

    def gathered(self, weights: Float32[ndarray, "r S"]) -> Float32[ndarray, "r S"]:
        """`weights` of radiosity as weights of irradiance: their products with `radiosity`'s matrix."""
        if self._most is None:
            return self._solved(np.ascontiguousarray(weights.T, np.float32), 1).T * self._albedo
        total = last = weights * (self._albedo if self._most else np.float32(0))
        for _ in range(1, self._most):
            last = (last @ self._form_factors) * self._albedo
            total = total + last
        return total

    def _solved(self, right: Float32[ndarray, "S n"], transposed: int) -> Float32[ndarray, "S n"]:
        from scipy.linalg import lu_solve

        return np.asarray(lu_solve(self._factors, right, trans=transposed, check_finite=False), np.float32)


def summed_series(feedback: Float[ndarray, "r r"], first: Float[ndarray, "r n"], terms: int | None) -> Float[ndarray, "r n"]:
    """sum over k < `terms` of feedback^k first; None: of all k."""
    feedback, first = np.ascontiguousarray(feedback), np.ascontiguousarray(first)  # one channel of several: BLAS takes no such strides
    if terms is None or terms >= SERIES:
        return np.linalg.solve(np.eye(len(feedback), dtype=feedback.dtype) - feedback, first)
    total = last = first if terms else np.zeros_like(first)
    for _ in range(1, terms):
        last = feedback @ last
        total = total + last
    return total


def series_by_channel(feedback: Float[ndarray, "r r 3"], terms: int | None) -> Float[ndarray, "r r 3"]:
    """The sum over k < `terms` of feedback^k, of each channel; None: of all k."""
    one = np.eye(len(feedback), dtype=feedback.dtype)
    return np.stack([summed_series(feedback[:, :, c], one, terms) for c in range(feedback.shape[2])], axis=2)


def reciprocal(form_factors: ndarray | csr_array, areas: Float32[ndarray, " S"]) -> Any:
    """Form factors of rays made to agree with reciprocity, A_i F_ij = A_j F_ji: the mean of both estimates, which halves the variance.

    Rows keep their sums, what of each hemisphere the surfels fill, so that no light is lost: flux is scaled by D F D, a few rounds.
    """
    area = np.maximum(areas, 1e-30).astype(np.float32)
    flux = area[:, None] * form_factors
    wanted = flux.sum(axis=1, dtype=np.float64)
    flux = flux + flux.T  # twice the mean
    scale = np.full(len(area), np.sqrt(0.5))
    for _ in range(ROUNDS):
        own = scale * (flux @ scale.astype(np.float32))
        scale *= np.sqrt(np.divide(wanted, own, out=np.ones_like(own), where=own > 0))
    flux *= scale.astype(np.float32)
    flux *= (scale / area).astype(np.float32)[:, None]
    return flux
