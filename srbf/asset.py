"""An asset on disk: what a fit leaves to ship, and all that relighting may look at."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf import files, schemas
from srbf.arrays import Bool, Float32, Float64
from srbf.basis.gaussian import GaussianBasis, weight
from srbf.capture import COVERED, Quantity, check_version
from srbf.errors import ImageError, ManifestError
from srbf.image import Encoding, read_image, require_finite, write_image
from srbf.sphere import Domain

MANIFEST = "asset.json"
GEOMETRY = ("position", "normal", "coverage", "ambient", "albedo")
SCENE_FILE = "scene.glb"
UNIT_TOLERANCE = 1e-3
TABLE_ENTRY_TOLERANCE = 1e-5  # float32 rounding of an entry, and of a manifest's spread


@dataclass(eq=False)
class Asset:
    """Stored maps with the rule value = stored * scale + bias, the basis that they weigh, and the receivers' geometry.

    `stored` (K, H, W, 3) is float16, float32 or uint8 as on disk (a byte counts as byte / 255); `scale`, `bias` (K, 3).
    `images` holds position, normal (H, W, 3) float32, coverage (H, W) and ambient (H, W, 3), each optional.
    `manifest` is asset.json: what is in memory is exactly what the files say.
    """

    manifest: dict[str, Any]
    stored: ndarray
    scale: Float32[ndarray, "K 3"]
    bias: Float32[ndarray, "K 3"]
    table: Float32[ndarray, " n"]
    images: dict[str, ndarray] = field(default_factory=dict)
    scene: bytes | None = None  # scene.glb of an indirect asset: what casts the shadows of the light to be added

    @property
    def method(self) -> str:
        return self.manifest["method"]

    @property
    def width(self) -> int:
        return self.manifest["width"]

    @property
    def height(self) -> int:
        return self.manifest["height"]

    @property
    def quantity(self) -> Quantity:
        return self.manifest["quantity"]

    @property
    def transport(self) -> str:
        return self.manifest.get("transport", "combined")

    @property
    def k(self) -> int:
        """How many maps."""
        return len(self.stored)

    @property
    def encoding(self) -> Encoding:
        return self.manifest["maps"][0]["encoding"]

    @property
    def domain(self) -> Domain:
        return self.manifest["domain"]

    @property
    def basis(self) -> GaussianBasis:
        """The Gaussians that the maps weigh; centers are normalised here."""
        centers = np.array(self.manifest["basis"]["centers"], np.float64)
        return GaussianBasis(centers / np.linalg.norm(centers, axis=1, keepdims=True), float(self.manifest["basis"]["spread"]))

    @property
    def asset_from_world(self) -> Float64[ndarray, "4 4"]:
        """World to the frame that the asset was captured in: identity until an instance moves it."""
        return np.array(self.manifest.get("asset_from_world", np.eye(4).tolist()), np.float64)

    @property
    def covered(self) -> Bool[ndarray, "H W"]:
        """Which texels are real; all of them where the asset says nothing."""
        coverage = self.images.get("coverage")
        return np.ones((self.height, self.width), bool) if coverage is None else coverage >= COVERED

    def coefficients(self, rows: slice = slice(None)) -> Float32[ndarray, "K h W 3"]:
        """The decoded maps c_i, or some of their rows."""
        stored = self.stored[:, rows].astype(np.float32)
        if self.encoding == "uint8":
            stored /= 255
        if (self.scale == 1).all() and (self.bias == 0).all():
            return stored
        return stored * self.scale[:, None, None] + self.bias[:, None, None]

    def map_bytes_per_texel(self) -> int:
        """What a shader reads of a texel's own maps: three channels count as four, since no GPU keeps three."""
        return self.k * 4 * {"half": 2, "float": 4, "uint8": 1}[self.encoding]

    def resident_bytes(self) -> int:
        """Everything the folder holds, as GPU memory: maps, position, normal, ambient (RGBA float), coverage, the table, and the scene."""
        texels = self.width * self.height
        channels = sum(1 if name == "coverage" else 4 for name in self.images)
        return texels * (self.map_bytes_per_texel() + 4 * channels) + self.table.nbytes + len(self.scene or b"")

    def save(self, folder: Path, force: bool = False) -> None:
        """Write the folder whole or not at all; fills in `sha256`."""
        with files.atomic_folder(folder, force, MANIFEST) as temporary:
            for entry, stored in zip(self.manifest["maps"], self.stored, strict=True):
                write_image(temporary / entry["file"], stored, entry["encoding"])
            write_image(temporary / self.manifest["r_table"]["file"], self.table[None, :, None], "float")
            for name, image in self.images.items():
                write_image(temporary / self.manifest[name], image, "float")
            if self.scene is not None:
                (temporary / self.manifest["scene"]).write_bytes(self.scene)
            written = sorted(p.name for p in temporary.iterdir())
            self.manifest["sha256"] = {name: files.sha256_of(temporary / name) for name in written}
            schemas.check(self.manifest, "asset", MANIFEST)
            files.write_json(temporary / MANIFEST, self.manifest)

    @staticmethod
    def open(folder: Path | str) -> Asset:
        """Read an asset; ManifestError or ImageError, in one line, where a file is missing, damaged or not what asset.json says."""
        folder = Path(folder)
        path = folder / MANIFEST
        if not path.is_file():
            raise ManifestError(f"expected an asset with an {MANIFEST} at {folder}, found none; srbf fit makes one")
        manifest = files.read_json(path)
        check_version(manifest, "srbf-asset", path)
        schemas.check(manifest, "asset", str(path))
        _check_basis(manifest, path)
        reader = _Reader(folder, manifest)
        maps = manifest["maps"]
        encoding: Encoding = maps[0]["encoding"]
        stored = np.empty((len(maps), manifest["height"], manifest["width"], 3), _DTYPE[encoding])
        for target, entry in zip(stored, maps, strict=True):
            pixels = reader.image(entry["file"], 3)
            target[...] = np.round(pixels * 255) if encoding == "uint8" else pixels
        images = {name: reader.image(manifest[name], 1 if name == "coverage" else 3) for name in GEOMETRY if name in manifest}
        if "coverage" in images:
            images["coverage"] = images["coverage"][:, :, 0]
        table = reader.table(manifest["r_table"])
        error = float(np.abs(table - weight(np.linspace(-1, 1, len(table)), manifest["basis"]["spread"])).max())
        if error > TABLE_ENTRY_TOLERANCE:
            raise ManifestError(f"expected the R table of spread {manifest['basis']['spread']:g} in {path}, found one off by {error:.2g}")
        scale = np.array([entry["scale"] for entry in maps], np.float32)
        bias = np.array([entry["bias"] for entry in maps], np.float32)
        scene = reader.bytes(manifest["scene"]) if "scene" in manifest else None
        return Asset(manifest, stored, scale, bias, table, images, scene)


