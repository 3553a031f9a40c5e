"""Images found by the names of a list, however list and file system spell them."""

from __future__ import annotations

import unicodedata
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import ImageError
from srbf.importing.image_pairing import paired
from srbf.io.image import write_image


def png(path: Path, level: int = 0) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_image(path, np.full((2, 3, 3), level, np.uint8), "uint8")
    return path


def list_of(folder: Path, *names: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"{name} {i} 0 1\n" for i, name in enumerate(names)]
    (folder / "l.lp").write_text(f"{len(names)}\n{''.join(lines)}", encoding="utf-8")
    return folder / "l.lp"


def found(light_list: Path, images: Path | None = None) -> tuple[list[Path], list[str]]:
    said: list[str] = []
    return [path for path, _ in paired(light_list, images=images, say=said.append)], said


def test_accents_and_letter_case_do_not_matter_and_are_said_once(tmp_path: Path) -> None:
    composed, decomposed = (unicodedata.normalize(form, "Façade é 1.png") for form in ("NFC", "NFD"))
    images = [png(tmp_path / name) for name in (decomposed, "IMG_2.PNG", "c.png")]
    assert found(list_of(tmp_path, composed, "img_2.png", "c.png")) == (
        images,
        ["2 of 3 images of l.lp were found by another letter case or composition of accents"],
    )
    (tmp_path / decomposed).rename(tmp_path / composed)
    assert found(list_of(tmp_path, decomposed))[0] == [tmp_path / composed]


def test_the_same_name_comes_before_one_alike(tmp_path: Path) -> None:
    lower, upper = png(tmp_path / "a.png"), png(tmp_path / "A.png")
    if lower.samefile(upper):
        pytest.skip("this file system knows no letter case")
    assert found(list_of(tmp_path, "A.png", "a.png")) == ([upper, lower], [])
    png(tmp_path / "A.PNG")
    with pytest.raises(ImageError, match="several"):
        found(list_of(tmp_path, "a.Png"))


@pytest.mark.parametrize("suffix", ["bmp", "webp", "tga", "hdr", "jpg", "tif", "ppm"])
def test_other_formats_are_found_and_read(tmp_path: Path, suffix: str) -> None:
    import OpenImageIO as oiio

    name = tmp_path / f"a.{suffix}"
    image = oiio.ImageBuf(oiio.ImageSpec(16, 16, 3, "uint8"))
    oiio.ImageBufAlgo.fill(image, (0.5, 0.5, 0.5))
    assert image.write(str(name)), image.geterror()
    for listed in (f"a.{suffix}", "a", f"C:\\scans\\A.{suffix.upper()}"):
        assert found(list_of(tmp_path, listed))[0] == [name]
    done = srbf_import(list_of(tmp_path, "a"), tmp_path / "capture")
    assert done.exit_code == 0, done.stderr
    assert Capture.open(tmp_path / "capture").image(0) == pytest.approx(0.5, abs=0.02)


def test_a_folder_of_exports(tmp_path: Path) -> None:
    images = [png(tmp_path / "exports" / name) for name in ("a.png", "b.png")]
    assert found(list_of(tmp_path, "exports/a.png", "Exports\\B.png"))[0] == images
    assert found(list_of(tmp_path, "a.png", "b.tif")) == (
        images,
        ["1 of 2 images of l.lp were found by another extension", "2 of 2 images of l.lp were found by a folder inside"],
    )
    png(tmp_path / "thumbnails" / "a.png")
    with pytest.raises(ImageError, match=r"several with that stem \(exports/a.png, thumbnails/a.png\)"):
        found(list_of(tmp_path, "a.png"))
    assert found(list_of(tmp_path, "exports/a.png"))[0] == images[:1]
    (tmp_path / "thumbnails" / "capture.json").write_text("{}")  # a capture's own images are not photographs
    assert found(list_of(tmp_path, "a.png"))[0] == images[:1]


