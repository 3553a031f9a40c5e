"""Random mixes of named lights: their errors in order, and three of them side by side."""

from __future__ import annotations

import numpy as np

from srbf.evaluation.random_mixes import HIGHEST, MIN_COLOR, MixErrors, mixed_images
from srbf.report.canvas import gain_text, shown
from srbf.report.inline import Table, figure, image, pixels_uri
from srbf.report.plot import Axis, Plot
from srbf.report.subject import EXPOSURE_LEVEL, EXPOSURE_QUANTILE, Subject

BOOST = 8  # of the shown errors
WORDS = (
    f"A mix sets every light to a random intensity between 0 and {HIGHEST:g} (1 is as designed) times a random color between {MIN_COLOR:g} "
    "and 1 per channel (seeded). The sum of the captured images is the truth; the peak of PSNR is the 99.9 % quantile of the true mixes."
)


def mix_table(mixes: MixErrors) -> Table:
    """Mean, worst and pooled error."""
    row = (str(mixes.count), f"{mixes.psnr:.2f} dB", f"{mixes.worst:.2f} dB", f"{100 * mixes.relative_rmse:.2f} %", f"{mixes.peak:.4g}")
    return Table("Random mixes", ("mixes", "PSNR, mean", "worst", "relative rmse", "peak"), (row,), numbers=True)


def mix_strip(subject: Subject, mixes: MixErrors) -> str:
    """The mixes of the lowest, the middle and the highest PSNR: truth, relit and error."""
    order = np.argsort(mixes.pictures, kind="stable")
    chosen = list(dict.fromkeys(int(i) for i in (order[0], order[len(order) // 2], order[-1])))
    names = ("worst", "middle", "best")[: len(chosen)]
    true, relit = (np.maximum(images, 0) for images in mixed_images(subject.asset, subject.capture, mixes.colors[chosen]))
    covered = subject.covered
    level = float(np.quantile(true[:, covered], EXPOSURE_QUANTILE))
    gain = EXPOSURE_LEVEL / level if level > 0 else 1.0
    heads = ("", "truth", "relit", f"error ×{BOOST}")
    cells = [f'<p class="head">{head}</p>' for head in heads]
    for row, name in enumerate(names):
        cells.append(f'<p><b>{mixes.pictures[chosen[row]]:.1f} dB</b><br><span class="soft">{name} mix</span></p>')
        for head, pixels, factor in (
            ("truth", true[row], gain),
            ("relit", relit[row], gain),
            ("error", np.abs(relit[row] - true[row]), gain * BOOST),
        ):
            cells.append(image(pixels_uri(shown(pixels, factor, covered)), f"{head}, {name} mix"))
    grid = f'<div class="pictures" style="grid-template-columns: 7.2rem repeat(3, 1fr)">{"".join(cells)}</div>'
    caption = f"{len(chosen)} of {mixes.count} mixes at {gain_text(gain)}; absolute errors have a further ×{BOOST}."
    return figure(grid, caption)


def sorted_mixes(mixes: MixErrors) -> str:
    """PSNR of all mixes, the worst first."""
    values = np.sort(mixes.pictures)
    margin = 0.06 * max(float(np.ptp(values)), 1.0)
    across = Axis(0, max(len(values) - 1, 1), "mixes, worst first")
    plot = Plot(940, 200, across, Axis(float(values[0]) - margin, float(values[-1]) + margin, "PSNR, dB", most=5), (24, 110, 42, 52))
    plot.rule(y=mixes.psnr, style="line gray dash")
    plot.text(940 - 104, float(plot.point(0, mixes.psnr)[1]) + 4, f"mean {mixes.psnr:.1f} dB", "soft")
    plot.line(np.arange(len(values)), values, "red")
    return figure(plot.svg("PSNR of the mixes in order"), f"PSNR of the {mixes.count} mixes, in order.")
