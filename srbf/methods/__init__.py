"""Methods of relighting, one a file: encode(capture) -> asset, relight(asset, lights) -> image. None imports another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from srbf.asset import Asset
from srbf.lights import Light
from srbf.methods import relighting_map

RELIGHT: dict[str, Callable[[Asset, Sequence[Light]], np.ndarray]] = {"relighting-map": relighting_map.relight}
LINEAR: dict[str, Callable[[Asset, Sequence[Light]], np.ndarray]] = {"relighting-map": relighting_map.linear_response}
DIRECTIONAL: dict[str, Callable[[Asset, np.ndarray], np.ndarray]] = {"relighting-map": relighting_map.directional_responses}


def relight(asset: Asset, lights: Sequence[Light], direct: np.ndarray | None = None) -> np.ndarray:
    """The asset under `lights`, (H, W, 3) float32, by the method that it names; `direct` light is added before the one clamp."""
    if direct is None:
        return RELIGHT[asset.method](asset, lights)
    total = np.maximum(LINEAR[asset.method](asset, lights) + direct, 0)
    return total + asset.images["ambient"] if "ambient" in asset.images else total


def directional_responses(asset: Asset, directions: np.ndarray) -> np.ndarray:
    """(b, H, W, 3) float32 answers to a white light from each of (b, 3) unit directions, before the clamp and without ambient."""
    return DIRECTIONAL[asset.method](asset, directions)
