"""The sheet on which the figures are drawn, and the conversion of linear values to display values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.errors import MissingLibraryError
from srbf.io.files import atomic_path
from srbf.io.image import encode_srgb
from srbf.report.abrdf import disc_points

INK, SOFT, RULE = "#262626", "#707070", "#c9c9c9"
ROLE_COLOR = {"train": "#8a99a8", "validation": "#2f7fa8", "holdout": "#c4502f"}
ROLE_MARKER = {"train": "o", "validation": "D", "holdout": "s"}
UNCOVERED = 0.82  # sRGB gray of texels outside the validity mask
DPI = 150  # of the saved PNG; sheets are laid out in units of 1/100 inch
MARGIN = 28
MIN_WIDTH = 760  # of a sheet, so that the title fits


class Sheet:
    """A white sheet in units of 1/100 inch from its top left corner, with a title and a line of explanation."""

    def __init__(self, width: float, height: float, title: str, note: str = "") -> None:
        """An empty sheet; MissingLibraryError without matplotlib."""
        try:
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure
        except ImportError as error:
            raise MissingLibraryError("writing a report needs matplotlib: pip install matplotlib") from error
        width = max(width, MIN_WIDTH)
        self.width, self.height = width, height
        self.figure = Figure(figsize=(width / 100, height / 100), dpi=DPI, facecolor="white")
        FigureCanvasAgg(self.figure)
        self._paper: Any = self.figure.add_axes((0, 0, 1, 1))
        self._paper.set(xlim=(0, width), ylim=(height, 0), autoscale_on=False)
        self._paper.set_axis_off()
        self.text(MARGIN, 20, title, size=14, weight="bold", va="top")
        self.text(MARGIN, 46, note, size=8.5, color=SOFT, va="top")

    def text(self, x: float, y: float, text: str, size: float = 9, color: str = INK, **options: Any) -> None:
        """Text at (x, y); `options` are those of matplotlib."""
        self.figure.text(x / self.width, 1 - y / self.height, text, fontsize=size, color=color, **options)

    def axes(self, x: float, y: float, width: float, height: float) -> Any:
        """Axes in the given box, with thin gray lines."""
        axes = self.figure.add_axes((x / self.width, 1 - (y + height) / self.height, width / self.width, height / self.height))
        axes.tick_params(labelsize=8, colors=SOFT, length=3)
        for name, spine in axes.spines.items():
            spine.set_visible(name in ("left", "bottom"))
            spine.set_color(RULE)
        return axes

    def image(self, x: float, y: float, width: float, height: float, pixels: ndarray, label: str = "") -> None:
        """Display values (H, W, 3) or gray (H, W) in [0, 1], row 0 at the top, with a label above the box."""
        shown = np.repeat(pixels[..., None], 3, axis=2) if pixels.ndim == 2 else pixels
        stored = np.round(np.clip(shown, 0, 1) * 255).astype(np.uint8)
        self._paper.imshow(stored, extent=(x, x + width, y + height, y), aspect="auto", interpolation="antialiased")
        if label:
            self.text(x, y - 4, label, va="bottom")

    def sun(self, x: float, y: float, size: float, direction: ndarray) -> None:
        """A light direction on the disc of directions seen from above (x right, y up); a ring if it is below the horizon."""
        from matplotlib.patches import Circle

        radius = size / 2.24
        cx, cy = x + size / 2, y + size / 2
        self._paper.add_patch(Circle((cx, cy), radius, fc="#f7f7f7", ec=RULE, lw=0.8))
        self._paper.plot([cx - radius, cx + radius], [cy, cy], color=RULE, lw=0.5)
        self._paper.plot([cx, cx], [cy - radius, cy + radius], color=RULE, lw=0.5)
        px, py = disc_points(np.asarray(direction)[None])[0] * radius
        self._paper.plot([cx, cx + px], [cy, cy - py], color="#e0a526", lw=1)
        self.point_light(cx + px, cy - py, above=bool(direction[2] > 0))

    def point_light(self, x: float, y: float, above: bool = True, size: float = 6.5) -> None:
        """A yellow dot, hollow for lights below the horizon."""
        self._paper.plot(x, y, "o", ms=size, mfc="#f0b429" if above else "white", mec="#a87512", mew=0.9)

    def dots(self, points: ndarray) -> None:
        """A faint cloud of (N, 2) points."""
        self._paper.scatter(*points.T, s=0.4, color=RULE)

    def save(self, path: Path) -> None:
        """Write the PNG atomically; equal figures give equal bytes."""
        with atomic_path(path) as temporary:
            self.figure.savefig(temporary, dpi=DPI, metadata={"Software": None})


def draw_disc(axes: Any, rings: tuple[float, ...] = (0.0, 30.0, 60.0), labels: bool = True) -> None:
    """The equal-area disc of a hemisphere: circles of equal elevation (degrees), and the axes x and y."""
    from matplotlib.patches import Circle

    axes.set(xlim=(-1.12, 1.12), ylim=(-1.12, 1.12), aspect="equal")
    axes.set_axis_off()
    for elevation in rings:
        radius = float(np.sqrt(1 - np.sin(np.radians(elevation))))
        axes.add_patch(Circle((0, 0), radius, fill=elevation == 0, fc="#f7f7f7", ec=RULE, lw=0.8, zorder=0))
        if labels and elevation > 0:
            axes.text(0.01, -radius + 0.02, f"{elevation:.0f}°", fontsize=7, color=SOFT, ha="left", va="bottom", zorder=1)
    axes.plot([-1, 1], [0, 0], color=RULE, lw=0.5, zorder=0)
    axes.plot([0, 0], [-1, 1], color=RULE, lw=0.5, zorder=0)
    if labels:
        axes.text(1.03, 0, "x", fontsize=8, color=SOFT, va="center")
        axes.text(0, 1.03, "y", fontsize=8, color=SOFT, ha="center")


def shown(linear: Float32[ndarray, "H W 3"], gain: float, covered: ndarray | None = None) -> ndarray:
    """sRGB of clip(linear * gain) as display values, NaN and uncovered receivers neutral gray."""
    gray = ~np.isfinite(linear).all(axis=2)
    display = encode_srgb(np.clip(np.where(gray[..., None], 0, linear) * gain, 0, 1))
    display[gray if covered is None else gray | ~covered] = UNCOVERED
    return display


def shown_signed(values: Float32[ndarray, "H W 3"], scale: float, covered: ndarray | None = None) -> ndarray:
    """Signed values as display values: mid gray is 0, white `scale`, black -`scale`, no sRGB curve."""
    display = 0.5 + 0.5 * np.clip(values / scale, -1, 1)
    if covered is not None:
        display[~covered] = UNCOVERED
    return display


def box_for(width: int, height: int, area: float, widest: float, tallest: float) -> tuple[float, float]:
    """(width, height) of about `area` with the image's aspect ratio, within `widest` and `tallest`."""
    w = np.sqrt(area * width / height)
    w = min(w, widest, tallest * width / height)
    return float(w), float(w * height / width)


def gain_text(gain: float) -> str:
    """An exposure as caption text: factor and stops."""
    return f"exposure ×{gain:.3g} ({np.log2(gain):+.1f} EV)"


def place_text(position: Sequence[float] | ndarray) -> str:
    """A position in meters, rounded to centimeters, without a negative zero."""
    return "(" + ", ".join(f"{round(v, 2) + 0.0:.2f}" for v in position) + ")"
