"""Plots as SVG inside the page: they use its font and its colors, light or dark, and print sharply."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy import ndarray

from srbf.report.abrdf import disc_points

LETTER_WIDTH = 6.2  # pixels, of a letter of a 12 px label, about
DISC_RINGS = (0.0, 30.0, 60.0)  # degrees of elevation


@dataclass(frozen=True)
class Axis:
    """A range of values, linear or logarithmic, its label and its ticks, at round values unless given."""

    low: float
    high: float
    label: str = ""
    log: bool = False
    ticks: tuple[float, ...] | None = None
    form: str = "g"
    most: int = 6  # ticks of a linear axis

    def at(self, values: ndarray) -> ndarray:
        """Values mapped linearly (or by their logarithm) to 0 at `low` and 1 at `high`."""
        if self.log:
            return np.asarray(np.log(np.maximum(values, 1e-300) / self.low) / np.log(self.high / self.low))
        return np.asarray((values - self.low) / (self.high - self.low))

    def marks(self) -> tuple[float, ...]:
        """The ticks' values."""
        if self.ticks is not None:
            return self.ticks
        return tuple(decade_ticks(self.low, self.high) if self.log else nice_ticks(self.low, self.high, self.most))


class Plot:
    """Axes in a box of `width` x `height` CSS pixels; nothing is clipped, so keep values in range."""

    def __init__(
        self, width: float, height: float, x: Axis, y: Axis, margins: tuple[float, float, float, float] = (18, 16, 42, 52)
    ) -> None:
        """`margins`: top, right, bottom, left."""
        self.width, self.height, self.x, self.y = width, height, x, y
        self.top, self.right, self.bottom, self.left = margins
        self._parts: list[str] = []
        self._axes()

    def point(self, x: ndarray | float, y: ndarray | float) -> tuple[ndarray, ndarray]:
        """Values as CSS pixels."""
        across = self.left + self.x.at(np.asarray(x, np.float64)) * (self.width - self.left - self.right)
        down = self.height - self.bottom - self.y.at(np.asarray(y, np.float64)) * (self.height - self.top - self.bottom)
        return np.asarray(across), np.asarray(down)

    def line(self, x: ndarray, y: ndarray, style: str) -> None:
        """A polyline of CSS class `style`."""
        self._parts.append(f'<polyline class="line {style}" points="{_points(*self.point(x, y))}"/>')

    def dots(self, x: ndarray, y: ndarray, style: str, radius: float = 3.5, titles: Sequence[str] = ()) -> None:
        """Dots of CSS class `style`; `titles` show under the pointer."""
        self.shapes(*self.point(x, y), style, radius, titles)

    def shapes(self, across: ndarray, down: ndarray, style: str, radius: float, titles: Sequence[str] = ()) -> None:
        """Dots at CSS pixels."""
        for i, (px, py) in enumerate(zip(np.atleast_1d(across), np.atleast_1d(down), strict=True)):
            title = f"<title>{escape(titles[i])}</title>" if titles else ""
            self._parts.append(f'<circle class="dot {style}" cx="{px:.1f}" cy="{py:.1f}" r="{radius:g}">{title}</circle>')

    def label(self, x: float, y: float, text: str, style: str = "", dx: float = 0, dy: float = 0, anchor: str = "start") -> None:
        """Text at a value, moved by (dx, dy) CSS pixels; `anchor` start, middle or end."""
        px, py = self.point(x, y)
        self.text(float(px) + dx, float(py) + dy, text, style, anchor)

    def text(self, px: float, py: float, text: str, style: str = "", anchor: str = "start") -> None:
        """Text at CSS pixels."""
        self._parts.append(f'<text class="{style}" x="{px:.1f}" y="{py:.1f}" text-anchor="{anchor}">{escape(text)}</text>')

    def rule(self, x: float | None = None, y: float | None = None, style: str = "rule") -> None:
        """A line through the whole box, vertical at `x` or horizontal at `y`."""
        if x is not None:
            px = float(self.point(x, self.y.low)[0])
            self._parts.append(f'<path class="{style}" d="M{px:.1f} {self.top:g}V{self.height - self.bottom:g}"/>')
        if y is not None:
            py = float(self.point(self.x.low, y)[1])
            self._parts.append(f'<path class="{style}" d="M{self.left:g} {py:.1f}H{self.width - self.right:g}"/>')

    def svg(self, title: str) -> str:
        """The element; `title` is its accessible description."""
        return svg(self.width, self.height, title, self._parts)

    def _axes(self) -> None:
        for value in self.y.marks():
            self.rule(y=value)
            self.label(self.x.low, value, f"{value:{self.y.form}}", "soft", dx=-8, dy=4, anchor="end")
        for value in self.x.marks():
            px = float(self.point(value, self.y.low)[0])
            floor = self.height - self.bottom
            self._parts.append(f'<path class="rule" d="M{px:.1f} {floor:g}v5"/>')
            self.text(px, floor + 18, f"{value:{self.x.form}}", "soft", "middle")
        self.text((self.left + self.width - self.right) / 2, self.height - 4, self.x.label, "soft", "middle")
        self.text(0, 11, self.y.label, "soft")


