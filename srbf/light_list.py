"""Light lists (.lp): a count, then `name x y z` a line, as photographers of relightable images keep them.

For near lights the same file holds positions instead of directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.capture import LightKind
from srbf.errors import ManifestError
from srbf.sphere import normalize


@dataclass(frozen=True)
class LightListEntry:
    """One image's name as the list spells it, and its light's unit direction, or position in metres (axes as they stand)."""

    name: str
    place: tuple[float, float, float]


def read_light_list(path: Path, kind: LightKind = "directional") -> list[LightListEntry]:
    """All entries of a .lp file, directions normalised, positions of point lights as they are; ManifestError names the line that is bad."""
    try:
        lines = [line.strip() for line in path.read_text(encoding="utf-8-sig").splitlines()]
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not text"
        raise ManifestError(f"expected a light list (.lp) at {path}, found none to read: {reason}") from error
    rows = [(number, line) for number, line in enumerate(lines, 1) if line]
    if not rows or not (rows[0][1].isascii() and rows[0][1].isdecimal()):
        raise ManifestError(f"expected the number of lights on the first line of {path}, found {rows[0][1] if rows else 'nothing'!r}")
    count, rows = int(rows[0][1]), rows[1:]
    if count != len(rows) or count == 0:
        raise ManifestError(f"expected {count} lights in {path} as its first line says, found {len(rows)}")
    entries, seen = [], set()
    for number, line in rows:
        words = line.rsplit(maxsplit=3)
        try:
            name, vector = words[0], np.array([float(w) for w in words[1:]])
        except ValueError:
            name, vector = "", np.zeros(0)
        if vector.shape != (3,) or not np.isfinite(vector).all():
            raise ManifestError(f"expected `name x y z` on line {number} of {path}, found {line!r}")
        if kind == "directional" and np.abs(vector).max() < 1e-12:
            raise ManifestError(f"expected a direction on line {number} of {path}, found the zero vector")
        if name in seen:
            raise ManifestError(f"expected each image once in {path}, found {name!r} again on line {number}")
        seen.add(name)
        x, y, z = normalize(vector) if kind == "directional" else vector
        entries.append(LightListEntry(name, (float(x), float(y), float(z))))
    return entries
