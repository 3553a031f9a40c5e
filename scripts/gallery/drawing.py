"""Images, labels and light directions on a sheet; all sizes in pixels."""

from __future__ import annotations

from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import get_data_path
from numpy import ndarray
from PIL import Image, ImageDraw, ImageFont

from srbf.io import files
from srbf.io.image import encode_srgb
from srbf.report.abrdf import disc_points

INK, SOFT, RULE, SUN, SUN_EDGE = "#262626", "#707070", "#c9c9c9", "#f0b429", "#a87512"
QUALITY = 85  # of WebP
SUPERSAMPLING = 4  # of a glyph


@cache
def font(size: int) -> Any:
    """DejaVu Sans, as included in matplotlib."""
    return ImageFont.truetype(str(Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), size)


def picture(linear: ndarray, gain: float, size: tuple[int, int]) -> Image.Image:
    """Linear values (H, W, 3) times a gain as sRGB, scaled to `size`."""
    display = encode_srgb(np.clip(linear * gain, 0, 1))
    shown = Image.fromarray(np.round(display * 255).astype(np.uint8))
    return shown if shown.size == size else shown.resize(size, Image.Resampling.LANCZOS)


def gain_of(linear: ndarray, white: float = 0.995) -> float:
    """The gain that makes the `white` quantile of the values 1."""
    return 1.0 / max(float(np.quantile(linear, white)), 1e-6)


def sun(direction: ndarray, size: int) -> Image.Image:
    """A glyph of a direction on the disk of the hemisphere seen from above (x right, y up), the zenith at its center; RGBA."""
    n = size * SUPERSAMPLING
    glyph = Image.new("RGBA", (n, n), (255, 255, 255, 0))
    draw = ImageDraw.Draw(glyph)
    middle, radius = n / 2, 0.44 * n
    draw.ellipse([middle - radius, middle - radius, middle + radius, middle + radius], fill="#f7f7f7", outline=RULE, width=SUPERSAMPLING)
    draw.line([middle - radius, middle, middle + radius, middle], fill=RULE, width=SUPERSAMPLING)
    draw.line([middle, middle - radius, middle, middle + radius], fill=RULE, width=SUPERSAMPLING)
    x, y = disc_points(np.asarray(direction, np.float64)[None])[0] * radius * [1, -1] + middle
    dot = 0.085 * n
    draw.line([middle, middle, x, y], fill="#e0a526", width=SUPERSAMPLING)
    draw.ellipse([x - dot, y - dot, x + dot, y + dot], fill=SUN, outline=SUN_EDGE, width=SUPERSAMPLING)
    return glyph.resize((size, size), Image.Resampling.LANCZOS)


def paste(sheet: Image.Image, glyph: Image.Image, x: int, y: int) -> None:
    """Paste a glyph with alpha onto a sheet."""
    sheet.paste(glyph, (x, y), glyph)


def label(sheet: Image.Image, x: int, y: int, text: str) -> None:
    """Draw white text on a dark band; its lower left corner is at (x, y)."""
    draw = ImageDraw.Draw(sheet, "RGBA")
    left, top, right, bottom = draw.textbbox((x + 6, y - 6), text, font=font(12), anchor="ls")
    draw.rectangle([left - 5, top - 4, right + 5, bottom + 4], fill=(0, 0, 0, 130))
    draw.text((x + 6, y - 6), text, font=font(12), fill="white", anchor="ls")


def save(sheet: Image.Image, path: Path) -> None:
    """Write a WebP atomically."""
    with files.atomic_path(path) as temporary:
        sheet.convert("RGB").save(temporary, "WEBP", quality=QUALITY, method=6)


def save_moving(frames: list[Image.Image], path: Path, milliseconds: int, most: int) -> int:
    """Write a looping WebP of at most `most` bytes with the best quality that allows it; returns that quality."""
    for quality in (85, 75, 65, 55, 45, 35, 25):
        held = BytesIO()
        frames[0].save(
            held,
            "WEBP",
            save_all=True,
            append_images=frames[1:],
            duration=milliseconds,
            loop=0,
            quality=quality,
            method=4,
            allow_mixed=False,
        )
        if held.tell() <= most:
            break
    with files.atomic_path(path) as temporary:
        temporary.write_bytes(held.getvalue())
    return quality
