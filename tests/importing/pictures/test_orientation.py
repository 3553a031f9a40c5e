"""EXIF's eight orientations in every kind of file, against numpy's own turns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tifffile
from picture_files import asymmetrical, encoded, exif, png

from srbf.capture import Capture
from srbf.importing.photographs import LightListImport
from srbf.importing.pictures import read_picture

SEEN = {  # what is to be seen, of what is stored [EXIF 2.32, tag 274: where row 0 and column 0 are]
    1: lambda a: a,
    2: np.fliplr,
    3: lambda a: np.rot90(a, 2),
    4: np.flipud,
    5: lambda a: np.transpose(a, (1, 0, 2)),
    6: lambda a: np.rot90(a, -1),
    7: lambda a: np.rot90(np.transpose(a, (1, 0, 2)), 2),
    8: lambda a: np.rot90(a, 1),
}
STORED = {  # their inverses
    **SEEN,
    6: SEEN[8],
    8: SEEN[6],
}


def _file(folder: Path, kind: str, stored: np.ndarray, orientation: int) -> Path:
    path = folder / f"{orientation}.{kind}"
    stored = np.ascontiguousarray(stored)
    if kind == "tif":
        tifffile.imwrite(path, stored, photometric="rgb", metadata=None, extratags=[(274, "H", 1, orientation, True)])
    elif kind == "png":
        path.write_bytes(png(stored, (b"eXIf", exif(orientation).removeprefix(b"Exif\0\0"))))
    elif kind == "jpg":
        path.write_bytes(encoded(stored, "JPEG", quality=100, subsampling=0, exif=exif(orientation)))
    return path


@pytest.mark.parametrize("kind", ["jpg", "png", "tif"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_every_orientation_is_applied(tmp_path: Path, kind: str, orientation: int) -> None:
    stored = asymmetrical()
    picture = read_picture(_file(tmp_path, kind, stored, orientation), "linear")
    expected = SEEN[orientation](stored) / 255
    assert picture.pixels.shape == expected.shape
    np.testing.assert_allclose(picture.pixels, expected, atol=(3 if kind == "jpg" else 0.01) / 255)
    assert any("EXIF" in note for note in picture.notes) == (orientation > 1)


@pytest.mark.parametrize("orientation", [0, 9, 77])
def test_what_is_no_orientation_turns_nothing(tmp_path: Path, orientation: int) -> None:
    picture = read_picture(_file(tmp_path, "tif", asymmetrical(), orientation), "linear")
    np.testing.assert_allclose(picture.pixels, asymmetrical() / 255, atol=1e-6)
    assert not picture.notes


def test_a_set_of_which_some_are_turned_comes_out_alike(tmp_path: Path) -> None:
    scene = asymmetrical()
    names = []
    for orientation in range(1, 9):
        for kind in ("png", "tif"):
            names.append(_file(tmp_path, kind, STORED[orientation](scene), orientation).name)
    (tmp_path / "l.lp").write_text(f"{len(names)}\n" + "".join(f"{name} {i} 0 5\n" for i, name in enumerate(names)))
    said: list[str] = []
    manifest = LightListImport(tmp_path / "l.lp", "linear").write(tmp_path / "capture", say=said.append)
    assert said == ["turned 14 images by their EXIF orientation"] == manifest["source"]["pictures"]
    capture = Capture.open(tmp_path / "capture")
    for i in range(len(names)):
        np.testing.assert_allclose(capture.image(i), scene / 255, rtol=2**-11)


def test_masks_are_turned_with_the_photographs(tmp_path: Path) -> None:
    scene = asymmetrical()
    mask = np.zeros_like(scene)
    mask[:3, :5] = 255
    _file(tmp_path, "png", STORED[6](scene), 6)
    path = _file(tmp_path, "tif", STORED[6](mask), 6)
    (tmp_path / "l.lp").write_text("1\n6.png 0 0 1\n")
    LightListImport(tmp_path / "l.lp", "linear", mask=path).write(tmp_path / "capture")
    np.testing.assert_array_equal(Capture.open(tmp_path / "capture").coverage(), mask[:, :, 0] / 255)


@pytest.mark.parametrize("block", [b"", b"MM", b"Exif\0\0broken", b"MM\0*\0\0\0\x08\0\x05\x01\x12", b"II*\0\xff\xff\xff\x7f"])
def test_broken_exif_turns_nothing(tmp_path: Path, block: bytes) -> None:
    (tmp_path / "a.png").write_bytes(png(asymmetrical(), (b"eXIf", block)))
    (tmp_path / "a.jpg").write_bytes(encoded(asymmetrical(), "JPEG", quality=100, subsampling=0, exif=b"Exif\0\0" + block))
    for name in ("a.png", "a.jpg"):
        np.testing.assert_allclose(read_picture(tmp_path / name, "linear").pixels, asymmetrical() / 255, atol=3 / 255)
