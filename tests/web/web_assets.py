"""Made assets as they lie on disk, and how exactly a browser must relight them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from srbf import methods
from srbf.asset import LAYERS, Asset
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight
from srbf.quantization import layer_entries

FLOAT = 1e-4  # of the sum of the magnitudes of all terms; measured 3e-6
HALF = 2 * 2.0**-10  # two steps of a half float
HALF_TINY = 2.0**-24

LIGHTS: dict[str, list[Light]] = {
    "directional": [DirectionalLight((0.3, -0.5, 0.7), (1.0, 0.5, 0.2))],
    "point": [PointLight((0.4, -0.3, 0.9), (0.7, 1.0, 0.4), a0=0.8)],
    "spot": [SpotLight((-0.5, 0.6, 1.2), (1.0, 0.9, 0.3), a0=1.5, falloff="inverse-square", direction=(0.4, -0.5, -1), inner=0.3, outer=0.8)],
    "environment": [EnvironmentLight(np.random.default_rng(5).random((6, 12, 3)).astype(np.float32), (0.5, 0.6, 0.7))],
}
LIGHTS["several"] = [light for lights in LIGHTS.values() for light in lights] + [
    DirectionalLight((-0.8, 0.1, 0.4), (0.1, 0.3, 0.9)),
    PointLight((-0.9, -0.7, 0.5), (0.3, 0.2, 0.8), falloff="inverse-square"),
]


def complete(asset: Asset, **manifest: Any) -> Asset:
    """`asset` with every key that asset.json has, ready to be saved."""
    own = asset.manifest
    relighting = own["method"] == "relighting-map"
    keys: dict[str, Any] = {"format": "srbf-asset", "version": 1, "quantity": "irradiance", "transport": "combined"}
    keys |= {"row_origin": "top", "axes": "z-up-right-handed", "asset_from_world": np.eye(4).tolist()}
    keys |= {name: f"{name}.exr" for name in asset.images}
    keys[LAYERS[own["method"]]] = layer_entries("map" if relighting else "plane", asset.encoding, asset.scale, asset.bias)
    if relighting:
        keys["r_table"] = {"file": "r_table.exr", "size": len(asset.table)}
    else:
        keys["light_coefficients"] = {"file": "light_coefficients.exr"}
        keys["w_table"] = {**own["w_table"], "file": "w_table.exr", "mapping": "octahedral"}
        if "cluster_index" in asset.tables:
            keys["cluster_index"] = {"file": "cluster_index.png"}
    return replace(asset, manifest={**own, **keys, **manifest})


def tolerance(asset: Asset, lights: Sequence[Light], target: str = "float") -> np.ndarray:
    """How far a picture may be from numpy's, (H, W, 3): relative to the sum of the magnitudes of all terms of all lights."""
    values = asset.coefficients()
    bare = replace(
        asset,
        manifest={**asset.manifest, LAYERS[asset.method]: [{**entry, "encoding": "float"} for entry in asset.layers]},
        scale=np.ones_like(asset.scale),
        bias=np.zeros_like(asset.bias),
    )
    bound = np.zeros((asset.height, asset.width, 3), np.float32)
    for light in lights:
        nothing = methods.linear_response(replace(bare, stored=np.zeros_like(values)), [light])
        bound += np.abs(nothing)
        for layer in range(len(values)):
            for channels in [slice(None)] if values.shape[3] == 3 else [slice(c, c + 1) for c in range(4)]:
                alone = np.zeros_like(values)
                alone[layer, ..., channels] = values[layer, ..., channels]
                bound += np.abs(methods.linear_response(replace(bare, stored=alone), [light]) - nothing)
    ambient = asset.images.get("ambient", 0)
    if target == "half":
        return HALF * (bound + ambient) + HALF_TINY
    return FLOAT * (bound + ambient) + 1e-7
