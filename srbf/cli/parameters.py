"""Parameters that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from srbf.errors import InputError

Output = Annotated[Path, typer.Option("-o", "--output", help="Folder to write.", show_default=False)]
AssetFolder = Annotated[Path, typer.Argument(help="Folder of an asset (asset.json).", show_default=False)]
CaptureFolder = Annotated[Path, typer.Argument(help="Folder of a capture (capture.json).", show_default=False)]
Force = Annotated[bool, typer.Option("--force", help="Replace an output that exists.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")]
Blender = Annotated[
    Path | None, typer.Option("--blender", help="An installed Blender's executable, instead of the bpy module.", show_default=False)
]


def parse_size(text: str) -> tuple[int, int]:
    """(width, height) of `256` or `640x480`; InputError on others."""
    words = text.lower().split("x")
    if len(words) > 2 or not all(word.isascii() and word.isdecimal() for word in words):
        raise InputError(f"expected --size N or WxH, found {text!r}")
    return int(words[0]), int(words[-1])


def parse_sun_angle(text: str) -> Literal["auto"] | float:
    """`auto` or radians."""
    if text == "auto":
        return "auto"
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"expected --sun-angle auto or a number of radians, found {text!r}") from error
