"""Reference, relit image and their difference, side by side for held-out directions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from srbf.report.canvas import MARGIN, SOFT, Sheet, box_for, gain_text, shown
from srbf.report.subject import Picture, Subject

FILE = "contact_sheet.png"
LEGEND, GAP, TOP = 128, 14, 92
GLYPH_SIZE, MIN_ROW_HEIGHT = 64, 116  # of the sun glyph, and of a row with its text


def contact_sheet(subject: Subject, folder: Path) -> Picture:
    """Write contact_sheet.png: one row per direction, all under one exposure; the difference has a further gain, stated in its label."""
    asset, gain = subject.asset, subject.gain
    w, h = box_for(asset.width, asset.height, area=290 * 195, widest=380, tallest=290)
    difference = np.abs(subject.relit - subject.references)
    boost = difference_gain(difference[:, subject.covered], gain)
    rows, pitch = len(subject.shown), max(h, MIN_ROW_HEIGHT) + GAP
    sheet = Sheet(
        2 * MARGIN + LEGEND + 3 * w + 2 * GAP,
        TOP + rows * pitch + 14,
        f"Relit under {len(subject.shown)} {subject.role_words.split(' (this')[0].split(',')[0]}",
        f"Reference and relit: {gain_text(gain)}; difference a further ×{boost:g}. Sun: seen from above, world x right, y up.",
    )
    x = [MARGIN + LEGEND + i * (w + GAP) for i in range(3)]
    for column, label in zip(x, ("reference", "relit", f"|difference| ×{boost:g}"), strict=True):
        sheet.text(column, TOP - 7, label, size=10, va="bottom")
    for row in range(rows):
        y = TOP + row * pitch
        direction = subject.direction(row)
        for column, pixels, factor in zip(
            x, (subject.references[row], subject.relit[row], difference[row]), (gain, gain, gain * boost), strict=True
        ):
            sheet.image(column, y, w, h, shown(pixels, factor, subject.covered))
        sheet.sun(MARGIN, y, GLYPH_SIZE, direction)
        sheet.text(MARGIN, y + GLYPH_SIZE + 6, f"{subject.psnr_of(subject.shown[row]):.1f} dB", size=12, va="top", weight="bold")
        elevation, azimuth = np.degrees(np.arcsin(direction[2])), np.degrees(np.arctan2(direction[1], direction[0]))
        sheet.text(MARGIN, y + GLYPH_SIZE + 28, f"elevation {elevation:.0f}°\nazimuth {azimuth:.0f}°", size=8, color=SOFT, va="top")
    sheet.save(folder / FILE)
    caption = (
        f"Reference, relit and absolute difference for {rows} {subject.role_words}, chosen far apart, with the PSNR of each. "
        f"Shown at {gain_text(gain)}: the 99.5 % quantile of these references is 0.9; differences have a further ×{boost:g}."
    )
    return Picture(FILE, "Reference against relit", caption)


def difference_gain(differences: np.ndarray, gain: float) -> float:
    """The power of two, 1 to 64, that brings the 99.5 % quantile of the exposed differences nearest below white."""
    level = float(np.quantile(differences, 0.995)) * gain if differences.size else 0.0
    return float(2.0 ** np.clip(np.floor(-np.log2(max(level, 1e-9))), 0, 6))
