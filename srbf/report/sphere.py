"""The sphere of directions: basis centers, captured lights, and the curve R."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.basis.gaussian import TABLE_TOLERANCE, lookup, weight
from srbf.captured_light import ROLES
from srbf.report.abrdf import disc_points
from srbf.report.canvas import INK, MARGIN, ROLE_COLOR, ROLE_MARKER, RULE, SOFT, Sheet, draw_disc
from srbf.report.subject import Picture, Subject

CENTERS, CURVE = "centers.png", "r_curve.png"
DISC, TOP = 430, 88
SIZE = {"train": 14, "validation": 30, "holdout": 30}
MAX_LABELED = 64  # centers; the numbers of more would overlap


def centers(subject: Subject, folder: Path) -> Picture:
    """Write centers.png: centers with their spread on the left, lights by role on the right; a second row for those below the horizon."""
    basis = subject.asset.basis
    halves = [1, -1] if subject.asset.domain == "sphere" else [1]
    spread = np.degrees(basis.spread)
    sheet = Sheet(
        2 * MARGIN + 2 * DISC + 40,
        TOP + len(halves) * (DISC + 30),
        f"{len(basis.centers)} basis centers and {len(subject.capture.lights)} captured lights",
        f"Equal-area discs seen from +z, x right, y up; rings at 0°, 30°, 60° of elevation. Circles: one spread, {spread:.1f}°.",
    )
    for n, half in enumerate(halves):
        y = TOP + n * (DISC + 30)
        side = "" if len(halves) == 1 else (", z ≥ 0" if half > 0 else ", z < 0 (seen from above)")
        axes = disc_axes(sheet, MARGIN, y, f"basis centers $Q_i${side}")
        for circle in spread_circles(basis.centers, basis.spread):
            circle[circle[:, 2] * half < 0] = np.nan
            axes.plot(*disc_points(circle).T, color=ROLE_COLOR["validation"], lw=0.7, alpha=0.45)
        here = on_half(basis.centers, half)
        points = disc_points(basis.centers)
        axes.scatter(*points[here].T, s=26, color=INK, zorder=3)
        if len(points) <= MAX_LABELED:
            for i in here:
                axes.annotate(str(i), points[i], xytext=(4, 3), textcoords="offset points", fontsize=7, color=SOFT)
        axes = disc_axes(sheet, MARGIN + DISC + 40, y, f"captured lights{side}")
        for role in ROLES:
            directions = subject.capture.directions(subject.capture.indices(role))
            if len(directions):
                chosen = disc_points(directions)[on_half(directions, half)]
                label = f"{role} ({len(directions)})"
                axes.scatter(*chosen.T, s=SIZE[role] * 0.7, c=ROLE_COLOR[role], marker=ROLE_MARKER[role], lw=0, label=label, zorder=3)
        if half > 0:
            legend(axes)
    sheet.save(folder / CENTERS)
    caption = "Basis centers with circles of one spread, and the captured light directions by role, on equal-area discs seen from above."
    return Picture(CENTERS, "Centers and lights", caption)


def r_curve(subject: Subject, folder: Path) -> Picture:
    """Write r_curve.png: R against the cosine with the table's entries, and the error of interpolating them [Wong2005, fig. 9]."""
    table, spread = subject.asset.table, subject.asset.basis.spread
    n = len(table)
    sheet = Sheet(
        760,
        576,
        "R: one dot product, one lookup",
        f"Spread {np.degrees(spread):.2f}° ({spread:.4f} rad); table of {n} entries, texel centers, linear interpolation.",
    )
    x = np.unique(np.concatenate([np.linspace(-1, 1, 4001), 1 - np.geomspace(1e-6, 2 / (n - 1), 200)]))
    entries = np.linspace(-1, 1, n)
    axes = sheet.axes(78, 84, 650, 300)
    axes.plot(x, weight(x, spread), color=INK, lw=1.2, label="R, exact", zorder=2)
    axes.plot(entries, table, "o", ms=2.6 if n <= 256 else 1.6, color=ROLE_COLOR["holdout"], label="entries of the table", zorder=3)
    axes.set(xlim=(-1.02, 1.02), ylim=(-0.03, 1.05))
    axes.set_ylabel("R", color=SOFT, fontsize=9)
    legend(axes, loc="upper left")
    for angle in (0, 30, 60, 90, 120, 180):
        axes.axvline(np.cos(np.radians(angle)), color=RULE, lw=0.5, zorder=0)
        axes.text(np.cos(np.radians(angle)), 1.06, f"{angle}°", fontsize=7, color=SOFT, ha="center", va="bottom")
    axes = sheet.axes(78, 420, 650, 90)
    axes.plot(x, np.abs(lookup(table, x) - weight(x, spread)), color=ROLE_COLOR["validation"], lw=0.8)
    axes.axhline(TABLE_TOLERANCE, color=SOFT, lw=0.7, ls="--")
    axes.text(-1, TABLE_TOLERANCE, "allowed: $2^{-12}$", fontsize=7, color=SOFT, va="bottom")
    axes.set(xlim=(-1.02, 1.02), ylim=(0, 1.3 * TABLE_TOLERANCE))
    axes.ticklabel_format(axis="y", style="sci", scilimits=(0, 0))
    axes.yaxis.get_offset_text().set(fontsize=7, color=SOFT)
    axes.set_ylabel("|error|", color=SOFT, fontsize=9)
    axes.set_xlabel(r"$\cos\theta = \hat{L}\cdot Q_i$", color=SOFT, fontsize=9)
    sheet.save(folder / CURVE)
    caption = "The curve that all basis functions share and the entries of its table; below, the interpolation error (after figure 9)."
    return Picture(CURVE, "The curve R", caption)


def disc_axes(sheet: Sheet, x: float, y: float, title: str) -> Any:
    """Axes with the disc of a hemisphere and a title above."""
    axes = sheet.axes(x, y, DISC, DISC)
    draw_disc(axes)
    sheet.text(x + DISC / 2, y, title, size=10, ha="center", va="center")
    return axes


def legend(axes: Any, loc: str = "lower right") -> None:
    """A frameless legend."""
    axes.legend(loc=loc, fontsize=8, frameon=False, labelcolor=SOFT, handletextpad=0.3, borderaxespad=0)


def on_half(directions: ndarray, half: int) -> ndarray:
    """Indices of directions above (half 1, the horizon included) or below it (half -1)."""
    return np.flatnonzero((directions[:, 2] >= 0) == (half > 0))


def spread_circles(axes_of: ndarray, angle: float, points: int = 90) -> list[ndarray]:
    """Circles of `angle` (rad) about unit vectors, each (points, 3)."""
    turn = np.linspace(0, 2 * np.pi, points)
    circles = []
    for q in axes_of:
        u = np.cross(q, np.eye(3)[int(np.argmin(np.abs(q)))])
        u /= np.linalg.norm(u)
        v = np.cross(q, u)
        circles.append(np.cos(angle) * q + np.sin(angle) * (np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v))
    return circles
