"""The decoder of neural maps: against the formula written out number by number, and its table there and back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from srbf.basis.neural_decoder import NeuralDecoder, elu, rows_of
from srbf.sphere import random_directions

SUM = 1e-5  # float32 sums of a few dozen products of numbers near 1


def network(codes: int, hidden: int) -> NeuralDecoder:
    table = np.random.default_rng([codes, hidden]).normal(size=(rows_of(codes, hidden), hidden)).astype(np.float32) * 0.5
    table[-1, 3:] = 0
    return NeuralDecoder.of_table(table)


def by_hand(network: NeuralDecoder, code: np.ndarray, direction: np.ndarray) -> list[float]:
    """One response, by loops in double precision."""

    def unit(x: float) -> float:
        return x if x > 0 else math.exp(x) - 1

    given = [*code.tolist(), *direction.tolist()]
    first = np.concatenate([network.code, network.direction]).tolist()
    width = len(network.first_bias)
    a = [unit(float(network.first_bias[i]) + sum(x * row[i] for x, row in zip(given, first, strict=True))) for i in range(width)]
    b = [unit(float(network.hidden_bias[i]) + sum(a[j] * float(network.hidden[j, i]) for j in range(width))) for i in range(width)]
    return [float(network.output_bias[c]) + sum(b[j] * float(network.output[j, c]) for j in range(width)) for c in range(3)]


@pytest.mark.parametrize(("codes", "hidden"), [(1, 4), (9, 20)])
def test_equals_the_formula_written_out(codes: int, hidden: int) -> None:
    decoder = network(codes, hidden)
    rng = np.random.default_rng(1)
    given = rng.normal(size=(6, codes)).astype(np.float32)
    directions = random_directions(6, "sphere", rng).astype(np.float32)
    found = decoder.toward(decoder.of_codes(given), directions)
    expected = [by_hand(decoder, code, direction) for code, direction in zip(given, directions, strict=True)]
    np.testing.assert_allclose(found, expected, atol=SUM * np.abs(expected).max())
    one = decoder.toward(decoder.of_codes(given), directions[2:3])
    np.testing.assert_allclose(one[2], found[2], atol=SUM)


def test_the_table_holds_every_number() -> None:
    decoder = network(9, 20)
    again = NeuralDecoder.of_table(decoder.table())
    for name in ("code", "direction", "first_bias", "hidden", "hidden_bias", "output", "output_bias"):
        np.testing.assert_array_equal(getattr(again, name), getattr(decoder, name))
    assert decoder.numbers == (9 + 3 + 1) * 20 + 21 * 20 + 3 * 21
    assert decoder.products == (9 + 3) * 20 + 20 * 20 + 3 * 20


def test_elu_is_smooth_at_zero_and_bounded_below() -> None:
    x = np.array([[-50, -1e-4, 0, 1e-4, 3]], np.float32)
    np.testing.assert_allclose(elu(x), [[-1, math.expm1(-1e-4), 0, 1e-4, 3]], rtol=1e-6)
