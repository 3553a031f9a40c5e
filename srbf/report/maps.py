"""The sum of relighting maps, weighted by R_i(L0), that is a relit image."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from srbf.methods import responses
from srbf.methods.relighting_map import basis_weights
from srbf.report.canvas import MARGIN, SOFT, Sheet, box_for, gain_text, shown, shown_signed
from srbf.report.subject import Picture, Subject

FILE = "sum_of_maps.png"
TERMS = 5  # maps drawn one by one; the others are drawn as their sum
SIGNED_QUANTILE = 0.995


def sum_of_maps(subject: Subject, folder: Path) -> Picture:
    """Write sum_of_maps.png: the maps of largest weight, their weights, their shares and the running sum [Wong2005, fig. 6]."""
    asset, gain, covered = subject.asset, subject.gain, subject.covered
    row = int(np.argmin([abs(subject.direction(i)[2] - np.sin(np.radians(45))) for i in range(len(subject.shown))]))
    world = subject.direction(row)
    direction = asset.asset_from_world[:3, :3] @ world
    weights = basis_weights(asset, direction[None] / np.linalg.norm(direction))[0]
    terms = [int(i) for i in np.argsort(-weights, kind="stable")[:TERMS]]
    maps = np.stack([decoded(subject, i) for i in terms])
    scale = signed_scale(maps[:, covered])
    w, h = box_for(asset.width, asset.height, area=190 * 128, widest=250, tallest=190)
    gap, top, sign, first = 34, 118, 132, MARGIN
    xs = [first, first + w + gap + sign, first + 2 * w + 2 * gap + sign + 8]
    large_w, large_h = 1.3 * w, 1.3 * h
    x_large = xs[2] + w + 60
    others = asset.k - len(terms)
    rows = len(terms) + (others > 0)
    bottom = top + rows * (h + 30)
    sheet = Sheet(
        x_large + large_w + MARGIN,
        max(bottom + 6, top + 2 * large_h + 90),
        r"A relit image is a sum of relighting maps, $c_0 R_0(L_0) + c_1 R_1(L_0) + …$",
        f"Maps and shares: mid gray is 0, white +{scale:.3g}, black −{scale:.3g}, per color. Sums: clamped at 0, {gain_text(gain)}.",
    )
    for x, label in zip(xs, (r"map $c_i$", r"share $c_i\,R_i(L_0)$", "sum so far"), strict=True):
        sheet.text(x, top - 30, label, size=10, va="bottom")
    sheet.text(xs[0] + w + 18, top - 30, r"weight $R_i(L_0)$", size=10, va="bottom")
    total = np.zeros_like(maps[0])
    for n, i in enumerate(terms):
        y = top + n * (h + 30)
        share = maps[n] * np.float32(weights[i])
        total += share
        sheet.image(xs[0], y, w, h, shown_signed(maps[n], scale, covered), label=rf"$c_{{{i}}}$")
        sheet.text(xs[1] - 16, y + h / 2, "=", size=12, ha="center", va="center")
        sheet.text(xs[0] + w + 18, y + h / 2, f"× {weights[i]:.3f}", size=12, va="center")
        sheet.sun(xs[1] - 76, y + h / 2 - 24, 48, asset.basis.centers[i])
        sheet.image(xs[1], y, w, h, shown_signed(share, scale, covered))
        sheet.text(xs[2] - 23, y + h / 2, "→", size=13, color=SOFT, ha="center", va="center")
        sheet.image(xs[2], y, w, h, shown(total, gain, covered))
    relit = subject.relit[row]
    if others:
        y = top + len(terms) * (h + 30)
        sheet.text(
            xs[0],
            y + h / 2,
            f"+ the other {others} maps,\n   weights {weights[np.argsort(-weights)[TERMS]]:.3f} and less",
            va="center",
        )
        signed = unclamped(subject, world)
        sheet.image(xs[1], y, w, h, shown_signed(signed - total, scale, covered))
        sheet.text(xs[2] - 23, y + h / 2, "→", size=13, color=SOFT, ha="center", va="center")
        sheet.image(xs[2], y, w, h, shown(signed, gain, covered))
    sheet.text(x_large - 30, top + large_h / 2, "=", size=18, ha="center", va="center")
    sheet.image(x_large, top, large_w, large_h, shown(relit, gain, covered), label="relit, all maps")
    sheet.image(x_large, top + large_h + 46, large_w, large_h, shown(subject.references[row], gain, covered), label="reference")
    sheet.sun(x_large, top + 2 * large_h + 58, 56, world)
    sheet.text(x_large + 66, top + 2 * large_h + 86, rf"$L_0$, elevation {np.degrees(np.arcsin(world[2])):.0f}°", va="center")
    sheet.save(folder / FILE)
    caption = (
        f"The {len(terms)} maps of largest weight for one {subject.role} light, times their weights, and the running sum "
        "(after the article's figure 6). Coefficients are signed, so maps and shares are shown offset: mid gray is 0. "
        "The disc beside a weight shows that map's center."
    )
    return Picture(FILE, "A sum of maps", caption)


def decoded(subject: Subject, i: int) -> np.ndarray:
    """Map c_i decoded, (H, W, 3)."""
    asset = subject.asset
    stored = asset.stored[i].astype(np.float32)
    return (stored / 255 if asset.held == "uint8" else stored) * asset.scale[i] + asset.bias[i]


def unclamped(subject: Subject, direction: np.ndarray) -> np.ndarray:
    """The signed sum of all maps under one white light, (H, W, 3)."""
    return responses(subject.asset, direction[None])[0]


def signed_scale(values: np.ndarray) -> float:
    """The magnitude shown as white and black: a high quantile of |values|, never 0."""
    return max(float(np.quantile(np.abs(values), SIGNED_QUANTILE)), 1e-6) if values.size else 1.0
