"""Methods of relighting, one a file: encode(capture) -> asset, relight(asset, lights) -> image. None imports another."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

import numpy as np

from srbf.asset import Asset
from srbf.lights import Light
from srbf.methods import clustered_eigen_map, eigen_map, relighting_map
from srbf.methods.receivers import finish

METHODS: dict[str, ModuleType] = {
    "relighting-map": relighting_map,
    "eigen-map": eigen_map,
    "clustered-eigen-map": clustered_eigen_map,
}


def relight(asset: Asset, lights: Sequence[Light], direct: np.ndarray | None = None) -> np.ndarray:
    """The asset under `lights`, (H, W, 3) float32, by the method that it names; `direct` light is added before the one clamp."""
    total = linear_response(asset, lights)
    return finish(asset, total if direct is None else total + direct)


def linear_response(asset: Asset, lights: Sequence[Light]) -> np.ndarray:
    """The sum over lights before the clamp and without ambient, (H, W, 3) float32."""
    return METHODS[asset.method].linear_response(asset, lights)


def directional_responses(asset: Asset, directions: np.ndarray) -> np.ndarray:
    """(b, H, W, 3) float32 answers to a white light from each of (b, 3) unit directions, before the clamp and without ambient."""
    return METHODS[asset.method].directional_responses(asset, directions)


def projected_weights(asset: Asset, lights: Sequence[Light]) -> np.ndarray:
    """One weight a map, or a light function, and color for all directional and environment lights together, float64."""
    return METHODS[asset.method].projected_weights(asset, lights)
