"""Light lists and the captures they become."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.errors import ImageError, ManifestError
from srbf.evaluation.errors_by_role import evaluate
from srbf.importing.light_list import read_light_list
from srbf.importing.photographs import LightListImport
from srbf.io.image import decode_srgb, write_image
from srbf.methods.relighting_map import RelightingMap

DIRECTIONS = {"b.png": (0, 0, 2), "a.png": (0.6, 0, 0.8), "c with space.png": (0, -3, 4)}


@pytest.fixture
def photographs(tmp_path: Path) -> Path:
    """Three 8-bit images of constant gray 50, 100, 150, listed neither by name nor by order."""
    for level, name in zip((50, 100, 150), DIRECTIONS, strict=True):
        write_image(tmp_path / name, np.full((4, 6, 3), level, np.uint8), "uint8")
    lines = [f"{name} {x} {y} {z}" for name, (x, y, z) in DIRECTIONS.items()]
    (tmp_path / "dirs.lp").write_text("3  \r\n" + "\r\n".join(lines) + "\r\n\r\n")
    return tmp_path / "dirs.lp"


@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_images_are_paired_by_name_and_decoded(photographs: Path, tmp_path: Path, transfer: str) -> None:
    LightListImport(photographs, transfer).write(tmp_path / "capture")
    capture = Capture.open(tmp_path / "capture")
    np.testing.assert_allclose(capture.directions(), [[0, 0, 1], [0.6, 0, 0.8], [0, -0.6, 0.8]], atol=1e-12)
    stored = np.array([50, 100, 150]) / 255
    expected = decode_srgb(stored) if transfer == "srgb" else stored
    for i, value in enumerate(expected):
        np.testing.assert_allclose(capture.image(i), value, rtol=2**-11)  # half floats
    assert capture.source_bits == 8


def test_holdout_mask_and_peak(photographs: Path, tmp_path: Path) -> None:
    mask = np.zeros((4, 6, 3), np.uint8)
    mask[:, 3:] = 255
    write_image(tmp_path / "mask.png", mask, "uint8")
    LightListImport(photographs, "linear", holdout=photographs, mask=tmp_path / "mask.png").write(tmp_path / "capture")
    capture = Capture.open(tmp_path / "capture")
    assert [light.role for light in capture.lights] == ["train"] * 3 + ["holdout"] * 3
    np.testing.assert_array_equal(capture.coverage()[0], [0, 0, 0, 1, 1, 1])
    result = evaluate(RelightingMap(k=2).encode(capture), capture)
    assert result["holdout"]["peak"] == 1  # 8-bit sources


def test_wide_images_stay_wide(tmp_path: Path) -> None:
    value = np.float32(0.123456789)
    write_image(tmp_path / "a.exr", np.full((2, 2, 3), value), "float")
    (tmp_path / "l.lp").write_text("1\na.exr 0 0 1\n")
    LightListImport(tmp_path / "l.lp", "linear").write(tmp_path / "capture")
    assert Capture.open(tmp_path / "capture").image(0)[0, 0, 0] == value


def test_names_from_another_system_and_another_extension(tmp_path: Path) -> None:
    write_image(tmp_path / "IMG_1.png", np.zeros((2, 2, 3), np.uint8), "uint8")
    (tmp_path / "l.lp").write_text("1\nC:\\scans\\img_1.TIF 0 0 1\n")
    LightListImport(tmp_path / "l.lp", "srgb").write(tmp_path / "capture")
    assert len(Capture.open(tmp_path / "capture").lights) == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "number of lights"),
        ("two\na.png 0 0 1\n", "number of lights"),
        ("2\na.png 0 0 1\n", "expected 2 lights"),
        ("1\na.png 0 0\n", "line 2"),
        ("1\na.png 0 0 x\n", "line 2"),
        ("1\na.png 0 0 nan\n", "line 2"),
        ("1\na.png 0 0 0\n", "zero vector"),
        ("2\na.png 0 0 1\na.png 1 0 1\n", "again"),
    ],
)
def test_bad_lists_name_their_line(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "l.lp").write_text(text)
    with pytest.raises(ManifestError, match=words):
        read_light_list(tmp_path / "l.lp")


def test_names_with_folders_and_an_image_taken_twice(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    for name, level in (("a.png", 10), ("sub/a.png", 200)):
        write_image(tmp_path / name, np.full((2, 2, 3), level, np.uint8), "uint8")
    (tmp_path / "l.lp").write_text("2\nsub/a.png 0 0 1\na.png 1 0 1\n")
    LightListImport(tmp_path / "l.lp", "linear").write(tmp_path / "capture")
    assert Capture.open(tmp_path / "capture").image(0)[0, 0, 0] == pytest.approx(200 / 255, rel=1e-3)
    (tmp_path / "l.lp").write_text("2\nx/a.png 0 0 1\na.png 1 0 1\n")
    with pytest.raises(ImageError, match="taken by"):
        LightListImport(tmp_path / "l.lp", "linear").write(tmp_path / "again")


def test_alpha_does_not_darken_color(tmp_path: Path) -> None:
    from PIL import Image  # OpenImageIO would divide by alpha when it writes

    Image.fromarray(np.full((2, 2, 4), 128, np.uint8)).save(tmp_path / "a.png")
    (tmp_path / "l.lp").write_text("1\na.png 0 0 1\n")
    LightListImport(tmp_path / "l.lp", "linear").write(tmp_path / "capture")
    assert Capture.open(tmp_path / "capture").image(0)[0, 0, 0] == pytest.approx(128 / 255, rel=1e-3)


def test_missing_and_mismatched_images_leave_nothing(photographs: Path, tmp_path: Path) -> None:
    write_image(tmp_path / "a.png", np.zeros((4, 7, 3), np.uint8), "uint8")
    with pytest.raises(ImageError, match=r"6x4.*a\.png.*7x4"):
        LightListImport(photographs, "srgb").write(tmp_path / "capture")
    (tmp_path / "a.png").unlink()
    with pytest.raises(ImageError, match=r"a\.png"):
        LightListImport(photographs, "srgb").write(tmp_path / "capture")
    assert not (tmp_path / "capture").exists() and not list(tmp_path.glob(".*partial*"))
