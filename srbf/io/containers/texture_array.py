"""A texture array in GPU layout: layers of one size, four channels, and their mip levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.errors import InputError
from srbf.io.containers.blocks import BLOCK_BYTES, BlockFormat, decode
from srbf.io.containers.dds_header import TexelFormat

TEXEL_BYTES = {"uint8": 4, "half": 8}
DTYPES = {"uint8": np.uint8, "half": np.float16}


def level_size(width: int, height: int, level: int) -> tuple[int, int]:
    """(width, height) of a mip level: halved and rounded down `level` times, at least one texel."""
    return max(1, width >> level), max(1, height >> level)


def level_bytes(form: str, width: int, height: int) -> int:
    """Bytes of one layer's level of width x height texels: blocks of 4 x 4 texels, rounded up, or plain texels."""
    if form in BLOCK_BYTES:
        return -(-width // 4) * -(-height // 4) * BLOCK_BYTES[form]
    return width * height * TEXEL_BYTES[form]


@dataclass(frozen=True, eq=False)
class TextureArray:
    """N layers of `width` x `height` texels, linear values, row 0 at the top.

    `levels`: from full size down, each (N, bytes) uint8 in the layout of GPU memory: texels or blocks, row by row.
    """

    form: TexelFormat
    width: int
    height: int
    levels: tuple[ndarray, ...]

    def __post_init__(self) -> None:
        for level, data in enumerate(self.levels):
            expected = (self.layers, level_bytes(self.form, *level_size(self.width, self.height, level)))
            if data.shape != expected or data.dtype != np.uint8:
                raise InputError(f"expected {expected} bytes of {self.form} in level {level}, found {data.shape} {data.dtype}")

    @staticmethod
    def of(form: TexelFormat, pixels: Sequence[ndarray]) -> TextureArray:
        """The array of plain texels (N, h, w, C) uint8 or float16, with one level; three channels get a fourth of 1."""
        height, width = pixels[0].shape[1:3]
        return TextureArray(form, width, height, tuple(_four(level).reshape(len(level), -1).view(np.uint8) for level in pixels))

    @property
    def layers(self) -> int:
        return len(self.levels[0])

    def pixels(self, level: int = 0) -> ndarray:
        """(N, h, w, 4) uint8 or float16 of a level, its blocks decoded."""
        width, height = level_size(self.width, self.height, level)
        data = self.levels[level]
        if self.form in BLOCK_BYTES:
            form: BlockFormat = "bc7" if self.form == "bc7" else "bc1"
            return decode(data, form, width, height)
        return np.ascontiguousarray(data).view(DTYPES[self.form]).reshape(self.layers, height, width, 4)


def _four(pixels: ndarray) -> ndarray:
    if pixels.shape[3] == 4:
        return np.ascontiguousarray(pixels)
    one = np.full((*pixels.shape[:3], 1), 255 if pixels.dtype == np.uint8 else 1, pixels.dtype)
    return np.concatenate([pixels, one], axis=3)
