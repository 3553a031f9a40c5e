"""The text of a light list: its encoding, its lines without comments, its numbers."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from srbf.errors import ManifestError

NUMBER = re.compile(r"[-+\u2212]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
MARKS = (  # byte order marks; that of UTF-32 begins with that of UTF-16
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8"),
    (codecs.BOM_UTF32_LE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF32_BE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)


@dataclass(frozen=True)
class Row:
    """A line with content: its number in the file, from 1, and its stripped text."""

    number: int
    text: str


def rows_of(path: Path, say: Callable[[str], None] = lambda line: None) -> tuple[list[Row], int]:
    """Lines that are neither blank nor comments (#, //, ;), and the number of comments; ManifestError if the file is not text."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ManifestError(f"expected a light list (.lp) at {path}, found none to read: {error.strerror}") from error
    text, encoding = decoded(data)
    if text is None or re.search(r"[\x00-\x08\x0e-\x1f\x7f-\x9f]", text):
        raise ManifestError(f"expected a light list (.lp) at {path}, found none to read: it is not text")
    if encoding != "UTF-8":
        say(f"read {path.name} as {encoding}")
    lines = [Row(number, line.strip()) for number, line in enumerate(re.split(r"\r\n|\r|\n", text), 1) if line.strip()]
    rows = [row for row in lines if not row.text.startswith(("#", "//", ";"))]
    return rows, len(lines) - len(rows)


def decoded(data: bytes) -> tuple[str | None, str]:
    """(text, encoding): by its byte order mark, else UTF-16 where every second byte is 0, else UTF-8, Latin-1 or Windows-1252.

    The text is None if none of them fits.
    """
    for mark, codec, name in MARKS:
        if data.startswith(mark):
            return _decode(data, codec), name
    even, odd = data[0::2].count(0), data[1::2].count(0)
    if even or odd:
        return _decode(data, "utf-16-le" if odd > even else "utf-16-be"), "UTF-16"
    if (text := _decode(data, "utf-8")) is not None:
        return text, "UTF-8"
    if not any(0x80 <= byte < 0xA0 for byte in data):
        return data.decode("latin-1"), "Latin-1"
    return _decode(data, "cp1252"), "Windows-1252"


def as_number(word: str) -> float | None:
    """A word as a finite number with a decimal point; None for other words. A typographic minus is accepted."""
    if NUMBER.fullmatch(word) is None:
        return None
    value = float(word.replace("\u2212", "-"))
    return value if math.isfinite(value) else None


def _decode(data: bytes, codec: str) -> str | None:
    try:
        return data.decode(codec)
    except UnicodeDecodeError:
        return None
