"""The files of an asset as they are read: inside its folder, of the recorded checksum and size, and finite."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.captured_light import UNIT_TOLERANCE
from srbf.errors import ImageError, ManifestError
from srbf.io import files
from srbf.io.containers import read_texture_array
from srbf.io.containers.texture_array import TextureArray
from srbf.io.image import read_image, read_stored, require_finite
from srbf.io.packed_table import unpack

ASSET_MANIFEST = "asset.json"


@dataclass(frozen=True)
class AssetReader:
    """Reads an asset's files: inside its folder, of the recorded checksum and size, and finite."""

    folder: Path
    manifest: dict[str, Any]

    @property
    def path(self) -> Path:
        """Of the manifest, for messages."""
        return self.folder / ASSET_MANIFEST

    def check_unit(self, vectors: list[list[float]]) -> None:
        """ManifestError where a listed center is not a unit vector."""
        lengths = np.linalg.norm(np.array(vectors, np.float64), axis=1)
        if (np.abs(lengths - 1) > UNIT_TOLERANCE).any():
            raise ManifestError(f"expected unit centers in {self.path}, found length {lengths[np.abs(lengths - 1).argmax()]:.4g}")

    def image(self, name: str, channels: int) -> np.ndarray:
        pixels = self.pixels(name, channels)
        expected = (self.manifest["height"], self.manifest["width"])
        if pixels.shape[:2] != expected:
            size = f"{pixels.shape[1]}x{pixels.shape[0]}"
            raise ImageError(f"expected {expected[1]}x{expected[0]} texels in {self.folder / name}, found {size}")
        return pixels

    def table(self, name: str, shape: tuple[int, int], channels: int) -> np.ndarray:
        """A table of the manifest's key `name`, (rows, columns, channels) float32."""
        return self.stored_table(name, shape, channels).astype(np.float32, copy=False)

    def stored_table(self, name: str, shape: tuple[int, int], channels: int) -> np.ndarray:
        """`table` without widening: float16 where the file has half floats."""
        file = self.manifest[name]["file"]
        path = self._checked(file)
        pixels = read_stored(path, channels)
        require_finite(pixels, path)
        if pixels.shape[:2] != shape:
            found = f"{pixels.shape[1]}x{pixels.shape[0]}"
            raise ImageError(f"expected {shape[1]}x{shape[0]} texels in {path}, found {found}")
        return pixels

    def half_table(self, name: str, shape: tuple[int, int], channels: int) -> np.ndarray:
        """A table of half floats, (rows, columns, channels), packed or not: see `srbf.io.packed_table`."""
        packed = self.manifest[name].get("packed")
        if packed is None:
            return self.table(name, shape, channels).astype(np.float16)
        file = self.manifest[name]["file"]
        pixels = self.pixels(file, channels)
        rows, columns = shape if packed == "rows" else shape[::-1]
        if pixels.shape[1] != columns + 1 or pixels.shape[0] not in (rows, 2 * rows):
            found = f"{pixels.shape[1]}x{pixels.shape[0]}"
            raise ImageError(f"expected {columns + 1}x{rows} or {columns + 1}x{2 * rows} bytes in {self.folder / file}, found {found}")
        table: np.ndarray = unpack(np.round(pixels * 255).astype(np.uint8), rows, packed)
        require_finite(table, self.folder / file)
        return table

    def rows(self, name: str, rows: int, channels: int) -> np.ndarray:
        """A table of the manifest's key `name` with `rows` rows of any length, (rows, n, channels) float32."""
        file = self.manifest[name]["file"]
        pixels = self.pixels(file, channels)
        if len(pixels) != rows:
            raise ImageError(f"expected {rows} rows in {self.folder / file}, found {len(pixels)}")
        return pixels

    def texture(self, name: str) -> TextureArray:
        texture = read_texture_array(self._checked(name))
        expected = (self.manifest["width"], self.manifest["height"])
        if (texture.width, texture.height) != expected:
            size = f"{texture.width}x{texture.height}"
            raise ImageError(f"expected {expected[0]}x{expected[1]} texels in {self.folder / name}, found {size}")
        return texture

    def bytes(self, name: str) -> bytes:
        path = self._checked(name)
        if not path.is_file():
            raise ManifestError(f"expected {path}, found no such file; fit again")
        return path.read_bytes()

    def _checked(self, name: str) -> Path:
        path = files.inside(self.folder, name, self.folder / ASSET_MANIFEST)
        expected = self.manifest.get("sha256", {}).get(name)
        if expected and path.is_file() and files.sha256_of(path) != expected:
            raise ImageError(f"expected {path} as it was written, found another checksum: damaged or changed since; fit or export again")
        return path

    def pixels(self, name: str, channels: int) -> np.ndarray:
        """An image of any size, (H, W, channels) float32."""
        path = self._checked(name)
        pixels = read_image(path, channels)
        require_finite(pixels, path)
        return pixels


def read_layers(reader: AssetReader, layers: list[dict[str, Any]], channels: int, path: Path) -> ndarray:
    """The full size of layers in texture arrays, (N, H, W, C); refuses arrays that are not what the entries say."""
    textures: dict[str, TextureArray] = {}
    decoded: dict[str, ndarray] = {}
    stored = []
    for entry in layers:
        name = entry["file"]
        if "layer" not in entry:
            raise ManifestError(f"expected the layer of {name} in {path}, found none")
        if name not in textures:
            textures[name] = reader.texture(name)
            decoded[name] = textures[name].pixels()
        texture = textures[name]
        told = (entry["encoding"], entry.get("levels", 1))
        if (texture.form, len(texture.levels)) != told or entry["layer"] >= texture.layers:
            found = f"{texture.layers} layers of {len(texture.levels)} levels of {texture.form}"
            raise ManifestError(f"expected layer {entry['layer']} of {told[1]} levels of {told[0]} in {name}, found {found}")
        stored.append(decoded[name][entry["layer"], ..., :channels])
    pixels = np.stack(stored)
    if pixels.dtype == np.float16:
        require_finite(pixels.reshape(1, -1, channels), reader.folder / layers[0]["file"])
    return pixels
