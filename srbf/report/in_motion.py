"""Plots of motion under a light that sweeps between the captured directions, or moves inside the scene: change and brightness per frame."""

from __future__ import annotations

import numpy as np

from srbf.evaluation.motion_inside import MotionInside
from srbf.evaluation.temporal_stability import Motion
from srbf.report.canvas import place_text
from srbf.report.inline import Table, figure
from srbf.report.plot import Axis, Plot, spread_labels

WIDTH, HEIGHT = 940.0, 152.0
RIGHT = 106.0  # for labels at the lines' ends


def motion_figures(motion: Motion) -> Table:
    """The measures of a sweep beside their ideal values."""
    rows = (
        ("change of the relit image over the reference's", f"{motion.change_ratio:.2f}", "1.00", "above 1 flicker, below 1 lag"),
        ("largest single step over the reference's", f"{motion.largest_step:.2f}", "1.00", "popping"),
        ("largest error of the mean brightness", f"{motion.brightness_error:.1%}", "0.0%", "where the reference is bright"),
        ("largest flicker of the mean brightness", f"{motion.largest_flicker:.1%}", "0.0%", "without any gain or tilt"),
        ("ghosting of shadow edges", f"{motion.ghosting:.2f}", "0.00", "change at the wrong time over all change of edges"),
        ("motion of shadow edges kept", f"{motion.edge_kept:.2f}", "1.00", "change at the right time"),
    )
    return Table("Motion", ("measure", "here", "ideal", "meaning"), rows)


def motion_curves(motion: Motion) -> str:
    """Three plots over the frames of all circles in sequence."""
    circles, frames = motion.relit_brightness.shape
    rms = float(np.sqrt((motion.reference_change**2).mean()))
    mean = float(motion.reference_brightness.mean())
    edge = float(motion.edge.mean())
    error = 100 * (motion.relit_brightness - motion.reference_brightness) / mean
    has_edges = edge > 0
    plots = [
        _two("change from frame to frame, over the reference's rms", frames, (motion.relit_change / rms, motion.reference_change / rms)),
        _two(
            "mean brightness less the reference's, % of its mean",
            frames,
            (100 * motion.flicker, error),
            ("flicker", "error"),
            last=not has_edges,
        ),
    ]
    if has_edges:
        pair = (motion.ghost / edge, motion.edge / edge)
        plots.append(_two("change at shadow edges, over the mean of passing edges", frames, pair, ("ghosting", "passing edges"), last=True))
    caption = (
        f"{circles * frames} frames of one white light along {circles} great circles (separated by vertical lines), compared with all "
        "train images interpolated, the best reference between the captured directions. Flicker is the error without gain, offset and "
        "tilt. Ghosting is change at shadow-edge texels while no edge passes them."
    )
    return figure("".join(f'<div class="row">{plot}</div>' for plot in plots), caption)


def motion_inside_figures(motion: MotionInside) -> Table:
    """The measures of a path through an opening, by rays and from the table of positions."""
    rows = (
        ("largest step from frame to frame, over the reference's", f"{motion.largest_step:.2f}", f"{motion.table_step:.2f}", "1.00"),
        ("relative RMSE against the reference", f"{motion.error:.1%}", f"{motion.table_error:.1%}", "0.0%"),
    )
    return Table("Motion", ("measure", "by rays", "table of positions", "ideal"), rows, numbers=True)


def motion_inside_curves(motion: MotionInside) -> str:
    """Change from frame to frame and brightness along the path."""
    peak = max(float(motion.reference_change.max()), 1e-30)
    mean = max(float(motion.reference_brightness.mean()), 1e-30)
    changes = (motion.relit_change / peak, motion.table_change / peak, motion.reference_change / peak)
    bright = (motion.relit_brightness / mean, motion.table_brightness / mean, motion.reference_brightness / mean)
    plots = [
        _along(motion, changes, "change from frame to frame, over the reference's largest"),
        _along(motion, bright, "mean brightness, over the reference's mean", last=True),
    ]
    start, end = place_text(motion.places[0]), place_text(motion.places[-1])
    hidden = f"; {motion.apart:.0%} of the free places in sight of one end or the other are hidden from one of them"
    caption = (
        f"A white point light moves {motion.length:.2f} m from {start} to {end} m in {len(motion.places)} frames, on a straight path "
        f"between two free places that see each other{hidden if motion.apart > 0 else ''}. Reference: all captured images, "
        "interpolated without compression."
    )
    return figure("".join(f'<div class="row">{plot}</div>' for plot in plots), caption)


def _along(motion: MotionInside, curves: tuple[np.ndarray, np.ndarray, np.ndarray], label: str, last: bool = False) -> str:
    """Curves of rays, table and reference over the path's meters."""
    low, high = 0.0, 1.06 * max(float(curve.max()) for curve in curves)
    height, bottom = (HEIGHT + 16, 40) if last else (HEIGHT, 24)
    x = Axis(0, motion.length, "meters along the path" if last else "")
    plot = Plot(WIDTH, height, x, Axis(low, high, label, most=5, form=".4g"), (24, RIGHT, bottom, 44))
    at = np.linspace(0, motion.length, len(motion.places))
    if len(curves[0]) < len(at):
        at = (at[1:] + at[:-1]) / 2  # a step joins two frames
    names, colors = ("by rays", "table", "reference"), ("red", "blue", "gray")
    for curve, color in reversed(list(zip(curves, colors, strict=True))):
        plot.line(at, curve, color)
    ends = [float(plot.point(0, curve[-1])[1]) for curve in curves]
    floor = height - bottom
    spread = spread_labels(ends, 15)
    lift = max(0.0, max(spread) + 4 - floor)
    for name, y, color in zip(names, spread, colors, strict=True):
        plot.text(WIDTH - RIGHT + 8, y + 4 - lift, name, f"strong {color}")
    return plot.svg(label)


def _two(
    label: str, frames: int, curves: tuple[np.ndarray, np.ndarray], names: tuple[str, str] = ("relit", "reference"), last: bool = False
) -> str:
    """Two curves (C, F or F - 1), the first in color, labeled at their ends; only the `last` plot names the axis of frames."""
    circles, steps = curves[0].shape
    low, high = (float(f(np.stack(curves))) for f in (np.min, np.max))
    low = 0.0 if low >= 0 else low - 0.06 * (high - low)
    height, bottom = (HEIGHT + 16, 40) if last else (HEIGHT, 24)
    x = Axis(0, circles * frames, "frame" if last else "")
    plot = Plot(WIDTH, height, x, Axis(low, high + 0.06 * (high - low), label, most=5), (24, RIGHT, bottom, 44))
    if low < 0:
        plot.rule(y=0.0, style="axis")
    for circle in range(circles):
        if circle:
            plot.rule(x=circle * frames, style="axis")
        at = circle * frames + np.arange(steps)
        plot.line(at, curves[1][circle], "gray")
        plot.line(at, curves[0][circle], "red")
    ends = [float(plot.point(0, curve[-1, -1])[1]) for curve in curves]
    for name, y, color in zip(names, spread_labels(ends, 15), ("red", "gray"), strict=True):
        plot.text(WIDTH - RIGHT + 8, min(y + 4, height - bottom), name, f"strong {color}")
    return plot.svg(label)
