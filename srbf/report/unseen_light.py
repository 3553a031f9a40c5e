"""The first thing a report shows: the worst unseen directions side by side, and errors under one and several unseen lights."""

from __future__ import annotations

import numpy as np

from srbf.evaluation.held_out import DIMMEST, EDGES
from srbf.report.canvas import UNCOVERED, gain_text, shown
from srbf.report.contact_sheet import difference_gain
from srbf.report.findings import Unseen
from srbf.report.inline import Table, colored, figure, image, paragraphs, pixels_uri
from srbf.report.subject import Subject

WITHOUT_FLIP = "FLIP is not shown: flip-evaluator is not installed (pip install flip-evaluator)."


def worst_directions(subject: Subject, unseen: Unseen) -> str:
    """A row a direction: reference, relit, difference, FLIP."""
    gain, covered = subject.gain, subject.covered
    rows = list(unseen.worst)
    differences = np.abs(np.maximum(unseen.relit[rows], 0) - np.maximum(unseen.references[rows], 0))
    boost = difference_gain(differences[:, covered], gain)
    heads = ["", "reference", "relit", f"difference ×{boost:g}", *(["FLIP"] if unseen.flips else [])]
    cells = [f'<p class="head">{head}</p>' for head in heads]
    for n, row in enumerate(rows):
        index = unseen.lights[row]
        x, y, z = subject.capture.lights[index].direction
        where = f"elevation {np.degrees(np.arcsin(z)):.0f}°<br>azimuth {np.degrees(np.arctan2(y, x)):.0f}°".replace("-", "−")
        flip = f"<br>FLIP {unseen.flips[n][covered].mean():.3f}" if unseen.flips else ""
        cells.append(f'<p><b>{subject.psnr_of(index):.1f} dB</b><br><span class="soft">{where}{flip}</span></p>')
        pictures = [
            shown(np.maximum(unseen.references[row], 0), gain, covered),
            shown(np.maximum(unseen.relit[row], 0), gain, covered),
            shown(differences[n], gain * boost, covered),
        ]
        if unseen.flips:
            pictures.append(colored(unseen.flips[n], 1.0, "magma", covered, UNCOVERED))
        for head, display in zip(heads[1:], pictures, strict=True):
            cells.append(image(pixels_uri(display), f"{head}, light {index}"))
    columns = f"grid-template-columns: 7.2rem repeat({len(heads) - 1}, 1fr)"
    grid = f'<div class="pictures" style="{columns}">' + "\n".join(cells) + "</div>"
    caption = f"The {len(rows)} of {len(unseen.lights)} {subject.role_words} with the lowest PSNR, worst first, at {gain_text(gain)}. " + (
        f"{unseen.judge.sentence()} Black is no error, pale yellow the most." if unseen.flips else WITHOUT_FLIP
    )
    return figure(grid, caption)


def table_of_lights(unseen: Unseen) -> Table:
    """Mean, worst and shadow edges by how many lights shine at once."""
    rows = []
    for e in unseen.errors:
        flips = ("–", "–") if e.flip is None else (f"{e.flip:.3f}", f"{e.worst_flip:.3f}")
        rows.append((str(e.lights), str(e.pictures), f"{e.psnr:.2f} dB", f"{e.worst:.2f} dB", f"{e.edges:.2f} dB", *flips))
    columns = ("lights at once", "pictures", "PSNR, mean", "worst picture", "at shadow edges", "FLIP, mean", "worst FLIP")
    return Table("Under one, two and eight unseen lights", columns, tuple(rows), numbers=True)


def how_measured(unseen: Unseen) -> str:
    """What the table's words mean."""
    counts = {e.flip_pictures for e in unseen.errors if e.flip is not None}
    flip = f" FLIP is of {max(counts)} pictures of each row at most, the one of lowest PSNR among them." if counts else f" {WITHOUT_FLIP}"
    return paragraphs(
        "Light adds up, so two and eight lights are sums of unseen references, drawn at random (seeded), with random colors between "
        f"{DIMMEST:g} and 1, scaled to be together as bright as one white light; relit and reference are clamped at 0 after the sum. "
        f"Shadow edges are the {EDGES:.0%} of the covered texels where the reference, divided by the mean picture, changes most from one "
        f"texel to the next.{flip}"
    )
