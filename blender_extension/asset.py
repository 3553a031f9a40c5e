# SPDX-License-Identifier: GPL-3.0-or-later
"""An asset's folder as Blender can show it: relighting maps of Gaussians over a lightmap. Reads asset.json only, no images."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

IDENTITY_TOLERANCE = 1e-6


class AssetError(Exception):
    """An asset that cannot be shown: one line with what was expected, what was found, and what to do."""


@dataclass(frozen=True, eq=False)
class RelightingMaps:
    """k maps with value = stored scale + bias (K, 3), their Gaussians' centers (K, 3) and spread (rad), and what they light.

    quantity is irradiance or radiance; uv_layer and object are those of the bake, None where the asset does not say.
    """

    folder: Path
    files: list[Path]
    scale: np.ndarray
    bias: np.ndarray
    centers: np.ndarray
    spread: float
    quantity: str
    width: int
    height: int
    ambient: Path | None
    object: str | None
    uv_layer: str | None

    @property
    def k(self) -> int:
        return len(self.files)

    def weights(self, direction: np.ndarray) -> np.ndarray:
        """R_i(L) = exp(-acos(L . Q_i)^2 / (2 spread^2)) of one unit direction to the light, (K,) [Wong2005, eq. 2]."""
        theta = np.arccos(np.clip(self.centers @ direction, -1, 1))
        return np.exp(-0.5 * (theta / self.spread) ** 2)


def read(folder: Path) -> RelightingMaps:
    """The asset in `folder`. AssetError where there is none, or one that nodes cannot show."""
    path = folder / "asset.json"
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise AssetError(f"expected an asset at {folder}, found no asset.json; fit a capture first") from None
    except (OSError, ValueError) as error:
        raise AssetError(f"cannot read {path}: {error}; fit again") from error
    if not isinstance(manifest, dict) or (manifest.get("format"), manifest.get("version")) != ("srbf-asset", 1):
        raise AssetError(f"expected a srbf-asset of version 1 in {path}, found another file; fit again")
    try:
        return _maps(folder, manifest)
    except (KeyError, TypeError, ValueError) as error:
        raise AssetError(f"{path} breaks the asset format ({type(error).__name__}: {error}); fit again") from error


def _maps(folder: Path, manifest: dict[str, Any]) -> RelightingMaps:
    method = manifest["method"]
    if method != "relighting-map":
        raise AssetError(f"expected relighting maps to show, found method {method}; fit with --method relighting-map")
    if manifest["basis"]["kind"] != "gaussian":
        raise AssetError(f"expected Gaussians to show, found {manifest['basis']['kind']}; fit with --basis gaussian")
    if manifest.get("transport", "combined") != "combined":
        raise AssetError("expected combined transport in the maps, found an indirect asset, whose direct light Blender's nodes cannot add")
    receiver = _receiver(manifest)
    if receiver.get("kind") == "view":
        raise AssetError("expected a lightmap to show on an object, found a view; bake with an object as receiver")
    placed = np.array(manifest.get("asset_from_world", np.eye(4)), np.float64)
    if not np.allclose(placed, np.eye(4), atol=IDENTITY_TOLERANCE):
        raise AssetError("expected an asset where it was baked, found one moved by asset_from_world; show the one that was fitted")
    centers = np.array(manifest["basis"]["centers"], np.float64).reshape(len(manifest["maps"]), 3)
    spread = float(manifest["basis"]["spread"])
    if not (math.isfinite(spread) and spread > 0):
        raise AssetError(f"expected a spread above 0 rad, found {spread}; fit again")
    return RelightingMaps(
        folder,
        [_inside(folder, entry["file"]) for entry in manifest["maps"]],
        np.array([entry["scale"] for entry in manifest["maps"]], np.float64),
        np.array([entry["bias"] for entry in manifest["maps"]], np.float64),
        centers / np.linalg.norm(centers, axis=1, keepdims=True),
        spread,
        manifest["quantity"],
        int(manifest["width"]),
        int(manifest["height"]),
        _inside(folder, manifest["ambient"]) if "ambient" in manifest else None,
        receiver.get("object"),
        receiver.get("uv_layer"),
    )


def _receiver(manifest: dict[str, Any]) -> dict[str, Any]:
    """What is lit, the first of several; empty where the asset does not say. Assets of older versions say so in `source`."""
    for place in (manifest, manifest.get("source", {})):
        if "receiver" in place or place.get("receivers"):
            return place["receiver"] if "receiver" in place else place["receivers"][0]
    return {}


def _inside(folder: Path, name: str) -> Path:
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise AssetError(f"expected files inside {folder}, found {name}; fit again")
    if not path.is_file():
        raise AssetError(f"expected {path}, found no such file; fit again")
    return path
