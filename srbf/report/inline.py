"""Files and pixels as data URIs, and the HTML elements of the page."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from numpy import ndarray

KINDS = {".png": "image/png", ".webp": "image/webp", ".gif": "image/gif"}
SHEET_QUALITY = 92


@dataclass(frozen=True)
class Table:
    """A heading and rows of text under column names; with `numbers`, all columns except the first are right-aligned."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: bool = False

    def html(self) -> str:
        """The table without its heading."""
        head = "".join(f"<th{self._style(i)}>{escape(name)}</th>" for i, name in enumerate(self.columns))
        body = "\n".join(
            "<tr>" + "".join(f"<td{self._style(i)}>{escape(cell)}</td>" for i, cell in enumerate(row)) + "</tr>" for row in self.rows
        )
        return f"<table>\n<tr>{head}</tr>\n{body}\n</table>"

    def markdown(self) -> list[str]:
        """The table without its heading, line by line."""
        lines = ["| " + " | ".join(self.columns) + " |", "|" + " --- |" * len(self.columns)]
        return lines + ["| " + " | ".join(row) + " |" for row in self.rows]

    def _style(self, column: int) -> str:
        return ' class="number"' if self.numbers and column > 0 else ""


def data_uri(path: Path) -> str:
    """An image file as a data URI; a PNG becomes WebP of high quality, a third of its size, if Pillow supports it."""
    from PIL import Image, features

    if path.suffix == ".png" and features.check("webp"):
        memory = io.BytesIO()
        with Image.open(path) as sheet:
            sheet.convert("RGB").save(memory, "WEBP", quality=SHEET_QUALITY, method=3)
        return "data:image/webp;base64," + base64.b64encode(memory.getvalue()).decode()
    return f"data:{KINDS[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"


def pixels_uri(display: ndarray) -> str:
    """Display values (H, W, 3) in [0, 1] as the data URI of a PNG."""
    from PIL import Image

    stored = np.round(np.clip(display, 0, 1) * 255).astype(np.uint8)
    memory = io.BytesIO()
    Image.fromarray(stored).save(memory, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(memory.getvalue()).decode()


def image(source: str, alt: str, style: str = "") -> str:
    """An image element of CSS class `style`; `source` is a data URI."""
    return f'<img{_class(style)} src="{source}" alt="{escape(alt)}">'


def figure(inside: str, caption: str, style: str = "") -> str:
    """A figure: HTML elements and a caption of plain text."""
    return f"<figure{_class(style)}>{inside}\n<figcaption>{escape(caption)}</figcaption></figure>"


def paragraphs(*texts: str) -> str:
    """Plain texts, one paragraph each."""
    return "\n".join(f"<p>{escape(text)}</p>" for text in texts)


def colored(values: ndarray, top: float, name: str, covered: ndarray, uncovered: float) -> ndarray:
    """Scalars (H, W) as display values by a matplotlib color map from 0 to `top`; the gray `uncovered` outside `covered`."""
    from matplotlib import colormaps

    display = colormaps[name](np.clip(values / max(top, 1e-30), 0, 1))[..., :3]
    display[~covered] = uncovered
    return display


def ramp(name: str, steps: int = 24) -> Sequence[str]:
    """Hex colors along a matplotlib color map."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps[name]((i + 0.5) / steps)) for i in range(steps)]


def _class(style: str) -> str:
    return f' class="{style}"' if style else ""
