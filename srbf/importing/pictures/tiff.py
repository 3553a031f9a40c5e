"""TIFF: the largest full-resolution page, of any supported sample format."""

from __future__ import annotations

import logging
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.errors import ImageError
from srbf.importing.pictures.found import Found, Tags, stripped
from srbf.importing.pictures.raw import read_raw

logging.getLogger("tifffile").addHandler(logging.NullHandler())  # its warnings are checked here or irrelevant
WHITE_IS_ZERO, BLACK_IS_ZERO, RGB, PALETTE, INKS, YCBCR, CIELAB, ICCLAB = 0, 1, 2, 3, 5, 6, 8, 9
RAW = (32803, 34892)  # a sensor mosaic; linear values in the camera's color space
FAX = (2, 3, 4)  # compressions that tifffile lacks
MAX_PIXELS = 2**30  # 12 GB as float32
REDUCED, MASK = 1, 4  # bits of NewSubfileType
ORIENTATION, TRANSFER_FUNCTION, WHITE_POINT, PRIMARIES, PROFILE = 274, 301, 318, 319, 34675


def read_tiff(path: Path) -> Found:
    """The largest page or sub-page that is neither reduced nor a mask. A file with a page of raw samples is read as a raw file.

    ImageError if the file is damaged, truncated, or has samples that are no color.
    """
    import tifffile

    try:
        with tifffile.TiffFile(path) as file:
            pages = _pages(file.pages)
            if any(page.photometric in RAW for page in pages) or _is_canon(path):
                return read_raw(path)
            if not pages:
                raise ImageError(f"cannot read image {path}: it has no page; is it damaged or cut short?")
            page = _largest(pages)
            size = path.stat().st_size
            if len(page.dataoffsets) < math.prod(page.chunked) or page.imagewidth * page.imagelength > MAX_PIXELS:
                raise ImageError(f"cannot read image {path}: {page.imagewidth}x{page.imagelength} pixels are not in it; is it damaged?")
            if any(at + count > size for at, count in zip(page.dataoffsets, page.databytecounts, strict=False)):
                raise ImageError(f"cannot read image {path}: it is cut short, or damaged; copy it again")
            pixels, model = _meant(page, path)
            tags = _tags(page, pages[0], page.photometric)
            notes = (f"took the largest of the {len(pages)} pages of {{}}",) if len(pages) > 1 else ()
            bits = 8 if page.bitspersample <= 8 else 16 if page.bitspersample <= 16 else 32
            whole = page.dtype is not None and page.dtype.kind == "u" and page.bitspersample in (8, 16) and page.photometric != PALETTE
            return Found(pixels, model, bits, tags, notes, 2**bits - 1 if whole else 0)
    except ImageError:
        raise
    except (
        tifffile.TiffFileError,
        OSError,
        SyntaxError,
        RuntimeError,
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
        struct.error,
    ) as error:
        raise ImageError(f"cannot read image {path}: {' '.join(str(error).split())[:120]}; is it damaged or cut short?") from error


def _pages(top: Any) -> list[Any]:
    pages = []
    for page in top:
        page = getattr(page, "keyframe", page) if type(page).__name__ == "TiffFrame" else page
        pages.append(page)
        if page.subifds:
            pages += _pages(page.pages)
    return pages


def _largest(pages: list[Any]) -> Any:
    whole = [page for page in pages if not page.subfiletype & (REDUCED | MASK) and not _old_reduced(page)]
    return max(whole or pages, key=lambda page: page.imagewidth * page.imagelength)


def _old_reduced(page: Any) -> bool:
    tag = page.tags.get(255)  # SubfileType, before NewSubfileType: 2 is reduced
    return tag is not None and int(tag.value) == 2


