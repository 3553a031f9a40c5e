"""Light that arrives at a point as nine spherical harmonics, from the irradiance on facets that face twelve ways."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.basis.harmonics import SphericalHarmonics

HARMONICS = 9  # l = 0, 1, 2
COSINE_LOBE = np.pi * np.array([1, 2 / 3, 1 / 4])[[0, 1, 1, 1, 2, 2, 2, 2, 2]]  # A_l of each harmonic [Ramamoorthi2001, eq. 8]


def facet_normals() -> Float64[ndarray, "12 3"]:
    """The vertices of an icosahedron: a spherical 5-design, so that sums over them are integrals of polynomials up to degree 5."""
    golden = (1 + np.sqrt(5)) / 2
    even = [(0.0, a, b * golden) for a in (-1, 1) for b in (-1, 1)]
    vertices = np.array([np.roll(vertex, turn) for turn in range(3) for vertex in even], np.float64)
    return vertices / np.linalg.norm(vertices[0])


FACETS = len(facet_normals())


def radiance_harmonics(irradiance: Float[ndarray, "*n 12 3"]) -> Float64[ndarray, "*n 9 3"]:
    """Coefficients L_lm of the radiance whose irradiance E(n) = sum A_l L_lm Y_lm(n) fits that on the facets best.

    Least squares over twelve normals, exact for l <= 2; light of l = 3 gives no irradiance, and what l = 4 gives, 1/24 of it, is the first
    that is taken for l = 2. Order and signs as of `SphericalHarmonics`.
    """
    return np.einsum("fk,...fc->...kc", facet_weights(), np.asarray(irradiance, np.float64))


def facet_weights() -> Float64[ndarray, "12 9"]:
    """How much irradiance on each facet adds to each coefficient."""
    return 4 * np.pi / FACETS * SphericalHarmonics(HARMONICS).evaluate(facet_normals()) / COSINE_LOBE


def irradiance_at(radiance: Float[ndarray, "n 9 3"], normals: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
    """max(0, E) on surfaces of unit normal, one for each row of coefficients [Ramamoorthi2001, eq. 9]."""
    functions = SphericalHarmonics(HARMONICS).evaluate(normals) * COSINE_LOBE
    return np.maximum(np.einsum("nk,nkc->nc", functions, np.asarray(radiance, np.float64)), 0)
