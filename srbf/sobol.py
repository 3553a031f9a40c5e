"""Sobol's sequence in a few dimensions, as scipy.stats has it, whose import takes a second."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64

BITS = 30
# By dimension after the first: the inner coefficients of a primitive polynomial, and the first direction numbers.
POLYNOMIALS: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...] = (((), (1,)), ((1,), (1, 3)), ((0, 1), (1, 3, 1)))


def sobol(count: int, dimensions: int) -> Float64[ndarray, "n d"]:
    """`count` evenly spread points of the unit hypercube of up to 4 dimensions, best for powers of two [Sobol1967]."""
    numbers = np.arange(count)
    gray = numbers ^ (numbers >> 1)
    points = np.zeros((count, dimensions), np.int64)
    for axis in range(dimensions):
        for bit, direction in enumerate(_directions(axis)):
            points[:, axis] ^= (gray >> bit & 1) * (direction << (BITS - 1 - bit))
    return points / 2**BITS


def _directions(axis: int) -> list[int]:
    if axis == 0:
        return [1] * BITS
    inner, first = POLYNOMIALS[axis - 1]
    degree, found = len(first), list(first)
    while len(found) < BITS:
        value = found[-degree] ^ found[-degree] << degree
        for back, coefficient in enumerate(inner, 1):
            value ^= coefficient * found[-back] << back
        found.append(value)
    return found
