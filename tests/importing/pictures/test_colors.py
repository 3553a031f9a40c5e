"""Colors of other spaces become linear Rec.709: closed forms of matrix and curve, to 1.5 / 255 in what sRGB would show."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import tifffile
from picture_files import (
    ADOBE_RGB,
    ADOBE_TO_709,
    DISPLAY_P3,
    P3_TO_709,
    REC709,
    asymmetrical,
    encoded,
    ink_profile,
    png,
    profile,
)
from PIL import Image

from srbf.importing.photographs import LightListImport
from srbf.importing.pictures import read_picture
from srbf.importing.pictures.color import by_profile
from srbf.io.image import decode_srgb, encode_srgb

STEP = 1.5 / 255  # of what is shown: half a step of the stored bytes and a step of Little CMS's tables
COLORS = np.random.default_rng(7).integers(0, 256, (12, 9, 3), dtype=np.uint8)
COLORS[0, :4] = [[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 255, 0]]
SPACES = {"Display P3": (DISPLAY_P3, 2.4, P3_TO_709), "Adobe RGB": (ADOBE_RGB, 563 / 256, ADOBE_TO_709), "linear": (REC709, 1.0, np.eye(3))}


def shown(linear: np.ndarray) -> np.ndarray:
    """As sRGB, signed, so that colors outside of Rec.709 count."""
    return np.sign(linear) * encode_srgb(np.abs(linear))


def agree(found: np.ndarray, expected: np.ndarray, step: float = STEP) -> None:
    np.testing.assert_allclose(shown(found), shown(np.broadcast_to(expected, found.shape)), atol=step)


def written(path: Path, pixels: np.ndarray, icc: bytes) -> Path:
    wide = pixels.dtype == np.uint16
    if path.suffix == ".tif":
        kind = "minisblack" if pixels.ndim == 2 else "rgb"
        tifffile.imwrite(path, pixels, photometric=kind, metadata=None, iccprofile=icc, compression="lzw")
    elif path.suffix == ".png" and wide:
        import zlib

        path.write_bytes(png(pixels, (b"iCCP", b"own\0\0" + zlib.compress(icc))))
    else:
        path.write_bytes(encoded(pixels, {".png": "PNG", ".jpg": "JPEG"}[path.suffix], icc_profile=icc))
    return path


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("bits", [8, 16])
def test_profiles_of_matrix_and_curve(tmp_path: Path, space: str, suffix: str, bits: int) -> None:
    primaries, gamma, matrix = SPACES[space]
    stored = COLORS if bits == 8 else COLORS.astype(np.uint16) * 257
    path = written(tmp_path / f"a{suffix}", stored, profile(primaries, gamma))
    picture = read_picture(path, "srgb")
    agree(picture.pixels, (COLORS / 255.0) ** gamma @ matrix.T)
    assert picture.bits == bits and len(picture.notes) == 1 and "Rec.709" in picture.notes[0]


def test_a_profile_in_a_jpeg(tmp_path: Path) -> None:
    flat = np.full((16, 16, 3), (200, 90, 40), np.uint8)
    path = tmp_path / "a.jpg"
    path.write_bytes(encoded(flat, "JPEG", quality=100, subsampling=0, icc_profile=profile(DISPLAY_P3, 2.2)))
    stored = np.asarray(Image.open(path))[0, 0]
    agree(read_picture(path, "srgb").pixels, (stored / 255.0) ** 2.2 @ P3_TO_709.T)


@pytest.mark.parametrize("bits", [8, 16])
def test_a_gray_profile(tmp_path: Path, bits: int) -> None:
    ramp = np.arange(256, dtype=np.uint8).reshape(8, 32)
    stored = ramp if bits == 8 else ramp.astype(np.uint16) * 257
    for suffix in (".png", ".tif"):
        path = written(tmp_path / f"a{suffix}", stored, profile(REC709, 1.8, "gray"))
        agree(read_picture(path, "srgb").pixels, ((ramp / 255.0) ** 1.8)[:, :, None])


def test_srgb_profiles_change_nothing_and_say_nothing(tmp_path: Path) -> None:
    from PIL import ImageCms

    icc = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    for transfer in ("srgb", "linear"):
        picture = read_picture(written(tmp_path / "a.png", COLORS, icc), transfer)
        expected = decode_srgb(COLORS / 255) if transfer == "srgb" else COLORS / 255
        np.testing.assert_allclose(picture.pixels, expected, atol=1e-6)
        assert not picture.notes


@pytest.mark.parametrize(("gamma", "kept"), [(2.2, True), (1.0, False)])
def test_linear_by_the_user_keeps_a_curve_out_and_follows_primaries(tmp_path: Path, gamma: float, kept: bool) -> None:
    picture = read_picture(written(tmp_path / "a.png", COLORS, profile(DISPLAY_P3, gamma)), "linear")
    agree(picture.pixels, COLORS / 255 if kept else COLORS / 255 @ P3_TO_709.T)
    assert ("`transfer=linear`" in picture.notes[0]) == kept


@pytest.mark.parametrize("kind", ["rgb", "cmyk"])
def test_a_profile_that_cannot_be_read_is_said(tmp_path: Path, kind: str) -> None:
    bad = bytearray(profile(DISPLAY_P3, 2.2))
    bad[36:40] = b"none"
    if kind == "cmyk":
        bad = bytearray(ink_profile())
    picture = read_picture(written(tmp_path / "a.png", COLORS, bytes(bad)), "srgb")
    np.testing.assert_allclose(picture.pixels, decode_srgb(COLORS / 255), atol=1e-6)
    assert len(picture.notes) == 1 and "`transfer=srgb`" in picture.notes[0]


@pytest.mark.parametrize("suffix", [".tif", ".jpg"])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_inks_by_their_profile(tmp_path: Path, suffix: str, transfer: str) -> None:
    inks = np.zeros((8, 8, 4), np.uint8)
    inks[:] = (51, 102, 0, 51)
    path = tmp_path / f"a{suffix}"
    Image.fromarray(inks, "CMYK").save(path, icc_profile=ink_profile(), **({"quality": 100} if suffix == ".jpg" else {}))
    lightness = 100 - 25 * (0.2 + 0.4 + 0 + 0.2)  # by the table
    expected = ((lightness + 16) / 116) ** 3  # CIE 15, L* to Y
    picture = read_picture(path, transfer)
    agree(picture.pixels, np.float64(expected))
    assert "inks of a test" in picture.notes[0]


def test_inks_without_a_profile_are_paper_left(tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 4, 4), (51, 0, 255, 51), np.uint8), "CMYK").save(tmp_path / "a.tif")
    picture = read_picture(tmp_path / "a.tif", "srgb")
    np.testing.assert_allclose(picture.pixels, np.broadcast_to(decode_srgb(np.array([0.64, 0.8, 0])), (4, 4, 3)), atol=1e-6)
    assert "CMYK" in picture.notes[0]


LAB = {(50.0, 0, 0): None, (100.0, 0, 0): None, (53.0, 40, -20): None, (70.0, -30, 30): None}


@pytest.mark.parametrize("kind", ["cielab 8", "cielab 16", "icclab 8", "icclab 16", "Pillow"])
def test_cie_lab(tmp_path: Path, kind: str) -> None:
    values = np.array([list(LAB)] * 2, float)  # (2, 4, 3)
    if kind == "Pillow":
        stored = np.round(values * [2.55, 1, 1]).astype(np.int16).astype(np.uint8)
        Image.fromarray(stored, "LAB").save(tmp_path / "a.tif")
    else:
        name, bits = kind.split()
        wide, signed = bits == "16", name == "cielab"
        light = np.round(values[:, :, :1] * (652.80 if wide and not signed else 655.35 if wide else 2.55))
        opponent = values[:, :, 1:] * (256 if wide else 1) + (0 if signed else 32768 if wide else 128)
        stored = np.concatenate([light, opponent], axis=2).astype(np.int64).astype(np.uint16 if wide else np.uint8)
        tifffile.imwrite(tmp_path / "a.tif", stored, photometric=name, metadata=None)
    step = 0.5 / 2.55 if "8" in kind or kind == "Pillow" else 0.01
    expected = _lab_to_rec709(values)
    picture = read_picture(tmp_path / "a.tif", "srgb")
    agree(picture.pixels, expected, STEP if step > 0.1 else 0.001)
    assert "CIE Lab" in picture.notes[0]


def _lab_to_rec709(lab: np.ndarray) -> np.ndarray:
    """CIE 15 under D50 to XYZ, and Lindbloom's matrix of XYZ under D50 to linear sRGB, adapted by Bradford."""
    fy = (lab[..., 0] + 16) / 116
    f = np.stack([fy + lab[..., 1] / 500, fy, fy - lab[..., 2] / 200], axis=-1)
    xyz = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * [0.96422, 1, 0.82521]
    matrix = [[3.1338561, -1.6168667, -0.4906146], [-0.9787684, 1.9161415, 0.0334540], [0.0719453, -0.2289914, 1.4052427]]
    return xyz @ np.transpose(matrix)


