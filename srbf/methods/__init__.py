"""Methods of relighting, one a file: encode(capture) -> asset, relight(asset, lights) -> image. None imports another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from srbf.asset import Asset
from srbf.lights import Light
from srbf.methods import relighting_map

RELIGHT: dict[str, Callable[[Asset, Sequence[Light]], np.ndarray]] = {"relighting-map": relighting_map.relight}
DIRECTIONAL: dict[str, Callable[[Asset, np.ndarray], np.ndarray]] = {"relighting-map": relighting_map.directional_responses}


def relight(asset: Asset, lights: Sequence[Light]) -> np.ndarray:
    """The asset under `lights`, (H, W, 3) float32, by the method that it names."""
    return RELIGHT[asset.method](asset, lights)


def directional_responses(asset: Asset, directions: np.ndarray) -> np.ndarray:
    """(b, H, W, 3) float32 answers to a white light from each of (b, 3) unit directions, before the clamp and without ambient."""
    return DIRECTIONAL[asset.method](asset, directions)
