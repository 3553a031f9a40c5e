"""An unfinished bake of an earlier version: its folder of sums gets the names that this version goes by."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from srbf.bake.accumulation import ACCUMULATION
from srbf.bake.images import PREPARED, RESIDUAL, VALID_MASK, checksum_of, write_preparation
from srbf.channels import GEOMETRY
from srbf.errors import ManifestError
from srbf.io import files

FORMER = "sums"
FILES = {"readable.npz": VALID_MASK, "left.npz": RESIDUAL}


def adopt(folder: Path) -> None:
    """Rename what an earlier version left, so that the bake is resumed. Killed at any moment, the next call completes it.

    For the process that holds the folder. A folder of this version is left as it is.
    """
    present = folder / ACCUMULATION
    if (folder / FORMER).is_dir() and not present.exists():
        (folder / FORMER).rename(present)
    for former, name in FILES.items():
        if (present / former).is_file():
            (present / former).replace(present / name)
    with suppress(ManifestError):  # damaged, or none: the receiver is prepared again
        stored = files.read_json(present / PREPARED)
        prepared = stored.get("prepared")
        if isinstance(prepared, dict) and "tints" in prepared and stored.get("sha256") == checksum_of(prepared):  # words: ok
            write_preparation(folder, _present(prepared))


def _present(former: dict[str, Any]) -> dict[str, Any]:
    ambient = ["ambient"] if former["ambient"] else []
    renamed = {f"{FORMER}/{name}": f"{ACCUMULATION}/{present}" for name, present in FILES.items()}
    checksums = {renamed.get(name, name): checksum for name, checksum in former["files"].items()}
    return {
        "facts": former["facts"],
        "sampling": former["sampling"],
        "transmittances": former["tints"],  # words: ok
        "channels": [*GEOMETRY, *ambient],
        "seams": former["seams"],
        "uv": former["uv"],
        "files": checksums,
    }
