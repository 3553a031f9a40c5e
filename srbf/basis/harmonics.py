"""Basis functions of other methods, as baselines: spherical and hemispherical harmonics, polynomial texture maps."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial, isqrt, pi, sqrt
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.errors import InputError

HarmonicKind = Literal["spherical-harmonics", "hemispherical-harmonics", "ptm"]
PTM_TERMS = 6


@dataclass(frozen=True)
class SphericalHarmonics:
    """The K = (order + 1)^2 real spherical harmonics, orthonormal on the sphere; K must be a square."""

    k: int
    kind: HarmonicKind = "spherical-harmonics"

    def __post_init__(self) -> None:
        if isqrt(self.k) ** 2 != self.k:
            raise InputError(f"expected `k` of 1, 4, 9, 16, 25 … for {self.kind}, found {self.k}")

    def evaluate(self, directions: Float[ndarray, "N 3"]) -> Float64[ndarray, "N K"]:
        """All functions at unit directions."""
        d = np.asarray(directions, np.float64)
        return _harmonics(d[:, 2], np.arctan2(d[:, 1], d[:, 0]), isqrt(self.k) - 1)


@dataclass(frozen=True)
class HemisphericalHarmonics(SphericalHarmonics):
    """Spherical harmonics of 2 cos(theta) - 1: orthonormal on the hemisphere z > 0 [Gautron2004]. Below it, cos(theta) counts as 0."""

    kind: HarmonicKind = "hemispherical-harmonics"

    def evaluate(self, directions: Float[ndarray, "N 3"]) -> Float64[ndarray, "N K"]:
        """All functions at unit directions."""
        d = np.asarray(directions, np.float64)
        return sqrt(2) * _harmonics(2 * np.maximum(d[:, 2], 0) - 1, np.arctan2(d[:, 1], d[:, 0]), isqrt(self.k) - 1)


@dataclass(frozen=True)
class PolynomialTextureMap:
    """1, x, y, xy, x^2, y^2 of the light direction [Malzbender2001]: six functions, for lights on the hemisphere."""

    k: int = PTM_TERMS
    kind: HarmonicKind = "ptm"

    def __post_init__(self) -> None:
        if self.k != PTM_TERMS:
            raise InputError(f"expected `k` of {PTM_TERMS} for ptm, found {self.k}")

    def evaluate(self, directions: Float[ndarray, "N 3"]) -> Float64[ndarray, "N K"]:
        """All functions at unit directions."""
        x, y = np.asarray(directions, np.float64)[:, :2].T
        return np.stack([np.ones_like(x), x, y, x * y, x * x, y * y], axis=1)


HARMONICS = {
    "spherical-harmonics": SphericalHarmonics,
    "hemispherical-harmonics": HemisphericalHarmonics,
    "ptm": PolynomialTextureMap,
}


def _harmonics(cosine: Float64[ndarray, " N"], azimuth: Float64[ndarray, " N"], order: int) -> Float64[ndarray, "N K"]:
    """Real harmonics, degree by degree, m from -l to l, without the Condon-Shortley phase."""
    from scipy.special import lpmv

    columns = []
    for degree in range(order + 1):
        for m in range(-degree, degree + 1):
            scale = sqrt((2 * degree + 1) / (4 * pi) * factorial(degree - abs(m)) / factorial(degree + abs(m)))
            legendre = (-1) ** m * scale * lpmv(abs(m), degree, cosine)
            columns.append(legendre if m == 0 else sqrt(2) * legendre * (np.cos(m * azimuth) if m > 0 else np.sin(-m * azimuth)))
    return np.stack(columns, axis=1)
