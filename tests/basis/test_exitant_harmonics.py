"""Exitant radiance in spherical harmonics: the functions, and least squares on a hemisphere."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.exitant_harmonics import MAX_ORDER, harmonics, projection, radiance
from srbf.basis.harmonics import SphericalHarmonics
from srbf.errors import InputError

ORDERS = range(MAX_ORDER + 1)
UP = np.array([[0.0, 0, 1]])


def fibonacci(count: int) -> np.ndarray:
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    return np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)


def exact_rule(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """(directions, solid angles) that integrate polynomials of that degree exactly, on each of the hemispheres z > 0 and z < 0."""
    nodes, weights = np.polynomial.legendre.leggauss(degree + 1)
    z, angle = np.concatenate([nodes - 1, nodes + 1]) / 2, 2 * np.pi * np.arange(degree + 1) / (degree + 1)
    z, angle = (part.ravel() for part in np.meshgrid(z, angle))
    ring = np.sqrt(1 - z * z)
    angles = np.tile(np.tile(weights / 2, 2), degree + 1) * 2 * np.pi / (degree + 1)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1), angles


def turned(seed: int) -> np.ndarray:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn))


@pytest.mark.parametrize("order", ORDERS)
def test_closed_forms_are_the_harmonics(order: int) -> None:
    directions = fibonacci(200)
    np.testing.assert_allclose(harmonics(directions, order), SphericalHarmonics((order + 1) ** 2).evaluate(directions), atol=1e-13)
    assert harmonics(directions.reshape(10, 20, 3), order).shape == (10, 20, (order + 1) ** 2)


def test_they_are_orthonormal_on_the_sphere() -> None:
    directions, angles = exact_rule(2 * MAX_ORDER)
    functions = harmonics(directions, MAX_ORDER)
    np.testing.assert_allclose(functions.T * angles @ functions, np.eye(25), atol=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_band_limited_functions_are_exact_on_the_sphere(order: int) -> None:
    coefficients = np.random.default_rng(order).normal(size=((order + 1) ** 2, 3))
    directions = fibonacci(150)
    found = projection(directions, None, order, ridge=0.0) @ (harmonics(directions, order) @ coefficients)
    np.testing.assert_allclose(found[0], coefficients, atol=1e-10)


@pytest.mark.parametrize("order", ORDERS)
def test_band_limited_functions_are_exact_on_a_hemisphere(order: int) -> None:
    """Whatever lies below the horizon."""
    coefficients = np.random.default_rng(order).normal(size=(order + 1) ** 2)
    directions, normals = fibonacci(300), turned(order)
    values = np.where(normals @ directions.T > 0, harmonics(directions, order) @ coefficients, 99.0)
    found = np.einsum("pks,ps->pk", projection(directions, normals, order, ridge=0.0), values)
    np.testing.assert_allclose(found, np.tile(coefficients, (3, 1)), atol=1e-8)


def test_a_clamped_cosine_is_one_term_on_its_hemisphere_and_the_known_series_on_the_sphere() -> None:
    """Coefficients on the sphere: A_l sqrt((2 l + 1) / 4 pi) with A = pi, 2 pi / 3, pi / 4, 0, -pi / 24."""
    directions, angles = exact_rule(2 * MAX_ORDER)
    cosine = np.maximum(directions[:, 2], 0)
    on_sphere = projection(directions, None, 4, angles, ridge=0.0)[0] @ cosine
    zonal = np.array([np.pi, 2 * np.pi / 3, np.pi / 4, 0, -np.pi / 24]) * np.sqrt((2 * np.arange(5) + 1) / (4 * np.pi))
    expected = np.zeros(25)
    expected[[0, 2, 6, 12, 20]] = zonal
    np.testing.assert_allclose(on_sphere, expected, atol=1e-10)
    on_hemisphere = projection(directions, UP, 1, angles, ridge=0.0)[0] @ cosine
    np.testing.assert_allclose(on_hemisphere, [0, 0, np.sqrt(4 * np.pi / 3), 0], atol=1e-10)


@pytest.mark.parametrize(("order", "known"), [(2, 0.572), (3, 0.370), (4, 0.213)])
def test_a_phong_lobe_of_exponent_12(order: int, known: float) -> None:
    """The error of the article's material under one light at 30 degrees, relative rms: lower than of the series on the sphere."""
    directions = fibonacci(4000)
    above = directions[:, 2] > 0
    lobe = np.where(above, np.maximum(directions @ (0.5, 0, np.sqrt(0.75)), 0) ** 12, 0)

    def error(matrix: np.ndarray) -> float:
        rest = harmonics(directions[above], order) @ (matrix @ lobe) - lobe[above]
        return float(np.sqrt((rest**2).mean() / (lobe[above] ** 2).mean()))

    found = error(projection(directions, UP, order)[0])
    assert found == pytest.approx(known, abs=0.01)
    assert found < error(projection(directions, None, order, ridge=0.0)[0])


@pytest.mark.parametrize("order", [1, 3])
def test_the_residual_is_orthogonal_to_all_functions_on_the_hemisphere(order: int) -> None:
    """The normal equations."""
    directions, normals = fibonacci(500), turned(7)
    values = np.random.default_rng(0).uniform(size=(3, 500))
    found = np.einsum("pks,ps->pk", projection(directions, normals, order, ridge=0.0), values)
    above = normals @ directions.T > 0
    residual = np.where(above, found @ harmonics(directions, order).T - values, 0)
    np.testing.assert_allclose(residual @ harmonics(directions, order), 0, atol=1e-8)


def test_a_turned_surface_sends_its_light_to_turned_viewers() -> None:
    turn, directions, viewers = turned(1), fibonacci(200), fibonacci(40)
    values = np.random.default_rng(1).uniform(size=200)
    one = radiance(np.tile(projection(directions, UP, 3) @ values, (40, 1)), viewers, 3)
    two = radiance(np.tile(projection(directions @ turn.T, UP @ turn.T, 3) @ values, (40, 1)), viewers @ turn.T, 3)
    np.testing.assert_allclose(one, two, atol=1e-8)


def test_few_viewers_give_the_smallest_coefficients() -> None:
    directions = fibonacci(16)  # eight above the horizon, for 16 coefficients
    matrix = projection(directions, UP, 3)
    values = np.random.default_rng(2).uniform(1, 2, 16)
    found = matrix[0] @ values
    above = directions[:, 2] > 0
    np.testing.assert_allclose(harmonics(directions[above], 3) @ found, values[above], atol=0.01)
    assert np.abs(found).max() < 10
    assert (projection(directions[~above], UP, 3) == 0).all()


def test_colors_and_lights_keep_their_axes() -> None:
    coefficients = np.random.default_rng(3).normal(size=(5, 16, 3))
    viewers = fibonacci(5)
    np.testing.assert_allclose(radiance(coefficients, viewers, 3)[:, 1], radiance(coefficients[:, :, 1], viewers, 3))


@pytest.mark.parametrize("order", [-1, 5])
def test_orders_that_are_not_there(order: int) -> None:
    with pytest.raises(InputError, match="order of spherical harmonics from 0 to 4"):
        harmonics(UP, order)
