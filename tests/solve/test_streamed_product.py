"""The streamed product against numpy.einsum, whatever the blocks, the precision of the rows and the number of cores."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve.streamed_product import StreamedProduct

FLOAT32_SUM = 1e-5  # absolute: sums of some tens of products of order one in float32
L, P, C, J = 23, 700, 3, 5


def fed(weights: np.ndarray, rows: np.ndarray, block: int) -> StreamedProduct:
    product = StreamedProduct(weights)
    for first in range(0, len(rows), block):
        product.add(first, rows[first : first + block])
    return product


@pytest.fixture(params=[np.float16, np.float32])
def rows(request: pytest.FixtureRequest) -> np.ndarray:
    return np.random.default_rng(1).normal(size=(L, P, C)).astype(request.param)


@pytest.mark.parametrize("block", [1, 7, L])
@pytest.mark.parametrize("tile_bytes", [1, 1 << 20])
def test_components_apart_and_summed(rows: np.ndarray, block: int, tile_bytes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.solve.streamed_product.TILE_BYTES", tile_bytes)
    monkeypatch.setattr("srbf.solve.streamed_product.TASK_COLUMNS", 150)  # neither divides the columns
    weights = np.random.default_rng(2).normal(size=(J, L, C))
    exact = rows.astype(np.float64)
    apart = fed(weights[:, :, 0], rows, block)
    np.testing.assert_allclose(apart.result.reshape(J, P, C), np.einsum("jl,lpc->jpc", weights[:, :, 0], exact), atol=FLOAT32_SUM)
    joint = fed(weights, rows, block)
    np.testing.assert_allclose(joint.result, np.einsum("jlc,lpc->jp", weights, exact), atol=FLOAT32_SUM)
    for product in (apart, joint):
        assert product.norm_squared == pytest.approx((exact**2).sum(), rel=1e-6)
        assert all(plane.flags.c_contiguous for plane in product.result)


def test_blocks_may_come_in_any_order(rows: np.ndarray) -> None:
    weights = np.random.default_rng(3).normal(size=(J, L))
    backwards = StreamedProduct(weights)
    for first in range(L - 1, -1, -1):
        backwards.add(first, rows[first : first + 1])
    np.testing.assert_allclose(backwards.result, fed(weights, rows, L).result, atol=FLOAT32_SUM)


def test_the_same_bits_on_any_number_of_cores(rows: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbf.solve.streamed_product.TASK_COLUMNS", 128)
    weights = np.random.default_rng(4).normal(size=(J, L))
    results = []
    for count in (1, 3):
        monkeypatch.setattr("srbf.solve.streamed_product.cores", lambda count=count: count)
        results.append(fed(weights, rows, 5))
    assert results[0].result.tobytes() == results[1].result.tobytes() and results[0].norm_squared == results[1].norm_squared


@pytest.mark.parametrize("count", [J, J + 2])
def test_transform(rows: np.ndarray, count: int) -> None:
    rng = np.random.default_rng(5)
    weights, matrix = rng.normal(size=(J, L)), rng.normal(size=(count, J))
    expected = np.einsum("ij,jl,lpc->ipc", matrix, weights, rows.astype(np.float64)).reshape(count, -1)
    np.testing.assert_allclose(fed(weights, rows, 6).transform(matrix), expected, atol=5 * FLOAT32_SUM)