@pytest.mark.parametrize("bits", [1, 8, 16])
@pytest.mark.parametrize("compression", [None, "lzw", "deflate"])
def test_min_is_white_at_every_depth(tmp_path: Path, bits: int, compression: str | None) -> None:
    ramp = asymmetrical()[:, :, 0]
    stored = {1: ramp > 90, 8: ramp, 16: ramp.astype(np.uint16) * 257}[bits]
    tifffile.imwrite(tmp_path / "a.tif", stored, photometric="miniswhite", metadata=None, compression=compression)
    expected = 1 - (stored.astype(float) if bits == 1 else ramp / 255)
    np.testing.assert_allclose(read_picture(tmp_path / "a.tif", "linear").pixels, np.repeat(expected[:, :, None], 3, 2), atol=1e-6)


@pytest.mark.parametrize("exponent", [1.0, 1.8])
@pytest.mark.parametrize("wide", [False, True])
def test_gamma_and_primaries_of_png(tmp_path: Path, exponent: float, wide: bool) -> None:
    pixels = COLORS.astype(np.uint16) * 257 if wide else COLORS
    gama = (b"gAMA", struct.pack(">I", round(1e5 / exponent)))
    xy = np.round(np.array(DISPLAY_P3) * 1e5).astype(int)
    chrm = (b"cHRM", struct.pack(">8I", *xy[6:], *xy[:6]))
    for chunks, matrix in (((gama,), np.eye(3)), ((gama, chrm), P3_TO_709)):
        (tmp_path / "a.png").write_bytes(png(pixels, *chunks))
        picture = read_picture(tmp_path / "a.png", "srgb")
        agree(picture.pixels, (COLORS / 255.0) ** exponent @ matrix.T)
        assert len(picture.notes) == 1
    (tmp_path / "a.png").write_bytes(png(pixels, (b"sRGB", b"\0"), gama, chrm))
    np.testing.assert_allclose(read_picture(tmp_path / "a.png", "srgb").pixels, decode_srgb(COLORS / 255), atol=1e-6)


