"""Bytes that are rounded together: what is seen of their errors, against rounding each alone and against the lattice's bound."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.gaussian import GaussianBasis
from srbf.encode.quantization import metric, quantize, quantize_together, rounding_variance
from srbf.sphere import all_around, point_set


@pytest.fixture(params=[0.5, 1.0])
def functions(request: pytest.FixtureRequest) -> np.ndarray:
    """16 Gaussians on the hemisphere, of spreads that overlap a little and much."""
    return GaussianBasis(point_set("fibonacci", 16, "hemisphere"), request.param).evaluate(all_around("hemisphere"))


def restored(stored: np.ndarray, scale: np.ndarray, bias: np.ndarray) -> np.ndarray:
    return stored.astype(np.float64) / 255 * scale[:, None, None] + bias[:, None, None]


def seen(errors: np.ndarray, functions: np.ndarray) -> np.ndarray:
    """(H, W, C) squared error of the sums, mean over directions."""
    upper = np.linalg.qr(functions, mode="r") / np.sqrt(len(functions))
    return (np.einsum("jk,khwc->jhwc", upper, errors) ** 2).sum(axis=0)


def test_metric_is_the_functions_mean_products(functions: np.ndarray) -> None:
    upper = metric(functions)
    assert not np.tril(upper, -1).any()
    np.testing.assert_allclose(upper.T @ upper, functions.T @ functions / len(functions), atol=1e-7)


def test_less_is_seen_than_of_bytes_rounded_alone(functions: np.ndarray) -> None:
    values = np.random.default_rng(0).normal(size=(16, 20, 30, 3)).astype(np.float32)
    alone = seen(restored(*quantize(values, "uint8")) - values, functions).mean()
    together = seen(restored(*quantize_together(values, functions)) - values, functions).mean()
    assert together < alone / 2


def test_never_worse_than_the_lattices_bound(functions: np.ndarray) -> None:
    values = np.random.default_rng(1).normal(size=(16, 20, 30, 3)).astype(np.float32)
    stored, scale, bias = quantize_together(values, functions)
    inside = ((stored > 0) & (stored < 255)).all(axis=0)  # past either end there is no byte to round to
    assert inside.mean() > 0.5
    upper = metric(functions)
    bound = ((np.abs(np.diag(upper))[:, None] * scale / 255 / 2) ** 2).sum(axis=0)  # (C,)
    errors = seen(restored(stored, scale, bias) - values, functions)
    assert (errors <= 1.001 * np.broadcast_to(bound, errors.shape))[inside].all()


def test_functions_that_do_not_overlap_round_each_byte_alone() -> None:
    values = np.random.default_rng(2).uniform(-1, 1, (4, 9, 9, 3)).astype(np.float32)
    stored, scale, bias = quantize_together(values, np.eye(4))
    error = np.abs(restored(stored, scale, bias) - values)
    inside = (stored > 0) & (stored < 255)
    assert (error <= 0.501 * scale[:, None, None] / 255)[inside].all()
    assert (stored.min(axis=(1, 2)) == 0).all() and (stored.max(axis=(1, 2)) == 255).all()  # no part of the range is idle


def test_a_constant_layer_is_exact(functions: np.ndarray) -> None:
    values = np.random.default_rng(3).normal(size=(16, 6, 6, 3)).astype(np.float32)
    values[5] = 2.5
    stored, scale, bias = quantize_together(values, functions)
    assert np.isfinite(scale).all() and np.isfinite(bias).all()
    constant = quantize_together(np.full((16, 4, 4, 3), -1.25, np.float32), functions)
    np.testing.assert_allclose(restored(*constant), -1.25, atol=1e-6)


def test_rounding_variance_is_what_rounding_does() -> None:
    low, high = np.array([-3.0]), np.array([5.0])
    values = np.random.default_rng(4).uniform(-3, 5, (1, 200, 200, 3)).astype(np.float32)
    lost = ((restored(*quantize(values, "uint8")) - values) ** 2).mean()
    assert lost == pytest.approx(rounding_variance(low, high, "uint8")[0], rel=0.03)
    halves = ((quantize(values, "half")[0].astype(np.float64) - values) ** 2).mean()
    assert 0 < halves <= rounding_variance(low, high, "half")[0]
    assert rounding_variance(low, high, "float") == 0
