"""Relighting by a point light: one weight per map and receiver, and attenuation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.lights import PointLight, moved
from srbf.methods import relight
from srbf.methods.over_lights import CHUNK
from srbf.methods.relighting_map import receiver_weights
from srbf.report.canvas import MARGIN, Sheet, box_for, gain_text, place_text, shown, shown_signed
from srbf.report.maps import decoded, signed_scale
from srbf.report.subject import Picture, Subject

FILE = "point_light.png"
TERMS = 5


def point_light(subject: Subject, folder: Path) -> Picture:
    """Write point_light.png: c_i, the maps R_i and their products, then the sum, the attenuation and the result [Wong2005, fig. 8, 10]."""
    asset, gain, covered = subject.asset, subject.gain, subject.covered
    point_light = subject.points[1 if len(subject.points) > 1 else 0]
    inside = moved(point_light, asset.asset_from_world)
    assert isinstance(inside, PointLight)
    terms = strongest(subject, inside)
    r_maps, strength, signed = weighed(subject, inside, terms)
    maps = np.stack([decoded(subject, i) for i in terms])
    scale = signed_scale(maps[:, covered])
    w, h = box_for(asset.width, asset.height, area=205 * 138, widest=260, tallest=200)
    gap, top, left = 16, 104, MARGIN + 74
    large_w = (len(terms) * (w + gap) - gap - 2 * 46) / 3 if len(terms) == TERMS else 1.4 * w
    large_h = large_w * asset.height / asset.width
    y_large = top + 3 * (h + 22) + 52
    sheet = Sheet(
        left + max(len(terms) * (w + gap) - gap, 3 * large_w + 92) + MARGIN,
        y_large + large_h + 34,
        "A point light has separate weights for every receiver",
        f"Point light at {place_text(point_light.position)} m, $a_o$ {point_light.a0:.3g} m. "
        f"Maps: mid gray is 0, white +{scale:.3g}, black −{scale:.3g}. "
        f"$R_i$: black 0, white 1. Lower row: {gain_text(gain)}.",
    )
    labels = (r"$c_i$", r"$R_i(\hat{L})$", r"$c_i\,R_i$")
    for line, label in enumerate(labels):
        sheet.text(
            left - 16,
            top + line * (h + 22) + h / 2,
            ("× " if line == 1 else "= " if line == 2 else "") + label,
            size=12,
            ha="right",
            va="center",
        )
    for n, i in enumerate(terms):
        column = left + n * (w + gap)
        sheet.image(column, top, w, h, shown_signed(maps[n], scale, covered), label=f"i = {i}")
        sheet.image(column, top + h + 22, w, h, gray(r_maps[..., n], covered))
        sheet.image(column, top + 2 * (h + 22), w, h, shown_signed(maps[n] * r_maps[..., n, None], scale, covered))
    result = relight(asset, [point_light])
    if "ambient" in asset.images:
        result = result - asset.images["ambient"]
    limit = float(np.quantile(strength[covered], 0.995))
    panels = (
        (shown(np.maximum(signed, 0), gain, covered), f"sum of all {asset.k} products"),
        (
            gray(strength / limit, covered),
            f"× attenuation $a_o/|L|$ (white {limit:.2f})"
            if point_light.falloff == "linear"
            else f"× attenuation $(a_o/|L|)^2$ (white {limit:.2f})",
        ),
        (shown(result, gain, covered), "= result"),
    )
    for n, (pixels, label) in enumerate(panels):
        sheet.image(left + n * (large_w + 46), y_large, large_w, large_h, pixels, label=label)
    sheet.save(folder / FILE)
    caption = (
        "Under a point light the weights become images R_i, which look like partially lit depth maps; their products with the maps "
        "are summed and then attenuated (after the article's figures 8 and 10). Receivers nearer than a_o get "
        "brighter, farther ones darker."
    )
    return Picture(FILE, "A point light", caption)


def gray(values: ndarray, covered: ndarray) -> ndarray:
    """Scalars (H, W) in [0, 1] as linear display grays, uncovered receivers in the usual gray."""
    return shown_signed(np.repeat(2 * values[..., None] - 1, 3, axis=2), 1.0, covered)


def strongest(subject: Subject, point_light: PointLight) -> list[int]:
    """The maps whose weight peaks highest over the receivers (0.9 quantile), ordered by the azimuth of their centers."""
    positions = subject.asset.images["position"][subject.covered]
    weights, _ = receiver_weights(subject.asset, point_light, positions[:: max(1, len(positions) // 4096)])
    terms = np.argsort(-np.quantile(weights, 0.9, axis=0), kind="stable")[:TERMS]
    return sorted((int(i) for i in terms), key=lambda i: float(subject.asset.basis.centers[i, 0]))


def weighed(subject: Subject, point_light: PointLight, terms: list[int]) -> tuple[ndarray, ndarray, ndarray]:
    """(R_i of `terms` (H, W, n), attenuation (H, W), signed sum of c_i R_i without attenuation (H, W, 3)), in blocks of rows."""
    asset = subject.asset
    r_maps = np.empty((asset.height, asset.width, len(terms)), np.float32)
    strength = np.empty((asset.height, asset.width), np.float32)
    signed = np.empty((asset.height, asset.width, 3), np.float32)
    rows_per_chunk = max(1, CHUNK // asset.width)
    for start in range(0, asset.height, rows_per_chunk):
        rows = slice(start, start + rows_per_chunk)
        weights, strength[rows] = receiver_weights(asset, point_light, asset.images["position"][rows])
        r_maps[rows] = weights[..., terms]
        signed[rows] = np.einsum("khwc,hwk->hwc", asset.coefficients(rows), weights.astype(np.float32), optimize=True)
    return r_maps, strength, signed
