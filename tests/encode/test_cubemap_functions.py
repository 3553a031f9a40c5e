"""Functions through values at all texels of a cubemap: they keep to the values, are smooth between, and cost sparse products."""

from __future__ import annotations

import numpy as np

from srbf.basis.gaussian import weight
from srbf.basis.light_functions import LightFunctions, nearby_weights
from srbf.cubemap import Cubemap
from srbf.encode.cubemap_functions import functions_between
from srbf.sphere import random_directions

CUBEMAP = Cubemap(14)  # 1176 directions: enough for sparse weights


def test_smooth_values_are_kept_at_the_texels_and_between() -> None:
    def true(directions: np.ndarray) -> np.ndarray:
        x, y, z = directions.T
        return np.stack([1 + x * y, z**2 + 0.3 * x, np.maximum(z, 0) ** 2], axis=1)[:, None]

    functions, told = functions_between(CUBEMAP.directions, true(CUBEMAP.directions))
    assert told["kernel"]["narrow"] < 0.15
    np.testing.assert_allclose(functions.evaluate(CUBEMAP.directions), true(CUBEMAP.directions), atol=0.02)
    between = random_directions(500, "sphere", np.random.default_rng(0))
    np.testing.assert_allclose(functions.evaluate(between), true(between), atol=0.03)


def test_edges_overshoot_little() -> None:
    """A step, as visibility is: within a third of its height, and sharp within two texels."""
    step = (CUBEMAP.directions[:, 2] > 0.2).astype(np.float64)[:, None, None].repeat(3, axis=2)
    functions, _ = functions_between(CUBEMAP.directions, step)
    heights = np.linspace(-1, 1, 400)
    angle = np.full_like(heights, 0.4)
    line = np.stack([np.sqrt(1 - heights**2) * np.cos(angle), np.sqrt(1 - heights**2) * np.sin(angle), heights], axis=1)
    found = functions.evaluate(line)[:, 0, 0]
    assert found.min() > -0.33 and found.max() < 1.33
    far = np.abs(np.arcsin(heights) - np.arcsin(0.2)) > 2 * 2 / CUBEMAP.side
    np.testing.assert_allclose(found[far], (heights > 0.2)[far], atol=0.1)


def test_weights_of_nearby_centers_are_those_of_all() -> None:
    directions, spread = random_directions(300, "sphere", np.random.default_rng(1)), 0.08
    sparse = nearby_weights(directions, CUBEMAP.directions, spread)
    dense = weight(directions @ CUBEMAP.directions.T, spread)
    np.testing.assert_allclose(sparse.toarray(), dense, atol=1e-6)
    assert sparse.nnz < 0.1 * dense.size
    rng = np.random.default_rng(2)
    coefficients = rng.normal(size=(4, CUBEMAP.count, 3)).astype(np.float32)
    functions = LightFunctions(CUBEMAP.directions, np.full(4, spread), coefficients)
    np.testing.assert_allclose(functions.evaluate(directions), np.einsum("nb,fbc->nfc", dense, coefficients), atol=1e-3)
    colors = rng.random((300, 3))
    np.testing.assert_allclose(functions.project(directions, colors), np.einsum("nb,fbc,nc->fc", dense, coefficients, colors), atol=1e-2)