def test_the_gamma_of_srgb_in_a_png_is_srgb(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png(COLORS, (b"gAMA", struct.pack(">I", 45455))))
    for transfer, expected in (("srgb", decode_srgb(COLORS / 255)), ("linear", COLORS / 255)):
        picture = read_picture(tmp_path / "a.png", transfer)
        np.testing.assert_allclose(picture.pixels, expected, atol=1e-6)
        assert not picture.notes


@pytest.mark.parametrize(("primaries", "matrix"), [(1, None), (12, P3_TO_709)])
@pytest.mark.parametrize("curve", [8, 13])
def test_code_points_of_png(tmp_path: Path, primaries: int, matrix: np.ndarray | None, curve: int) -> None:
    (tmp_path / "a.png").write_bytes(png(COLORS, (b"cICP", bytes([primaries, curve, 0, 1]))))
    light = COLORS / 255.0 if curve == 8 else decode_srgb(COLORS / 255.0)
    agree(read_picture(tmp_path / "a.png", "srgb").pixels, light if matrix is None else light @ matrix.T)


def test_adobe_rgb_that_a_camera_tells_by_exif_alone(tmp_path: Path) -> None:
    block = Image.Exif()
    block[0x8769] = {0xA001: 0xFFFF, 0xA005: {1: "R03"}}
    flat = np.full((16, 16, 3), (60, 180, 90), np.uint8)
    (tmp_path / "a.jpg").write_bytes(encoded(flat, "JPEG", quality=100, subsampling=0, exif=block.tobytes()))
    stored = np.asarray(Image.open(tmp_path / "a.jpg"))[0, 0]
    agree(read_picture(tmp_path / "a.jpg", "srgb").pixels, (stored / 255.0) ** (563 / 256) @ ADOBE_TO_709.T)


def test_tags_of_tiff(tmp_path: Path) -> None:
    curve = np.round(65535 * (np.arange(256) / 255) ** 1.6).astype(int)
    xy = [int(v) for value in DISPLAY_P3 for v in (round(value * 1e6), 10**6)]
    tags = [
        (301, "H", 256, tuple(curve.tolist()), True),
        (318, "2I", 2, tuple(xy[12:]), True),
        (319, "2I", 6, tuple(xy[:12]), True),
    ]
    tifffile.imwrite(tmp_path / "a.tif", COLORS, photometric="rgb", metadata=None, extratags=tags)
    picture = read_picture(tmp_path / "a.tif", "srgb")
    agree(picture.pixels, (COLORS / 255.0) ** 1.6 @ P3_TO_709.T)
    assert len(picture.notes) == 1


def test_a_set_says_each_kind_once(tmp_path: Path) -> None:
    for i in range(5):
        written(tmp_path / f"{i}.png", COLORS, profile(DISPLAY_P3, 2.2) if i < 3 else profile(ADOBE_RGB, 2.2))
    (tmp_path / "l.lp").write_text("5\n" + "".join(f"{i}.png {i} 0 4\n" for i in range(5)))
    said: list[str] = []
    LightListImport(tmp_path / "l.lp", "srgb").write(tmp_path / "capture", say=said.append)
    assert len(said) == 1 and said[0].startswith("converted 5 images from")


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("model", ["rgb", "gray"])
def test_large_pictures_go_by_tables_to_the_same_values(bits: int, model: str) -> None:
    levels = 2**bits - 1
    shape = (400, 500, 3) if model == "rgb" else (800, 700, 1)
    values = (np.random.default_rng(1).integers(0, levels + 1, shape) / levels).astype(np.float32)
    icc = profile(DISPLAY_P3, 1.9, model)
    np.testing.assert_allclose(by_profile(values, icc, levels), by_profile(values, icc), atol=3e-4)
