"""TIFF of several pages and raw files: the largest image that is not reduced, and raw ones in one fixed way."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from picture_files import asymmetrical, profile

from srbf.capture import Capture
from srbf.errors import MissingLibraryError
from srbf.importing.photographs import LightListImport
from srbf.importing.pictures import read_picture

FULL, THUMBNAIL = asymmetrical(48, 72), np.full((12, 18, 3), 255, np.uint8)
D65_TO_CAMERA = np.array([[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]])


def _pages(path: Path, *pages: tuple[np.ndarray, dict[str, Any]]) -> Path:
    with tifffile.TiffWriter(path) as file:
        for pixels, options in pages:
            file.write(pixels, **{"photometric": "rgb", "metadata": None, **options})
    return path


def _same(path: Path) -> None:
    picture = read_picture(path, "linear")
    np.testing.assert_allclose(picture.pixels, FULL / 255, atol=1e-6)
    assert any("pages" in note for note in picture.notes)


@pytest.mark.parametrize("suffix", ["tif", "dng", "nef"])
@pytest.mark.parametrize("compression", [None, "lzw", "deflate"])
def test_a_thumbnail_whose_sub_page_is_the_picture(tmp_path: Path, suffix: str, compression: str | None) -> None:
    first = (THUMBNAIL, {"subfiletype": 1, "subifds": 1})
    _same(_pages(tmp_path / f"a.{suffix}", first, (FULL, {"subfiletype": 0, "compression": compression})))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_pages_one_after_the_other(tmp_path: Path, order: tuple[int, ...]) -> None:
    pages = [(FULL, {}), (THUMBNAIL, {"subfiletype": 1}), (THUMBNAIL, {})]
    _same(_pages(tmp_path / "a.tif", *(pages[i] for i in order)))


def test_larger_pages_that_are_reduced_or_masks_are_left(tmp_path: Path) -> None:
    larger = np.zeros((96, 144, 3), np.uint8)
    mask = (larger[:, :, 0] > 0, {"subfiletype": 4, "photometric": "minisblack"})
    _same(_pages(tmp_path / "a.tif", (larger, {"subfiletype": 1}), (FULL, {}), mask))


def test_a_picture_with_its_pyramid(tmp_path: Path) -> None:
    levels = [(FULL[::2, ::2], {"subfiletype": 1, "tile": (16, 16)}), (FULL[::4, ::4], {"subfiletype": 1, "tile": (16, 16)})]
    _same(_pages(tmp_path / "a.tif", (FULL, {"subifds": 2, "tile": (16, 16)}), *levels))


@pytest.mark.parametrize("planar", ["contig", "separate"])
@pytest.mark.parametrize("dtype", ["u1", "u2", "u4", "f2", "f4", "f8"])
def test_samples_of_every_kind(tmp_path: Path, planar: str, dtype: str) -> None:
    top = 1 if dtype[0] == "f" else np.iinfo(dtype).max
    values = (FULL / 255.0 * top).round(0 if top > 1 else 9).astype(dtype)
    stored = values if planar == "contig" else np.ascontiguousarray(values.transpose(2, 0, 1))
    tifffile.imwrite(
        tmp_path / "a.tif", stored, photometric="rgb", planarconfig=planar, metadata=None, compression="deflate", predictor=True
    )
    picture = read_picture(tmp_path / "a.tif", "linear")
    np.testing.assert_allclose(picture.pixels, values / float(top), atol=1e-6)
    assert picture.bits == min(32, 8 * np.dtype(dtype).itemsize)


def test_palettes_one_bit_and_alpha(tmp_path: Path) -> None:
    table = np.arange(3 * 256, dtype=np.uint16).reshape(3, 256) * 85
    index = asymmetrical()[:, :, 0]
    tifffile.imwrite(tmp_path / "a.tif", index, photometric="palette", colormap=table, metadata=None)
    np.testing.assert_allclose(read_picture(tmp_path / "a.tif", "linear").pixels, table.T[index] / 65535, atol=1e-6)
    tifffile.imwrite(tmp_path / "b.tif", index > 90, photometric="minisblack", metadata=None)
    np.testing.assert_array_equal(read_picture(tmp_path / "b.tif", "linear").pixels[:, :, 1], index > 90)
    with_alpha = np.dstack([FULL, np.full(FULL.shape[:2], 7, np.uint8)])
    tifffile.imwrite(tmp_path / "c.tif", with_alpha, photometric="rgb", extrasamples=["unassalpha"], metadata=None)
    np.testing.assert_allclose(read_picture(tmp_path / "c.tif", "linear").pixels, FULL / 255, atol=1e-6)
    from PIL import Image

    Image.fromarray(FULL).convert("P", palette=Image.Palette.ADAPTIVE, colors=200).save(tmp_path / "p.png")
    shown = np.asarray(Image.open(tmp_path / "p.png").convert("RGB"))
    np.testing.assert_allclose(read_picture(tmp_path / "p.png", "linear").pixels, shown / 255, atol=1e-6)


def test_turn_and_profile_of_the_first_page_hold_for_its_sub_page(tmp_path: Path) -> None:
    primaries = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
    first = {"subfiletype": 1, "subifds": 1, "iccprofile": profile(primaries, 1.8), "extratags": [(274, "H", 1, 6, True)]}
    picture = read_picture(_pages(tmp_path / "a.tif", (THUMBNAIL, first), (FULL, {})), "srgb")
    np.testing.assert_allclose(picture.pixels, np.rot90((FULL / 255.0) ** 1.8, -1), atol=1e-3)


def _rational(values: np.ndarray) -> tuple[int, ...]:
    return tuple(int(v) for value in np.ravel(values) for v in (round(value * 10000), 10000))


def _dng(path: Path, levels: tuple[float, float, float], neutral: tuple[float, float, float] = (1, 1, 1), orientation: int = 1) -> Path:
    """An RGGB mosaic of 72 x 48 whose camera has Rec.709's primaries and is neutral under D65, with a thumbnail before it."""
    mosaic = np.zeros((48, 72), np.uint16)
    for (row, column), level in zip(((0, 0), (0, 1), (1, 0), (1, 1)), (levels[0], levels[1], levels[1], levels[2]), strict=True):
        mosaic[row::2, column::2] = round(level * 65535)
    camera = [
        (274, "H", 1, orientation, True),
        (50706, "B", 4, (1, 4, 0, 0), True),
        (50708, "s", 0, "Camera of a test", True),
        (50721, 10, 9, _rational(D65_TO_CAMERA), True),
        (50728, 5, 3, _rational(np.array(neutral)), True),
        (50778, "H", 1, 21, True),
    ]
    sensor = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, (0, 1, 1, 2), True), (50714, "H", 1, 0, True), (50717, "H", 1, 65535, True)]
    return _pages(
        path,
        (THUMBNAIL, {"subfiletype": 1, "subifds": 1, "extratags": camera}),
        (mosaic, {"photometric": 32803, "subfiletype": 0, "extratags": sensor}),
    )


