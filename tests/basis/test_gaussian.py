"""R: its symmetry, its spread rules, and its table."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from srbf.basis.gaussian import TABLE_TOLERANCE, GaussianBasis, interpolation_error, lookup, r_table, spread_of, weight
from srbf.errors import InputError
from srbf.sphere import nearest_neighbor_angles, point_set

ROUNDING = 1e-12


def test_weight_closed_forms() -> None:
    np.testing.assert_allclose(weight(np.cos([0, 0.3, 0.6]), 0.3), np.exp([0, -0.5, -2]), rtol=1e-12)
    np.testing.assert_allclose(weight(np.array([-1.0]), 1.0), np.exp(-(np.pi**2) / 2), rtol=1e-12)
    assert weight(np.array([1 + 1e-9]), 0.3) == 1  # a dot product may round past 1


def test_basis_is_symmetric_and_rotation_invariant() -> None:
    points = point_set("hammersley", 12, "sphere")
    gram = GaussianBasis(points, 0.5).evaluate(points)
    np.testing.assert_allclose(gram, gram.T, atol=ROUNDING)
    np.testing.assert_array_equal(np.diag(gram) > 1 - 1e-7, True)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    np.testing.assert_allclose(GaussianBasis(points @ turn.T, 0.5).evaluate(points @ turn.T), gram, atol=1e-7)


def test_spread_rules() -> None:
    centers = point_set("hammersley", 35, "sphere")
    angles = nearest_neighbor_angles(centers)
    assert spread_of(centers, "min") == angles.min()
    assert spread_of(centers, "mean") == angles.mean()
    assert spread_of(centers, 0.48) == 0.48
    # Just above a power of the base the minimum collapses and the mean does not.
    assert spread_of(point_set("hammersley", 35, "sphere"), "min") < 0.7 * spread_of(point_set("hammersley", 35, "sphere"), "mean")
    for bad in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError):
            spread_of(centers, bad)


@pytest.mark.parametrize("spread", [0.12, 0.25, 0.47, 0.75, 1.0])
def test_table_is_within_its_tolerance_everywhere(spread: float) -> None:
    table = r_table(spread)
    assert table.dtype == np.float32 and len(table) <= 4096
    x = np.linspace(-1, 1, 200_001)
    assert np.abs(lookup(table, x) - weight(x, spread)).max() <= TABLE_TOLERANCE
    np.testing.assert_allclose(table, weight(np.linspace(-1, 1, len(table)), spread), atol=1e-7)
    if len(table) > 16:
        half = weight(np.linspace(-1, 1, len(table) // 2), spread).astype(np.float32)
        assert interpolation_error(half, spread) > TABLE_TOLERANCE  # no smaller power of two would do


@pytest.mark.parametrize("spread", [0.05, 1.5, np.pi])
def test_spreads_that_no_table_holds_are_warned_of(spread: float) -> None:
    with pytest.warns(UserWarning, match="spread"):
        assert len(r_table(spread)) == 4096


def test_lookup_meets_its_entries_and_clips() -> None:
    table = r_table(0.4)
    np.testing.assert_allclose(lookup(table, np.linspace(-1, 1, len(table))), table, atol=1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert lookup(table, np.array([-1.1, 1.1])).tolist() == [table[0], table[-1]]
