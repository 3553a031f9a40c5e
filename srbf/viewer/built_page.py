"""The built page, `srbf/viewer/page/`: files that need no network."""

from __future__ import annotations

from pathlib import Path

from srbf.errors import MissingLibraryError

ROOT = Path(__file__).resolve().parent / "page"
FILES = ("index.html", "viewer.js", "viewer.css", "LICENSES.txt")


def page_files(root: Path = ROOT) -> dict[str, Path]:
    """The page's files by name; MissingLibraryError if they were not built."""
    found = {name: root / name for name in FILES}
    if missing := [name for name, path in found.items() if not path.is_file()]:
        raise MissingLibraryError(f"expected the built page in {root}, found no {missing[0]}; run `make web`, or install a released srbf")
    return found
