"""JPEG by Pillow, which refuses truncated files; PNG and all other formats by OpenImageIO, which keeps 16 bits."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from srbf.errors import ImageError, MissingLibraryError
from srbf.importing.pictures.color import ADOBE_RGB, DISPLAY_P3, REC709, REC2020
from srbf.importing.pictures.found import Found, Tags, stripped
from srbf.io.image import parts_of, read_channels

PNG = b"\x89PNG\r\n\x1a\n"
ORIENTATION, EXIF, INTEROPERABILITY, COLOR_SPACE = 0x112, 0x8769, 0xA005, 0xA001
BROKEN_EXIF = (OSError, SyntaxError, ValueError, KeyError, TypeError, AttributeError, struct.error)
SRGB_GAMMA = 2.2
CICP_PRIMARIES = {1: ("Rec.709", REC709), 9: ("Rec.2020", REC2020), 12: ("Display P3", DISPLAY_P3)}
CICP_CURVES = {8: 1.0, 4: 2.2, 5: 2.8, 13: None}  # None: sRGB's


def read_jpeg(path: Path) -> Found:
    """Gray, RGB or inks of a JPEG, or of the first image of an MPO."""
    Image = _pillow()
    try:
        with Image.open(path) as image:
            image.load()
            tags = _exif_tags(_exif_of(image), image.info.get("icc_profile"))
            stored = np.asarray(image, np.float32) / np.float32(255)
            mode = image.mode
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise ImageError(f"cannot read image {path}: {error}; is it damaged or cut short?") from error
    if mode == "CMYK":
        return Found(stored, "cmyk", 8, tags)
    pixels, model = stripped(stored)
    return Found(pixels, model, 8, tags, levels=255)


def read_other(path: Path) -> Found:
    """The first image of any file that OpenImageIO reads; for PNG, with the tags of its chunks."""
    try:
        parts = parts_of(path)
    except ImageError as error:
        raise ImageError(f"{error}; export it as JPEG, PNG, TIFF or EXR") from error
    part = parts[0]
    pixels, model = stripped(read_channels(path, part, range(len(part.channels))))
    with path.open("rb") as file:
        is_png = file.read(8) == PNG
    tags = _png_tags(path) if is_png else Tags(profile=part.profile, orientation=part.orientation)
    notes = (f"took the first of the {len(parts)} images of {{}}",) if len(parts) > 1 else ()
    return Found(pixels, model, part.bits, tags, notes, 2**part.bits - 1 if is_png else 0)


def _exif_tags(exif: Any, profile: bytes | None) -> Tags:
    """Orientation and, without a profile, Adobe RGB, which cameras mark in EXIF only."""
    orientation = _orientation(exif)
    if profile:
        return Tags(profile=profile, orientation=orientation)
    try:
        space, index = exif.get_ifd(EXIF).get(COLOR_SPACE), exif.get_ifd(INTEROPERABILITY).get(1)
    except BROKEN_EXIF:
        space, index = None, None
    if space == 2 or (space == 0xFFFF and str(index).strip("\0") == "R03"):
        return Tags(gamma=563 / 256, chromaticities=ADOBE_RGB, space="Adobe RGB", orientation=orientation)
    return Tags(orientation=orientation)


def _exif_of(image: Any) -> Any:
    try:
        return image.getexif()
    except BROKEN_EXIF:
        return {}


def _orientation(exif: Any) -> int:
    found = exif.get(ORIENTATION, 1)
    return found if isinstance(found, int) else 1


def _png_tags(path: Path) -> Tags:
    """The tags of a PNG's chunks, by precedence: cICP, iCCP, sRGB, then gAMA and cHRM."""
    Image = _pillow()
    chunks = dict(_chunks(path))
    exif = Image.Exif()
    try:
        if b"eXIf" in chunks:
            exif.load(chunks[b"eXIf"])
        elif b"Raw profile type exif" in chunks:
            with Image.open(path) as image:
                exif = image.getexif()
    except BROKEN_EXIF:
        exif = Image.Exif()
    orientation = _orientation(exif)
    cicp = chunks.get(b"cICP", b"")
    if cicp[:2] == b"\x01\x0d":
        return Tags(srgb=True, orientation=orientation)
    if len(cicp) >= 2 and cicp[0] in CICP_PRIMARIES and cicp[1] in CICP_CURVES:
        name, primaries = CICP_PRIMARIES[cicp[0]]
        return Tags(gamma=CICP_CURVES[cicp[1]], chromaticities=primaries, space=name, orientation=orientation)
    if b"iCCP" in chunks:
        try:
            with Image.open(path) as image:
                return Tags(profile=image.info.get("icc_profile") or b"", orientation=orientation)
        except (OSError, SyntaxError, ValueError, struct.error):
            return Tags(profile=b"", orientation=orientation)
    if b"sRGB" in chunks:
        return Tags(srgb=True, orientation=orientation)
    gamma, chromaticities = chunks.get(b"gAMA", b""), chunks.get(b"cHRM", b"")
    exponent = 1e5 / struct.unpack(">I", gamma)[0] if len(gamma) == 4 and any(gamma) else None
    xy = None
    if len(chromaticities) == 32:
        stored = [n / 1e5 for n in struct.unpack(">8I", chromaticities)]
        xy = (*stored[2:], *stored[:2])
    if exponent is not None and abs(exponent - SRGB_GAMMA) < 0.01:  # approximates sRGB's curve
        return Tags(chromaticities=xy, space="primaries of their own", orientation=orientation)
    return Tags(gamma=exponent, chromaticities=xy, orientation=orientation)


def _chunks(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Type and bytes of the small chunks; for an old text chunk with EXIF, its keyword instead of the type."""
    with path.open("rb") as file:
        file.seek(8)
        while len(head := file.read(8)) == 8:
            length, kind = struct.unpack(">I4s", head)
            if kind in (b"tEXt", b"zTXt"):
                yield file.read(length).split(b"\0")[0], b""
                file.seek(4, 1)
            elif kind in (b"eXIf", b"cICP", b"iCCP", b"sRGB", b"gAMA", b"cHRM"):
                yield kind, file.read(length)
                file.seek(4, 1)
            else:
                file.seek(length + 4, 1)


def _pillow() -> Any:
    try:
        from PIL import Image
    except ImportError as error:
        raise MissingLibraryError("reading JPEG and PNG needs Pillow: pip install pillow") from error
    return Image
