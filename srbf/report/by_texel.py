"""Maps of the error per texel: rms error, clamped light and the mean reference."""

from __future__ import annotations

import numpy as np

from srbf.report.canvas import UNCOVERED, gain_text, shown
from srbf.report.findings import HeldOut
from srbf.report.inline import colored, figure, image, pixels_uri
from srbf.report.subject import Subject

WHITE_QUANTILE = 0.995  # of the error map, shown brightest


def by_texel(subject: Subject, held_out: HeldOut) -> str:
    """The three maps and their totals."""
    covered = subject.covered
    errors = np.sqrt(((np.maximum(held_out.relit, 0) - np.maximum(held_out.references, 0)) ** 2).mean(axis=(0, 3)))
    below = (held_out.relit < 0).mean(axis=(0, 3))
    top, most = float(np.quantile(errors[covered], WHITE_QUANTILE)), max(float(np.quantile(below[covered], WHITE_QUANTILE)), 0.01)
    mean = held_out.references.mean(axis=0)
    maps = (
        (f"mean reference, {gain_text(subject.gain)}", shown(mean, subject.gain, covered)),
        (f"rms error, pale is {top:.3g}", colored(errors, top, "magma", covered, UNCOVERED)),
        (f"share of lights clamped, bright is {most:.0%}", colored(below, most, "viridis", covered, UNCOVERED)),
    )
    cells = "".join(f"<div>{image(pixels_uri(display), title)}<p>{title}</p></div>" for title, display in maps)
    half = error_half(errors[covered])
    low = held_out.negative
    caption = (
        f"Over {len(held_out.lights)} {subject.role_words}. Half of the squared error lies in {half:.1%} of the texels. Before the clamp "
        f"{low.values:.1%} of the relit values are below 0; the clamp takes {low.brightness:.2%} of the brightness and {low.energy:.2%} of "
        "the energy (the sum of squares)."
    )
    return figure(f'<div class="pictures row" style="grid-template-columns: repeat(3, 1fr)">{cells}</div>', caption)


def error_half(errors: np.ndarray) -> float:
    """The smallest share of texels that holds half of the squared error."""
    squares = np.sort(errors.astype(np.float64) ** 2)[::-1]
    total = squares.sum()
    return float((np.searchsorted(np.cumsum(squares), total / 2) + 1) / len(squares)) if total > 0 else 0.0
