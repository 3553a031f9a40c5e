"""Files and images: whole or not at all, inside their folder, and errors that name them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbf.errors import ImageError, ManifestError, OutputExistsError
from srbf.io import files
from srbf.io.image import decode_srgb, encode_srgb, read_image, require_finite, size_of, write_image, write_picture


@pytest.mark.parametrize(("encoding", "dtype"), [("half", np.float16), ("float", np.float32)])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_exr_round_trip_keeps_rows_and_bits(tmp_path: Path, encoding: str, dtype: type, channels: int) -> None:
    pixels = np.random.default_rng(0).normal(size=(5, 9, channels)).astype(dtype)
    write_image(tmp_path / "a.exr", pixels, encoding)
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr"), pixels.astype(np.float32))
    assert size_of(tmp_path / "a.exr") == (5, 9)


def test_equal_pixels_give_equal_bytes(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).random((8, 8, 3)).astype(np.float32)
    for name in ("a.exr", "b.exr"):
        write_image(tmp_path / name, pixels, "half")
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_png_bytes_are_linear_and_pictures_are_srgb(tmp_path: Path) -> None:
    stored = np.arange(48, dtype=np.uint8).reshape(4, 4, 3) * 5
    write_image(tmp_path / "a.png", stored, "uint8")
    np.testing.assert_array_equal(np.round(read_image(tmp_path / "a.png") * 255), stored)
    write_picture(tmp_path / "b.png", np.full((2, 2, 3), 0.25, np.float32), exposure=1)
    # sRGB of 0.5 linear is 0.735: 188 of 255.
    np.testing.assert_array_equal(np.round(read_image(tmp_path / "b.png") * 255), 188)


def test_srgb_curves_are_inverse() -> None:
    x = np.linspace(0, 1, 1000)
    np.testing.assert_allclose(decode_srgb(encode_srgb(x)), x, atol=1e-7)


def test_values_that_do_not_fit_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="half"):
        write_image(tmp_path / "a.exr", np.full((2, 2, 3), 7e4, np.float32), "half")
    with pytest.raises(ImageError, match="NaN"):
        write_image(tmp_path / "a.exr", np.full((2, 2, 3), np.nan, np.float32), "float")
    assert list(tmp_path.iterdir()) == []


def test_damaged_images_are_named(tmp_path: Path) -> None:
    path = tmp_path / "light.exr"
    write_image(path, np.random.default_rng(0).random((64, 64, 3)).astype(np.float32), "float")
    whole = path.read_bytes()
    for damaged in (b"", b"not an image", whole[: len(whole) // 2]):
        path.write_bytes(damaged)
        with pytest.raises(ImageError, match=r"light\.exr"):
            read_image(path)
    with pytest.raises(ImageError, match="no such file"):
        read_image(tmp_path / "none.exr")


def test_nan_is_named_with_its_texel(tmp_path: Path) -> None:
    pixels = np.zeros((4, 5, 3), np.float32)
    pixels[2, 3, 1] = np.inf
    with pytest.raises(ImageError, match=r"x\.exr.*row 2, column 3"):
        require_finite(pixels, tmp_path / "x.exr")


def test_gray_is_repeated_and_alpha_dropped(tmp_path: Path) -> None:
    write_image(tmp_path / "gray.exr", np.full((2, 2, 1), 0.5, np.float32), "float")
    write_image(tmp_path / "rgba.exr", np.arange(16, dtype=np.float32).reshape(2, 2, 4), "float")
    assert read_image(tmp_path / "gray.exr", 3).shape == (2, 2, 3)
    np.testing.assert_array_equal(read_image(tmp_path / "rgba.exr", 3)[0, 1], [4, 5, 6])


@pytest.mark.parametrize("name", ["../x.exr", "/etc/x.exr", "a/../../x.exr", "a\\x.exr", ""])
def test_paths_may_not_leave_their_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(ManifestError, match="inside"):
        files.inside(tmp_path, name, tmp_path / "capture.json")


def test_links_may_not_leave_their_folder(tmp_path: Path) -> None:
    (tmp_path / "capture").mkdir()
    (tmp_path / "capture" / "away").symlink_to(tmp_path)
    with pytest.raises(ManifestError, match="inside"):
        files.inside(tmp_path / "capture", "away/x.exr", tmp_path / "capture.json")


def test_a_failed_folder_leaves_nothing_and_the_old_one(tmp_path: Path) -> None:
    target = tmp_path / "asset"
    with files.atomic_folder(target, False, "asset.json") as folder:
        (folder / "asset.json").write_text("1")
    with pytest.raises(RuntimeError), files.atomic_folder(target, True, "asset.json") as folder:
        (folder / "asset.json").write_text("2")
        raise RuntimeError
    assert [p.name for p in tmp_path.iterdir()] == ["asset"]
    assert (target / "asset.json").read_text() == "1"


def test_force_never_replaces_a_folder_that_is_not_ours(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(OutputExistsError, match=r"asset\.json"), files.atomic_folder(tmp_path, True, "asset.json"):
        pass
    with pytest.raises(OutputExistsError, match="force=True"), files.atomic_folder(tmp_path, False, "asset.json"):
        pass
    assert (tmp_path / "thesis.txt").read_text() == "years of work"


def test_atomic_text_replaces_or_keeps(tmp_path: Path) -> None:
    files.write_json(tmp_path / "a.json", {"x": 1})
    with pytest.raises(ValueError):
        files.write_json(tmp_path / "a.json", {"x": float("nan")})
    assert files.read_json(tmp_path / "a.json") == {"x": 1}
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]
