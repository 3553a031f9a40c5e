"""The error of every tested point light as a map over its place: in plan and in section, over the cells of the scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.evaluation.motion_inside import MotionInside
from srbf.report.canvas import place_text
from srbf.report.inline import figure, ramp
from srbf.report.plot import nice_ticks, svg
from srbf.report.subject import Subject
from srbf.visibility.surface_cells import Cells

WIDTH = 900.0  # of all, without the scale
TALLEST = 460.0  # of a panel
GAP, LEFT, HEAD, FOOT = 64.0, 44.0, 26.0, 40.0
SCALE_WIDTH = 76.0
STACKED = 1.6  # panels stand one above the other where that draws a meter so much longer
MARGIN = 0.03  # of the longest side, m: around the scene
BACKGROUND = 2400  # dots of the scene
STEPS = 24  # of the scale
RADIUS = 5.0
EDGE_ON = 0.5  # |cosine| of a normal with the view below which a surface is an outline


@dataclass(frozen=True)
class Panel:
    """A view along an axis: its world axes across and up, and where its box is (CSS pixels)."""

    across: int
    up: int
    title: str
    x: float
    y: float
    scale: float
    low: Float64[ndarray, " 3"]
    high: Float64[ndarray, " 3"]

    @property
    def width(self) -> float:
        return float((self.high - self.low)[self.across] * self.scale)

    @property
    def height(self) -> float:
        return float((self.high - self.low)[self.up] * self.scale)

    def at(self, places: Float64[ndarray, "n 3"]) -> tuple[ndarray, ndarray]:
        """CSS pixels of places, m."""
        px = self.x + (places[:, self.across] - self.low[self.across]) * self.scale
        return px, self.y + self.height - (places[:, self.up] - self.low[self.up]) * self.scale

    def axes(self) -> list[str]:
        """Heading, frame, and ticks in meters."""
        names = "xyz"
        parts = [
            f'<text class="strong" x="{self.x:.1f}" y="{self.y - 10:.1f}">{self.title}</text>',
            f'<rect class="rule" x="{self.x:.1f}" y="{self.y:.1f}" width="{self.width:.1f}" height="{self.height:.1f}"/>',
        ]
        bottom = self.y + self.height
        for axis, length in ((self.across, self.width), (self.up, self.height)):
            for value in nice_ticks(float(self.low[axis]), float(self.high[axis]), max(2, min(7, int(length / 40)))):
                offset = (value - float(self.low[axis])) * self.scale
                if axis == self.across:
                    parts.append(f'<path class="rule" d="M{self.x + offset:.1f} {bottom:.1f}v5"/>')
                    parts.append(
                        f'<text class="soft" x="{self.x + offset:.1f}" y="{bottom + 18:.1f}" text-anchor="middle">{value:g}</text>'
                    )
                else:
                    parts.append(f'<path class="rule" d="M{self.x:.1f} {bottom - offset:.1f}h-5"/>')
                    parts.append(
                        f'<text class="soft" x="{self.x - 9:.1f}" y="{bottom - offset + 4:.1f}" text-anchor="end">{value:g}</text>'
                    )
        parts.append(
            f'<text class="soft" x="{self.x + self.width / 2:.1f}" y="{bottom + 35:.1f}" text-anchor="middle">'
            f"{names[self.across]}, m</text>"
        )
        parts.append(f'<text class="soft" x="{self.x - LEFT:.1f}" y="{self.y + 10:.1f}">{names[self.up]}</text>')
        return parts


def by_place(subject: Subject, tested: Sequence[int], motion: MotionInside | None = None) -> str:
    """The map of the lights `tested` (indices of point lights of the capture), with the path of a moving light."""
    places = subject.capture.positions(tested)
    values = np.array([subject.relative_of(i) for i in tested])
    scene, normals = background(subject)
    everything = np.concatenate([places, scene])
    extent = np.ptp(everything, axis=0)
    pad = MARGIN * max(float(extent.max()), 1e-3)
    low, high = everything.min(axis=0) - pad, everything.max(axis=0) + pad
    panels, height, width = arrange(low, high)
    top = max(float(np.quantile(values, 0.98)), 1e-6)
    colors = ramp("viridis", STEPS)
    order = np.argsort(values)  # the worst on top
    worst = int(order[-1])
    parts: list[str] = []
    for panel in panels:
        parts += panel.axes()
        along = np.abs(normals[:, 3 - panel.across - panel.up]) > EDGE_ON  # surfaces that face the eye; the others are outlines
        for style, chosen in (("cells", along), ("cells outline", ~along)):
            dots = " ".join(f"M{x:.1f} {y:.1f}h.01" for x, y in zip(*panel.at(scene[chosen]), strict=True))
            parts.append(f'<path class="{style}" d="{dots}"/>')
        if motion is not None:
            (x0, x1), (y0, y1) = panel.at(motion.places[[0, -1]])
            parts.append(f'<path class="line red dash" d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}"/>')
        across, down = panel.at(places)
        for i in order:
            title = f"<title>{place_text(places[i])} m: {values[i]:.1%}</title>"
            color = colors[int(np.clip(values[i] / top * STEPS, 0, STEPS - 1))]
            parts.append(f'<circle class="spot" cx="{across[i]:.1f}" cy="{down[i]:.1f}" r="{RADIUS:g}" fill="{color}">{title}</circle>')
        parts += _marked(panel, float(across[worst]), float(down[worst]), f"{values[worst]:.1%}")
    parts += _scale(width - SCALE_WIDTH + 22, panels[0].y + 10, colors, top)
    role = subject.capture.lights[tested[0]].role
    path = " Dashed: the path of the light in motion, below." if motion is not None else ""
    caption = (
        f"Relative RMSE of the picture under each of the {len(tested)} {role} point lights, at its place: from above, and from the "
        "side (−y). Small dots are surfaces, those seen edge-on stronger; a ring marks the worst light. Rest the pointer on a dot for its "
        f"place and error.{path}"
    )
    return figure(svg(width, height, "Relative error over the places of the lights", parts), caption)


def background(subject: Subject) -> tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]:
    """(places, normals) of the surfaces: of the patches' cells, or else of the receivers; at most BACKGROUND. Unknown normals are 0."""
    capture = subject.capture
    if "patches" in capture.manifest:
        cells = Cells.of_image(capture.patches())
        points, normals = cells.places, cells.normals
    else:
        images = [capture.geometry(name) for name in ("position", "normal")]
        points, normals = (np.zeros((0, 3)) if image is None else image[subject.covered] for image in images)
        normals = normals if len(normals) == len(points) else np.zeros_like(points)
    rows = np.arange(len(points))
    if len(points) > BACKGROUND:
        rows = np.sort(np.random.default_rng(0).choice(len(points), BACKGROUND, replace=False))
    return points[rows].astype(np.float64), normals[rows].astype(np.float64)


