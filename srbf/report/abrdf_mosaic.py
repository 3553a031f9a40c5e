"""ABRDF tiles before and after the fit: a grid over the whole image, and a few enlarged receivers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_array, vstack

from srbf.arrays import Float32
from srbf.evaluation.rate_distortion import name_of
from srbf.report.abrdf import (
    Projection,
    block_means,
    captured_tiles,
    fitted_tiles,
    grid_for,
    mosaic,
    rebin,
    single_receivers,
    tile_count,
    tile_directions,
)
from srbf.report.canvas import DPI, MARGIN, SOFT, Sheet, gain_text, shown
from srbf.report.subject import EXPOSURE_LEVEL, EXPOSURE_QUANTILE, Picture, Subject
from srbf.sphere import farthest_points

FILE = "abrdf_tiles.png"
TILES = {"hemisphere": 432, "sphere": 216}  # a sphere's tile is twice as wide
MAX_WIDTH, MAX_HEIGHT = 590, 640  # of a mosaic, in sheet units
GAP = 2  # pixels between tiles
LARGE_TILE = 144  # pixels of a single receiver's tile
CANDIDATES, PROBES = 128, 6  # receivers examined, and drawn


def abrdf_tiles(subject: Subject, folder: Path) -> Picture:
    """Write abrdf_tiles.png: captured and fitted tiles of blocks, and of the receivers that differ most [Wong2005, fig. 1, 4]."""
    asset, capture, covered = subject.asset, subject.capture, subject.covered
    sphere = asset.domain == "sphere"
    projection: Projection = "latitude-longitude" if sphere else "equal-area"
    grid = grid_for(asset.height, asset.width, TILES[asset.domain])
    blocks = block_means(capture.coverage(), grid)
    candidates = spread_receivers(covered, CANDIDATES)
    train = capture.indices("train") or list(range(len(capture.lights)))
    lights = capture.directions(train)
    responses = rebin(capture, train, csr_array(vstack([blocks, single_receivers(candidates, covered.size)])))
    gain = EXPOSURE_LEVEL / max(float(np.nanquantile(responses[:, : tile_count(blocks)], EXPOSURE_QUANTILE)), 1e-9)
    probe_responses = responses[:, tile_count(blocks) :]
    probes = farthest_points(
        np.append(probe_responses.transpose(1, 0, 2).reshape(len(candidates), -1), 0 * probe_responses[0, :, :1], 1), PROBES
    )
    squash = 2 if sphere else 1  # a latitude-longitude tile is twice as wide as high
    side = int(min(MAX_WIDTH * DPI / 100 / grid[1] - GAP, squash * (MAX_HEIGHT * DPI / 100 / grid[0] - GAP)))
    small, large = tile_directions(max(1, side // squash), projection), tile_directions(LARGE_TILE // squash, projection)
    before = mosaic(captured_tiles(responses[:, : tile_count(blocks)], lights, small), grid, GAP)
    after = mosaic(fitted_tiles(asset, blocks, small), grid, GAP)
    frame = mosaic(np.repeat(small[None], grid[0] * grid[1], axis=0).astype(np.float32), grid, GAP)
    probe_before = captured_tiles(probe_responses[:, probes], lights, large)
    probe_after = fitted_tiles(asset, single_receivers(candidates[probes], covered.size), large)

    wide, tall = before.shape[1] * 100 / DPI, before.shape[0] * 100 / DPI  # a pixel of the mosaic is a pixel of the file
    gap, top = 30, 104
    y = top + tall + 76
    columns = len(probes)
    cell = min(150.0, (2 * wide + gap - 74) / (columns + 1.6) - 6)
    cell_h = cell * probe_before.shape[1] / probe_before.shape[2]
    picture_w = min(2 * wide + gap - columns * (cell + 6) - 74, 2.2 * cell_h * asset.width / asset.height)
    picture_h = picture_w * asset.height / asset.width
    view = "latitude and longitude, +z on top" if sphere else "the hemisphere seen from +z, x right, y up, equal-area"
    sheet = Sheet(
        2 * MARGIN + 2 * wide + gap,
        y + max(2 * cell_h + 16, picture_h) + 30,
        "Rebinned: the response of each part of the image to every light",
        f"One tile per block of receivers ({grid[1]}×{grid[0]}); a tile shows {view}; {gain_text(gain)}.",
    )
    sheet.image(MARGIN, top, wide, tall, paper(before, gain, frame), label=f"captured: {len(train)} lights, the nearest one per pixel")
    sheet.image(MARGIN + wide + gap, top, wide, tall, paper(after, gain, frame), label=f"fitted: {name_of(asset)}")
    sheet.text(MARGIN, y - 28, "Single receivers whose responses differ most", size=10, va="center", weight="bold")
    brightest = int(np.argmax(subject.references[:, covered].mean(axis=(1, 2))))
    sheet.image(MARGIN, y, picture_w, picture_h, shown(subject.references[brightest], subject.gain, covered))
    x0 = MARGIN + picture_w + 74
    for n, probe in enumerate(probes):
        letter, flat = chr(ord("A") + n), int(candidates[probe])
        px, py = (flat % asset.width + 0.5) / asset.width, (flat // asset.width + 0.5) / asset.height
        badge = {"boxstyle": "circle,pad=0.2", "fc": "#262626", "ec": "white", "lw": 0.7}
        sheet.text(MARGIN + px * picture_w, y + py * picture_h, letter, size=8, color="white", ha="center", va="center", bbox=badge)
        x = x0 + n * (cell + 6)
        sheet.image(x, y, cell, cell_h, paper(probe_before[n], gain, large))
        sheet.image(x, y + cell_h + 12, cell, cell_h, paper(probe_after[n], gain, large))
        sheet.text(x + 2, y - 2, letter, size=9, weight="bold", va="bottom")
    for line, label in enumerate(("captured", "fitted")):
        sheet.text(x0 - 10, y + line * (cell_h + 12) + cell_h / 2, label, size=8.5, color=SOFT, ha="right", va="center")
    sheet.save(folder / FILE)
    caption = (
        f"The capture rebinned: each tile is the mean response of a block of receivers as a function on the {asset.domain} "
        "of light directions, before (nearest train light) and after "
        "the fit (negative sums black), and six single receivers enlarged (after figures 1 and 4). "
        f"Shown at {gain_text(gain)}."
    )
    return Picture(FILE, "ABRDF tiles", caption)


def paper(image: Float32[ndarray, "H W 3"], gain: float, frame: ndarray) -> ndarray:
    """Display values: white like the sheet where `frame` (H, W, 3) is NaN, gray where a tile has no covered receiver."""
    display = shown(image, gain)
    display[np.isnan(frame[..., 0])] = 1.0
    return display


def spread_receivers(covered: ndarray, count: int) -> ndarray:
    """Flat indices of at most `count` covered receivers on a regular lattice over the image, or of all if it misses them."""
    height, width = covered.shape
    rows, columns = grid_for(height, width, count)
    r = ((np.arange(rows) + 0.5) * height / rows).astype(np.int64)
    c = ((np.arange(columns) + 0.5) * width / columns).astype(np.int64)
    flat = (r[:, None] * width + c).ravel()
    flat = flat[covered.ravel()[flat]]
    return flat if len(flat) else np.flatnonzero(covered.ravel())[:count]