_DTYPE: dict[str, Any] = {"half": np.float16, "float": np.float32, "uint8": np.uint8}


@dataclass(frozen=True)
class _Reader:
    """Reads an asset's files: inside its folder, of the recorded checksum and size, and finite."""

    folder: Path
    manifest: dict[str, Any]

    def image(self, name: str, channels: int) -> np.ndarray:
        pixels = self._pixels(name, channels)
        expected = (self.manifest["height"], self.manifest["width"])
        if pixels.shape[:2] != expected:
            size = f"{pixels.shape[1]}x{pixels.shape[0]}"
            raise ImageError(f"expected {expected[1]}x{expected[0]} texels in {self.folder / name}, found {size}")
        return pixels

    def table(self, entry: dict[str, Any]) -> np.ndarray:
        pixels = self._pixels(entry["file"], 1)
        if pixels.shape[:2] != (1, entry["size"]):
            raise ImageError(
                f"expected {entry['size']}x1 texels in {self.folder / entry['file']}, found {pixels.shape[1]}x{pixels.shape[0]}"
            )
        return np.ascontiguousarray(pixels[0, :, 0])

    def bytes(self, name: str) -> bytes:
        path = self._checked(name)
        if not path.is_file():
            raise ManifestError(f"expected {path}, found no such file; fit again")
        return path.read_bytes()

    def _checked(self, name: str) -> Path:
        path = files.inside(self.folder, name, self.folder / MANIFEST)
        expected = self.manifest.get("sha256", {}).get(name)
        if expected and path.is_file() and files.sha256_of(path) != expected:
            raise ImageError(f"expected {path} as it was written, found another checksum: it is damaged or was changed; fit again")
        return path

    def _pixels(self, name: str, channels: int) -> np.ndarray:
        path = self._checked(name)
        pixels = read_image(path, channels)
        require_finite(pixels, path)
        return pixels


def _check_basis(manifest: dict[str, Any], path: Path) -> None:
    centers = np.array(manifest["basis"]["centers"], np.float64)
    if len(centers) != len(manifest["maps"]):
        raise ManifestError(f"expected as many centers as maps in {path}, found {len(centers)} centers, {len(manifest['maps'])} maps")
    if len({entry["encoding"] for entry in manifest["maps"]}) != 1:
        raise ManifestError(f"expected one encoding for all maps in {path}, found several")
    lengths = np.linalg.norm(centers, axis=1)
    if (np.abs(lengths - 1) > UNIT_TOLERANCE).any():
        raise ManifestError(f"expected unit centers in {path}, found length {lengths[np.abs(lengths - 1).argmax()]:.4g}")
