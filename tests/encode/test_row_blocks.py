"""A fit by tiles of rows is the fit of the whole: to the bit where tiles begin at a piece of columns, else to float32's rounding."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.encode.row_blocks import fit_tiles, tiles_of
from srbf.errors import ImageError
from srbf.light_images import STRIP
from srbf.methods import FitRun
from srbf.methods.relighting_map import RelightingMap
from srbf.solve.streamed_product import TASK_COLUMNS

METHOD = RelightingMap(k=9, spread="mean", ridge=0.1, encoding="float")
ROUNDING = 1e-5  # of the largest coefficient: float32 sums over 30 lights in another order, times at most 1/(2 sqrt(ridge)) of the result
FLOAT64 = 1e-12


def backwards(work, items):
    """Machines of which the last is the fastest."""
    for i in reversed(range(len(items))):
        yield i, work(*items[i])


def noisy(height: int, width: int):
    rng = np.random.default_rng(4)
    return lambda direction: (rng.random((height, width, 3)) * (1 + direction[2])).astype(np.float16)


@pytest.mark.lengthy
@pytest.mark.parametrize(("height", "width", "threads", "exact"), [(512, 128, 1, True), (100, 77, 2, False)])
def test_tiles_give_the_fit_of_the_whole(make_capture, height: int, width: int, threads: int, exact: bool) -> None:
    capture = make_capture(noisy(height, width), lights=30, holdout=0, encoding="half")
    seen: list[tuple[int, int]] = []

    def tiles(capture: Capture, lights, matrix, ridge, progress):
        assert len(tiles_of(capture.height, capture.width, METHOD.k, threads)) > 1
        return fit_tiles(capture, lights, matrix, ridge, backwards, threads, lambda done, total: seen.append((done, total)))

    whole, parts = METHOD.encode(capture), METHOD.encode(capture, FitRun(solve_rows=tiles))
    assert seen[-1][0] == seen[-1][1] == len(seen) > 1
    if exact:
        np.testing.assert_array_equal(parts.coefficients(), whole.coefficients())
    scale = np.abs(whole.coefficients()).max()
    np.testing.assert_allclose(parts.coefficients(), whole.coefficients(), rtol=0, atol=ROUNDING * scale)
    fits = [asset.manifest["source"]["fit"] for asset in (whole, parts)]
    for name in ("condition_number", "rank", "relative_residual", "ridge"):
        assert fits[0][name] == pytest.approx(fits[1][name], rel=FLOAT64 if exact else ROUNDING)


def test_tiles_cover_every_row_once_and_keep_to_strips() -> None:
    for height, width, k, threads in [(1, 1, 1, 1), (512, 128, 9, 2), (4096, 4096, 25, 30), (1000, 777, 35, 8), (16, 5, 4, 100)]:
        tiles = tiles_of(height, width, k, threads)
        assert [begin for begin, _ in tiles] == [0, *(end for _, end in tiles[:-1])] and tiles[-1][1] == height
        assert all(begin % STRIP == 0 for begin, _ in tiles)
    assert all(begin * 4096 * 3 % TASK_COLUMNS == 0 for begin, _ in tiles_of(4096, 4096, 25, 30))


def test_indirect_and_kept_captures_stream_rows_too(make_capture) -> None:
    capture = make_capture(noisy(40, 6), lights=7, holdout=0, encoding="half")
    for opened in (capture, capture.load()):
        whole = np.concatenate([block.astype(np.float32) for _, block in opened.stream(range(7))])
        rows = np.concatenate([block.astype(np.float32) for _, block in opened.stream(range(7), rows=[(3, 20), (39, 40)])])
        np.testing.assert_array_equal(rows, whole.reshape(7, 40, 6, 3)[:, [*range(3, 20), 39]].reshape(7, -1, 3))


def test_an_error_of_a_tile_is_the_fits(make_capture) -> None:
    capture = make_capture(noisy(40, 6), lights=12, holdout=0, encoding="half")

    def failing(work, items):
        yield 0, work(*items[0])
        yield 1, ImageError("a worker died")

    with pytest.raises(ImageError, match="a worker died"):
        METHOD.encode(
            capture, FitRun(solve_rows=lambda *given: partial(fit_tiles, distribute=failing, threads=1)(*given[:4], progress=given[4]))
        )
