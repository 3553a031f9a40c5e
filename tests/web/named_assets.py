"""Made assets of named lights as they lie on disk, and what their mixes look like: written and evaluated here, not by the library."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from web_assets import FLOAT, HALF_EXTENT

from srbf.encode.quantization import quantize
from srbf.io.image import write_image
from srbf.stored_layers import layer_entries

NAMES = ("Desk lamp", "Window", "TV", "L0", "Sconce & rail")
SCALE = 2.0**-9  # of stored light values
Colors = Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True, eq=False)
class Mixed:
    """A made asset: `responses` (N, H, W, 3) of its lights, `terms` of the magnitudes of what each is a sum of, and `ambient`."""

    manifest: dict[str, Any]
    files: dict[str, tuple[np.ndarray, str]]
    responses: np.ndarray
    terms: np.ndarray
    ambient: np.ndarray

    def write(self, folder: Path) -> None:
        """asset.json and its files."""
        folder.mkdir(parents=True)
        for name, (image, encoding) in self.files.items():
            write_image(folder / name, image, encoding)  # type: ignore[arg-type]
        (folder / "asset.json").write_text(json.dumps(self.manifest))

    def picture(self, colors: Colors) -> np.ndarray:
        """(H, W, 3) under the lights in `colors`, by name; the others are as designed."""
        return np.maximum(np.einsum("nc,nhwc->hwc", self._weights(colors), self.responses), 0) + self.ambient

    def tolerance(self, colors: Colors, share: float = FLOAT) -> np.ndarray:
        """How far a picture may be from `picture`, relative to the magnitudes of all terms."""
        return share * (np.einsum("nc,nhwc->hwc", np.abs(self._weights(colors)), self.terms) + self.ambient) + 1e-7

    @staticmethod
    def _weights(colors: Colors) -> np.ndarray:
        return np.array([colors.get(name, (1.0, 1.0, 1.0)) for name in NAMES])


def light_mix(clusters: int | None, components: int = 6, encoding: str = "half", height: int = 9, width: int = 14) -> Mixed:
    """Random components under five named lights; `clusters` scattered over the texels, or none."""
    rng = np.random.default_rng([components, clusters or 0])
    layers = np.zeros((-(-components // 4), height, width, 4), np.float32)
    for j in range(components):
        layers[j // 4, :, :, j % 4] = rng.normal(size=(height, width))
    stored, scale, bias = quantize(layers, encoding)  # type: ignore[arg-type]
    scale[-1, components % 4 or 4 :], bias[-1, components % 4 or 4 :] = 0, 0
    values = rng.normal(size=((clusters or 1) * (components + 1), len(NAMES), 3)).astype(np.float32)
    stored_values = (values / SCALE).astype(np.float16)
    values = stored_values.astype(np.float32) * SCALE
    index = rng.integers(0, clusters or 1, (height, width))
    decoded = _decoded(stored, scale, bias).transpose(0, 3, 1, 2).reshape(-1, height, width)[:components]
    factors = np.concatenate([np.ones((1, height, width)), decoded])  # (S + 1, H, W)
    functions = values.reshape(clusters or 1, components + 1, len(NAMES), 3)[index]  # (H, W, S + 1, N, 3)
    responses = np.einsum("jhw,hwjnc->nhwc", factors, functions)
    terms = np.einsum("jhw,hwjnc->nhwc", np.abs(factors), np.abs(functions))
    entry = {"file": "light_values.exr", "lights": len(NAMES), "scale": SCALE}
    own: dict[str, Any] = {"method": "light-mix", "scalars": components, "light_values": entry}
    files: dict[str, tuple[np.ndarray, str]] = {"light_values.exr": (stored_values, "half")}
    if clusters is not None:
        own |= {"clusters": clusters, "cluster_index": {"file": "cluster_index.png"}}
        files["cluster_index.png"] = index.astype(np.uint8)[..., None], "uint8"
    own["planes"] = layer_entries("plane", encoding, scale, bias)  # type: ignore[arg-type]
    return _complete(own, own["planes"], stored, encoding, files, responses, terms)


def named_maps(encoding: str = "half", height: int = 9, width: int = 14) -> Mixed:
    """A random map for each of five named lights."""
    layers = np.random.default_rng(7).normal(size=(len(NAMES), height, width, 3)).astype(np.float32)
    stored, scale, bias = quantize(layers, encoding)  # type: ignore[arg-type]
    responses = _decoded(stored, scale, bias)
    own: dict[str, Any] = {"method": "named-maps", "maps": layer_entries("map", encoding, scale, bias)}  # type: ignore[arg-type]
    return _complete(own, own["maps"], stored, encoding, {}, responses, np.abs(responses))


def _decoded(stored: np.ndarray, scale: np.ndarray, bias: np.ndarray) -> np.ndarray:
    values = stored.astype(np.float32) / (255 if stored.dtype == np.uint8 else 1)
    channels = stored.shape[3]
    return values * scale[:, None, None, :channels] + bias[:, None, None, :channels]


def _complete(
    own: dict[str, Any],
    layers: list[dict[str, Any]],
    stored: np.ndarray,
    encoding: str,
    files: dict[str, tuple[np.ndarray, str]],
    responses: np.ndarray,
    terms: np.ndarray,
) -> Mixed:
    _, height, width, _ = stored.shape
    a, b, z = HALF_EXTENT
    position = np.empty((height, width, 3), np.float32)
    position[..., 0] = a * (2 * (np.arange(width) + 0.5) / width - 1)
    position[..., 1] = b * (1 - 2 * (np.arange(height) + 0.5) / height)[:, None]
    position[..., 2] = z
    ambient = np.random.default_rng(3).random((height, width, 3)).astype(np.float32)
    manifest = {
        **{"format": "srbf-asset", "version": 1, "quantity": "irradiance", "transport": "combined", "width": width, "height": height},
        **{"row_origin": "top", "axes": "z-up-right-handed", "asset_from_world": np.eye(4).tolist()},
        **{"light_domain": "named", "lights": [{"name": name, "objects": [name]} for name in NAMES]},
        **{
            "position": "position.exr",
            "ambient": "ambient.exr",
            "coverage": "coverage.exr",
            "receiver": {"kind": "lightmap", "object": "Room"},
        },
        **own,
    }
    images = {"position.exr": position, "ambient.exr": ambient, "coverage.exr": np.ones((height, width, 1), np.float32)}
    files = files | {name: (image, "float") for name, image in images.items()}
    files |= {entry["file"]: (stored[i], encoding) for i, entry in enumerate(layers)}
    return Mixed(manifest, files, responses, terms, ambient)
