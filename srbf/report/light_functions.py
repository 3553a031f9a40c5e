"""What the scalar planes of an asset are weighed by: RGB functions of the light's direction, as discs."""

from __future__ import annotations

import numpy as np

from srbf.report.abrdf import tile_directions
from srbf.report.canvas import shown_signed
from srbf.report.inline import figure, image, pixels_uri
from srbf.report.subject import Subject

MOST = 12  # functions shown
PIXELS = 96


def light_functions(subject: Subject) -> str:
    """The mean's function and the first planes', of the cluster that most covered texels are in."""
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
    values = asset.light_functions.evaluate(directions[inside])[:, first : first + min(MOST, asset.components + 1)]  # (N, f, 3)
    cells = []
    for j in range(values.shape[1]):
        own = values[:, j]
        scale = max(float(np.abs(own).max()), 1e-9)
        tile = np.zeros((*inside.shape, 3), np.float32)
        tile[inside] = own
        display = shown_signed(tile, scale)
        display[~inside] = 1.0
        name = "mean" if j == 0 else f"plane {j}"
        cells.append(f'<div>{image(pixels_uri(display), name, "sheet round")}<p class="head">{name}, ±{scale:.2g}</p></div>')
    view = "by latitude and longitude, +z on top" if sphere else "on the hemisphere seen from +z, x right, y up"
    caption = (
        f"Functions of light direction{words}, {view}: what a texel's scalars are multiplied by, color by color. Mid gray is 0, each "
        "shown to its own largest value. A light's weights are read off here once a frame."
    )
    grid = f'<div class="pictures row" style="grid-template-columns: repeat(6, 1fr)">{"".join(cells)}</div>'
    return figure(grid, caption)
