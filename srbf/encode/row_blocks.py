"""A fit of a large capture by tiles of rows, which are independent once the small matrix is known, on this or on other machines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import gcd, lcm
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.capture import Capture
from srbf.errors import SrbfError
from srbf.light_images import STRIP
from srbf.solve.least_squares import LeastSquaresReport, StreamedLeastSquares
from srbf.solve.streamed_product import TASK_COLUMNS

TILES_PER_THREAD = 3  # so that a slow machine delays few tiles
RESULT_BYTES = 128 << 20  # of a tile's maps, which are sent over the network

# Runs work(*items[i]) on some machine and yields (i, its result or its error), in any order.
Distribute = Callable[[Callable[..., Any], Sequence[tuple]], Iterator[tuple[int, Any]]]

# (capture, train lights, matrix (L, K), ridge, progress) -> (maps (K, 3 P), report): `fit_tiles` with its machines
SolveRows = Callable[[Capture, list[int], ndarray, float, Callable[[int, int], None]], tuple[ndarray, LeastSquaresReport]]


@dataclass(frozen=True)
class TileFit:
    """Maps of the texels of some rows, and their energies for the report: |B|^2, and that of each row of U^T B."""

    coefficients: Float32[ndarray, "K M"]
    energy: float
    row_energies: Float64[ndarray, " K"]


def fit_rows(capture: Capture, lights: list[int], matrix: ndarray, ridge: float, begin: int, end: int) -> TileFit:
    """`StreamedLeastSquares` of rows begin … end - 1, fed by the same blocks of lights as a fit of all rows."""
    solve = StreamedLeastSquares(matrix, ridge)
    for first, block in capture.stream(lights, rows=[(begin, end)]):
        solve.add(first, block)
    return TileFit(solve.solve(), *solve.energies())


def fit_tiles(
    capture: Capture,
    lights: list[int],
    matrix: Float64[ndarray, "L K"],
    ridge: float,
    distribute: Distribute,
    threads: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[Float32[ndarray, "K M"], LeastSquaresReport]:
    """The maps of all tiles, assembled, and their report.

    If tiles can start at the pieces of columns of `StreamedProduct` (every width that is a multiple of a large enough power of two) and
    the machines' matrix products are the same, the maps are bit-identical to those of a fit of all rows. Otherwise another kernel may
    compute a column's sum, and the maps differ by the float32 rounding of a sum over lights.
    """
    capture = replace(capture, folder=capture.folder.resolve())
    tiles = tiles_of(capture.height, capture.width, matrix.shape[1], threads)
    width = capture.width * 3
    coefficients = np.empty((matrix.shape[1], capture.height * width), np.float32)
    energy, row_energies = np.zeros(len(tiles)), np.zeros((len(tiles), min(matrix.shape)))
    for done, (i, tile) in enumerate(distribute(fit_rows, [(capture, lights, matrix, ridge, *rows) for rows in tiles])):
        if isinstance(tile, SrbfError):
            raise tile
        begin, end = tiles[i]
        coefficients[:, begin * width : end * width] = tile.coefficients
        energy[i], row_energies[i] = tile.energy, tile.row_energies
        progress(done + 1, len(tiles))
    report = StreamedLeastSquares(matrix, ridge).report((float(energy.sum()), row_energies.sum(axis=0)))
    return coefficients, report


def tiles_of(height: int, width: int, k: int, threads: int) -> list[tuple[int, int]]:
    """(begin, end) of tiles of rows, in order: whole strips of the files, and whole pieces of columns if at least two fit."""
    unit = lcm(STRIP, TASK_COLUMNS // gcd(TASK_COLUMNS, 3 * width))
    if 2 * unit > height:
        unit = STRIP
    wanted = min(height / (TILES_PER_THREAD * max(1, threads)), RESULT_BYTES / (12 * k * width))
    rows = unit * max(1, round(wanted / unit))
    return [(begin, min(begin + rows, height)) for begin in range(0, height, rows)]
