"""Rebinning: what a tile shows at a direction, which way up it is, and what a block of receivers averages to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array

import srbf.capture
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.io import files
from srbf.io.image import write_image
from srbf.methods import responses as asset_responses
from srbf.methods.relighting_map import RelightingMap
from srbf.report.abrdf import (
    block_means,
    captured_tiles,
    disc_points,
    fitted_tiles,
    grid_for,
    mosaic,
    rebin,
    single_receivers,
    tile_directions,
)
from srbf.sphere import normalize, point_set

LIGHTS = 400
HEIGHT, WIDTH = 6, 9
HALF_STEP = 2.0**-11  # relative rounding of values up to 1 to half floats
SPACING = np.sqrt(2 * np.pi / LIGHTS)  # side of the solid angle that one of the lights has to itself on the hemisphere
COVERING = 1.5 * SPACING  # no direction is farther than this from a Hammersley light: gaps reach 1.3 spacings at this count
SINGLE = 1e-5  # of sums of products in float32, relative to the sum of magnitudes


def normals() -> np.ndarray:
    """Receivers that face left to right with the column and down to up with the row from the bottom; all upwards."""
    y, x = np.meshgrid(np.linspace(0.8, -0.8, HEIGHT), np.linspace(-0.8, 0.8, WIDTH), indexing="ij")
    return normalize(np.stack([x, y, 0 * x + 1], axis=2))


@pytest.fixture(scope="module")
def lambert(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    """Receivers with the response max(0, n . L), without shadows."""
    folder: Path = tmp_path_factory.mktemp("lambert")
    (folder / "lights").mkdir()
    lights = []
    for i, direction in enumerate(point_set("hammersley", LIGHTS, "hemisphere")):
        response = np.repeat(np.maximum(normals() @ direction, 0)[..., None], 3, axis=2) * [1, 0.5, 0.25]
        write_image(folder / f"lights/{i}.exr", response.astype(np.float32), "half")
        lights.append({"kind": "directional", "direction": direction.tolist(), "role": "train", "file": f"lights/{i}.exr"})
    manifest = {"format": "srbf-capture", "version": 1, "quantity": "radiance", "width": WIDTH, "height": HEIGHT, "lights": lights}
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)


def every_receiver() -> csr_array:
    return block_means(np.ones((HEIGHT, WIDTH), np.float32), (HEIGHT, WIDTH))


@pytest.mark.lengthy
@pytest.mark.parametrize("projection", ["equal-area", "orthographic", "latitude-longitude"])
def test_lambert_tiles_are_the_cosine(lambert: Capture, projection: str) -> None:
    directions = tile_directions(20, projection)  # type: ignore[arg-type]
    responses = rebin(lambert, range(LIGHTS), every_receiver())
    tiles = captured_tiles(responses, lambert.directions(), directions)
    above = directions[..., 2] > 0
    expected = np.maximum(normals().reshape(-1, 3) @ directions[above].T, 0)
    assert np.abs(tiles[:, above, 0] - expected).max() < COVERING + HALF_STEP
    assert np.abs(tiles[:, above, 0] - expected).mean() < 0.5 * SPACING  # a square's points lie 0.38 sides from its center on average
    assert np.array_equal(np.isnan(tiles[0, ..., 0]), np.isnan(directions[..., 0]))


def test_a_pixel_holds_the_nearest_light_exactly(lambert: Capture) -> None:
    directions = tile_directions(15, "equal-area")
    responses = rebin(lambert, range(LIGHTS), every_receiver())
    tiles = captured_tiles(responses, lambert.directions(), directions)
    for row, column in ((7, 7), (2, 9), (11, 3)):
        nearest = int(np.argmin([np.arccos(min(1.0, float(d @ directions[row, column]))) for d in lambert.directions()]))
        assert np.array_equal(tiles[:, row, column], lambert.image(nearest).reshape(-1, 3))


@pytest.mark.parametrize("projection", ["equal-area", "orthographic"])
def test_tiles_have_x_to_the_right_and_y_up(lambert: Capture, projection: str) -> None:
    directions = tile_directions(16, projection)  # type: ignore[arg-type]
    tiles = captured_tiles(rebin(lambert, range(LIGHTS), every_receiver()), lambert.directions(), directions)[..., 0]
    tiles = tiles.reshape(HEIGHT, WIDTH, 16, 16)
    faces_right, faces_up = tiles[HEIGHT // 2, -1], tiles[0, WIDTH // 2]
    assert np.nanmean(faces_right[:, 8:]) > 1.5 * np.nanmean(faces_right[:, :8])
    assert np.nanmean(faces_up[:8]) > 1.5 * np.nanmean(faces_up[8:])
    assert directions[0, 8, 1] > 0 > directions[-1, 8, 1] and directions[8, -1, 0] > 0 > directions[8, 0, 0]


def test_latitude_longitude_tiles_are_laid_out_as_environments() -> None:
    directions = tile_directions(64, "latitude-longitude")
    assert directions.shape == (64, 128, 3)
    assert directions[0, :, 2].min() > 0.99 and directions[-1, :, 2].max() < -0.99
    middle = directions[32]
    assert middle[63, 0] > 0.99 and middle[31, 1] > 0.99 and middle[95, 1] < -0.99  # u = 1/2: +x, 1/4: +y, 3/4: -y


def test_discs_hold_unit_directions_and_equal_areas() -> None:
    for projection in ("equal-area", "orthographic"):
        directions = tile_directions(101, projection)  # type: ignore[arg-type]
        inside = np.isfinite(directions[..., 0])
        assert np.allclose(np.linalg.norm(directions[inside], axis=1), 1) and (directions[inside][:, 2] >= 0).all()
        assert np.allclose(directions[50, 50], [0, 0, 1])
    flat = tile_directions(101, "equal-area")
    z = flat[np.isfinite(flat[..., 0])][:, 2]
    assert abs(z.mean() - 0.5) < 0.01  # z is uniform on the hemisphere (Archimedes); 7,800 pixels, jagged at the rim


def test_disc_points_invert_the_equal_area_disc() -> None:
    directions = tile_directions(8, "equal-area")
    row, column = np.nonzero(np.isfinite(directions[..., 0]))
    points = disc_points(directions[row, column])
    assert np.allclose(points, np.stack([(column + 0.5) / 4 - 1, 1 - (row + 0.5) / 4], axis=1))
    assert np.allclose(disc_points(directions[row, column] * [1, 1, -1]), points)


@pytest.mark.parametrize("grid", [(1, 1), (2, 3), (4, 5), (6, 9)])
def test_blocks_average_their_covered_receivers(grid: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    image = rng.random((HEIGHT, WIDTH, 3)).astype(np.float32)
    coverage = rng.choice([0, 0.3, 0.5, 1], (HEIGHT, WIDTH)).astype(np.float32)
    means = (block_means(coverage, grid) @ image.reshape(-1, 3)).reshape(*grid, 3)
    share = np.where(coverage >= 0.5, coverage, 0)
    for i in range(grid[0]):
        for j in range(grid[1]):
            rows = [r for r in range(HEIGHT) if r * grid[0] // HEIGHT == i]
            columns = [c for c in range(WIDTH) if c * grid[1] // WIDTH == j]
            weights = share[np.ix_(rows, columns)]
            expected = (
                np.zeros(3) if weights.sum() == 0 else (image[np.ix_(rows, columns)] * weights[..., None]).sum((0, 1)) / weights.sum()
            )
            assert np.allclose(means[i, j], expected, atol=SINGLE)


@pytest.mark.slow
def test_a_tile_without_receivers_is_nan_before_and_after(lambert: Capture) -> None:
    coverage = np.ones((HEIGHT, WIDTH), np.float32)
    coverage[:3, :3] = 0
    blocks = block_means(coverage, (2, 3))
    responses = rebin(lambert, range(40), blocks)
    fitted = fitted_tiles(RelightingMap(k=9).encode(lambert), blocks, tile_directions(5, "equal-area"))
    for values in (responses.transpose(1, 0, 2), fitted[:, 2, 2]):
        assert np.isnan(values[0]).all() and np.isfinite(values[1:]).all()


def test_rebinning_does_not_depend_on_the_blocks_it_is_read_in(lambert: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    tiles = block_means(np.ones((HEIGHT, WIDTH), np.float32), (2, 2))
    whole = rebin(lambert, range(LIGHTS), tiles)
    monkeypatch.setattr(srbf.light_images, "BLOCK_BYTES", 7 * HEIGHT * WIDTH * 12)
    assert np.array_equal(rebin(lambert, range(LIGHTS), tiles), whole)


@pytest.mark.slow
def test_fitted_tiles_are_what_relighting_gives(lambert: Capture) -> None:
    asset = RelightingMap(k=16).encode(lambert)
    directions = tile_directions(7, "equal-area")
    chosen = [0, 20, HEIGHT * WIDTH - 1]
    tiles = fitted_tiles(asset, single_receivers(chosen, HEIGHT * WIDTH), directions)
    inside = np.isfinite(directions[..., 0])
    relit = asset_responses(asset, directions[inside]).reshape(inside.sum(), -1, 3)[:, chosen]
    magnitude = np.abs(asset.coefficients()).sum(axis=0).max()  # bounds sum |c R|, since R <= 1
    assert np.abs(tiles[:, inside] - relit.transpose(1, 0, 2)).max() < SINGLE * magnitude
    assert np.isnan(tiles[:, ~inside]).all()


def test_a_mosaic_lays_tiles_where_their_blocks_are() -> None:
    tiles = np.arange(6, dtype=np.float32)[:, None, None, None] + np.zeros((6, 2, 3, 3), np.float32)
    image = mosaic(tiles, (2, 3), gap=1)
    assert image.shape == (5, 11, 3)
    assert (image[:2, 8:] == 2).all() and (image[3:, :3] == 3).all() and np.isnan(image[2]).all() and np.isnan(image[:, 3]).all()


def test_a_grid_keeps_blocks_square_and_within_the_image() -> None:
    assert grid_for(300, 400, 432) == (18, 24)
    assert grid_for(2, 1000, 432) == (1, 465)
    assert grid_for(1, 1) == (1, 1)


def test_impossible_tiles_are_refused() -> None:
    with pytest.raises(InputError, match="1 pixel"):
        tile_directions(0, "equal-area")
    with pytest.raises((InputError, TypeError), match="projection"):  # TypeError where annotations are checked at run time
        tile_directions(4, "mercator")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="grid of 1 to 2 rows"):
        block_means(np.ones((2, 2), np.float32), (3, 1))
