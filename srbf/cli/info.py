"""`srbf info`: what a capture or an asset holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from srbf.cli.parameters import Json
from srbf.cli.terminal import print_json
from srbf.info import describe

MOST_NAMES = 8  # in a line
COLUMN = 18  # characters of a name, at least


def info(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="Folder of a capture or an asset.", show_default=False)],
    json: Json = False,
) -> None:
    """Print size, lights, fit, error and memory; checks every file on the way."""
    facts = describe(path)
    if json:
        print_json(facts)
        return
    width = max(COLUMN, *(len(name) + 1 for name in facts))
    for name, value in facts.items():
        typer.echo(f"{name.replace('_', ' '):<{width}}{_shown(value)}")


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_shown(part)}" for key, part in value.items())
    if isinstance(value, list) and value and all(isinstance(part, str) for part in value):
        more = f" and {len(value) - MOST_NAMES} more" if len(value) > MOST_NAMES else ""
        return ", ".join(value[:MOST_NAMES]) + more
    if isinstance(value, list) and value and all(isinstance(part, (int, float)) for part in value):
        return "(" + ", ".join(_shown(part) for part in value) + ")"
    return f"{value:.5g}" if isinstance(value, float) else str(value)
