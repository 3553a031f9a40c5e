"""Photometric files, IES LM-63: candela over directions, as luminaires' makers publish them."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.errors import InputError

CANDELA = 4 * np.pi / 177.83  # of a light's strength: Cycles takes 177.83 lm/W, of D65, and a point light of 4 pi W gives 1 W/sr
ROWS, COLUMNS = 361, 721  # directions of a table: half a degree
MOST_ANGLES = 4096  # of a file, each way
HEADER = 13  # numbers before the angles
TYPES = {2: "B", 3: "A"}


@dataclass(frozen=True, eq=False)
class IesFile:
    """Candela (H, V) at V angles from the downward axis and H angles about it, degrees, ascending; H from 0 to 360, or 0
    alone."""

    vertical: Float64[ndarray, " V"]
    horizontal: Float64[ndarray, " H"]
    candela: Float64[ndarray, "H V"]

    def table(self, as_cycles: bool = True) -> Float32[ndarray, "R C"]:
        """CANDELA times the candela at R angles from the axis, 0 to pi, and C about it, 0 to 2 pi, the ends included; 0 outside the file.

        Cubic interpolation. `as_cycles`: with 0 past the ends of the file, where Cycles 4.5 takes 0, except at the downward axis; between
        the first two and the last two angles that is up to an eighth too bright, and so is all of a file of one horizontal angle. Else
        periodic about the axis, and mirrored at both ends of it.
        """
        vertical, horizontal, candela = self.vertical, self.horizontal, self.candela
        if len(horizontal) == 1:
            horizontal, candela = np.array([0.0, 360.0]), np.repeat(candela, 2, axis=0)
        down, up = float(vertical[0] == 0), float(not as_cycles and vertical[-1] == 180)
        ends = (down * candela[:, 1:2], candela, up * candela[:, -2:-1])
        rows = np.linspace(0, 180, ROWS)
        across = _cubic(vertical, np.concatenate(ends, axis=1).T, rows)  # (R, H)
        across[(rows < vertical[0]) | (rows > vertical[-1])] = 0
        around = 0.0 if as_cycles else 1.0
        beside = (around * across[:, -2:-1], across, around * across[:, 1:2])
        found = _cubic(horizontal, np.concatenate(beside, axis=1).T, np.linspace(0, 360, COLUMNS)).T
        return (CANDELA * np.maximum(found, 0)).astype(np.float32)


def parse_ies(content: bytes, where: str) -> IesFile:
    """LM-63 of 1986, 1991, 1995, 2002 or 2019: type C, TILT=NONE, over a quarter, a half or all of the circle, or axially symmetric.

    A file from 90 to 270 degrees counts as one from 0 to 180, as in Cycles. InputError that names `where` on anything else.
    """
    text = content.decode("latin-1")
    tilt = re.search(r"^[ \t]*TILT[ \t]*=[ \t]*(\S*)[^\n\r]*$", text, re.MULTILINE)
    if tilt is None:
        raise InputError(f"expected a line TILT=NONE in the IES file {where}, found none")
    if tilt[1].upper() != "NONE":
        raise InputError(f"expected TILT=NONE in the IES file {where}, found TILT={tilt[1][:40]}; export it without a tilt")
    words = [word for word in re.split(r"[\s,]+", text[tilt.end() :]) if word]
    numbers = _numbers(words[:HEADER], HEADER, where)
    counts = [int(n) for n in numbers[3:5]]
    if not all(1 <= count <= MOST_ANGLES and count == n for count, n in zip(counts, numbers[3:5], strict=True)) or counts[0] < 2:
        raise InputError(
            f"expected numbers of vertical and horizontal angles in the IES file {where}, found {numbers[3]:g}, {numbers[4]:g}"
        )
    if numbers[5] != 1:
        raise InputError(
            f"expected photometry of type C in the IES file {where}, found type {TYPES.get(int(numbers[5]), f'{numbers[5]:g}')}"
        )
    v, h = counts
    rest = _numbers(words[HEADER : HEADER + v + h + v * h], v + h + v * h, where)
    vertical, horizontal = rest[:v], rest[v : v + h]
    candela = numbers[2] * numbers[10] * numbers[11] * rest[v + h :].reshape(h, v)  # multiplier, ballast factor, photometric factor
    if (np.diff(vertical) <= 0).any() or vertical[0] < 0 or vertical[-1] > 180:
        raise InputError(f"expected ascending vertical angles of 0 to 180 degrees in the IES file {where}, found {_ends(vertical)}")
    if (candela < 0).any():
        raise InputError(f"expected candela of at least 0 in the IES file {where}, found {candela.min():g}")
    return IesFile(vertical, *_whole_circle(horizontal, candela, where))


def _whole_circle(
    horizontal: Float64[ndarray, " h"], candela: Float64[ndarray, "h V"], where: str
) -> tuple[Float64[ndarray, " H"], Float64[ndarray, "H V"]]:
    """Mirrored from a quarter or a half; the angle 360 added where a file leaves it out."""
    if (np.diff(horizontal) <= 0).any():
        raise InputError(f"expected ascending horizontal angles in the IES file {where}, found {_ends(horizontal)}")
    if len(horizontal) > 1 and horizontal[0] == 90:
        horizontal = horizontal - 90
    if len(horizontal) == 1:
        return np.zeros(1), candela
    for end in (90.0, 180.0):
        if horizontal[0] == 0 and horizontal[-1] == end:
            horizontal = np.concatenate([horizontal, 2 * end - horizontal[-2::-1]])
            candela = np.concatenate([candela, candela[-2::-1]])
    if horizontal[0] == 0 and np.isclose(horizontal[-1] + horizontal[1], 360):
        horizontal, candela = np.append(horizontal, 360.0), np.concatenate([candela, candela[:1]])
    if horizontal[0] != 0 or horizontal[-1] != 360:
        raise InputError(
            f"expected horizontal angles from 0 to 0, 90, 180 or 360 degrees in the IES file {where}, found {_ends(horizontal)}"
        )
    return horizontal, candela


def _cubic(knots: Float64[ndarray, " n"], values: Float64[ndarray, "m k"], at: Float64[ndarray, " r"]) -> Float64[ndarray, "r k"]:
    """Catmull-Rom by the number of a knot, as if they were equally far apart; `values` have one more at each end, m = n + 2."""
    i = np.clip(np.searchsorted(knots, at, "left") - 1, 0, len(knots) - 2)
    x = np.clip((at - knots[i]) / (knots[i + 1] - knots[i]), 0, 1)[:, None]
    a, b, c, d = (values[i + k] for k in range(4))
    return b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 4 * c - d + x * (3 * (b - c) + d - a)))


def _numbers(words: list[str], count: int, where: str) -> Float64[ndarray, " n"]:
    try:
        numbers = np.array([float(word) for word in words])
    except ValueError as error:
        raise InputError(f"expected numbers after TILT=NONE in the IES file {where}, found another word ({error})") from error
    if len(numbers) < count or not np.isfinite(numbers).all():
        raise InputError(f"expected {count} finite numbers more in the IES file {where}, found {len(numbers)}: it is cut off")
    return numbers


def _ends(angles: Float64[ndarray, " n"]) -> str:
    return f"{angles[0]:g} to {angles[-1]:g}"
