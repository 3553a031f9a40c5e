"""Error over the sphere of directions: one disc per role, and PSNR against the light's elevation."""

from __future__ import annotations

import numpy as np

from srbf.captured_light import ROLES
from srbf.report.inline import figure, ramp
from srbf.report.plot import Axis, Plot, disc, on_disc, svg
from srbf.report.sphere import on_half
from srbf.report.subject import Subject

COLOR = {"train": "gray", "validation": "blue", "holdout": "red"}
RADIUS = 142.0
GAP, HEAD = 34.0, 34.0
DOT = {"train": 4.4, "validation": 6.5, "holdout": 6.5}
STEPS = 24


def by_direction(subject: Subject) -> str:
    """The discs and the plot as one figure."""
    values = np.array([subject.psnr_of(i) for i in range(len(subject.capture.lights))])
    caption = (
        "PSNR of every light over its direction: equal-area discs of the hemisphere seen from +z, world x to the right and y up, one per "
        "role, the best light dark and the worst bright; a ring marks the worst of each role. Below: PSNR against elevation."
    )
    return figure(discs(subject, values) + against_elevation(subject, values), caption)


def discs(subject: Subject, values: np.ndarray) -> str:
    """One disc per role that has lights, two if some lights are below the horizon."""
    directions = subject.capture.directions()
    halves = (1, -1) if (directions[:, 2] < 0).any() else (1,)
    roles = [role for role in ROLES if subject.capture.indices(role)]
    low, high = float(np.quantile(values, 0.02)), float(np.quantile(values, 0.98))
    colors = ramp("viridis", STEPS)[::-1]
    width = len(roles) * (2 * RADIUS + GAP) + 60
    height = HEAD + len(halves) * (2 * RADIUS + 30)
    parts: list[str] = []
    labels: list[str] = []
    for column, role in enumerate(roles):
        cx = RADIUS + 4 + column * (2 * RADIUS + GAP)
        indices = np.array(subject.capture.indices(role))
        error = subject.evaluation[role]
        parts.append(f'<text class="strong" x="{cx - RADIUS:.1f}" y="14">{role}</text>')
        count = f"{len(indices)} lights, {error['psnr']:.2f} dB"
        parts.append(f'<text class="soft" x="{cx + RADIUS:.1f}" y="14" text-anchor="end">{count}</text>')
        worst = int(indices[np.argmin(values[indices])])
        for line, half in enumerate(halves):
            cy = HEAD + RADIUS + line * (2 * RADIUS + 30)
            parts += disc(cx, cy, RADIUS)
            if len(halves) > 1:
                parts.append(
                    f'<text class="soft small" x="{cx - RADIUS:.1f}" y="{cy - RADIUS + 8:.1f}">{"above" if half > 0 else "below"}</text>'
                )
            here = indices[on_half(directions[indices], half)]
            for index, px, py in zip(here, *on_disc(directions[here], cx, cy, RADIUS), strict=True):
                step = int(np.clip((values[index] - low) / max(high - low, 1e-9) * STEPS, 0, STEPS - 1))
                title = f"<title>{values[index]:.1f} dB</title>"
                parts.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="{DOT[role]:g}" fill="{colors[step]}">{title}</circle>')
                if index == worst:
                    parts.append(f'<circle class="ring" cx="{px:.1f}" cy="{py:.1f}" r="{DOT[role] + 3.5:g}"/>')
                    side = -1 if px > cx else 1
                    anchor = "start" if side > 0 else "end"
                    x = px + side * (DOT[role] + 7)
                    parts.append(
                        f'<text class="strong halo" x="{x:.1f}" y="{py + 4:.1f}" text-anchor="{anchor}">{values[index]:.1f} dB</text>'
                    )
    parts += labels
    x, top, tall = width - 48, HEAD + 30, 2 * RADIUS - 60
    for step, color in enumerate(colors):
        y = top + tall * (1 - (step + 1) / STEPS)
        parts.append(f'<rect x="{x:.1f}" y="{y:.1f}" width="10" height="{tall / STEPS + 0.5:.2f}" fill="{color}"/>')
    parts.append(f'<text class="soft small" x="{x + 14:.1f}" y="{top + 8:.1f}">{high:.0f} dB</text>')
    parts.append(f'<text class="soft small" x="{x + 14:.1f}" y="{top + tall:.1f}">{low:.0f} dB</text>')
    return svg(width, height, "PSNR of every light over the directions", parts)


def against_elevation(subject: Subject, values: np.ndarray) -> str:
    """PSNR against elevation, all roles in one plot."""
    elevation = np.degrees(np.arcsin(np.clip(subject.capture.directions()[:, 2], -1, 1)))
    below = float(elevation.min()) < 0
    low, high = float(values.min()), float(values.max())
    margin = 0.06 * max(high - low, 1.0)
    ticks = (-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0) if below else (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)
    across = Axis(-90 if below else 0, 90, "elevation of the light, degrees", ticks=ticks)
    plot = Plot(940, 250, across, Axis(low - margin, high + margin, "PSNR, dB"), (24, 16, 42, 52))
    x = 940.0 - 16
    for role in ROLES[::-1]:
        if subject.capture.indices(role):
            plot.text(x, 11, role, f"strong {COLOR[role]}", "end")
            x -= 14 + 7.5 * len(role)
    for role in ROLES:
        indices = subject.capture.indices(role)
        plot.dots(elevation[indices], values[indices], COLOR[role], 2.6 if role == "train" else 4.2)
    return plot.svg("PSNR against the elevation of the light")
