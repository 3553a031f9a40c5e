"""Images on disk: the only module that imports OpenImageIO. Arrays are (H, W, C), row 0 at the top."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32
from srbf.compute.threads import each
from srbf.errors import ImageError, MissingLibraryError
from srbf.io.files import atomic_path
from srbf.io.float16 import all_finite, finite_to_float32

Encoding = Literal["half", "float", "uint8"]
HALF_MAX = 65504.0
PNG_NO_FILTER = 8  # of libpng
NO_DATE = "1970:01:01 00:00:00"  # OpenImageIO would write the time, and equal pixels would give different files


def read_image(path: Path, channels: int | None = None) -> Float32[ndarray, "H W C"]:
    """All channels of an image as float32: EXR values as stored, integers over their maximum (8 bit: byte / 255).

    Parameters
    ----------
    path
        Of any format that OpenImageIO reads.
    channels
        How many to return; None: all. With 3, gray is repeated and alpha dropped. Of more channels than asked for, the first are returned.

    Returns
    -------
    ndarray
        (H, W, C) float32, row 0 at the top. Non-finite values are returned unchanged; `require_finite` rejects them.

    Raises
    ------
    ImageError
        On a missing, damaged or truncated file, and on one with too few channels.
    MissingLibraryError
        Without OpenImageIO.

    Examples
    --------
    >>> write_image(folder / "gray.exr", np.full((2, 4), 0.5, np.float32), "half")
    >>> read_image(folder / "gray.exr").shape
    (2, 4, 1)
    >>> read_image(folder / "gray.exr", channels=3)[0, 0].tolist()
    [0.5, 0.5, 0.5]
    """
    pixels = read_stored(path, channels)
    if pixels.dtype == np.float32:
        return pixels
    return finite_to_float32(pixels, np.empty(pixels.shape, np.float32)) if all_finite(pixels) else pixels.astype(np.float32)


def read_stored(path: Path, channels: int | None = None, rows: Sequence[tuple[int, int]] | None = None) -> Float[ndarray, "H W C"]:
    """`read_image` without widening: float16 for half floats, float32 for all else. The file is opened once.

    With `rows`, only these ranges (begin, end), stacked; other strips of 16 rows of an EXR are not decompressed.
    """
    oiio = _oiio()
    wanted = oiio.ImageSpec()
    wanted.attribute("oiio:UnassociatedAlpha", 1)  # colors as stored, not multiplied by alpha
    source = oiio.ImageInput.open(str(path), wanted) if path.is_file() else None
    if source is None:
        reason = _first_line(oiio.geterror()) if path.is_file() else "no such file"
        raise ImageError(f"cannot read image {path}: {reason}")
    try:
        spec = source.spec()
        half = spec.format == oiio.TypeHalf
        kind = oiio.HALF if half else oiio.FLOAT
        if rows is None or spec.tile_width:
            parts = [source.read_image(0, 0, 0, spec.nchannels, kind)]
        else:
            parts = [source.read_scanlines(0, 0, spec.y + begin, spec.y + end, 0, 0, spec.nchannels, kind) for begin, end in rows]
        if any(part is None for part in parts):
            raise ImageError(f"cannot read image {path}: {_first_line(source.geterror())}; is it damaged or cut short?")
        if rows is not None and spec.tile_width:
            parts = [parts[0][begin:end] for begin, end in rows]
    finally:
        source.close()
    pixels = np.asarray(parts[0] if len(parts) == 1 else np.concatenate(parts), np.float16 if half else np.float32)
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    if channels is None or pixels.shape[2] == channels:
        return pixels
    if channels == 3 and pixels.shape[2] in (1, 2):
        return np.repeat(pixels[:, :, :1], 3, axis=2)
    if pixels.shape[2] > channels:
        return np.ascontiguousarray(pixels[:, :, :channels])
    raise ImageError(f"expected {channels} channels in {path}, found {pixels.shape[2]}")


def holds_half(path: Path) -> bool:
    """Whether a file stores half floats, from its header; False if it cannot be read."""
    source = _oiio().ImageInput.open(str(path)) if path.is_file() else None
    if source is None:
        _oiio().geterror()  # cleared, so that it is not printed at exit
        return False
    half = bool(source.spec().format == _oiio().TypeHalf)
    source.close()
    return half


def size_of(path: Path) -> tuple[int, int]:
    """(height, width) from the header; ImageError if it cannot be read."""
    oiio = _oiio()
    source = oiio.ImageInput.open(str(path)) if path.is_file() else None
    if source is None:
        raise ImageError(f"cannot read image {path}: {_first_line(oiio.geterror()) if path.is_file() else 'no such file'}")
    spec = source.spec()
    source.close()
    return spec.height, spec.width


@dataclass(frozen=True)
class Part:
    """One image of a file by its header: `data` is the stored window, `display` the frame, each (x, y, width, height)."""

    index: int
    name: str
    channels: tuple[str, ...]
    data: tuple[int, int, int, int]
    display: tuple[int, int, int, int]
    bits: int
    chromaticities: tuple[float, ...] | None
    orientation: int
    profile: bytes | None


def parts_of(path: Path) -> list[Part]:
    """The headers of all images of a file: parts of an EXR, pages, frames. ImageError if the file cannot be read."""
    source = _opened(path)
    parts: list[Part] = []
    try:
        while source.seek_subimage(len(parts), 0):
            spec = source.spec()
            primaries = spec.getattribute("chromaticities")
            profile = spec.getattribute("ICCProfile")
            parts.append(
                Part(
                    len(parts),
                    str(spec.getattribute("oiio:subimagename") or ""),
                    tuple(spec.channelnames),
                    (spec.x, spec.y, spec.width, spec.height),
                    (spec.full_x, spec.full_y, spec.full_width, spec.full_height),
                    int(spec.format.basesize()) * 8,
                    tuple(float(v) for v in primaries) if primaries is not None and len(primaries) == 8 else None,
                    int(spec.getattribute("Orientation") or 1),
                    None if profile is None else bytes(bytearray(profile)),
                )
            )
        source.geterror()
    finally:
        source.close()
    return parts


def read_channels(path: Path, part: Part, channels: Sequence[int]) -> Float32[ndarray, "H W C"]:
    """Channels of one part in its display window: zero outside the stored window; overscan is cropped."""
    source, low, high = _opened(path), min(channels), max(channels) + 1
    try:
        stored = source.read_image(part.index, 0, low, high, _oiio().FLOAT)
        if stored is None:
            raise ImageError(f"cannot read image {path}: {_first_line(source.geterror())}; is it damaged or cut short?")
    finally:
        source.close()
    x, y, width, height = part.data
    stored = np.asarray(stored, np.float32).reshape(height, width, high - low)[:, :, [c - low for c in channels]]
    if part.data == part.display:
        return np.ascontiguousarray(stored)
    left, top, across, down = part.display
    frame = np.zeros((down, across, len(channels)), np.float32)
    x0, x1, y0, y1 = max(x, left), min(x + width, left + across), max(y, top), min(y + height, top + down)
    if x0 < x1 and y0 < y1:
        frame[y0 - top : y1 - top, x0 - left : x1 - left] = stored[y0 - y : y1 - y, x0 - x : x1 - x]
    return frame


def _opened(path: Path) -> Any:
    oiio = _oiio()
    wanted = oiio.ImageSpec()
    wanted.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), wanted) if path.is_file() else None
    if source is None:
        raise ImageError(f"cannot read image {path}: {_first_line(oiio.geterror()) if path.is_file() else 'no such file'}")
    return source


def require_finite(pixels: Float[ndarray, "H W C"], path: Path) -> None:
    """ImageError that names the file, the count and the first texel if `pixels`, float32 or float16, contain NaN or Inf."""
    if not (all_finite(pixels) if pixels.dtype == np.float16 else np.isfinite(pixels).all()):
        bad = ~np.isfinite(pixels).all(axis=2)
        r, c = np.argwhere(bad)[0]
        raise ImageError(f"expected finite values in {path}, found NaN or Inf in {int(bad.sum())} texels, first at row {r}, column {c}")


def write_image(path: Path, pixels: ndarray, encoding: Encoding, noisy: bool = False) -> None:
    """Write an image, atomically.

    Parameters
    ----------
    path
        Ends in .exr for `half` and `float`, in .png for `uint8`.
    pixels
        (H, W) or (H, W, C), row 0 at the top; uint8 for `uint8`.
    encoding
        `half` or `float`: an EXR, ZIP-compressed. `uint8`: a PNG of the bytes as given, without a color transform.
    noisy
        Bytes that their neighbors tell nothing of: they are smaller without PNG's filters.

    Raises
    ------
    ImageError
        On a value that is not finite or exceeds half floats (65504), on `uint8` of another type than bytes, and where the file cannot be
        written. Nothing is written then.
    MissingLibraryError
        Without OpenImageIO.

    Examples
    --------
    >>> image = relight(asset, [DirectionalLight((0.0, 0.0, 1.0))])
    >>> write_image(folder / "relit.exr", image, "float")
    >>> bool((read_image(folder / "relit.exr") == image).all())
    True
    """
    oiio = _oiio()
    pixels = pixels[:, :, None] if pixels.ndim == 2 else pixels
    if encoding == "uint8":
        if pixels.dtype != np.uint8:
            raise ImageError(f"expected bytes for {path}, found {pixels.dtype}")
        stored = pixels
    else:
        if not (all_finite(pixels) if pixels.dtype == np.float16 else np.isfinite(pixels).all()):
            raise ImageError(f"refused to write {path}: it would hold NaN or Inf")
        if encoding == "half" and pixels.dtype != np.float16 and pixels.size and float(np.abs(pixels).max()) > HALF_MAX:
            raise ImageError(f"expected values within half float's ±{HALF_MAX:.0f} for {path}, found {float(np.abs(pixels).max()):.4g}")
        stored = pixels.astype(np.float16 if encoding == "half" else np.float32, copy=False)
    height, width, channels = stored.shape
    spec = oiio.ImageSpec(width, height, channels, {"half": oiio.HALF, "float": oiio.FLOAT, "uint8": oiio.UINT8}[encoding])
    if encoding != "uint8":
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", NO_DATE)
    else:
        spec.attribute("oiio:UnassociatedAlpha", 1)  # a fourth channel is data, not alpha
        if noisy:
            spec.attribute("png:filter", PNG_NO_FILTER)
            spec.attribute("compression", "rle")
    with atomic_path(path) as temporary:
        target = oiio.ImageOutput.create(str(path))
        if target is None or not target.open(str(temporary), spec):
            raise ImageError(f"cannot write image {path}: {_first_line(target.geterror() if target else oiio.geterror())}")
        written = target.write_image(np.ascontiguousarray(stored))
        if not (target.close() and written):
            raise ImageError(f"cannot write image {path}: {_first_line(target.geterror())}; is the disk full?")


def float_exr(pixels: ndarray) -> bytes:
    """(H, W, C) as the bytes of an EXR of 32-bit floats."""
    with tempfile.TemporaryDirectory(prefix="srbf-") as folder:
        path = Path(folder) / "image.exr"
        write_image(path, pixels, "float")
        return path.read_bytes()


def write_images(images: Sequence[tuple[Path, ndarray, Encoding, bool]]) -> None:
    """`write_image` of each (path, pixels, encoding, noisy), with one thread per core; raises the first error after all have ended."""
    each(lambda i: write_image(*images[i]), len(images))


def write_picture(path: Path, linear: Float32[ndarray, "H W 3"], exposure: float = 0.0) -> None:
    """Write a PNG for display: the sRGB encoding of clip(value 2^exposure), 8 bits."""
    srgb = encode_srgb(np.clip(linear * 2.0**exposure, 0, 1))
    write_image(path, np.round(srgb * 255).astype(np.uint8), "uint8")


def encode_srgb(linear: ndarray) -> ndarray:
    """Linear [0, 1] to sRGB [0, 1] [IEC61966]."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)


def decode_srgb(srgb: ndarray) -> ndarray:
    """sRGB [0, 1] to linear [0, 1] [IEC61966]."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((np.maximum(srgb, 0.04045) + 0.055) / 1.055) ** 2.4)


def _oiio() -> Any:
    try:
        import OpenImageIO
    except ImportError as error:
        raise MissingLibraryError("reading and writing images needs OpenImageIO: pip install OpenImageIO") from error
    return OpenImageIO


def _first_line(message: str) -> str:
    return message.strip().splitlines()[0] if message.strip() else "unknown error"