def test_images_beside_the_lists_folder_need_leave(tmp_path: Path) -> None:
    image = png(tmp_path / "jpeg-exports" / "a.png")
    light_list = list_of(tmp_path / "lists", "../jpeg-exports/a.png")
    with pytest.raises(ImageError, match="followed only below `images`; add `images=.*jpeg-exports"):
        found(light_list)
    for leave in (tmp_path / "jpeg-exports", tmp_path):
        assert found(light_list, leave) == ([image], [])
    assert found(list_of(tmp_path / "lists", "a.png"), tmp_path / "jpeg-exports") == ([image], [])
    assert found(list_of(tmp_path / "lists", str(image)), tmp_path / "jpeg-exports") == ([image], [])
    with pytest.raises(ImageError, match="`images`"):
        found(light_list, tmp_path / "none")
    with pytest.raises(ImageError, match="outside"):
        found(list_of(tmp_path / "lists", str(image)))
    png(tmp_path / "other" / "secret.png")
    (tmp_path / "lists" / "link").symlink_to(tmp_path / "other")
    with pytest.raises(ImageError, match="found none"):
        found(list_of(tmp_path / "lists", "link/secret.png"))


def test_a_picture_comes_before_a_raw_file(tmp_path: Path) -> None:
    raw = [tmp_path / f"a.{suffix}" for suffix in ("NEF", "dng", "cr2", "psd")]
    for path in raw:
        path.write_bytes(b"raw")
    picture = png(tmp_path / "a.png")
    paths, said = found(list_of(tmp_path, "a"))
    assert paths == [picture] and len(said) == 1 and "raw file" in said[0]
    assert found(list_of(tmp_path, "a.tif"))[0] == found(list_of(tmp_path, "a.arw"))[0] == [picture]
    assert found(list_of(tmp_path, "a.NEF")) == ([raw[0]], [])
    picture.unlink()
    raw[3].unlink()
    with pytest.raises(ImageError, match="several with that stem .a.NEF, a.cr2, a.dng."):
        found(list_of(tmp_path, "a"))
    raw[1].unlink()
    raw[2].unlink()
    assert found(list_of(tmp_path, "a"))[0] == raw[:1]


def test_a_missing_image_names_the_nearest(tmp_path: Path) -> None:
    png(tmp_path / "IMG_0012.png")
    with pytest.raises(ImageError, match=r"found none \(the nearest name is 'IMG_0012.png'\)"):
        found(list_of(tmp_path, "IMG_012.png"))
    with pytest.raises(ImageError, match="found none"):
        found(list_of(tmp_path, "x" * 300 + ".png"))
    with pytest.raises(ImageError, match="found none"):
        found(list_of(tmp_path, ".."))


def srbf_import(light_list: Path, output: Path, *more: object):  # type: ignore[no-untyped-def]
    return CliRunner().invoke(app, list(map(str, ["import", "--lp", light_list, "-o", output, "--transfer", "linear", *more])))


def test_the_command_says_it_in_lines_and_leaves_nothing_half_written(tmp_path: Path) -> None:
    for name in "ab":
        png(tmp_path / "photos" / f"{name}.PNG")
    (tmp_path / "lists").mkdir()
    (tmp_path / "lists" / "l.lp").write_bytes("2\n'a.png' 0 0 1\nb.png 0 1 -1\n".encode("utf-16"))
    light_list = tmp_path / "lists" / "l.lp"
    missing = srbf_import(light_list, tmp_path / "capture")
    assert missing.exit_code == 1 and missing.stderr.splitlines()[-1].startswith("srbf: expected the image 'a.png'")
    assert "--images" in missing.stderr and not (tmp_path / "capture").exists()
    done = srbf_import(light_list, tmp_path / "capture", "--images", tmp_path / "photos")
    assert done.exit_code == 0
    lines = done.stderr.splitlines()
    for words in ("as UTF-16", "2 of 2 images of l.lp", "1 of 2 lights of l.lp are below the surface", "imported 2 images"):
        assert sum(words in line for line in lines) == 1, words
    assert len(lines) == 4
