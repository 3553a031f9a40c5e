"""What is no picture, or a damaged one, ends in one line that names the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tifffile
from picture_files import asymmetrical, encoded, exr, png, rgb
from PIL import Image

from srbf.errors import ImageError
from srbf.importing.photographs import LightListImport
from srbf.importing.pictures import read_picture

NOISE = np.random.default_rng(5).integers(0, 256, (60, 80, 3), dtype=np.uint8)


def _tiff(path: Path) -> None:
    tifffile.imwrite(path, NOISE, photometric="rgb", metadata=None, rowsperstrip=8)


def _packed(path: Path) -> None:
    tifffile.imwrite(path, NOISE, photometric="rgb", metadata=None, rowsperstrip=8, compression="deflate")


def _fax(path: Path) -> None:
    Image.fromarray(NOISE[:, :, 0] > 99).save(path, compression="group4")


WHOLE: dict[str, Callable[[Path], object]] = {
    "a.jpg": lambda path: path.write_bytes(encoded(NOISE, "JPEG")),
    "progressive.jpg": lambda path: path.write_bytes(encoded(NOISE, "JPEG", progressive=True)),
    "a.png": lambda path: path.write_bytes(png(NOISE)),
    "wide.png": lambda path: path.write_bytes(png(NOISE.astype(np.uint16) * 257)),
    "a.tif": _tiff,
    "packed.tif": _packed,
    "fax.tif": _fax,
    "a.exr": lambda path: exr(path, {"channels": rgb("", (1, 2, 3), (60, 80))}),
}


@pytest.mark.parametrize("name", WHOLE)
@pytest.mark.parametrize("kept", [0.2, 0.5, 0.9])
def test_a_file_cut_short_is_refused(tmp_path: Path, name: str, kept: float) -> None:
    path = tmp_path / name
    WHOLE[name](path)
    assert read_picture(path, "linear").pixels.shape == (60, 80, 3)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * kept)])
    _refused(path)


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif", "exr", "bmp", "nef"])
@pytest.mark.parametrize(
    "content", [b"", b"\0", b"This is a text, and no picture at all.\n" * 20, b"<svg xmlns='http://www.w3.org/2000/svg'/>"]
)
def test_what_is_no_picture_is_refused(tmp_path: Path, suffix: str, content: bytes) -> None:
    (tmp_path / f"a.{suffix}").write_bytes(content)
    _refused(tmp_path / f"a.{suffix}")


def _refused(path: Path) -> None:
    with pytest.raises(ImageError, match=path.name.replace(".", r"\.")) as error:
        read_picture(path, "linear")
    assert "\n" not in str(error.value) and len(str(error.value)) < 400
    (path.parent / "l.lp").write_text(f"1\n{path.name} 0 0 1\n")
    with pytest.raises(ImageError):
        LightListImport(path.parent / "l.lp", "srgb").write(path.parent / "capture")
    assert not (path.parent / "capture").exists()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_named(tmp_path: Path, value: float) -> None:
    pixels = np.ones((5, 7, 3), np.float32)
    pixels[2, 3, 1] = value
    tifffile.imwrite(tmp_path / "a.tif", pixels, photometric="rgb", metadata=None)
    with pytest.raises(ImageError, match=r"a\.tif.*1 texels, first at row 2, column 3"):
        read_picture(tmp_path / "a.tif", "srgb")


def test_a_wrong_suffix_is_no_matter(tmp_path: Path) -> None:
    for name, source in (("tiff.jpg", "a.tif"), ("jpeg.tif", "a.jpg"), ("exr.png", "a.exr"), ("png.jpg", "a.png")):
        WHOLE[source](tmp_path / source)
        (tmp_path / name).write_bytes((tmp_path / source).read_bytes())
        np.testing.assert_array_equal(read_picture(tmp_path / name, "linear").pixels, read_picture(tmp_path / source, "linear").pixels)


def test_damaged_bytes_never_end_otherwise(tmp_path: Path) -> None:
    """Bytes changed at random give a picture or an ImageError, of every kind."""
    rng = np.random.default_rng(11)
    for name, write in WHOLE.items():
        write(tmp_path / name)
        whole = np.frombuffer((tmp_path / name).read_bytes(), np.uint8)
        for _ in range(12):
            broken = whole.copy()
            at = rng.integers(8, min(len(broken), 600), 4)
            broken[at] = rng.integers(0, 256, 4)
            (tmp_path / name).write_bytes(broken.tobytes())
            try:
                read_picture(tmp_path / name, "linear")
            except ImageError as error:
                assert name in str(error)


def test_asymmetry() -> None:
    """The test image of the orientations differs in all eight of them."""
    square = asymmetrical(8, 8)
    turns = [np.rot90(flipped, i) for flipped in (square, np.fliplr(square)) for i in range(4)]
    assert sum(np.array_equal(square, turn) for turn in turns) == 1
