"""Sobol's sequence is scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from srbf.sobol import sobol


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_it_is_that_of_scipy(dimensions: int) -> None:
    np.testing.assert_array_equal(sobol(1 << 12, dimensions), qmc.Sobol(dimensions, scramble=False).random_base2(12))


def test_of_few_points_it_is_the_beginning() -> None:
    np.testing.assert_array_equal(sobol(100, 4), sobol(128, 4)[:100])
    assert sobol(0, 2).shape == (0, 2)
