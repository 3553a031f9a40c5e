"""Reading an image of any supported format as linear Rec.709 in display orientation."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from numpy import ndarray

from srbf.arrays import Float32
from srbf.errors import ImageError
from srbf.importing.pictures.encoded import read_jpeg, read_other
from srbf.importing.pictures.exr import read_exr
from srbf.importing.pictures.found import RAW_SUFFIXES, Found
from srbf.importing.pictures.meaning import Transfer, linear
from srbf.importing.pictures.orientation import turned
from srbf.importing.pictures.raw import TURNED, read_raw
from srbf.importing.pictures.tiff import read_tiff
from srbf.io.image import require_finite

EXR = b"\x76\x2f\x31\x01"
TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
JPEG = b"\xff\xd8\xff"


@dataclass(frozen=True)
class Picture:
    """Linear Rec.709, row 0 at the top; colors outside of Rec.709 have negative channels.

    bits: of a stored channel. notes: the conversions, each with {} in place of the image's name or a count.
    """

    pixels: Float32[ndarray, "H W 3"]
    bits: int
    notes: tuple[str, ...]


def read_picture(path: Path, transfer: Transfer, layer: str | None = None) -> Picture:
    """Read, convert and rotate an image. `transfer` applies to values without tags; `layer` is a layer of an EXR.

    ImageError if the file is missing, empty, damaged, not finite, not an image, or if its layers are ambiguous.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of other libraries: they name no file, and the relevant faults are checked here
        found = _found(path, layer)
    require_finite(found.pixels, path)
    pixels, notes = linear(found, transfer)
    if found.tags.orientation in range(2, 9):
        notes = [TURNED, *notes]
    return Picture(turned(pixels, found.tags.orientation), found.bits, (*found.notes, *notes))


def said_once(pictures: Iterable[tuple[str, tuple[str, ...]]]) -> list[str]:
    """The notes of many images, each kind once, with the number of images, or the name if it is only one."""
    counts: Counter[str] = Counter()
    names: dict[str, str] = {}
    for name, notes in pictures:
        for note in notes:
            counts[note] += 1
            names.setdefault(note, name)
    return [_said(note, number, names[note]) for note, number in counts.items()]


def _said(note: str, number: int, name: str) -> str:
    text = note.replace("{}", f"{number} images" if number > 1 else name)
    return text if number > 1 else text.replace(" their ", " its ").replace(", which hold ", ", which holds ")


def _found(path: Path, layer: str | None) -> Found:
    read = _reader(path)
    if read is None:
        return read_exr(path, layer)
    if layer is not None:
        raise ImageError(f"expected an EXR with the layer {layer!r}, found {path}; leave `layer` out")
    return read(path)


def _reader(path: Path) -> Callable[[Path], Found] | None:
    """The reader by the first bytes, since the suffix may be wrong; None for EXR."""
    if not path.is_file():
        raise ImageError(f"cannot read image {path}: no such file")
    with path.open("rb") as file:
        head = file.read(16)
    if not head:
        raise ImageError(f"cannot read image {path}: the file is empty; copy it again")
    if head.startswith(EXR):
        return None
    if head.startswith(TIFF):
        return read_tiff
    if path.suffix.lower() in RAW_SUFFIXES:
        return read_raw
    if head.startswith(JPEG):
        return read_jpeg
    return read_other
