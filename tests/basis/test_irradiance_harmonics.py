"""Spherical harmonics of the light at a probe: uniform light and harmonics exactly, a distant light nearly, and their order."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.harmonics import SphericalHarmonics
from srbf.basis.irradiance_harmonics import COSINE_LOBE, FACETS, HARMONICS, facet_normals, irradiance_at, radiance_harmonics
from srbf.sphere import point_set

NORMALS = point_set("fibonacci", 200, "sphere")
DISTANT = 0.14  # relative rms: 0.08 of it is what a clamped cosine has beyond l = 2 [Ramamoorthi2001], the rest l = 4 on so few facets


def test_uniform_light_gives_pi_everywhere() -> None:
    radiance = radiance_harmonics(np.full((1, FACETS, 3), np.pi))
    np.testing.assert_allclose(radiance[0, 0], np.sqrt(4 * np.pi), rtol=1e-12)
    np.testing.assert_allclose(radiance[0, 1:], 0, atol=1e-12)
    np.testing.assert_allclose(irradiance_at(np.repeat(radiance, len(NORMALS), axis=0), NORMALS), np.pi, rtol=1e-12)


def test_light_of_order_two_is_exact() -> None:
    true = np.random.default_rng(1).normal(size=(7, HARMONICS, 3))
    on_facets = np.einsum("fk,nkc->nfc", SphericalHarmonics(HARMONICS).evaluate(facet_normals()) * COSINE_LOBE, true)
    np.testing.assert_allclose(radiance_harmonics(on_facets), true, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_distant_light(axis: int) -> None:
    """Of unit irradiance: L_lm = Y_lm(d). Degree 1 goes y, z, x, as in three.js."""
    toward = np.eye(3)[axis]
    on_facets = np.repeat(np.maximum(facet_normals() @ toward, 0)[None, :, None], 3, axis=2)
    radiance = radiance_harmonics(on_facets)
    assert 1 + np.abs(radiance[0, 1:4, 0]).argmax() == (3, 1, 2)[axis]
    np.testing.assert_allclose(radiance[0, :4, 0], SphericalHarmonics(HARMONICS).evaluate(toward[None])[0, :4], atol=0.05)
    found, true = irradiance_at(np.repeat(radiance, len(NORMALS), axis=0), NORMALS)[:, 0], np.maximum(NORMALS @ toward, 0)
    assert np.sqrt(((found - true) ** 2).mean() / (true**2).mean()) < DISTANT
