"""Parts of the page: a heading with the HTML below it, and the pictures that are files."""

from __future__ import annotations

import html
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from srbf.io.image import size_of
from srbf.report.inline import data_uri, figure, image
from srbf.report.subject import Picture

MOVING_SUFFIXES = (".webp", ".gif")
WIDE_RATIO = 1.2  # width over height from which a sheet shares a printed page with another


@dataclass(frozen=True)
class Section:
    """A heading and the HTML below it."""

    title: str
    body: str


@dataclass(frozen=True)
class Figure:
    """A picture to draw into a folder as `file`; with `missing`, the reason why there is none."""

    file: str
    title: str
    draw: Callable[[Path], Picture]
    missing: str | None = None
    optional: bool = False  # where a library for it is not installed, the page says so


def drawn(picture: Picture, folder: Path) -> str:
    """A figure's element, or the reason for its absence."""
    if picture.omitted:
        return f'<p class="soft">{html.escape(picture.caption)}</p>'
    path = folder / picture.file
    height, width = size_of(path) if path.suffix == ".png" else (1, 1)
    style = "sheet wide" if width > WIDE_RATIO * height else "sheet"
    return figure(image(data_uri(path), picture.title, style), picture.caption)


def is_moving(picture: Picture) -> bool:
    """Whether it is an animation."""
    return Path(picture.file).suffix in MOVING_SUFFIXES


def moving(pictures: list[Picture], folder: Path) -> list[str]:
    """The elements of the animations among `pictures`."""
    return [f'<div class="moving">{drawn(picture, folder)}</div>' for picture in pictures if is_moving(picture)]
