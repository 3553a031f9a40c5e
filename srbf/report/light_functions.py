"""The light functions of an eigen map: RGB weights of its components as functions of light direction, drawn as discs."""

from __future__ import annotations

import numpy as np

from srbf.report.abrdf import tile_directions
from srbf.report.canvas import shown_signed
from srbf.report.inline import figure, image, pixels_uri
from srbf.report.subject import Subject

MAX_FUNCTIONS = 12  # shown
PIXELS = 96


def light_functions(subject: Subject) -> str:
    """The functions of the mean and of the first components, of the cluster with the most covered texels."""
    asset = subject.asset
    sphere = asset.domain == "sphere"
    directions = tile_directions(PIXELS, "latitude-longitude" if sphere else "equal-area")
    inside = np.isfinite(directions[..., 0])
    cluster, words = 0, ""
    if "cluster_index" in asset.tables:
        counts = np.bincount(asset.tables["cluster_index"][subject.covered], minlength=asset.clusters)
        cluster = int(np.argmax(counts))
        words = f" of cluster {cluster}, the largest of {asset.clusters} with {counts[cluster] / max(1, counts.sum()):.1%} of the texels"
    first = cluster * (asset.components + 1)
    values = asset.light_functions.evaluate(directions[inside])[:, first : first + min(MAX_FUNCTIONS, asset.components + 1)]  # (N, f, 3)
    cells = []
    for j in range(values.shape[1]):
        own = values[:, j]
        scale = max(float(np.abs(own).max()), 1e-9)
        tile = np.zeros((*inside.shape, 3), np.float32)
        tile[inside] = own
        display = shown_signed(tile, scale)
        display[~inside] = 1.0
        name = "mean" if j == 0 else f"component {j}"
        cells.append(f'<div>{image(pixels_uri(display), name, "sheet round")}<p class="head">{name}, ±{scale:.2g}</p></div>')
    view = "by latitude and longitude, +z on top" if sphere else "on the hemisphere seen from +z, x right, y up"
    caption = (
        f"Functions of light direction{words}, {view}: the weights of a texel's components, per color. Mid gray is 0, and each function "
        "is scaled to its largest value. A light's weights are evaluated here once per frame."
    )
    grid = f'<div class="pictures row" style="grid-template-columns: repeat(6, 1fr)">{"".join(cells)}</div>'
    return figure(grid, caption)
