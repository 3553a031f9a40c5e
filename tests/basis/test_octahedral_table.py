"""The octahedral table: exact at its nodes, whole across its folds, and nearer to the functions the larger it is."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.light_functions import LightFunctions
from srbf.basis.octahedral_table import SIZES, TABLE_ERROR, lookup, octahedral_table, table_directions
from srbf.sphere import point_set, random_directions

HALF = 2.0**-11  # relative rounding of a half float
ROUNDING = 1e-12


def functions(spread: float, count: int = 5) -> LightFunctions:
    coefficients = np.random.default_rng(0).normal(size=(count, 60, 3)).astype(np.float32)
    return LightFunctions(point_set("fibonacci", 60, "sphere"), np.full(count, spread), coefficients)


@pytest.mark.parametrize("size", [5, 17])
def test_partners_across_a_fold_are_one_direction(size: int) -> None:
    nodes = table_directions(size)
    np.testing.assert_allclose(np.linalg.norm(nodes, axis=-1), 1, atol=ROUNDING)
    for border in (nodes[0], nodes[-1], nodes[:, 0], nodes[:, -1]):
        np.testing.assert_allclose(border, border[::-1], atol=ROUNDING)
    np.testing.assert_allclose(nodes[[0, 0, -1, -1], [0, -1, 0, -1]], [[0, 0, -1]] * 4, atol=ROUNDING)
    np.testing.assert_allclose(nodes[size // 2, size // 2], [0, 0, 1], atol=ROUNDING)


def test_a_tile_holds_its_function_at_its_nodes() -> None:
    known = functions(0.5)
    table = octahedral_table(known, "sphere", (17,))
    assert table.columns == 3 and table.atlas.shape == (2 * 17, 3 * 17, 3)
    exact = known.evaluate(table_directions(17).reshape(-1, 3)).reshape(17, 17, 5, 3)
    for f in range(5):
        top, left = f // 3 * 17, f % 3 * 17
        np.testing.assert_allclose(table.atlas[top : top + 17, left : left + 17], exact[:, :, f], rtol=HALF, atol=1e-6)


def test_lookup_meets_its_nodes_and_mixes_between_them() -> None:
    known = functions(0.5)
    table = octahedral_table(known, "sphere", (17,))
    nodes = table_directions(17).reshape(-1, 3)
    scale = np.abs(known.evaluate(nodes)).max()
    for f in range(5):
        got = lookup(table.atlas, 17, table.columns, np.full(len(nodes), f), nodes)
        np.testing.assert_allclose(got, known.evaluate(nodes)[:, f], atol=2 * HALF * scale)
    # Inside the upper diamond, where the map is smooth: the middle of a cell is the mean of its corners.
    u = np.array([1.0, 1.0, 0]) / 16
    middle = np.array([u[0], u[1], 1 - u[0] - u[1]])
    corners = table.atlas[8:10, 8:10].astype(np.float32).reshape(4, 3)
    np.testing.assert_allclose(lookup(table.atlas, 17, 3, np.array([0]), middle[None])[0], corners.mean(axis=0), atol=1e-5 * scale)


def test_mixing_error_falls_with_the_square_of_the_step() -> None:
    known = functions(0.5)
    probes = random_directions(3000, "sphere", np.random.default_rng(3))
    exact = known.evaluate(probes)
    errors = []
    for size in (17, 33, 65):
        table = octahedral_table(known, "sphere", (size,))
        mixed = np.stack([lookup(table.atlas, size, table.columns, np.full(len(probes), f), probes) for f in range(5)], axis=1)
        errors.append(np.sqrt(((mixed - exact) ** 2).mean() / (exact**2).mean()))
        assert table.error == pytest.approx(errors[-1], rel=0.2)  # two sets of some thousand directions
    assert errors[0] / errors[1] > 3 and errors[1] / errors[2] > 3  # 4 except halves and for cells that a fold bends


@pytest.mark.parametrize("spread", [0.9, 0.35, 0.2])
def test_the_smallest_size_within_tolerance(spread: float) -> None:
    known = functions(spread)
    table = octahedral_table(known, "sphere")
    assert table.error <= TABLE_ERROR
    for size in SIZES[: SIZES.index(table.size)]:
        assert octahedral_table(known, "sphere", (size,)).error > TABLE_ERROR


def test_memory_bounds_the_size(monkeypatch: pytest.MonkeyPatch) -> None:
    known = functions(0.1)
    monkeypatch.setattr("srbf.basis.octahedral_table.TABLE_BYTES", 5 * 33 * 33 * 8)
    table = octahedral_table(known, "sphere")
    assert table.size == 33 and table.error > TABLE_ERROR
