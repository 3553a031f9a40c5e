"""Half floats widened by their bits: all 65536 of them against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.io.float16 import all_finite, finite_to_float32

EVERY = np.arange(1 << 16, dtype=np.uint16).view(np.float16)
FINITE = EVERY[np.isfinite(EVERY)]


def test_every_finite_half_is_widened_bit_for_bit() -> None:
    widened = finite_to_float32(FINITE, np.empty(FINITE.shape, np.float32))
    assert widened.tobytes() == FINITE.astype(np.float32).tobytes()


def test_strided_pieces() -> None:
    block = FINITE[:60000].reshape(5, -1, 3)
    out = np.empty((5, 3, 100), np.float32)
    np.testing.assert_array_equal(finite_to_float32(block[:, 50:150].transpose(0, 2, 1), out), block[:, 50:150].transpose(0, 2, 1))


@pytest.mark.parametrize("bad", [np.inf, -np.inf, np.nan])
def test_what_is_not_finite_is_seen(bad: float) -> None:
    assert all_finite(FINITE) and all_finite(FINITE[:0])
    assert not all_finite(np.append(FINITE, np.float16(bad)))