def arrange(low: Float64[ndarray, " 3"], high: Float64[ndarray, " 3"]) -> tuple[list[Panel], float, float]:
    """(plan and section, height, width): side by side, or one above the other where the scene is long."""
    x, y, z = np.maximum(high - low, 1e-3)
    beside = min((WIDTH - 2 * LEFT - GAP) / (2 * x), TALLEST / max(y, z))
    above = min((WIDTH - LEFT) / x, TALLEST / y, TALLEST / z)
    titles = "plan, from above", "section, from the side"
    if above > STACKED * beside:
        plan = Panel(0, 1, titles[0], LEFT, HEAD, above, low, high)
        section = Panel(0, 2, titles[1], LEFT, HEAD + plan.height + FOOT + HEAD + 8, above, low, high)
        return [plan, section], section.y + section.height + FOOT, LEFT + plan.width + SCALE_WIDTH + 20
    plan = Panel(0, 1, titles[0], LEFT, HEAD, beside, low, high)
    section = Panel(0, 2, titles[1], LEFT + plan.width + GAP, HEAD, beside, low, high)
    tall = max(plan.height, section.height)
    return [plan, section], HEAD + tall + FOOT, section.x + section.width + SCALE_WIDTH + 20


def _marked(panel: Panel, px: float, py: float, text: str) -> list[str]:
    """A ring, and the value beside it on the side with more room."""
    side = -1 if px > panel.x + panel.width / 2 else 1
    anchor = "start" if side > 0 else "end"
    return [
        f'<circle class="ring" cx="{px:.1f}" cy="{py:.1f}" r="{RADIUS + 3.5:g}"/>',
        f'<text class="strong halo" x="{px + side * (RADIUS + 8):.1f}" y="{py + 4:.1f}" text-anchor="{anchor}">{text}</text>',
    ]


def _scale(x: float, y: float, colors: Sequence[str], top: float) -> list[str]:
    """The scale of colors from 0 to `top`."""
    tall = 150.0
    parts = [f'<text class="soft small" x="{x:.1f}" y="{y - 8:.1f}">rel. RMSE</text>']
    for step, color in enumerate(colors):
        at = y + tall * (1 - (step + 1) / len(colors))
        parts.append(f'<rect x="{x:.1f}" y="{at:.1f}" width="10" height="{tall / len(colors) + 0.5:.2f}" fill="{color}"/>')
    for share, text in ((1.0, f"{top:.1%}"), (0.5, f"{top / 2:.1%}"), (0.0, "0")):
        parts.append(f'<text class="soft small" x="{x + 15:.1f}" y="{y + tall * (1 - share) + 4:.1f}">{text}</text>')
    return parts
