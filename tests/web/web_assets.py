"""Made assets as they lie on disk, and how exactly a browser must relight them."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from srbf import methods
from srbf.asset import Asset
from srbf.lights import DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight
from srbf.stored_layers import layer_entries

FLOAT = 1e-4  # of the sum of the magnitudes of all terms; a few 1e-6 are usual
HALF = 2 * 2.0**-10  # two steps of a half float
HALF_TINY = 2.0**-24

LIGHTS: dict[str, list[Light]] = {
    "directional": [DirectionalLight((0.3, -0.5, 0.7), (1.0, 0.5, 0.2))],
    "point": [PointLight((0.4, -0.3, 0.9), (0.7, 1.0, 0.4), a0=0.8)],
    "spot": [
        SpotLight((-0.5, 0.6, 1.2), (1.0, 0.9, 0.3), a0=1.5, falloff="inverse-square", direction=(0.4, -0.5, -1), inner=0.3, outer=0.8)
    ],
    "environment": [EnvironmentLight(np.random.default_rng(5).random((6, 12, 3)).astype(np.float32), (0.5, 0.6, 0.7)).turned(0.8)],
}
LIGHTS["several"] = [light for lights in LIGHTS.values() for light in lights] + [
    DirectionalLight((-0.8, 0.1, 0.4), (0.1, 0.3, 0.9)),
    PointLight((-0.9, -0.7, 0.5), (0.3, 0.2, 0.8), falloff="inverse-square"),
]

ALBEDO = (0.8, 0.5, 0.3)
PLACE = 2e-5  # texels: how far single precision may put a pixel off its middle
HALF_EXTENT = (1.4, 0.9, 0.25)  # of the rectangle that receivers of `on_a_plane` fill, and its height, meters

# Lights as three.js, y up, has them, and as the library does.
FOLLOWED: dict[str, tuple[list[dict[str, Any]], list[Light]]] = {
    "directional": (
        [{"type": "DirectionalLight", "color": (0.9, 0.6, 0.2), "intensity": 2.5, "position": (1, 3, -2), "target": (0.5, 0, 0.5)}],
        [DirectionalLight((0.5, 2.5, 3.0), (2.25, 1.5, 0.5))],
    ),
    "point": (
        [{"type": "PointLight", "color": (0.2, 0.6, 0.9), "intensity": 3, "position": (0.5, 1.1, -0.3)}],
        [PointLight((0.5, 0.3, 1.1), (0.6, 1.8, 2.7), falloff="inverse-square", radius=0.1)],
    ),
    "spot": (
        [
            {
                **{"type": "SpotLight", "color": (1, 0.8, 0.5), "intensity": 2, "position": (-0.6, 1.5, 0.4), "target": (0.3, 0, -0.1)},
                **{"angle": 0.9, "penumbra": 0.6, "decay": 1},
            }
        ],
        [SpotLight((-0.6, -0.4, 1.5), (2, 1.6, 1), radius=0.01, direction=(0.9, 0.5, -1.5), inner=0.36, outer=0.9)],
    ),
}
FOLLOWED["several"] = ([light for row in FOLLOWED.values() for light in row[0]], [light for row in FOLLOWED.values() for light in row[1]])


def on_a_plane(asset: Asset) -> Asset:
    """`asset` with its receivers evenly over a rectangle about the origin, row 0 at +y, all of it covered."""
    a, b, z = HALF_EXTENT
    position = np.empty((asset.height, asset.width, 3), np.float32)
    position[..., 0] = a * (2 * (np.arange(asset.width) + 0.5) / asset.width - 1)
    position[..., 1] = b * (1 - 2 * (np.arange(asset.height) + 0.5) / asset.height)[:, None]
    position[..., 2] = z
    return replace(asset, images={**asset.images, "position": position, "coverage": np.ones(position.shape[:2], np.float32)})


def complete(asset: Asset, **manifest: Any) -> Asset:
    """`asset` with every key that asset.json has, ready to be saved."""
    own = asset.manifest
    relighting = own["method"] == "relighting-map"
    keys: dict[str, Any] = {"format": "srbf-asset", "version": 1, "quantity": "irradiance", "transport": "combined"}
    keys |= {"row_origin": "top", "axes": "z-up-right-handed", "asset_from_world": np.eye(4).tolist()}
    keys |= {name: f"{name}.exr" for name in asset.images}
    keys[asset.layers_key] = layer_entries("map" if relighting else "plane", asset.encoding, asset.scale, asset.bias)
    if relighting:
        keys["r_table"] = {"file": "r_table.exr", "size": len(asset.table)}
    elif own["method"] != "neural-map":
        keys["light_coefficients"] = {"file": "light_coefficients.exr"}
        keys["w_table"] = {**own["w_table"], "file": "w_table.exr", "mapping": "octahedral"}
        if "cluster_index" in asset.tables:
            keys["cluster_index"] = {"file": "cluster_index.png"}
    return replace(asset, manifest={**own, **keys, **manifest})


def tolerance(asset: Asset, lights: Sequence[Light], target: str = "float") -> np.ndarray:
    """How far a picture may be from numpy's, (H, W, 3): relative to the sum of the magnitudes of all terms of all lights.

    Of a neural map: to the largest response to each light, since its terms have no fixed number.
    """
    values = asset.coefficients()
    bare = replace(
        asset,
        manifest={**asset.manifest, asset.layers_key: [{**entry, "encoding": "float"} for entry in asset.layers]},
        scale=np.ones_like(asset.scale),
        bias=np.zeros_like(asset.bias),
    )
    bound = np.zeros((asset.height, asset.width, 3), np.float32)
    for light in lights:
        if asset.method == "neural-map":
            bound += np.abs(methods.linear_response(asset, [light])).max()
            continue
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


def decoded(picture: dict[str, Any]) -> np.ndarray:
    """(H, W, 3) float32 of what the page says of a picture."""
    pixels = np.frombuffer(base64.b64decode(picture["pixels"]), np.float32)
    return pixels.reshape(picture["height"], picture["width"], 4)[..., :3]
