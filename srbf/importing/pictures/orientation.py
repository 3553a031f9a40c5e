"""EXIF's Orientation: the sides of the displayed image on which the stored row 0 and column 0 lie."""

from __future__ import annotations

import numpy as np
from numpy import ndarray


def turned(pixels: ndarray, orientation: int) -> ndarray:
    """(H, W, C) pixels in display orientation; 5 to 8 swap height and width. Values other than 1 to 8 have no effect."""
    if orientation in (5, 6, 7, 8):
        pixels = np.swapaxes(pixels, 0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)