def svg(width: float, height: float, title: str, parts: Iterable[str]) -> str:
    """An SVG element that scales with the page up to `width`."""
    return (
        f'<svg viewBox="0 0 {width:g} {height:g}" style="max-width:{width:g}px" role="img" aria-label="{escape(title)}">'
        + "".join(parts)
        + "</svg>"
    )


def disc(cx: float, cy: float, radius: float) -> list[str]:
    """The equal-area disc of a hemisphere of directions: circles of equal elevation and the axes, world x right and y up."""
    parts = []
    for elevation in DISC_RINGS:
        r = radius * float(np.sqrt(1 - np.sin(np.radians(elevation))))
        parts.append(f'<circle class="{"disc" if elevation == 0 else "rule"}" cx="{cx:g}" cy="{cy:g}" r="{r:.1f}"/>')
        if elevation:
            parts.append(f'<text class="soft small halo" x="{cx + 3:.1f}" y="{cy + r - 3:.1f}">{elevation:.0f}°</text>')
    parts.append(f'<path class="rule" d="M{cx - radius:g} {cy:g}h{2 * radius:g}M{cx:g} {cy - radius:g}v{2 * radius:g}"/>')
    parts.append(f'<text class="soft small" x="{cx + radius + 4:g}" y="{cy + 4:g}">x</text>')
    return parts


def on_disc(directions: ndarray, cx: float, cy: float, radius: float) -> tuple[ndarray, ndarray]:
    """CSS pixels of directions on a disc."""
    points = disc_points(directions)
    return cx + radius * points[:, 0], cy - radius * points[:, 1]


def nice_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten within [low, high], at most `most` of them."""
    for exponent in range(int(np.floor(np.log10(max(high - low, 1e-300)))) - 1, 400):
        for mantissa in (1, 2, 5):
            step = mantissa * 10.0**exponent
            first, last = int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9))
            if last - first + 1 <= most:
                return [round(i * step, max(0, -exponent)) for i in range(first, last + 1)]
    raise AssertionError("no step is large enough")


def decade_ticks(low: float, high: float) -> list[float]:
    """1, 2 and 5 times powers of ten within [low, high], or powers alone where those are many."""
    exponents = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    mantissas = (1, 2, 5) if len(exponents) <= 4 else (1,)
    return [m * 10.0**e for e in exponents for m in mantissas if low * 0.999 <= m * 10.0**e <= high * 1.001]


def spread_labels(wanted: Sequence[float], apart: float) -> list[float]:
    """Positions near `wanted` that are at least `apart` from each other, in the same order; for labels at the ends of lines."""
    order = np.argsort(wanted, kind="stable")
    placed = np.array(wanted, np.float64)
    for _ in range(200):
        moved = False
        for below, above in zip(order[:-1], order[1:], strict=True):
            gap = apart - (placed[above] - placed[below])
            if gap > 1e-6:
                placed[below] -= gap / 2
                placed[above] += gap / 2
                moved = True
        if not moved:
            break
    return placed.tolist()


def _points(across: ndarray, down: ndarray) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, down, strict=True))
