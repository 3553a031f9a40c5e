"""Tables as bytes of a PNG: nothing is lost, and what does not fit is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbf.io.image import read_image, write_image
from srbf.io.packed_table import Packed, fits, pack, unpack


def table(largest: int, channels: int = 3) -> np.ndarray:
    """(40, 70, channels) half floats: multiples of another power of two in each row, of both signs and up to `largest`."""
    rng = np.random.default_rng(largest)
    multiples = rng.integers(-largest, largest + 1, (40, 70, channels))
    multiples[0], multiples[1, 0, 0] = 0, largest
    return (multiples * 2.0 ** rng.integers(-12, 3, (40, 1, 1))).astype(np.float16)


@pytest.mark.parametrize("packed", ["rows", "columns"])
@pytest.mark.parametrize(("largest", "rows"), [(1, 40), (127, 40), (1000, 80)])
@pytest.mark.parametrize("channels", [1, 3])
def test_tables_are_read_as_they_were(tmp_path: Path, packed: Packed, largest: int, rows: int, channels: int) -> None:
    stored = table(largest, channels)
    stored = stored if packed == "rows" else np.ascontiguousarray(stored.transpose(1, 0, 2))
    assert fits(stored, packed)
    write_image(tmp_path / "table.png", pack(stored, packed), "uint8", noisy=True)
    picture = np.round(read_image(tmp_path / "table.png", channels) * 255).astype(np.uint8)
    assert picture.shape == (rows, 71, channels)
    np.testing.assert_array_equal(unpack(picture, 40, packed), stored)


def test_what_has_no_steps_does_not_fit() -> None:
    rng = np.random.default_rng(0)
    assert not fits((10.0 ** rng.uniform(-4, 4, (3, 50, 1))).astype(np.float16), "rows")
    assert fits(np.zeros((3, 5, 1), np.float16), "rows"), "a row of zeros has any step"
    steps_by_row = table(100)
    assert fits(steps_by_row, "rows")


def test_noise_is_smaller_than_as_half_floats(tmp_path: Path) -> None:
    noise = (np.round(np.random.default_rng(1).laplace(size=(200, 900, 1)) * 4) * 2.0**-9).astype(np.float16)
    write_image(tmp_path / "halves.exr", noise, "half")
    write_image(tmp_path / "bytes.png", pack(noise, "rows"), "uint8", noisy=True)
    assert (tmp_path / "bytes.png").stat().st_size < 0.75 * (tmp_path / "halves.exr").stat().st_size
