"""Single elements of visibility, traced: whether a receiver sees a distant light. Sets of them are bits, a row of bytes per receiver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Int
from srbf.compute.threads import each
from srbf.visibility.embree import EmbreeTriangles

RAYS = 1 << 19  # traced at a time
ROWS = 256  # of receivers at a time
REPORTED = 1 << 13  # receivers between two reports of progress
Bits = ndarray  # (n, B) uint8: bit l of row p is of receiver p and direction l, the first in the highest bit of the first byte


@dataclass(eq=False)
class ElementTracer:
    """Traces elements (receiver, direction) of R receivers and N directions, and counts the rays.

    `starts`: where rays start, m, a little above the surface; `normals`: unit; `directions`: unit vectors to distant lights.
    """

    starts: Float32[ndarray, "R 3"]
    normals: Float32[ndarray, "R 3"]
    directions: Float32[ndarray, "N 3"]
    occluders: EmbreeTriangles
    rays: int = field(default=0, init=False)

    @property
    def count(self) -> int:
        """Receivers."""
        return len(self.starts)

    @property
    def row_bytes(self) -> int:
        """Bytes of a row of bits."""
        return -(-len(self.directions) // 8)

    def above(self, rows: Int[ndarray, " n"]) -> Bool[ndarray, "n N"]:
        """Which directions are above the horizons of some receivers; the others need no ray."""
        return self.normals[rows] @ self.directions.T > 0

    def seen(self, rows: Int[ndarray, " m"], columns: Int[ndarray, " m"]) -> Bool[ndarray, " m"]:
        """Whether receiver rows[i] sees direction columns[i], by one ray each."""
        result = np.empty(len(rows), bool)
        starts = range(0, len(rows), RAYS)

        def trace(number: int) -> None:
            part = slice(starts[number], starts[number] + RAYS)
            result[part] = ~self.occluders.occluded(self.starts[rows[part]], self.directions[columns[part]], None)

        each(trace, len(starts))
        self.rays += len(rows)
        return result

    def add_seen(self, bits: Bits, rows: Int[ndarray, " n"], asked: Bits) -> None:
        """Trace the elements `asked` (n, B) of receivers `rows`, and set the bits of those that are seen in their rows of `bits` (R, B)."""
        starts = range(0, len(rows), ROWS)
        traced = [0] * len(starts)

        def trace(number: int) -> None:
            part = slice(starts[number], starts[number] + ROWS)
            own = np.ascontiguousarray(asked[part])
            place = np.flatnonzero(own)  # bytes with an element
            wanted = np.unpackbits(own.ravel()[place])
            which = np.flatnonzero(wanted)
            row, byte = np.divmod(place[which >> 3], self.row_bytes)
            column = 8 * byte + (which & 7)
            hidden = self.occluders.occluded(self.starts[rows[part][row]], self.directions[column], None)
            wanted[which[hidden]] = 0
            own.ravel()[place] = np.packbits(wanted)
            bits[rows[part]] |= own
            traced[number] = len(which)

        each(trace, len(starts))
        self.rays += sum(traced)

    def above_bits(self, rows: Int[ndarray, " n"]) -> Bits:
        """`above` as bits (n, B)."""
        result = np.empty((len(rows), self.row_bytes), np.uint8)
        starts = range(0, len(rows), 4 * ROWS)

        def pack(number: int) -> None:
            part = slice(starts[number], starts[number] + 4 * ROWS)
            result[part] = np.packbits(self.above(rows[part]), axis=1)

        each(pack, len(starts))
        return result

    def all_seen(self, progress: Callable[[int, int], None] = lambda done, total: None) -> Bits:
        """Every element, by a ray for each above its receiver's horizon; `progress` counts receivers."""
        bits = np.zeros((self.count, self.row_bytes), np.uint8)
        for start in range(0, self.count, REPORTED):
            rows = np.arange(start, min(start + REPORTED, self.count))
            self.add_seen(bits, rows, self.above_bits(rows))
            progress(int(rows[-1]) + 1, self.count)
        return bits
