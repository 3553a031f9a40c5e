"""BC7 and BC1 blocks of 4 x 4 texels: etcpak compresses, OpenImageIO decodes."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.errors import MissingLibraryError
from srbf.io.containers.dds_header import header
from srbf.io.image import read_stored

BlockFormat = Literal["bc7", "bc1"]
BLOCK_BYTES: dict[str, int] = {"bc7": 16, "bc1": 8}  # 8 and 4 bits per texel
SIDE = 4
ROW_BATCH = 1 << 14  # of one image that OpenImageIO decodes


def encode(pixels: ndarray, form: BlockFormat) -> ndarray:
    """(h, w, 3) or (h, w, 4) uint8 as blocks, (bytes,) uint8, row by row of blocks.

    All channels have equal weight, without perceptual weights, since the bytes are coefficients. The alpha of three channels is 255;
    `bc1` has none. Blocks beyond the right and the bottom edge repeat the last texels, and the texture keeps its size.
    MissingLibraryError without etcpak.
    """
    height, width, channels = pixels.shape
    padded = np.full((-(-height // SIDE) * SIDE, -(-width // SIDE) * SIDE, 4), 255, np.uint8)
    padded[..., :channels] = np.pad(pixels, ((0, len(padded) - height), (0, padded.shape[1] - width), (0, 0)), "edge")
    return np.frombuffer(_compressor(form)(padded.tobytes(), padded.shape[1], len(padded)), np.uint8)


def decode(blocks: ndarray, form: BlockFormat, width: int, height: int) -> ndarray:
    """(N, height, width, 4) uint8 of N layers' blocks, (N, bytes) uint8, by OpenImageIO's DDS reader."""
    high, wide = -(-height // SIDE) * SIDE, -(-width // SIDE) * SIDE
    pixels = np.empty((len(blocks), height, width, 4), np.uint8)
    at_a_time = max(1, ROW_BATCH // high)
    with tempfile.TemporaryDirectory(prefix="srbf-") as folder:
        path = Path(folder) / "blocks.dds"
        for start in range(0, len(blocks), at_a_time):
            some = blocks[start : start + at_a_time]
            path.write_bytes(header(form, wide, high * len(some)) + some.tobytes())  # layers stacked vertically
            picture = np.round(read_stored(path, 4) * 255).astype(np.uint8)
            pixels[start : start + at_a_time] = picture.reshape(len(some), high, wide, 4)[:, :height, :width]
    return pixels


def _compressor(form: BlockFormat) -> Callable[[bytes, int, int], bytes]:
    etcpak = _etcpak()
    if form == "bc1":
        return lambda data, width, height: etcpak.compress_bc1(data, width, height)
    settings = etcpak.BC7CompressBlockParams()
    settings.init_linear_weights()  # otherwise luma has the largest weight
    return lambda data, width, height: etcpak.compress_bc7(data, width, height, settings)


@cache
def _etcpak() -> Any:
    try:
        import etcpak
    except ImportError as error:
        raise MissingLibraryError("compressing textures needs etcpak: pip install 'srbf[export]'") from error
    return etcpak
