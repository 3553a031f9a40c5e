"""The grouped product against numpy.einsum, whatever the blocks and the precision of the rows."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.grouped_product import GroupedProduct

FLOAT32_SUM = 2e-5  # absolute: sums of some tens of products of order one in float32
L, P, C, J, G = 17, 230, 3, 4, 5


@pytest.mark.parametrize("kind", [np.float16, np.float32])
@pytest.mark.parametrize("block", [1, 6, L])
@pytest.mark.parametrize("columns", [7, 4096])
def test_equals_einsum(kind: type, block: int, columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.solve.grouped_product.COLUMN_BATCH", columns)
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(L, P, C)).astype(kind)
    weights = rng.normal(size=(G, J, L, C)).astype(np.float32)
    groups = rng.choice([0, 1, 4], P)  # two groups have no column
    product = GroupedProduct(weights, groups)
    for first in reversed(range(0, L, block)):
        product.add(first, rows[first : first + block])
    expected = np.einsum("pjlc,lpc->jp", weights[groups].astype(np.float64), rows.astype(np.float64))
    np.testing.assert_allclose(product.result, expected, atol=FLOAT32_SUM)