def _is_canon(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(10)[8:10] == b"CR"


def _meant(page: Any, path: Path) -> tuple[Float32[ndarray, "H W C"], Any]:
    """Samples as gray, RGB, inks or Lab, by the page's photometric interpretation."""
    kind = int(page.photometric)
    if int(page.compression) in FAX or (kind == YCBCR and page.compression not in (6, 7)):
        return _by_pillow(page, path)
    if kind not in (WHITE_IS_ZERO, BLACK_IS_ZERO, RGB, PALETTE, INKS, YCBCR, CIELAB, ICCLAB):
        raise ImageError(f"expected gray, RGB, palette, CMYK or Lab in {path}, found photometric {kind}; export it as RGB")
    samples = np.asarray(page.asarray())  # of a JPEG's YCbCr already RGB
    if page.planarconfig == 2 and page.samplesperpixel > 1:
        samples = np.moveaxis(samples.reshape(page.samplesperpixel, page.imagelength, page.imagewidth), 0, -1)
    samples = samples.reshape(page.imagelength, page.imagewidth, -1)
    if kind == PALETTE:
        table = np.asarray(page.colormap, np.float32).T  # (levels, 3)
        return (table / (65535 if table.max() > 255 else 255))[samples[:, :, 0]].astype(np.float32), "rgb"
    if kind in (CIELAB, ICCLAB):
        return _lab(samples, kind, path), "lab"
    values = _unit(samples, page.bitspersample)
    if kind == INKS:
        if values.shape[2] < 4:
            raise ImageError(f"expected the four inks of CMYK in {path}, found {values.shape[2]}; export it as RGB")
        return np.ascontiguousarray(values[:, :, :4]), "cmyk"
    if kind == WHITE_IS_ZERO:
        return 1 - values[:, :, :1], "gray"
    return stripped(values)


def _by_pillow(page: Any, path: Path) -> tuple[Float32[ndarray, "H W C"], Any]:
    """Samples decoded by libtiff through Pillow, with white as 1. ImageError for sub-pages."""
    from PIL import Image

    if not isinstance(page.index, int):
        raise ImageError(f"expected a packing of {path} that sub-pages are read in, found {page.compression.name}; export it as LZW")
    with Image.open(path) as image:
        image.seek(page.index)
        stored = np.asarray(image if image.mode in ("1", "L", "RGB") else image.convert("RGB"))
    return stripped(stored.astype(np.float32) / np.float32(1 if stored.dtype == bool else 255))


def _unit(samples: ndarray, bits: int) -> Float32[ndarray, "H W C"]:
    if samples.dtype.kind in "fb":
        return samples.astype(np.float32)
    top = 2**bits - 1 if samples.dtype.kind == "u" else 2 ** (bits - 1) - 1
    return (samples / np.float64(top)).astype(np.float32) if bits > 16 else samples.astype(np.float32) / np.float32(top)


def _lab(samples: ndarray, kind: int, path: Path) -> Float32[ndarray, "H W 3"]:
    """L* 0 to 100, a* and b*: signed in CIELab, offset in ICCLab, whose 16 bits end at 0xff00."""
    bits = samples.dtype.itemsize * 8
    if samples.dtype.kind not in "iu" or bits not in (8, 16) or samples.shape[2] < 3:
        raise ImageError(f"expected CIE Lab of 8 or 16 bits in {path}, found {samples.dtype}; export it as RGB")
    stored = samples[:, :, :3].astype(np.uint8 if bits == 8 else np.uint16)
    light = stored[:, :, :1].astype(np.float32) * np.float32(100 / (255 if bits == 8 else 0xFF00 if kind == ICCLAB else 65535))
    if kind == ICCLAB:
        opponent = (stored[:, :, 1:].astype(np.float32) - 2 ** (bits - 1)) / 2 ** (bits - 8)
    else:
        opponent = stored[:, :, 1:].astype(np.int8 if bits == 8 else np.int16).astype(np.float32) / 2 ** (bits - 8)
    return np.concatenate([light, opponent], axis=2).astype(np.float32)


def _tags(page: Any, first: Any, kind: int) -> Tags:
    def value(code: int) -> Any:
        tag = page.tags.get(code) or first.tags.get(code)
        return None if tag is None else tag.value

    profile, curve, white, primaries = value(PROFILE), value(TRANSFER_FUNCTION), value(WHITE_POINT), value(PRIMARIES)
    table = None
    if curve is not None and kind in (WHITE_IS_ZERO, BLACK_IS_ZERO, RGB):
        levels = np.asarray(curve, np.float64).ravel() / 65535
        one = 2**page.bitspersample
        table = np.repeat(levels[:, None], 3, axis=1) if levels.size == one else levels.reshape(3, -1).T if levels.size == 3 * one else None
    return Tags(
        profile=None if profile is None else bytes(profile),
        curve=table,
        chromaticities=_chromaticities(primaries, white),
        orientation=int(value(ORIENTATION) or 1),
    )


def _chromaticities(primaries: Any, white: Any) -> tuple[float, ...] | None:
    """Red, green, blue, white, out of two tags of numerators and denominators; None unless both are complete."""
    if primaries is None or white is None or len(primaries) != 12 or len(white) != 4:
        return None
    numbers = (*primaries, *white)
    if not all(numbers[1::2]):
        return None
    return tuple(top / bottom for top, bottom in zip(numbers[::2], numbers[1::2], strict=True))
