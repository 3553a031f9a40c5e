"""Light functions of a kernel of two spreads, put on Gaussians of one, against the kernel itself."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.gaussian import weight
from srbf.basis.light_kernel import LightKernel, narrowest
from srbf.encode.light_function_fit import dense_centers
from srbf.light_domain import Directions
from srbf.sphere import mean_spacing, point_set, random_directions

REPLACED = 1e-2  # of the largest value, of functions as rough as noise: wide Gaussians by narrow ones at 0.7 of their spacing


@pytest.mark.parametrize("domain", ["hemisphere", "sphere"])
@pytest.mark.parametrize("count", [49, 300])
def test_functions_of_two_spreads_are_the_kernel(domain: str, count: int) -> None:
    rng = np.random.default_rng(0)
    lights = point_set("fibonacci", count, domain)
    centers = dense_centers(lights, Directions(domain))
    spacing = mean_spacing(lights)
    kernel = LightKernel(max(0.7 * spacing, narrowest(centers)), min(2 * spacing, 1.0), 0.9)
    solved = rng.normal(size=(count, 6))
    directions = random_directions(200, domain, rng)
    expected = (kernel.between(directions, lights, centers) @ solved).reshape(200, 2, 3)
    found = kernel.functions(solved, lights, centers, domain).evaluate(directions)
    np.testing.assert_allclose(found, expected, atol=REPLACED * np.abs(expected).max())


def test_one_spread_is_ridge_regression_as_it_stands() -> None:
    lights = point_set("fibonacci", 30, "hemisphere")
    centers = point_set("fibonacci", 40, "hemisphere")
    basis = weight(lights @ centers.T, 0.5)
    np.testing.assert_allclose(LightKernel(0.5).between(lights, lights, centers), basis @ basis.T, atol=1e-12)


def test_two_spreads_have_variance_one_in_the_mean() -> None:
    lights = point_set("fibonacci", 30, "hemisphere")
    centers = point_set("fibonacci", 100, "hemisphere")
    kernel = LightKernel(0.3, 0.9, 0.75).between(lights, lights, centers)
    assert np.diag(kernel).mean() == pytest.approx(1)
