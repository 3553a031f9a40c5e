"""Light lists (.lp): a count, then one `name x y z` per line, as used for reflectance transformation imaging.

For near lights the file holds positions instead of directions.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.captured_light import LightKind
from srbf.errors import ManifestError
from srbf.importing.light_list_faults import fault_of, spherical_fault
from srbf.importing.light_list_text import Row, as_number, rows_of
from srbf.sphere import normalize

QUOTED = re.compile(r"""(?:"([^"]+)"|'([^']+)'|“([^”]+)”)\s+(.+)""")
COMMENT = re.compile(r"\s(?:#|//|;).*$")


@dataclass(frozen=True)
class LightListEntry:
    """One image's name as the list spells it, and its light's unit direction, or position in meters (axes unchanged)."""

    name: str
    place: tuple[float, float, float]


def read_light_list(path: Path, kind: LightKind = "directional", say: Callable[[str], None] = lambda line: None) -> list[LightListEntry]:
    """All entries of a .lp file, directions normalized, positions of point lights unchanged; ManifestError names the invalid line.

    Names may be in quotes. Blank lines, and lines that begin with #, // or ;, are skipped. `say` reports an encoding other than UTF-8.
    """
    rows, comments = rows_of(path, say)
    count, rows = _count(path, rows), rows[1:]
    split = [_split(row.text) for row in rows]
    for row, found in zip(rows, split, strict=True):
        if found is None:
            raise ManifestError(f"expected `name x y z` on line {row.number} of {path}, found {row.text!r}{fault_of(row.text)}")
    if count != len(rows) or count == 0:
        skipped = f", {comments} comment lines aside" if comments else ""
        raise ManifestError(
            f"expected {count} lights in {path} as its first line says, found {len(rows)}{skipped}; correct the number or the lines"
        )
    named = [found for found in split if found is not None]
    vectors = np.array([vector for _, vector in named])
    entries, seen = [], set()
    for row, (name, values) in zip(rows, named, strict=True):
        vector = np.array(values)
        if kind == "directional" and np.abs(vector).max() < 1e-12:
            raise ManifestError(f"expected a direction on line {row.number} of {path}, found the zero vector")
        if name in seen:
            raise ManifestError(f"expected each image once in {path}, found {name!r} again on line {row.number}")
        seen.add(name)
        x, y, z = normalize(vector) if kind == "directional" else vector
        entries.append(LightListEntry(name, (float(x), float(y), float(z))))
    if kind == "directional" and (fault := spherical_fault(vectors)):
        raise ManifestError(f"expected directions x y z in {path}, found {fault}")
    return entries


def below_the_horizon(entries: Sequence[LightListEntry], listed: str) -> str | None:
    """A message about directions with z <= 0 in the list named `listed`; None if there are none."""
    below = sum(entry.place[2] <= 0 for entry in entries)
    if below == 0:
        return None
    if below < len(entries):
        return f"{below} of {len(entries)} lights of {listed} are below the surface (z <= 0): the domain is the whole sphere"
    return (
        f"all {below} lights of {listed} are below the horizon (z <= 0): the domain is the whole sphere, and light from above was not "
        "captured; if they were above, z of the list has the wrong sign"
    )


def _count(path: Path, rows: Sequence[Row]) -> int:
    """The number on the first line, which may have a comment after it."""
    first = rows[0].text if rows else ""
    digits = COMMENT.sub("", first).strip()
    if re.fullmatch(r"[0-9]{1,9}", digits):
        return int(digits)
    missing = f"; every line is a light: put {len(rows)} above them" if rows and _split(first) is not None else ""
    raise ManifestError(f"expected the number of lights on the first line of {path}, found {first if rows else 'nothing'!r}{missing}")


def _split(line: str) -> tuple[str, tuple[float, ...]] | None:
    """(name, x y z) of a line without its comment; None for other lines."""
    return _name_and_numbers(line) or _name_and_numbers(COMMENT.sub("", line))


def _name_and_numbers(line: str) -> tuple[str, tuple[float, ...]] | None:
    quoted = QUOTED.fullmatch(line)
    if quoted is not None:
        name, words = next(group for group in quoted.groups()[:3] if group is not None), quoted[4].split()
    else:
        name, *words = line.rsplit(maxsplit=3)
        if _has_column_too_many(name):
            return None
    numbers = [as_number(word) for word in words]
    if len(numbers) != 3 or not name.strip():
        return None
    values = tuple(number for number in numbers if number is not None)
    return (name, values) if len(values) == 3 else None


def _has_column_too_many(name: str) -> bool:
    """Whether the text before the last three numbers is a file name and one more number (`a.png 0.5`), not a name (`IMG 5`)."""
    head, *rest = name.rsplit(maxsplit=1)
    return bool(rest) and as_number(rest[0]) is not None and re.search(r"\.[A-Za-z][A-Za-z0-9]{1,4}[\"'”]?$", head) is not None
