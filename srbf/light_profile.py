"""Profiles of lights: what share of a light's strength goes into each direction, by a photometric file or by a projected image."""

from __future__ import annotations

import functools
import hashlib
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.errors import InputError
from srbf.io.ies import parse_ies

Axes = tuple[ndarray, ndarray, ndarray]
VERTICAL = 1e-6  # sine of the angle to the world's z, up to which a direction is straight up or down
MOST_TEXELS = 1 << 26


@dataclass(frozen=True, eq=False)
class Profile:
    """A table of factors on a light's color over directions in the light's own frame, looked up bilinearly.

    The frame looks along the light's direction: x to the right and y upward, see `axes_of`. Two profiles of equal tables are equal.

    Parameters
    ----------
    table
        (H, W, 3), at least 0, linear; kept as float32. By angles: rows from the light's direction, 0, to the opposite, pi, both included;
        columns by the azimuth atan2(x, y) + pi, from 0 to 2 pi, both included, or one column for all. Projected: an image, row 0 at
        the top, over the square around a spot's cone, as Cycles maps it: its middle is the axis, its sides touch the half-angle `outer`.
    projected
        Which of both.
    file
        Name and content of the file that it is made of, for renders by Cycles; does not count where profiles are compared.

    Raises
    ------
    InputError
        On a table of another shape, with negative numbers, NaN or Inf.

    Examples
    --------
    >>> from srbf.light_profile import Profile
    >>> down = Profile(np.repeat([[[1.0, 1.0, 1.0]], [[1.0, 1.0, 1.0]], [[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]]], 1, axis=1))
    >>> PointLight((0.0, 0.0, 2.0), profile=down).profile == down
    True
    """

    table: ndarray  # (H, W, 3) float32
    projected: bool = False
    file: tuple[str, bytes] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        table = np.ascontiguousarray(self.table, np.float32)
        if table.ndim != 3 or table.shape[2] != 3 or 0 in table.shape or table.size > MOST_TEXELS:
            raise InputError(f"expected a profile's table of shape (H, W, 3), found {table.shape}")
        if not (np.isfinite(table).all() and (table >= 0).all()):
            raise InputError("expected a profile of finite factors of at least 0, found others")
        if not self.projected and len(table) < 2:
            raise InputError("expected a profile's table of at least 2 rows, found 1")
        object.__setattr__(self, "table", table)

    @staticmethod
    def of_ies(content: bytes, name: str) -> Profile:
        """Of a photometric file's content: the factors that Cycles' IES Texture gives at a strength of 1. InputError names `name`."""
        table = parse_ies(content, name).table()
        return Profile(np.repeat(table[:, :, None], 3, axis=2), file=(name, content))

    @property
    def name(self) -> str:
        """Of its file, by which lights name it; InputError where it was read from none."""
        if self.file is None:
            raise InputError("expected a profile that was read from a file, found another")
        return self.file[0]

    @functools.cached_property
    def key(self) -> bytes:
        """Equal of profiles that are equal."""
        digest = hashlib.sha256(repr((self.table.shape, self.projected)).encode())
        digest.update(self.table.tobytes())
        return digest.digest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Profile) and (self is other or self.key == other.key)

    def __hash__(self) -> int:
        return hash(self.key)

    def at(self, own: Float[ndarray, "n 3"], tangent: float) -> Float64[ndarray, "n 3"]:
        """The factors in directions.

        Parameters
        ----------
        own
            (n, 3) components along x, y and the light's direction, of any length.
        tangent
            Of a spot's outer half-angle, where the profile is projected.

        Returns
        -------
        ndarray
            (n, 3) float64.

        Examples
        --------
        >>> from srbf.light_profile import Profile
        >>> falling = Profile(np.stack([np.full((1, 3), 1.0), np.full((1, 3), 0.0)]))  # 1 ahead to 0 behind
        >>> falling.at(np.array([[1.0, 0.0, 0.0]]), 0.0).tolist()
        [[0.5, 0.5, 0.5]]
        """
        own = np.asarray(own, np.float64)
        x, y, ahead = own[:, 0], own[:, 1], own[:, 2]
        height, width = self.table.shape[:2]
        if self.projected:
            front = ahead > 0
            scale = 0.5 / (np.where(front, ahead, 1) * tangent)
            column = np.clip((0.5 + x * scale) * width - 0.5, 0, width - 1)
            row = np.clip((0.5 - y * scale) * height - 0.5, 0, height - 1)
            return self._mixed(row, column) * front[:, None]
        row = np.arctan2(np.hypot(x, y), ahead) / np.pi * (height - 1)
        return self._mixed(row, (np.arctan2(x, y) / (2 * np.pi) + 0.5) * (width - 1))

    def _mixed(self, row: Float64[ndarray, " n"], column: Float64[ndarray, " n"]) -> Float64[ndarray, "n 3"]:
        height, width = self.table.shape[:2]
        top, left = np.minimum(row.astype(np.int64), height - 1), np.minimum(column.astype(np.int64), width - 1)
        bottom, right = np.minimum(top + 1, height - 1), np.minimum(left + 1, width - 1)
        down, across = (row - top)[:, None], (column - left)[:, None]
        upper = self.table[top, left] * (1 - across) + self.table[top, right] * across
        lower = self.table[bottom, left] * (1 - across) + self.table[bottom, right] * across
        return upper * (1 - down) + lower * down


def read_ies_profile(path: Path) -> Profile:
    """Of a photometric file; InputError where it is not there or not read."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"expected an IES file, found none at {path} ({error.strerror})") from error
    return replace(Profile.of_ies(content, str(path)), file=(path.name, content))


def axes_of(direction: tuple[float, float, float], roll: float) -> Axes:
    """Unit vectors x to the right and y upward of what looks along a unit `direction`, and the direction itself.

    y is as near to the world's z as it can be; straight up or down it is the world's y. `roll` (rad) turns x toward y: counterclockwise for
    one who looks against the light, as Blender's rotation about an object's local z.
    """
    ahead = np.array(direction, np.float64)
    vertical = np.hypot(ahead[0], ahead[1]) < VERTICAL
    x = np.cross([0.0, 1.0, 0.0] if vertical else [0.0, 0.0, 1.0], -ahead)
    x /= np.linalg.norm(x)
    y = np.cross(-ahead, x)
    return np.cos(roll) * x + np.sin(roll) * y, np.cos(roll) * y - np.sin(roll) * x, ahead


def roll_of(direction: tuple[float, float, float], x: Float64[ndarray, " 3"]) -> float:
    """The roll (rad) at which `axes_of` has this x."""
    level, upward, _ = axes_of(direction, 0.0)
    return float(np.arctan2(x @ upward, x @ level))
