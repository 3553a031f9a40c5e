"""GGX lobes: density against samples, a furnace, what a pixel's color means."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.microfacets import albedo_terms, alpha_of, fresnel, lobe, sampled, schlick

COUNT = 200_000


@pytest.mark.parametrize(("roughness", "NoV"), [(0.5, 0.6), (0.6, 0.2), (1.0, 0.8)])
def test_samples_and_quadrature_agree_with_the_table(roughness: float, NoV: float) -> None:
    rng = np.random.default_rng(1)
    z, turn = rng.random(COUNT), 2 * np.pi * rng.random(COUNT)
    light = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    view, alpha = np.array([np.sqrt(1 - NoV**2), 0, NoV]), alpha_of(np.array([roughness]))
    half = (light + view) / np.linalg.norm(light + view, axis=1, keepdims=True)
    values = lobe(z, np.full(COUNT, NoV), half[:, 2], np.full(COUNT, alpha[0]))
    whole, grazing = albedo_terms(np.array([NoV]), alpha)
    np.testing.assert_allclose(2 * np.pi * values.mean(), whole[0], rtol=0.03)  # noise of even directions
    np.testing.assert_allclose((values * schlick(half @ view)).mean() / values.mean(), grazing[0], rtol=0.05)
    directions, VoH, weight = sampled(np.broadcast_to(view, (1, COUNT, 3)), alpha, rng.random((1, COUNT, 2)))
    np.testing.assert_allclose(weight.mean(), whole[0], rtol=0.01)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1, atol=1e-9)
    axis = np.array([0.3, 0.2, 0.9])  # the mean of any function of directions is the same
    np.testing.assert_allclose((weight * (directions @ axis)).mean(), 2 * np.pi * (values * (light @ axis)).mean(), rtol=0.04)
    assert (VoH > 0).all()


@pytest.mark.parametrize("color", [0.04, 0.3, 0.9])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_lobe_reflects_its_color(color: float, share: float) -> None:
    """In a white furnace, whatever Fresnel's term does within the lobe."""
    NoV, alpha = 0.5, alpha_of(np.array([0.5]))
    view = np.broadcast_to([np.sqrt(1 - NoV**2), 0, NoV], (1, COUNT, 3))
    _, VoH, weight = sampled(view, alpha, np.random.default_rng(2).random((1, COUNT, 2)))
    whole, grazing = albedo_terms(np.array([NoV]), alpha)
    term = fresnel(VoH[0], np.full((COUNT, 3), color), np.full(COUNT, share), np.full(COUNT, grazing[0]))
    np.testing.assert_allclose((weight[0][:, None] * term).mean(axis=0) / whole, color, rtol=0.01)


def test_a_lobe_is_dark_below_its_surface() -> None:
    ones = np.ones(2)
    assert not lobe(np.array([-0.1, 0.0]), 0.5 * ones, 0.9 * ones, 0.2 * ones).any()
