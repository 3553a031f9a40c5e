"""The content of a file before color conversion and rotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32

Model = Literal["gray", "rgb", "cmyk", "lab"]
# Raw files of cameras. If a name without suffix fits several files, these suffixes are tried after those of images.
RAW_NAMES = (
    "3fr arw bay cap cr2 cr3 crw dcr dng erf fff iiq k25 kc2 kdc mdc mef mos mrw nef nrw orf pef ptx pxn raf raw rw2 rwl sr2 srf srw "
    "sti x3f"
)
RAW_SUFFIXES = tuple(f".{name}" for name in RAW_NAMES.split())


@dataclass(frozen=True)
class Tags:
    """The tags of a file about its values. Most files have none and are decoded by the `transfer` given.

    profile: an ICC profile. gamma: light = value^gamma. curve: linear value of each stored level, (n,) or (n, 3). chromaticities: x and y
    of red, green, blue and white. srgb: the file is tagged as sRGB. orientation: EXIF's, 1 to 8.
    """

    profile: bytes | None = None
    gamma: float | None = None
    curve: ndarray | None = None
    chromaticities: tuple[float, ...] | None = None
    space: str = ""
    srgb: bool = False
    orientation: int = 1


@dataclass(frozen=True)
class Found:
    """Pixels as stored, without alpha: (H, W, 1, 3 or 4), integers over their maximum; inks of CMYK 1 where full; L*, a*, b* of Lab.

    levels: the divisor of integers, 0 for floats.
    """

    pixels: Float32[ndarray, "H W C"]
    model: Model
    bits: int
    tags: Tags
    notes: tuple[str, ...] = ()
    levels: int = 0


def stripped(pixels: ndarray) -> tuple[Float32[ndarray, "H W C"], Model]:
    """Gray or RGB without further channels such as alpha and depth."""
    pixels = pixels[:, :, None] if pixels.ndim == 2 else pixels
    kept = 1 if pixels.shape[2] < 3 else 3
    return np.ascontiguousarray(pixels[:, :, :kept], np.float32), "gray" if kept == 1 else "rgb"
