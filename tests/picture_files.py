"""Files of every kind, written by other libraries than those that the project reads them with wherever there are two."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray
from PIL import Image

REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
DISPLAY_P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290)
ADOBE_RGB = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290)
# Linear Rec.709 of the linear light of each space, all of them under D65 (so by their primaries' matrices alone).
P3_TO_709 = np.array([[1.2249401, -0.2249402, 0], [-0.0420569, 1.0420571, 0], [-0.0196376, -0.0786361, 1.0982735]])
ADOBE_TO_709 = np.array([[1.3983557, -0.3983557, 0], [0, 1, 0], [0, -0.0429290, 1.0429290]])


def asymmetrical(height: int = 8, width: int = 16) -> ndarray:
    """Bytes that no turn or flip gives again: ramps of each channel along its own way."""
    y, x = np.mgrid[:height, :width]
    return np.stack([y * 200 // height + 20, x * 200 // width + 30, (x + 2 * y) * 120 // (width + 2 * height) + 40], axis=2).astype(
        np.uint8
    )


def profile(chromaticities: Sequence[float], gamma: float, space: str = "rgb") -> bytes:
    """An ICC profile, matrix and curve (gray: the curve alone), by Little CMS."""
    import imagecodecs

    c = chromaticities
    white, primaries = (c[6], c[7], 1.0), (c[0], c[1], 1.0, c[2], c[3], 1.0, c[4], c[5], 1.0)
    return bytes(imagecodecs.cms_profile(space, whitepoint=white, primaries=primaries, gamma=gamma))


def ink_profile() -> bytes:
    """A CMYK profile of version 2 whose table says L* = 100 - 25 (c + m + y + k): linear, so every interpolation gives the same."""
    grid = np.stack(np.meshgrid(*[np.arange(2)] * 4, indexing="ij"), axis=-1).reshape(-1, 4)
    light = np.round(0xFF00 * (1 - grid.mean(axis=1))).astype(">u2")
    table = np.stack([light, np.full_like(light, 0x8000), np.full_like(light, 0x8000)], axis=1).astype(">u2")
    ramp = np.array([0, 65535], ">u2").tobytes()
    lut = b"mft2" + bytes(4) + bytes([4, 3, 2, 0]) + struct.pack(">9i", *[65536 if i % 4 == 0 else 0 for i in range(9)])
    lut += struct.pack(">2H", 2, 2) + ramp * 4 + table.tobytes() + ramp * 3
    text = b"inks of a test\0"
    described = b"desc" + bytes(4) + struct.pack(">I", len(text)) + text + bytes(12 + 67)
    white = b"XYZ " + bytes(4) + struct.pack(">3i", *[round(v * 65536) for v in (0.9642, 1, 0.8249)])
    body, entries, at = b"", b"", 128 + 4 + 12 * 3
    for name, data in ((b"desc", described), (b"wtpt", white), (b"A2B0", lut)):
        data += bytes(-len(data) % 4)
        entries += name + struct.pack(">2I", at + len(body), len(data))
        body += data
    head = struct.pack(">I", at + len(body)) + bytes(4) + b"\x02\x40\0\0" + b"prtrCMYKLab " + bytes(12) + b"acsp" + bytes(28)
    head += struct.pack(">3i", *[round(v * 65536) for v in (0.9642, 1, 0.8249)])
    return head.ljust(128, b"\0") + struct.pack(">I", 3) + entries + body


def exif(orientation: int) -> bytes:
    """An EXIF block of that alone."""
    block = Image.Exif()
    block[0x112] = orientation
    return block.tobytes()


def encoded(array: ndarray, kind: str, **options: Any) -> bytes:
    """A file's bytes by Pillow."""
    stream = io.BytesIO()
    Image.fromarray(array).save(stream, kind, **options)
    return stream.getvalue()


def png(array: ndarray, *chunks: tuple[bytes, bytes]) -> bytes:
    """A PNG of 8 or 16 bits, gray or RGB, with chunks before its pixels."""
    height, width = array.shape[:2]
    wide = array.dtype == np.uint16
    rows = b"".join(b"\0" + np.ascontiguousarray(row, ">u2" if wide else np.uint8).tobytes() for row in array)
    head = struct.pack(">IIBBBBB", width, height, 16 if wide else 8, 2 if array.ndim == 3 else 0, 0, 0, 0)
    parts = [(b"IHDR", head), *chunks, (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    written = (struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in parts)
    return b"\x89PNG\r\n\x1a\n" + b"".join(written)


def exr(path: Path, *parts: dict[str, Any]) -> None:
    """Parts of {name, channels {name: (h, w)}, at (x, y), frame (x, y, width, height), chromaticities}, float."""
    import OpenImageIO as oiio

    specs, arrays = [], []
    for part in parts:
        array = np.stack([np.asarray(v, np.float32) for v in part["channels"].values()], axis=2)
        spec = oiio.ImageSpec(array.shape[1], array.shape[0], array.shape[2], oiio.FLOAT)
        spec.channelnames = tuple(part["channels"])
        spec.x, spec.y = part.get("at", (0, 0))
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = part.get("frame", (0, 0, array.shape[1], array.shape[0]))
        if "name" in part:
            spec.attribute("oiio:subimagename", part["name"])
        if "chromaticities" in part:
            spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), part["chromaticities"])
        specs.append(spec)
        arrays.append(np.ascontiguousarray(array))
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), tuple(specs) if len(specs) > 1 else specs[0]), target.geterror()
    for i, array in enumerate(arrays):
        assert i == 0 or target.open(str(path), specs[i], "AppendSubimage"), target.geterror()
        assert target.write_image(array), target.geterror()
    target.close()


def rgb(prefix: str, values: Sequence[float], shape: tuple[int, int] = (4, 6)) -> dict[str, ndarray]:
    """Channels R, G, B of constant values, their names after a prefix."""
    return {f"{prefix}{name}": np.full(shape, value, np.float32) for name, value in zip("RGB", values, strict=True)}
