"""Error by bytes on this capture: PSNR of every method against its bytes per texel, and the baselines."""

from __future__ import annotations

import numpy as np

from srbf.evaluation.rate_distortion import ALL, NEAREST, Score
from srbf.report.findings import Findings
from srbf.report.inline import Table, figure
from srbf.report.plot import Axis, Plot, spread_labels
from srbf.report.subject import Subject

MIN_SPAN = 4.0  # dB, of the plot's axis
COLORS = ("blue", "green", "purple", "ink")
BASELINES = {ALL: "all {n} images interpolated, {b:,.0f} bytes", NEAREST: "the nearest of {n} images, {b:,.0f} bytes"}


def by_bytes(subject: Subject, findings: Findings) -> str:
    """The plot, with its table."""
    curves = families(findings)
    baselines = [score for score in findings.scores if score.family in BASELINES]
    points = [score for curve in curves.values() for score in curve] + [findings.own]
    low, high = min(s.bytes_per_texel for s in points) / 1.5, max(s.bytes_per_texel for s in points) * 1.6
    levels = [s.psnr for s in (*points, *baselines)]
    margin = max(0.08 * (max(levels) - min(levels)), (MIN_SPAN - max(levels) + min(levels)) / 2)
    ticks = tuple(b for b in (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048) if low <= b <= high)
    plot = Plot(
        940, 340, Axis(low, high, "bytes per texel that a shader reads (log scale)", log=True, ticks=ticks),
        Axis(min(levels) - margin, max(levels) + margin, "PSNR, dB"), (24, 176, 42, 52),
    )  # fmt: skip
    n = len(subject.capture.indices("train"))
    for score in baselines:
        plot.rule(y=score.psnr, style="line gray dash")
        plot.label(low, score.psnr, BASELINES[score.family].format(n=n, b=score.bytes_per_texel), "soft halo", dx=8, dy=-6)
    ends = [(curve[-1], family, color) for (family, curve), color in zip(curves.items(), COLORS * len(curves), strict=False)]
    heights = [float(plot.point(low, score.psnr)[1]) for score, _, _ in ends]
    for (score, family, color), y in zip(ends, spread_labels(heights, 16), strict=True):
        curve = curves[family]
        x, values = np.array([s.bytes_per_texel for s in curve]), np.array([s.psnr for s in curve])
        plot.line(x, values, color)
        plot.dots(x, values, color, 3.6, [f"{s.name}: {s.bytes_per_texel:g} bytes, {s.psnr:.2f} dB" for s in curve])
        plot.text(float(plot.point(score.bytes_per_texel, score.psnr)[0]) + 12, y + 4, family, f"strong halo {color}")
    own = findings.own
    plot.dots(np.array([own.bytes_per_texel]), np.array([own.psnr]), "red", 6)
    plot.label(own.bytes_per_texel, own.psnr, f"this asset: {own.name}, {own.psnr:.1f} dB", "strong red halo", dx=10, dy=18)
    caption = (
        f"PSNR on {len(subject.capture.indices(subject.role))} {subject.role_words} against bytes per texel, three channels counted "
        f"as four, half floats unless the table says bytes. All were fitted to the same {findings.texels} random texels and are measured "
        "there, this asset too. Clusters fit the few texels of a sample slightly better than the many of the whole image. "
        "Dashed: the captured images themselves, at the bytes of all of them."
    )
    return figure(plot.svg("PSNR against bytes per texel"), caption) + table(findings).html()


def families(findings: Findings) -> dict[str, list[Score]]:
    """The curves: scores of each family sorted by bytes, without the baselines."""
    curves: dict[str, list[Score]] = {}
    for score in findings.scores:
        if score.family not in BASELINES:
            curves.setdefault(score.family, []).append(score)
    return {family: sorted(curve, key=lambda s: s.bytes_per_texel) for family, curve in curves.items()}


def table(findings: Findings) -> Table:
    """All points as numbers, this asset first."""
    rows = [("this asset", findings.own)] + [(s.family, s) for s in findings.scores]
    cells = tuple(
        (family, "" if s.family in BASELINES else s.name, f"{s.bytes_per_texel:,.0f}", f"{s.psnr:.2f} dB", f"{100 * s.relative_rmse:.1f} %")
        for family, s in rows
    )
    return Table("Error against bytes", ("method", "kept", "bytes per texel", "PSNR", "relative rmse"), cells, numbers=True)
