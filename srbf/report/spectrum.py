"""Singular values of the responses, and the PSNR of the best planes beside that of the asset."""

from __future__ import annotations

import numpy as np

from srbf.methods import method_of
from srbf.report.findings import Spectrum
from srbf.report.inline import figure
from srbf.report.plot import Axis, Plot
from srbf.report.subject import Subject

SHOWN_SHARE = 0.999  # of the singular values; the last ones are rounding errors
FLOOR = 1e-4  # of the largest value
HEADROOM = 15.0  # dB shown above the asset's PSNR; beyond, planes fit noise


def spectrum_plots(subject: Subject, texels: int, spectrum: Spectrum) -> str:
    """Singular values, and the PSNR of the best planes, side by side."""
    components = method_of(subject.asset).numbers_per_texel(subject.asset)
    ranks = np.arange(1, len(spectrum.values) + 1)
    relative = spectrum.values / max(float(spectrum.values[0]), 1e-30)
    kept = (relative > FLOOR) & (ranks <= SHOWN_SHARE * len(ranks))
    kept[:2] = True
    ranks, relative = ranks[kept], np.maximum(relative[kept], FLOOR)
    last = float(max(len(ranks), components, 10))
    rank_axis = Axis(1, last, "components (log scale)", log=True)
    left = Plot(450, 290, rank_axis, Axis(float(relative.min()) * 0.8, 1.25, "singular value over the first", log=True), (24, 20, 42, 58))
    left.line(ranks, relative, "blue")
    left.rule(x=components, style="line red thin dash")
    left.label(components, 1.0, f"{components} numbers", "strong red halo", dx=6, dy=12)
    left.label(components, 1.0, "per texel here", "red halo", dx=6, dy=27)
    bound = spectrum.bound[: len(ranks)]
    near = np.flatnonzero(bound <= spectrum.own + HEADROOM)[1:]  # planes 1, 2, …
    high = max(float(bound[near].max(initial=0)), spectrum.own) + 1
    low = min(float(bound[0]), spectrum.own) - 4
    right = Plot(450, 290, rank_axis, Axis(low, high, "PSNR on train lights, pooled, dB"), (24, 20, 42, 52))
    right.line(near, bound[near], "blue")
    if len(near):
        last_shown = near[-1]  # HEADROOM above the asset, so that the labels keep apart
        right.label(float(last_shown), float(bound[last_shown]), "the best planes", "strong blue", dx=-10, dy=4, anchor="end")
    right.dots(np.array([components]), np.array([spectrum.own]), "red", 5)
    right.label(components, spectrum.own, f"this asset, {spectrum.own:.1f} dB", "strong red", dx=0, dy=20, anchor="middle")
    enough = bound >= spectrum.own
    reach = f", which the best {planes_words(int(np.argmax(enough)))} would reach too" if enough.any() else ""
    caption = (
        f"On the train lights the asset's {components} numbers per texel reach {spectrum.own:.1f} dB before the clamp{reach}. Singular "
        f"values are those of the responses of {texels} texels to all train lights and colors, minus the mean texel; all "
        "lights have equal weight. The curve on the right bounds any linear model of so many components on these responses, not on "
        "held-out lights; clusters with separate components may exceed it."
    )
    plots = left.svg("Singular values by rank"), right.svg("PSNR of the best planes, by their number")
    return figure('<div class="plots row">' + "".join(f'<div style="flex: 1 1 20rem">{p}</div>' for p in plots) + "</div>", caption)


def planes_words(count: int) -> str:
    """A number of planes as text."""
    return "plane" if count == 1 else f"{count} planes"
