"""Parameters that several commands share."""

from __future__ import annotations

import re
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
Dask = Annotated[
    str | None,
    typer.Option(
        help="Address of a dask scheduler, tcp://HOST:8786, whose workers do the work; they see the same folders.", show_default=False
    ),
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


def parse_samples(text: str) -> Literal["auto"] | int:
    """`auto` or a number of samples."""
    if text == "auto":
        return "auto"
    if not (text.isascii() and text.isdecimal()):
        raise InputError(f"expected --samples auto or a whole number, found {text!r}")
    return int(text)


def parse_duration(text: str) -> float:
    """Seconds of `90s`, `30m`, `8h`, `1h30m` or a plain number of seconds."""
    found = re.fullmatch(r"(?:(\d+(?:\.\d+)?)h)?(?:(\d+(?:\.\d+)?)m)?(?:(\d+(?:\.\d+)?)s?)?", text.strip())
    seconds = sum(float(n or 0) * unit for n, unit in zip(found.groups(), (3600, 60, 1), strict=True)) if found else 0.0
    if seconds <= 0:
        raise InputError(f"expected --time-limit as 90s, 30m or 8h, found {text!r}")
    return seconds


def parse_levels(text: str) -> Literal["auto"] | int:
    """`auto` or a number of mip levels."""
    if text == "auto":
        return "auto"
    if not (text.isascii() and text.isdecimal()):
        raise InputError(f"expected --levels auto or a whole number, found {text!r}")
    return int(text)
