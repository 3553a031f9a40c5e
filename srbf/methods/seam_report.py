"""What stitching did to the pictures of an asset."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.encode.uv_seams import Stitch

SEAM_LIGHTS = 32  # of the train lights, by which seams are measured
SEAM_TEXELS = 1 << 13  # that give the pictures' mean


def seam_report(
    asset: Asset,
    capture: Capture,
    stitch: Stitch,
    unstitched: Float32[ndarray, "N n C"],
    responses: Callable[[Asset, Capture, Sequence[int]], np.ndarray],
    unstitched_index: Int[ndarray, " n"] | None = None,
) -> dict[str, Any]:
    """The rms difference across the seams through a bilinear filter, over the pictures' mean.

    Under SEAM_LIGHTS of the train lights, unclamped, by a method's `captured_responses`: `before` is with the values `unstitched` of the
    stitch's texels (and clusters `unstitched_index`), `after` with those that the asset stores.
    """
    train = capture.indices("train")
    lights = train[:: -(-len(train) // SEAM_LIGHTS)]
    stitched = asset.at(stitch.texels)
    entries = [{**entry, "encoding": "float"} for entry in asset.layers]
    as_fitted = replace(
        stitched,
        manifest={**stitched.manifest, asset.layers_key: entries},
        stored=unstitched[:, None],
        scale=np.ones_like(asset.scale),
        bias=np.zeros_like(asset.bias),
        tables=stitched.tables
        if unstitched_index is None
        else {**stitched.tables, "cluster_index": unstitched_index[None].astype(np.uint8)},
    )
    covered = np.flatnonzero(asset.covered)
    mean = float(np.abs(responses(asset.at(covered[:: -(-len(covered) // SEAM_TEXELS)]), capture, lights)).mean())
    gaps = {}
    for name, part in (("before", as_fitted), ("after", stitched)):
        relit = responses(part, capture, lights)[:, 0].transpose(1, 0, 2)  # (n, b, 3)
        gaps[name] = stitch.difference(relit.reshape(len(relit), -1)) / max(mean, 1e-30)
    return {"edges": stitch.edges, "samples": stitch.samples, **gaps}
