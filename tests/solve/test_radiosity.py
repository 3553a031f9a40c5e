"""Radiosity: furnace, no bounces without albedo, linearity, reciprocity without loss."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.radiosity import MOST_REFLECTED, Bounces, reciprocal

AREAS = np.array([1.0, 2.0, 0.5, 3.0, 1.5], np.float32)


def closed(seed: int = 0) -> np.ndarray:
    """(5, 5) exact form factors of a made closed room: symmetric flux, rows of sum one."""
    flux = np.random.default_rng(seed).uniform(0.5, 1.5, (5, 5))
    flux = flux + flux.T
    for _ in range(200):
        scale = np.sqrt(AREAS / flux.sum(axis=1))
        flux *= scale[:, None] * scale
    return (flux / AREAS[:, None]).astype(np.float32)


@pytest.mark.parametrize("albedo", [0.1, 0.5, 0.9])
def test_a_furnace(albedo: float) -> None:
    """Even irradiance 1 in a closed room of one albedo: radiosity rho / (1 - rho)."""
    found = Bounces(closed(), np.full(5, albedo)).radiosity(np.ones((5, 1), np.float32))
    np.testing.assert_allclose(found, albedo / (1 - albedo), rtol=1e-4)


def test_black_walls_give_nothing_back() -> None:
    assert not Bounces(closed(), np.zeros(5)).radiosity(np.ones((5, 2), np.float32)).any()


def test_white_walls_have_a_solution() -> None:
    found = Bounces(closed(), np.ones(5)).radiosity(np.ones((5, 1), np.float32))
    np.testing.assert_allclose(found, MOST_REFLECTED / (1 - MOST_REFLECTED), rtol=1e-2)


def test_light_adds_up_and_weights_are_the_transpose() -> None:
    rng = np.random.default_rng(1)
    one = Bounces(closed(), rng.uniform(0.1, 0.8, 5))
    lights, weights = rng.uniform(size=(5, 3)).astype(np.float32), rng.normal(size=(2, 5)).astype(np.float32)
    np.testing.assert_allclose(one.radiosity(lights).sum(axis=1), one.radiosity(lights.sum(axis=1, keepdims=True))[:, 0], rtol=1e-5)
    np.testing.assert_allclose(one.gathered(weights) @ lights, weights @ one.radiosity(lights), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("most", [0, 1, 2, 5])
def test_bounces_end_where_a_renderer_ends_them(most: int) -> None:
    """In an even room: rho + rho^2 + ... + rho^most; weights are the transpose of the same series."""
    one = Bounces(closed(), np.full(5, 0.5), most)
    found = one.radiosity(np.ones((5, 1), np.float32))
    np.testing.assert_allclose(found, sum(0.5**k for k in range(1, most + 1)), rtol=1e-4, atol=1e-9)
    rng = np.random.default_rng(4)
    lights, weights = rng.uniform(size=(5, 3)).astype(np.float32), rng.normal(size=(2, 5)).astype(np.float32)
    np.testing.assert_allclose(one.gathered(weights) @ lights, weights @ one.radiosity(lights), rtol=1e-4, atol=1e-5)
    many = Bounces(closed(), np.full(5, 0.5), 1000).radiosity(lights)
    np.testing.assert_allclose(many, Bounces(closed(), np.full(5, 0.5)).radiosity(lights), rtol=1e-6)


def test_energy_is_kept() -> None:
    """What is absorbed equals what arrived first."""
    rho = np.array([0.2, 0.4, 0.6, 0.8, 0.5])
    direct = np.random.default_rng(2).uniform(size=(5, 1)).astype(np.float32)
    factors = closed()
    radiosity = Bounces(factors, rho).radiosity(direct)
    arriving = direct + factors @ radiosity
    absorbed = (AREAS * (1 - rho)) @ arriving[:, 0]
    assert absorbed == pytest.approx(float(AREAS @ direct[:, 0]), rel=1e-4)


def test_rays_become_reciprocal_and_lose_nothing() -> None:
    rng = np.random.default_rng(3)
    noisy = closed() * rng.uniform(0.8, 1.2, (5, 5)).astype(np.float32)
    noisy *= np.array([1, 1, 0.7, 1, 1], np.float32)[:, None] / noisy.sum(axis=1, keepdims=True)  # one surfel sees an opening
    found = reciprocal(noisy, AREAS)
    flux = AREAS[:, None] * found
    np.testing.assert_allclose(flux, flux.T, rtol=1e-4)
    np.testing.assert_allclose(found.sum(axis=1), noisy.sum(axis=1), rtol=2e-3)
    np.testing.assert_allclose(reciprocal(closed(), AREAS), closed(), rtol=1e-3)


def test_a_surfel_that_sees_nothing_keeps_nothing() -> None:
    factors = closed()
    factors[0], factors[:, 0] = 0, 0
    assert not reciprocal(factors, AREAS)[0].any() and np.isfinite(reciprocal(factors, AREAS)).all()
