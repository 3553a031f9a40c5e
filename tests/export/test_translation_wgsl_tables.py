"""The WGSL of named lights and of clouds through pixels, in Chromium: all lights in a texture of weights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from chromium import ask, encoded
from made_tables import INSIDE, KINDS, MIX, by_places, linear, made, size_of_terms
from pixels import FLOAT
from test_translation_wgsl import STAGE, needs_chromium, texels_of

from srbf import methods
from srbf.asset import Asset
from srbf.export import wgsl
from srbf.export.light_tables import weights_shape


def weights_of(asset: Asset) -> np.ndarray:
    return methods.projected_weights(asset, MIX) if asset.manifest["light_domain"] == "named" else by_places(asset, INSIDE)


def picture(asset: Asset) -> dict[str, Any]:
    """A case of the page, its textures in the order of their bindings."""
    clusters = asset.tables.get("cluster_index")
    rows = np.concatenate([weights_of(asset), np.ones((len(weights_of(asset)), 1))], axis=1).reshape(*weights_shape(asset), 4)
    unused = np.zeros((1, 1, 4), np.float32)
    index = unused if clusters is None else clusters[..., None].astype(np.float32) / 255
    where = ("" if clusters is None else "clusters, ") + "uv, " + ("0.0, " if asset.method == "named-maps" else "")
    body = f"return vec4f(srbfAssetDirectional(layers, nearest, {where}weightRows), 1.0);"
    values = np.zeros((1, 4), np.float32)
    return {
        "code": wgsl.asset_module(asset) + STAGE.replace("COUNT", "1").replace("BODY", body),
        "width": asset.width,
        "height": asset.height,
        "images": [texels_of(pixels) for pixels in (asset.stored, asset.images["position"], unused, index, rows.astype(np.float32))],
        "values": encoded(values),
    }


@needs_chromium
def test_wgsl_gives_the_pixels_of_numpy() -> None:
    assets = {kind: made(kind) for kind in KINDS}
    found = ask({"pictures": {kind: picture(asset) for kind, asset in assets.items()}, "modules": {}})
    for kind, asset in assets.items():
        assert "error" not in found[kind], found[kind]["error"]
        pixels = np.reshape(found[kind]["pixels"], (asset.height, asset.width, 4))[..., :3]
        expected = linear(asset, weights_of(asset))
        assert (np.abs(pixels - expected) <= FLOAT * size_of_terms(asset, weights_of(asset)) + 1e-6).all()
        assert np.abs(expected).max() > 0.2


@pytest.mark.parametrize("kind", KINDS)
def test_there_is_one_function_for_all_lights(kind: str) -> None:
    text = wgsl.asset_module(made(kind))
    assert text.count("fn srbfAssetDirectional(") == 1 and "srbfAssetPoint" not in text
