"""A few rows of many that stand for all of them, bright ones more often than dim ones."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64, Int


def bright_rows(energy: Float[ndarray, " P"], count: int, rng: np.random.Generator) -> tuple[Int[ndarray, " n"], Float64[ndarray, " n"]]:
    """(about `count` of P rows in order, how probable each was): one half evenly, the other by their share of the `energy`.

    Texels beside a light are few, and most of its picture: an even sample misses them [Drineas2006]. A row whose energy is its sum of
    squares, over the root of its probability, has the mean of all rows.
    """
    share = 0.5 / max(1, len(energy)) + 0.5 * energy.astype(np.float64) / max(float(energy.sum(dtype=np.float64)), 1e-30)
    probability = np.minimum(count * share, 1)
    passed = np.floor(np.cumsum(probability) + rng.random())
    chosen = np.flatnonzero(np.diff(passed, prepend=0) > 0)
    return chosen, probability[chosen]
