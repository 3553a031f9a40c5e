"""Images as stored and as widened, and many written at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbf.errors import ImageError
from srbf.io.files import WriteError
from srbf.io.image import holds_half, read_image, read_stored, require_finite, write_image, write_images


def test_halves_are_read_as_they_are_stored(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).normal(size=(5, 7, 3)).astype(np.float32)
    write_image(tmp_path / "half.exr", pixels, "half")
    write_image(tmp_path / "float.exr", pixels, "float")
    write_image(tmp_path / "byte.png", np.full((5, 7, 3), 51, np.uint8), "uint8")
    assert [holds_half(tmp_path / name) for name in ("half.exr", "float.exr", "byte.png", "none.exr")] == [True, False, False, False]
    half = read_stored(tmp_path / "half.exr", 3)
    assert half.dtype == np.float16
    np.testing.assert_array_equal(half, pixels.astype(np.float16))
    np.testing.assert_array_equal(read_image(tmp_path / "half.exr", 3), pixels.astype(np.float16).astype(np.float32))
    np.testing.assert_array_equal(read_stored(tmp_path / "float.exr", 3), pixels)
    np.testing.assert_allclose(read_stored(tmp_path / "byte.png", 3), 0.2, rtol=1e-6)


def test_non_finite_halves_are_returned_and_refused_by_name(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    pixels = np.ones((4, 5, 3), np.float16)
    pixels[2, 3] = [np.inf, 1, np.nan]
    target = oiio.ImageOutput.create(str(tmp_path / "bad.exr"))
    assert target.open(str(tmp_path / "bad.exr"), oiio.ImageSpec(5, 4, 3, oiio.HALF)) and target.write_image(pixels) and target.close()
    np.testing.assert_array_equal(read_image(tmp_path / "bad.exr"), pixels.astype(np.float32))
    for read in (read_stored, read_image):
        with pytest.raises(ImageError, match=r"bad\.exr.*1 texels, first at row 2, column 3"):
            require_finite(read(tmp_path / "bad.exr", 3), tmp_path / "bad.exr")


def test_many_written_at_once_are_the_same_files(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    images = [rng.normal(size=(9, 8, 3)).astype(np.float32) for _ in range(6)]
    (tmp_path / "one").mkdir()
    (tmp_path / "all").mkdir()
    for i, pixels in enumerate(images):
        write_image(tmp_path / f"one/{i}.exr", pixels, "half")
    write_images([(tmp_path / f"all/{i}.exr", pixels, "half", False) for i, pixels in enumerate(images)])
    for i in range(6):
        assert (tmp_path / f"one/{i}.exr").read_bytes() == (tmp_path / f"all/{i}.exr").read_bytes()
    assert len(list((tmp_path / "all").iterdir())) == 6


def test_the_first_failure_of_many_is_raised(tmp_path: Path) -> None:
    good = np.ones((2, 2, 3), np.float32)
    with pytest.raises((ImageError, WriteError), match=r"1\.exr"):
        write_images(
            [
                (tmp_path / "0.exr", good, "half", False),
                (tmp_path / "1.exr", good * np.inf, "half", False),
                (tmp_path / "2.exr", good, "half", False),
            ]
        )
    assert (tmp_path / "0.exr").is_file() and (tmp_path / "2.exr").is_file() and not (tmp_path / "1.exr").exists()


def test_four_channels_of_bytes_come_back_as_they_were(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (7, 9, 4), dtype=np.uint8)
    pixels[0, :, 3] = 0
    write_image(tmp_path / "planes.png", pixels, "uint8")
    assert np.array_equal(np.round(read_image(tmp_path / "planes.png", 4) * 255).astype(np.uint8), pixels)