@pytest.mark.parametrize("name", ["a.dng", "a.tif"])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_a_mosaic_is_developed_linearly(tmp_path: Path, name: str, transfer: str) -> None:
    pytest.importorskip("rawpy")
    picture = read_picture(_dng(tmp_path / name, (0.12, 0.25, 0.06)), transfer)
    assert picture.pixels.shape == (48, 72, 3) and picture.bits == 16
    np.testing.assert_allclose(picture.pixels[8:-8, 8:-8], np.broadcast_to((0.12, 0.25, 0.06), (32, 56, 3)), atol=0.001)
    assert "daylight" in picture.notes[0]


def test_a_set_of_raw_files_has_one_scale_and_white_balance(tmp_path: Path) -> None:
    """A camera's automatic white balance and a brighter picture change neither: twice the light gives twice the values."""
    pytest.importorskip("rawpy")
    one = read_picture(_dng(tmp_path / "1.dng", (0.1, 0.2, 0.05)), "linear").pixels[20, 20]
    two = read_picture(_dng(tmp_path / "2.dng", (0.2, 0.4, 0.1), neutral=(0.5, 1, 0.7)), "linear").pixels[20, 20]
    np.testing.assert_allclose(two, 2 * one, rtol=0.002)


def test_a_raw_file_is_turned(tmp_path: Path) -> None:
    pytest.importorskip("rawpy")
    picture = read_picture(_dng(tmp_path / "a.dng", (0.1, 0.2, 0.05), orientation=6), "linear")
    assert picture.pixels.shape == (72, 48, 3) and any("EXIF" in note for note in picture.notes)


def test_without_rawpy_a_raw_file_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rawpy", None)
    with pytest.raises(MissingLibraryError, match=r"a\.dng.*srbf\[raw\]"):
        read_picture(_dng(tmp_path / "a.dng", (0.1, 0.2, 0.05)), "linear")
    (tmp_path / "b.cr3").write_bytes(b"\0\0\0\x18ftypcrx " + bytes(100))
    with pytest.raises(MissingLibraryError, match=r"b\.cr3.*srbf\[raw\]"):
        read_picture(tmp_path / "b.cr3", "linear")


def test_a_set_of_raw_files_becomes_a_capture(tmp_path: Path) -> None:
    pytest.importorskip("rawpy")
    for i in range(3):
        _dng(tmp_path / f"{i}.dng", (0.1 * (i + 1), 0.2, 0.05))
    (tmp_path / "l.lp").write_text("3\n" + "".join(f"{i}.dng {i} 0 4\n" for i in range(3)))
    said: list[str] = []
    LightListImport(tmp_path / "l.lp", "linear").write(tmp_path / "capture", say=said.append)
    capture = Capture.open(tmp_path / "capture")
    np.testing.assert_allclose([capture.image(i)[20, 20, 0] for i in range(3)], [0.1, 0.2, 0.3], atol=0.001)
    assert said == ["developed 3 images from raw by LibRaw: linear, white balance of daylight, no automatic brightness"]


@pytest.mark.parametrize("packing", ["group3", "group4", "tiff_ccitt", "packbits", "tiff_lzw"])
def test_one_bit_in_every_packing(tmp_path: Path, packing: str) -> None:
    from PIL import Image

    bits = asymmetrical(16, 32)[:, :, 0] > 90
    Image.fromarray(bits).save(tmp_path / "a.tif", compression=packing)
    np.testing.assert_array_equal(read_picture(tmp_path / "a.tif", "linear").pixels, np.repeat(bits[:, :, None], 3, axis=2))


def test_jpeg_in_a_tiff(tmp_path: Path) -> None:
    from PIL import Image

    Image.fromarray(FULL).save(tmp_path / "a.tif", compression="jpeg", quality=95)
    stored = np.asarray(Image.open(tmp_path / "a.tif"))
    np.testing.assert_allclose(read_picture(tmp_path / "a.tif", "linear").pixels, stored / 255, atol=2.5 / 255)  # two decoders
