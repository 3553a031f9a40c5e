"""The baselines' functions: orthonormal where they claim to be, by quadrature that is exact for their degree."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.harmonics import HARMONICS, HemisphericalHarmonics, PolynomialTextureMap, SphericalHarmonics
from srbf.errors import InputError
from srbf.sphere import random_directions

ROUNDING = 1e-12
DEGREE = 12  # of polynomials that the quadrature integrates exactly, twice the highest order tried


def quadrature(low: float) -> tuple[np.ndarray, np.ndarray]:
    """(directions, weights) on low < z < 1: Gauss-Legendre in z, even in azimuth."""
    x, w = np.polynomial.legendre.leggauss(DEGREE)
    z = low + (1 - low) * (x + 1) / 2
    azimuth = 2 * np.pi * np.arange(2 * DEGREE) / (2 * DEGREE)
    r = np.sqrt(1 - z**2)
    grid = np.stack([r[:, None] * np.cos(azimuth), r[:, None] * np.sin(azimuth), np.repeat(z[:, None], 2 * DEGREE, axis=1)], axis=-1)
    weights = np.repeat(w[:, None] * (1 - low) / 2 * (2 * np.pi / (2 * DEGREE)), 2 * DEGREE, axis=1)
    return grid.reshape(-1, 3), weights.ravel()


@pytest.mark.parametrize(("harmonics", "low"), [(SphericalHarmonics, -1.0), (HemisphericalHarmonics, 0.0)])
@pytest.mark.parametrize("k", [1, 4, 9, 25, 36])
def test_orthonormal_on_their_domain(harmonics: type, low: float, k: int) -> None:
    directions, weights = quadrature(low)
    values = harmonics(k).evaluate(directions)
    np.testing.assert_allclose(values.T @ (weights[:, None] * values), np.eye(k), atol=ROUNDING * 10)


def test_first_harmonics_are_their_textbook_forms() -> None:
    d = random_directions(50, "sphere", np.random.default_rng(0))
    x, y, z = d.T
    first = np.sqrt(3 / (4 * np.pi))
    expected = [np.full(50, 0.5 / np.sqrt(np.pi)), first * y, first * z, first * x]
    np.testing.assert_allclose(SphericalHarmonics(4).evaluate(d), np.stack(expected, axis=1), atol=ROUNDING)


def test_addition_theorem() -> None:
    # The squares of one degree's harmonics add up to (2 l + 1) / 4 pi in every direction.
    values = SphericalHarmonics(36).evaluate(random_directions(40, "sphere", np.random.default_rng(1)))
    for degree in range(6):
        total = (values[:, degree**2 : (degree + 1) ** 2] ** 2).sum(axis=1)
        np.testing.assert_allclose(total, (2 * degree + 1) / (4 * np.pi), rtol=1e-10)


def test_below_the_horizon_hemispherical_harmonics_hold_the_horizons_value() -> None:
    d = random_directions(20, "hemisphere", np.random.default_rng(2))
    flat = np.stack([d[:, 0], d[:, 1], np.zeros(20)], axis=1)
    below = np.stack([d[:, 0], d[:, 1], -d[:, 2]], axis=1)
    np.testing.assert_allclose(HemisphericalHarmonics(9).evaluate(below), HemisphericalHarmonics(9).evaluate(flat), atol=ROUNDING)


def test_polynomial_texture_map_terms() -> None:
    values = PolynomialTextureMap().evaluate(np.array([[0.6, 0, 0.8], [0.3, -0.5, np.sqrt(0.66)]]))
    np.testing.assert_allclose(values, [[1, 0.6, 0, 0, 0.36, 0], [1, 0.3, -0.5, -0.15, 0.09, 0.25]], atol=ROUNDING)


@pytest.mark.parametrize(("kind", "k"), [("spherical-harmonics", 5), ("hemispherical-harmonics", 24), ("ptm", 7)])
def test_numbers_that_a_basis_cannot_have(kind: str, k: int) -> None:
    with pytest.raises(InputError, match=f"found {k}"):
        HARMONICS[kind](k)
