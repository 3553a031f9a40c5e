"""The first section of a report: the worst lights side by side, and errors under one and several held-out lights."""

from __future__ import annotations

from html import escape

import numpy as np

from srbf.evaluation.held_out import EDGE_SHARE, MIN_COLOR
from srbf.report.canvas import UNCOVERED, gain_text, shown
from srbf.report.contact_sheet import difference_gain
from srbf.report.findings import HeldOut
from srbf.report.inline import Table, colored, figure, image, paragraphs, pixels_uri
from srbf.report.subject import Subject

NO_FLIP = "FLIP is not shown: flip-evaluator is not installed (pip install flip-evaluator)."


def worst_lights(subject: Subject, held_out: HeldOut) -> str:
    """One row per light: reference, relit, difference, FLIP."""
    gain, covered = subject.gain, subject.covered
    rows = list(held_out.worst)
    differences = np.abs(np.maximum(held_out.relit[rows], 0) - np.maximum(held_out.references[rows], 0))
    boost = difference_gain(differences[:, covered], gain)
    heads = ["", "reference", "relit", f"difference ×{boost:g}", *(["FLIP"] if held_out.flips else [])]
    cells = [f'<p class="head">{head}</p>' for head in heads]
    for n, row in enumerate(rows):
        index = held_out.lights[row]
        where = "<br>".join(escape(line) for line in subject.light_words(index)).replace("-", "−")
        flip = f"<br>FLIP {held_out.flips[n][covered].mean():.3f}" if held_out.flips else ""
        cells.append(f'<p><b>{subject.error_words(index)}</b><br><span class="soft">{where}{flip}</span></p>')
        pictures = [
            shown(np.maximum(held_out.references[row], 0), gain, covered),
            shown(np.maximum(held_out.relit[row], 0), gain, covered),
            shown(differences[n], gain * boost, covered),
        ]
        if held_out.flips:
            pictures.append(colored(held_out.flips[n], 1.0, "magma", covered, UNCOVERED))
        for head, display in zip(heads[1:], pictures, strict=True):
            cells.append(image(pixels_uri(display), f"{head}, light {index}"))
    columns = f"grid-template-columns: 7.2rem repeat({len(heads) - 1}, 1fr)"
    grid = f'<div class="pictures" style="{columns}">' + "\n".join(cells) + "</div>"
    measure = "the largest relative RMSE" if subject.by_relative else "the lowest PSNR"
    caption = f"The {len(rows)} of {len(held_out.lights)} {subject.role_words} with {measure}, worst first, at {gain_text(gain)}. " + (
        f"{held_out.metric.sentence()} Black is no error, pale yellow the maximum." if held_out.flips else NO_FLIP
    )
    return figure(grid, caption)


def table_of_lights(held_out: HeldOut) -> Table:
    """Mean, worst and shadow-edge errors by the number of lights."""
    rows = []
    for e in held_out.errors:
        flips = ("–", "–") if e.flip is None else (f"{e.flip:.3f}", f"{e.worst_flip:.3f}")
        rows.append((str(e.lights), str(e.pictures), f"{e.psnr:.2f} dB", f"{e.worst:.2f} dB", f"{e.edges:.2f} dB", *flips))
    columns = ("lights at once", "images", "PSNR, mean", "worst image", "at shadow edges", "FLIP, mean", "worst FLIP")
    return Table("One, two and eight held-out lights", columns, tuple(rows), numbers=True)


def how_measured(held_out: HeldOut) -> str:
    """The definitions of the table's columns."""
    counts = {e.flip_pictures for e in held_out.errors if e.flip is not None}
    flip = f" FLIP uses at most {max(counts)} images of each row, among them that of lowest PSNR." if counts else f" {NO_FLIP}"
    return paragraphs(
        "Relighting is linear, so two and eight lights are random (seeded) sums of held-out references, with random colors between "
        f"{MIN_COLOR:g} and 1, scaled to the brightness of one white light; relit and reference are clamped at 0 after the sum. "
        f"Shadow edges are the {EDGE_SHARE:.0%} of the covered texels where the reference, divided by the mean image, changes most to a "
        f"neighbor.{flip}"
    )
