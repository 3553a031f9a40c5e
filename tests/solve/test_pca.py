"""Principal axes against numpy's SVD, whichever Gram matrix is the smaller."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.solve import pca
from srbf.solve.pca import principal_axes

FLOAT32 = 2e-5  # axes are float32, from a Gram matrix of float32 products


@pytest.mark.parametrize("shape", [(200, 30), (30, 200), (40, 40)])
def test_axes_and_values_are_those_of_the_svd(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    u, _ = np.linalg.qr(rng.normal(size=(shape[0], min(shape))))
    v, _ = np.linalg.qr(rng.normal(size=(shape[1], min(shape))))
    spectrum = 10 * 0.7 ** np.arange(min(shape))
    rows = (u * spectrum @ v.T).astype(np.float32)
    axes, values = principal_axes(rows, 6)
    expected = np.linalg.svd(rows, full_matrices=False)
    np.testing.assert_allclose(values, expected.S[:6], rtol=FLOAT32)
    signs = np.sign(np.einsum("km,km->k", axes, expected.Vh[:6]))
    np.testing.assert_allclose(axes * signs[:, None], expected.Vh[:6], atol=FLOAT32 * 10)
    np.testing.assert_allclose(axes @ axes.T, np.eye(6), atol=FLOAT32)


@pytest.mark.parametrize("shape", [(50, 9), (9, 50), (5, 4)])
def test_axes_that_the_rows_lack_are_zero(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    rows = (rng.normal(size=(shape[0], 3)) @ rng.normal(size=(3, shape[1]))).astype(np.float64)
    axes, values = principal_axes(rows, 12)
    assert axes.shape == (12, shape[1]) and values.shape == (12,)
    assert (values[:3] > 0).all() and (values[3:] < 1e-6 * values[0]).all()
    np.testing.assert_allclose((rows @ axes.T) @ axes, rows, atol=1e-4)
    assert not axes[min(shape) :].any()


def test_large_rows_give_the_axes_of_their_gram_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    """By random mixtures, where the spectrum falls as that of transport does."""
    rng = np.random.default_rng(2)
    rows = (rng.normal(size=(300, 40)) * 0.8 ** np.arange(40) @ rng.normal(size=(40, 250))).astype(np.float32)
    expected, energies = principal_axes(rows, 8)
    monkeypatch.setattr(pca, "LARGE", 200)
    axes, values = principal_axes(rows, 8)
    np.testing.assert_allclose(values, energies, rtol=1e-3)
    np.testing.assert_allclose(np.linalg.svd(axes @ expected.T)[1], 1, atol=1e-3)  # of the same space


def test_nothing_to_find() -> None:
    axes, values = principal_axes(np.zeros((6, 4), np.float32), 2)
    assert np.isfinite(axes).all() and not values.any()
