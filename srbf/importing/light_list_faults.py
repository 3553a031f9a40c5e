"""Faults of the lines of a light list, and how to correct them."""

from __future__ import annotations

import re

import numpy as np
from numpy import ndarray

from srbf.arrays import Float
from srbf.importing.light_list_text import as_number

FROM_ANGLES = "x = cos(elevation) cos(azimuth), y = cos(elevation) sin(azimuth), z = sin(elevation)"
MAX_VECTOR = 10.0  # of the first column; a larger one with a third column of 0 or 1 is an angle


def fault_of(line: str) -> str:
    """`; …` with the correction of a line that is not `name x y z`; empty if unknown."""
    if "°" in line or re.search(r"[0-9]\s*deg", line, re.IGNORECASE):
        return f"; degrees are not read: write {FROM_ANGLES}"
    words = line.split()
    numbers = _trailing(words)
    commas = [word for word in words if re.fullmatch(r"[-+]?[0-9]*,[0-9]+(?:[eE][-+]?[0-9]+)?[;]?", word)]
    if len(commas) >= 2 or re.search(r";\s*[-+]?[0-9]+,[0-9]+\s*;", line):
        return "; numbers have a decimal comma: write 0.5, not 0,5, and spaces between them"
    spaced = re.sub(r"[,;]\s*", " ", line)
    if spaced != line and _trailing(spaced.split()) >= 3:
        return "; values are separated by commas or semicolons: write spaces between them"
    if numbers >= 4:
        return (
            f"; {numbers} numbers follow the name: keep x y z and remove the rest (divide the images by a column of intensities), "
            "or put the name in quotes"
        )
    if numbers == 2:
        return f"; two numbers are no direction: if they are azimuth and elevation in degrees, write {FROM_ANGLES}"
    return ""


def spherical_fault(vectors: Float[ndarray, "L 3"]) -> str | None:
    """A message if the columns can only be azimuth and elevation in degrees with a radius of 0 or 1; None for vectors.

    Vectors of any length pass: those of a ring have one length, those of a dome differ in z.
    """
    lengths = np.linalg.norm(vectors, axis=1)
    azimuth, elevation, radius = vectors.T
    if len(vectors) < 2 or not (radius == radius[0]).all() or radius[0] not in (0, 1) or np.ptp(lengths) <= 0.01 * lengths.max():
        return None
    if np.abs(azimuth).max() <= MAX_VECTOR or np.abs(azimuth).max() > 360 or np.abs(elevation).max() > 90:
        return None
    return f"azimuth and elevation in degrees, by their range: write {FROM_ANGLES}; if they are vectors, write them at unit length"


def _trailing(words: list[str]) -> int:
    """The number of numbers at the end, without the first word, which is the name."""
    count = 0
    for word in reversed(words[1:]):
        if as_number(word) is None:
            break
        count += 1
    return count
