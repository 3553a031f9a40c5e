"""Tables of half floats as bytes of a PNG: the numbers of a row are multiples of one power of two, and most of them fit a byte.

Row i of the picture has the low bytes of the table's row i; where some number needs two, as many rows of high bytes follow. The first
column is BIAS plus the exponent of the row's power of two. A byte pair u is the multiple u / 2, or -(u + 1) / 2 of an odd u. PNG's
compression comes close to the entropy of such bytes, where that of EXR makes half floats of this kind half as large again.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float16, Int

Packed = Literal["rows", "columns"]  # which of them has one step
BIAS = 64
LEAST = -24  # exponent of the smallest half float
BYTE, MOST = 256, 1 << 16


def fits(table: Float16[ndarray, "R N C"], packed: Packed) -> bool:
    """Whether `pack` takes the table."""
    multiples = _multiples(_by_rows(table, packed))[0]
    return bool(multiples.min(initial=0) >= -MOST // 2 and multiples.max(initial=0) < MOST // 2)


def pack(table: Float16[ndarray, "R N C"], packed: Packed) -> ndarray:
    """The picture, uint8, of a table that `fits`, without loss; transposed where columns have one step."""
    multiples, exponents = _multiples(_by_rows(table, packed))
    folded = np.where(multiples >= 0, 2 * multiples, -2 * multiples - 1)
    parts = [folded % BYTE, folded // BYTE] if folded.max(initial=0) >= BYTE else [folded]
    rows, _, channels = folded.shape
    picture = np.zeros((len(parts) * rows, 1 + folded.shape[1], channels), np.uint8)
    picture[:rows, 0] = BIAS + exponents[:, None]
    picture[:, 1:] = np.concatenate(parts)
    return picture


def unpack(picture: ndarray, rows: int, packed: Packed) -> Float16[ndarray, "R N C"]:
    """The table of a picture with that many rows of low bytes."""
    folded = picture[:rows, 1:].astype(np.int64)
    if len(picture) > rows:
        folded += BYTE * picture[rows:, 1:].astype(np.int64)
    multiples = np.where(folded % 2 == 0, folded // 2, -(folded // 2) - 1)
    steps = np.exp2(picture[:rows, :1].astype(np.float64) - BIAS)
    return np.ascontiguousarray(_by_rows((multiples * steps).astype(np.float16), packed))


def _by_rows(table: ndarray, packed: Packed) -> ndarray:
    return table if packed == "rows" else table.transpose(1, 0, 2)


def _multiples(table: Float16[ndarray, "R N C"]) -> tuple[Int[ndarray, "R N C"], Int[ndarray, " R"]]:
    """(each number over its row's step, exponents of the steps): the largest powers of two that divide all of a row."""
    whole = np.round(np.ldexp(table.astype(np.float64), -LEAST)).astype(np.int64)  # exact: of halves
    bits = np.bitwise_or.reduce(np.abs(whole).reshape(len(whole), -1), axis=1)
    divides = np.where(bits > 0, np.log2(np.maximum(bits & -bits, 1)), -LEAST).astype(np.int64)
    return whole >> divides[:, None, None], divides + LEAST
