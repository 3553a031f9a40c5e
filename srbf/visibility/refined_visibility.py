"""Visibility sampled where it changes: receivers from coarse to fine, and of each what neither its coarser neighbors nor the directions
around agree on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float64, Int
from srbf.compute.threads import each
from srbf.cubemap import Cubemap
from srbf.visibility.element_tracer import Bits, ElementTracer

WINDOW = 3  # texels around a direction, 7 x 7 in all, whose samples tell whether visibility changes there [Huang2010]
COARSEST, FEWEST = 64, 64  # receivers of the first level: one of how many; at least
NEIGHBORS = 16  # coarser receivers that must agree
AROUND = 3  # of four directions around one, that must be known to decide it
FACING = 2.0  # of a level's spacing: how far apart two receivers count as whose normals differ by a unit vector
NORMALS = 3.0  # steps of a normal's coordinates, from -1 to 1, that share a cell
ROWS = 256  # receivers at a time
TESTED, TESTED_ROWS = 16, 16  # one guessed element of how many is traced to predict the error, of one receiver of how many
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class SampledVisibility:
    """Bits (R, B) of all elements; `asked`: how many of the R N elements were sampled; `error`: the predicted relative RMSE under suns."""

    bits: Bits
    asked: int
    error: float


def refined(
    tracer: ElementTracer, cubemap: Cubemap, seed: int = 0, progress: Progress = lambda done, total: None, neighbors: int = NEIGHBORS
) -> SampledVisibility:
    """Visibility of all elements, of which those are traced whose neighbors differ.

    The coarsest receivers are sampled on a quarter of the directions, and wherever the samples within 7 x 7 texels differ [Huang2010,
    section 4.2]. Every other receiver, level by level, has the visibility that its `neighbors` nearest coarser receivers agree on. Where
    they do not, it is traced on every other direction, and on those between as far as the directions around them differ. Some guessed
    elements are traced to predict the error.
    """
    levels = levels_of(tracer.starts, tracer.normals, seed)
    bits = np.zeros((tracer.count, tracer.row_bytes), np.uint8)
    asked, done = 0, 0
    tally, board = _Tally.empty(seed), _Checkerboard.of(cubemap)
    for number, (spacing, rows) in enumerate(levels):
        if number == 0:
            asked += coarse_rows(tracer, cubemap, rows, bits)
        else:
            known = np.concatenate([own for _, own in levels[:number]])
            near, _ = nearest_of(tracer.starts, tracer.normals, rows, known, spacing, neighbors)
            asked += _agreed(tracer, rows, near, bits, board, tally)
        done += len(rows)
        progress(done, tracer.count)
    return SampledVisibility(bits, asked + tally.tested, tally.error())


def levels_of(positions: Float[ndarray, "R 3"], normals: Float[ndarray, "R 3"], seed: int = 0) -> list[tuple[float, Int[ndarray, " n"]]]:
    """(spacing, receivers) of each level, coarse to fine; every receiver is in one.

    A level takes a receiver of every cell of `spacing` meters, and of about one normal, that has none yet: the nearest to its middle.
    """
    count, places = len(positions), np.asarray(positions, np.float64)
    if not count:
        return []
    finest = typical_spacing(places, seed)
    low, spacing = places.min(axis=0), max(float(np.ptp(places, axis=0).max()), finest)
    facing = np.round((np.asarray(normals) + 1) / 2 * NORMALS).astype(np.int64)
    level, number = np.full(count, -1), 0
    levels: list[tuple[float, ndarray]] = []
    while spacing > 1.5 * finest:
        cells = np.floor((places - low) / spacing).astype(np.int64)
        chosen = _one_each(np.concatenate([cells, facing], axis=1), (places - low) / spacing - cells - 0.5, level < 0)
        if number or len(chosen) >= max(FEWEST, count / COARSEST):
            level[chosen] = number
            levels.append((spacing, chosen))
            number += 1
        spacing /= 2
    left = np.flatnonzero(level < 0)
    return [(size, rows) for size, rows in [*levels, (finest, left)] if len(rows)]


def typical_spacing(positions: Float64[ndarray, "R 3"], seed: int = 0) -> float:
    """The median distance to the nearest other place, m; 1 where all are in one."""
    from scipy.spatial import KDTree

    if len(positions) < 2:
        return 1.0
    some = np.random.default_rng(seed).permutation(len(positions))[:4096]
    apart = KDTree(positions).query(positions[some], 2)[0][:, 1]
    return float(np.median(apart[apart > 0])) if (apart > 0).any() else 1.0


def _one_each(cells: Int[ndarray, "R 6"], off: Float64[ndarray, "R 3"], free: Bool[ndarray, " R"]) -> Int[ndarray, " n"]:
    """The `free` receiver nearest to the middle of every cell that has none yet."""
    key = np.zeros(len(cells), np.int64)
    for axis in cells.T:
        key = key * 1_000_003 + axis
    number = np.unique(key, return_inverse=True)[1].ravel()
    taken = np.bincount(number[~free], minlength=int(number.max()) + 1) > 0
    rows = np.flatnonzero(free & ~taken[number])
    rows = rows[np.argsort((off[rows] ** 2).sum(axis=1), kind="stable")]
    return np.sort(rows[np.unique(number[rows], return_index=True)[1]])


def nearest_of(
    positions: Float[ndarray, "R 3"],
    normals: Float[ndarray, "R 3"],
    rows: Int[ndarray, " n"],
    among: Int[ndarray, " m"],
    spacing: float,
    count: int,
) -> tuple[Int[ndarray, "n k"], Float64[ndarray, "n k"]]:
    """(the `count` receivers of `among`, or all, nearest to each of `rows` in place and normal; how far they are, m)."""
    from scipy.spatial import KDTree

    def placed(chosen: Int[ndarray, " n"]) -> Float64[ndarray, "n 6"]:
        return np.concatenate([positions[chosen], FACING * spacing * normals[chosen]], axis=1).astype(np.float64)

    apart, found = KDTree(placed(among)).query(placed(rows), min(count, len(among)), workers=-1)
    return among[found.reshape(len(rows), -1)], np.asarray(apart, np.float64).reshape(len(rows), -1)


def coarse_rows(tracer: ElementTracer, cubemap: Cubemap, rows: Int[ndarray, " n"], bits: Bits, changed: Bits | None = None) -> int:
    """Sample receivers `rows` of `bits` on the quarter grid and where it changes; how many elements that asked for.

    What is not sampled has the value of its window, whose samples agree. `changed` (R, B) gets the directions where they do not.
    """
    from scipy.sparse import csr_array

    window, coarse = cubemap.window(WINDOW), cubemap.coarse
    grid = np.flatnonzero(coarse)
    row, column = np.divmod(np.arange(window.size), window.shape[1])
    member = window[row, column]
    kept = coarse[member]
    sums = csr_array((np.ones(kept.sum(), np.float32), (member[kept], row[kept])), shape=(cubemap.count, cubemap.count))[grid]
    sums.data[:] = 1  # windows that fold over edges may have texels twice
    whole = np.asarray(sums.sum(axis=0)).ravel()
    asked = np.zeros(1, np.int64)
    for start in range(0, len(rows), ROWS):
        own = rows[start : start + ROWS]
        above = tracer.above(own)
        values = np.zeros((len(own), cubemap.count), bool)
        at, which = np.nonzero(above[:, grid])
        values[at, grid[which]] = tracer.seen(own[at], grid[which])
        seen = (sums.T @ values[:, grid].T.astype(np.float32)).T  # how many samples of each window see the light
        changes = (seen > 0.5) & (seen < whole - 0.5) & ~coarse
        values[:, ~coarse] = seen[:, ~coarse] > 0.5
        values &= above
        at, which = np.nonzero(changes & above)
        values[at, which] = tracer.seen(own[at], which)
        bits[own] = np.packbits(values, axis=1)
        if changed is not None:
            changed[own] = np.packbits(changes & above, axis=1)
        asked += len(own) * len(grid) + int(changes.sum())
    return int(asked[0])


@dataclass(frozen=True, eq=False)
class _Checkerboard:
    """Directions of which one color is decided first, those of the other, `between` (N,), then by the four around each."""

    between: Bool[ndarray, " N"]
    around: Int[ndarray, "N 4"]

    @staticmethod
    def of(cubemap: Cubemap) -> _Checkerboard:
        odd = np.arange(cubemap.side) % 2 == 1
        return _Checkerboard(np.tile((odd[:, None] != odd).ravel(), 6), cubemap.window(1)[:, [1, 3, 5, 7]])


def _agreed(
    tracer: ElementTracer, rows: Int[ndarray, " n"], near: Int[ndarray, "n k"], bits: Bits, board: _Checkerboard, tally: _Tally
) -> int:
    """Visibility of `rows` from what their neighbors agree on, then from the directions around; rays for the rest, which are counted."""
    starts = range(0, len(rows), ROWS)
    asked = [0] * len(starts)
    traced = np.empty((len(rows), tracer.row_bytes), np.uint8)

    def decide(number: int) -> None:
        part = slice(starts[number], starts[number] + ROWS)
        own = rows[part]
        above = tracer.above_bits(own)
        all_seen = all_hidden = np.full_like(above, 255)
        for k in range(near.shape[1]):
            theirs = bits[near[part, k]]
            all_seen, all_hidden = all_seen & theirs, all_hidden & ~theirs
        left = above & ~(all_seen | all_hidden)
        bits[own], traced[part] = _decided(tracer, own, above & all_seen, left, above & ~left, board)
        asked[number] = _ones(traced[part])

    each(decide, len(starts))
    tracer.rays += sum(asked)
    tally.add(tracer, rows, traced, bits)
    return sum(asked)


def _decided(
    tracer: ElementTracer, rows: Int[ndarray, " n"], seen: Bits, left: Bits, known: Bits, board: _Checkerboard
) -> tuple[Bits, Bits]:
    """(`seen` with the elements that are `left`, which of these were traced)."""
    size = len(board.between)
    values, is_known = (np.unpackbits(one, axis=1, count=size).ravel() for one in (seen, known))
    by_ray = np.zeros_like(values)

    def trace(row: Int[ndarray, " m"], column: Int[ndarray, " m"]) -> None:
        flat = row * size + column
        values[flat] = ~tracer.occluders.occluded(tracer.starts[rows[row]], tracer.directions[column], None)
        is_known[flat] = by_ray[flat] = 1

    byte = np.flatnonzero(left)
    place = np.flatnonzero(np.unpackbits(left.ravel()[byte]))
    row, within = np.divmod(byte[place >> 3], left.shape[1])
    column = 8 * within + (place & 7)
    between = board.between[column]
    trace(row[~between], column[~between])
    row, column = row[between], column[between]
    around = (row * size)[:, None] + board.around[column]
    there = is_known[around]
    count, lit = there.sum(axis=1), (values[around] & there).sum(axis=1)
    agree = (count >= AROUND) & ((lit == 0) | (lit == count))
    values[row[agree] * size + column[agree]] = lit[agree] > 0
    trace(row[~agree], column[~agree])
    return np.packbits(values.reshape(-1, size), axis=1), np.packbits(by_ray.reshape(-1, size), axis=1)


@dataclass(eq=False)
class _Tally:
    """Guessed elements that are traced all the same: how wrong they are, in cos^2, beside all that is seen."""

    rng: np.random.Generator
    tested: int
    wrong: float
    seen: float

    @staticmethod
    def empty(seed: int) -> _Tally:
        return _Tally(np.random.default_rng(seed), 0, 0.0, 0.0)

    def add(self, tracer: ElementTracer, rows: Int[ndarray, " n"], left: Bits, bits: Bits) -> None:
        """Trace one guessed element of TESTED, of one receiver of TESTED_ROWS."""
        own = self.rng.permutation(len(rows))[: max(1, len(rows) // TESTED_ROWS)]
        cosine = tracer.normals[rows[own]] @ tracer.directions.T
        told = np.unpackbits(bits[rows[own]], axis=1, count=len(tracer.directions)).view(bool)
        guessed = (cosine > 0) & ~np.unpackbits(left[own], axis=1, count=len(tracer.directions)).view(bool)
        place = np.flatnonzero(guessed)
        some = place[int(self.rng.integers(TESTED)) :: TESTED]
        row, column = np.divmod(some, len(tracer.directions))
        true = tracer.seen(rows[own][row], column)
        self.tested += len(row)
        share = len(rows) / len(own)
        self.wrong += share * TESTED * float((cosine[row, column] ** 2)[true != told[row, column]].sum())
        self.seen += share * float((cosine**2)[told].sum())

    def error(self) -> float:
        """Relative RMSE over all suns."""
        return float(np.sqrt(self.wrong / self.seen)) if self.seen else 0.0


def _ones(bits: Bits) -> int:
    return int(np.unpackbits(bits).sum()) if bits.size else 0
