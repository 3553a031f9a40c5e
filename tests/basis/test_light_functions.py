"""Light functions against their formula, and what many lights come to together."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.light_functions import LightFunctions
from srbf.sphere import point_set, random_directions

ROUNDING = 1e-6  # relative: coefficients are float32


@pytest.fixture
def functions() -> LightFunctions:
    rng = np.random.default_rng(0)
    coefficients = rng.normal(size=(7, 30, 3)).astype(np.float32)
    return LightFunctions(point_set("fibonacci", 30, "sphere"), rng.choice([0.3, 0.5, 0.9], 7), coefficients)


def test_evaluate_is_the_formula(functions: LightFunctions) -> None:
    directions = random_directions(9, "sphere", np.random.default_rng(1))
    expected = np.zeros((9, 7, 3))
    for n, direction in enumerate(directions):
        for f, spread in enumerate(functions.spreads):
            for b, center in enumerate(functions.centers):
                angle = np.arctan2(np.linalg.norm(np.cross(direction, center)), direction @ center)
                expected[n, f] += functions.coefficients[f, b] * np.exp(-(angle**2) / (2 * spread**2))
    np.testing.assert_allclose(functions.evaluate(directions), expected, atol=ROUNDING * np.abs(expected).max())


def test_projected_weights_are_a_sum_over_lights(functions: LightFunctions) -> None:
    rng = np.random.default_rng(2)
    directions, colors = random_directions(50, "sphere", rng), rng.normal(size=(50, 3))
    expected = np.einsum("nfc,nc->fc", functions.evaluate(directions), colors)
    np.testing.assert_allclose(functions.project(directions, colors), expected, atol=ROUNDING * np.abs(expected).max())
