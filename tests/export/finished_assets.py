"""Assets made in memory, with the manifest that a fit would have written: fit to be saved and exported."""

from __future__ import annotations

import numpy as np

from srbf.asset import LAYERS, Asset
from srbf.quantization import layer_entries


def finished(asset: Asset) -> Asset:
    """The asset itself, its manifest completed."""
    manifest, key = asset.manifest, LAYERS[asset.method]
    manifest |= {"format": "srbf-asset", "version": 1, "quantity": "radiance", "asset_from_world": np.eye(4).tolist()}
    manifest |= {name: f"{name}.exr" for name in asset.images}
    manifest[key] = layer_entries(key[:-1], asset.encoding, asset.scale, asset.bias)
    for name, table in asset.tables.items():
        entry = manifest.setdefault(name, {})
        entry["file"] = f"{name}.png" if name == "cluster_index" else f"{name}.exr"
        if name == "r_table":
            entry["size"] = len(table)
        if name == "w_table":
            entry["mapping"] = "octahedral"
    return asset
