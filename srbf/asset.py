"""An asset on disk: what a fit leaves to ship, and all that relighting may look at."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy import ndarray

from srbf import schemas
from srbf.arrays import Bool, Float32, Float64, Int
from srbf.basis.gaussian import GaussianBasis
from srbf.basis.harmonics import HARMONICS, PolynomialTextureMap, SphericalHarmonics
from srbf.basis.light_functions import LightFunctions
from srbf.capture import COVERED, Quantity, check_version
from srbf.captured_light import UNIT_TOLERANCE
from srbf.errors import ImageError, InputError, ManifestError
from srbf.io import files
from srbf.io.containers import read_texture_array
from srbf.io.containers.texture_array import TextureArray, level_bytes, level_size
from srbf.io.image import Encoding, read_image, require_finite, write_images
from srbf.registry import method_named
from srbf.sphere import Domain

if TYPE_CHECKING:
    from srbf.methods.protocol import Method

LayerEncoding = Literal["half", "float", "uint8", "bc7", "bc1"]  # the last two: blocks of a texture array, bytes once decoded

MANIFEST = "asset.json"
GEOMETRY = ("position", "normal", "coverage", "ambient", "albedo")
SCENE_FILE = "scene.glb"


@dataclass(eq=False)
class Asset:
    """Stored layers with the rule value = stored * scale + bias, the functions that they weigh, and the receivers' geometry.

    `stored` (N, H, W, C) is float16, float32 or uint8 as on disk (a byte counts as byte / 255; BC7 and BC1 are decoded to bytes, of mip
    levels the full size alone is kept); `scale`, `bias` (N, C). Relighting maps are N = K layers of C = 3, one a Gaussian; coefficient maps
    are four to a layer, C = 4.
    `tables` holds what the method looks up, by the manifest's key: `r_table` (n,) float32; or `light_coefficients` (F, B, 3) float32,
    `w_table` (rows, columns, 3) float16 and, where there are clusters, `cluster_index` (H, W) uint8.
    `images` holds position, normal (H, W, 3) float32, coverage (H, W) and ambient (H, W, 3), each optional.
    `manifest` is asset.json: what is in memory is exactly what the files say.
    """

    manifest: dict[str, Any]
    stored: ndarray
    scale: Float32[ndarray, "N C"]
    bias: Float32[ndarray, "N C"]
    tables: dict[str, ndarray]
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
        """How many relighting maps."""
        return len(self.stored)

    @property
    def components(self) -> int:
        """How many components."""
        return self.manifest["scalars"]

    @property
    def clusters(self) -> int:
        """How many clusters of texels have light functions of their own."""
        return self.manifest.get("clusters", 1)

    @property
    def layers_key(self) -> str:
        """Key of asset.json that lists the layers."""
        return method_named(self.method).layers

    @property
    def layers(self) -> list[dict[str, Any]]:
        """The manifest's entry of every stored layer: file, encoding, scale, bias; in a texture array also layer and levels."""
        return self.manifest[self.layers_key]

    @property
    def receivers(self) -> list[dict[str, Any]]:
        """What the asset was captured for; empty where it says nothing. Assets of before this was a key of its own have it in `source`."""
        for place in (self.manifest, self.manifest.get("source", {})):
            if "receiver" in place or "receivers" in place:
                return place["receivers"] if "receivers" in place else [place["receiver"]]
        return []

    @property
    def receiver(self) -> dict[str, Any]:
        """The first of the receivers; empty where the asset says nothing."""
        return next(iter(self.receivers), {})

    @property
    def receiver_kind(self) -> str:
        """`view`, `lightmap` or `vertices`; a picture of which nothing is known is a view."""
        return str(self.receiver.get("kind") or "view")

    @property
    def encoding(self) -> LayerEncoding:
        return self.layers[0]["encoding"]

    @property
    def held(self) -> Encoding:
        """What `stored` is in memory: blocks are bytes there."""
        return _ENCODING[self.stored.dtype.name]

    @property
    def levels(self) -> int:
        """Mip levels of the layers on disk, the full size included."""
        return self.layers[0].get("levels", 1)

    @property
    def table(self) -> Float32[ndarray, " n"]:
        """The R table of relighting maps."""
        return self.tables["r_table"]

    @property
    def light_functions(self) -> LightFunctions:
        """w_f(L) of coefficient maps: function (S + 1) m + j is that of component j in cluster m, j = 0 the mean's."""
        basis = self.manifest["light_basis"]
        return LightFunctions(np.array(basis["centers"], np.float64), np.array(basis["spreads"]), self.tables["light_coefficients"])

    @property
    def domain(self) -> Domain:
        return self.manifest["domain"]

    @property
    def basis(self) -> GaussianBasis:
        """The Gaussians that relighting maps weigh, centers normalized here; InputError on an asset of other functions."""
        basis = self.manifest.get("basis", {"kind": self.method})
        if basis["kind"] != "gaussian":
            raise InputError(f"expected relighting maps of Gaussians, found {basis['kind']}")
        centers = np.array(basis["centers"], np.float64)
        return GaussianBasis(centers / np.linalg.norm(centers, axis=1, keepdims=True), float(basis["spread"]))

    @property
    def map_functions(self) -> GaussianBasis | SphericalHarmonics | PolynomialTextureMap:
        """The functions that relighting maps weigh, Gaussians or a baseline's."""
        kind = self.manifest["basis"]["kind"]
        return self.basis if kind == "gaussian" else HARMONICS[kind](self.k)

    @property
    def asset_from_world(self) -> Float64[ndarray, "4 4"]:
        """World to the frame that the asset was captured in: identity until an instance moves it."""
        return np.array(self.manifest.get("asset_from_world", np.eye(4).tolist()), np.float64)

    @property
    def covered(self) -> Bool[ndarray, "H W"]:
        """Which texels are real; all of them where the asset says nothing."""
        coverage = self.images.get("coverage")
        return np.ones((self.height, self.width), bool) if coverage is None else coverage >= COVERED

    def coefficients(self, rows: slice = slice(None)) -> Float32[ndarray, "N h W C"]:
        """The decoded layers, c_i of relighting maps, or some of their rows."""
        stored = self.stored[:, rows].astype(np.float32)
        if self.held == "uint8":
            stored /= 255
        if (self.scale == 1).all() and (self.bias == 0).all():
            return stored
        return stored * self.scale[:, None, None] + self.bias[:, None, None]

    def is_plain(self) -> bool:
        """Whether what is stored needs no decoding: scale 1 and bias 0, and unused channels (scale 0) hold 0."""
        unused = self.scale == 0
        return bool(((self.scale == 1) | unused).all() and not self.bias.any() and not self.stored.transpose(0, 3, 1, 2)[unused].any())

    def at(self, texels: Int[ndarray, " n"]) -> Asset:
        """An asset of some flat `texels` alone, (1, n) of them, without their geometry: to get responses of, not to save."""
        stored = self.stored.reshape(len(self.stored), -1, self.stored.shape[3])[:, texels]
        tables = {name: table.reshape(-1)[texels][None] if name == "cluster_index" else table for name, table in self.tables.items()}
        manifest = {**self.manifest, "height": 1, "width": len(texels)}
        return replace(self, manifest=manifest, stored=stored[:, None], tables=tables, images={})

    def bytes_per_texel(self) -> dict[str, int | float]:
        """What a shader reads of a texel's own data, by kind of light: its layers, three channels counting as four since no GPU
        keeps three, blocks by their sixteenth, and its cluster's index; the position that point and spot lights need is left out.
        """
        bits = TEXEL_BITS[self.encoding] * len(self.stored) + (8 if "cluster_index" in self.tables else 0)
        own = bits / 8 if bits % 8 else bits // 8
        return {"directional": own, "point": own, "spot": own, "environment": own}

    def layer_bytes(self) -> int:
        """The layers as GPU memory, with the mip levels they have, and the clusters' index."""
        sizes = [level_size(self.width, self.height, level) for level in range(self.levels)]
        form = self.encoding
        a_layer = sum(2 * level_bytes("half", *size) if form == "float" else level_bytes(form, *size) for size in sizes)
        return len(self.stored) * a_layer + (self.width * self.height if "cluster_index" in self.tables else 0)

    def resident_bytes(self) -> int:
        """Everything the folder holds, as GPU memory: layers, position, normal, albedo, ambient (RGBA float), coverage, the tables and the
        scene."""
        texels = self.width * self.height
        channels = sum(1 if name == "coverage" else 4 for name in self.images)
        tables = {name: table for name, table in self.tables.items() if name != "cluster_index"}
        looked_up = sum(table.nbytes if table.ndim != 3 else table.nbytes // 3 * 4 for table in tables.values())
        return self.layer_bytes() + texels * 4 * channels + looked_up + len(self.scene or b"")

    def save(self, folder: Path, force: bool = False) -> None:
        """Write the folder whole or not at all, one image per layer; fills in `sha256`."""
        with files.atomic_folder(folder, force, MANIFEST) as temporary:
            if "layer" in self.layers[0]:  # read from a texture array: saved as what it decoded to
                self.manifest[self.layers_key] = layer_entries(self.layers_key[:-1], self.held, self.scale, self.bias)
            self.write(temporary)

    def write(self, folder: Path, layers: bool = True) -> None:
        """Fill an existing folder; fills in `sha256` of all that lies there. Without `layers`, they lie there already."""
        images: list[tuple[Path, ndarray, Encoding]] = []
        if layers:
            images += [(folder / entry["file"], stored, self.held) for entry, stored in zip(self.layers, self.stored, strict=True)]
        for name, table in self.tables.items():
            pixels = table[None] if table.ndim == 1 else table
            images.append((folder / self.manifest[name]["file"], np.atleast_3d(pixels), _ENCODING[table.dtype.name]))
        images += [(folder / self.manifest[name], image, "float") for name, image in self.images.items()]
        write_images(images)
        if self.scene is not None:
            (folder / self.manifest["scene"]).write_bytes(self.scene)
        self.manifest["sha256"] = files.checksums(folder, MANIFEST)
        schemas.check_asset(self.manifest, method_named(self.method).stem(), MANIFEST)
        files.write_json(folder / MANIFEST, self.manifest)

    @staticmethod
    def open(folder: Path | str) -> Asset:
        """Read an asset; ManifestError or ImageError, in one line, where a file is missing, damaged or not what asset.json says."""
        folder = Path(folder)
        path = folder / MANIFEST
        if not path.is_file():
            raise ManifestError(f"expected an asset with an {MANIFEST} at {folder}, found none; srbf fit makes one")
        manifest = files.read_json(path)
        check_version(manifest, "srbf-asset", path)
        method = _method(manifest, path)
        schemas.check_asset(manifest, method.stem(), str(path))
        reader = AssetReader(folder, manifest)
        layers = manifest[method.layers]
        if len({entry["encoding"] for entry in layers}) != 1:
            raise ManifestError(f"expected one encoding for all layers in {path}, found several")
        encoding: LayerEncoding = layers[0]["encoding"]
        channels = len(layers[0]["scale"])
        tables = method.read_tables(reader)
        if any("layer" in entry for entry in layers) or encoding in ("bc7", "bc1"):
            stored = _read_layers(reader, layers, channels, path)
        else:
            stored = np.empty((len(layers), manifest["height"], manifest["width"], channels), _DTYPE[encoding])
            for target, entry in zip(stored, layers, strict=True):
                pixels = reader.image(entry["file"], channels)
                target[...] = np.round(pixels * 255) if encoding == "uint8" else pixels
        images = {name: reader.image(manifest[name], 1 if name == "coverage" else 3) for name in GEOMETRY if name in manifest}
        if "coverage" in images:
            images["coverage"] = images["coverage"][:, :, 0]
        scale = np.array([entry["scale"] for entry in layers], np.float32)
        bias = np.array([entry["bias"] for entry in layers], np.float32)
        scene = reader.bytes(manifest["scene"]) if "scene" in manifest else None
        return Asset(manifest, stored, scale, bias, tables, images, scene)


TEXEL_BITS: dict[LayerEncoding, int] = {"half": 64, "float": 128, "uint8": 32, "bc7": 8, "bc1": 4}  # of a layer
_DTYPE: dict[str, Any] = {"half": np.float16, "float": np.float32, "uint8": np.uint8}
_ENCODING: dict[str, Encoding] = {"float16": "half", "float32": "float", "uint8": "uint8"}
SUFFIX: dict[Encoding, str] = {"half": "exr", "float": "exr", "uint8": "png"}


@dataclass(frozen=True)
class AssetReader:
    """Reads an asset's files: inside its folder, of the recorded checksum and size, and finite."""

    folder: Path
    manifest: dict[str, Any]

    @property
    def path(self) -> Path:
        """Of the manifest, for messages."""
        return self.folder / MANIFEST

    def check_unit(self, vectors: list[list[float]]) -> None:
        """ManifestError where a listed center is not a unit vector."""
        lengths = np.linalg.norm(np.array(vectors, np.float64), axis=1)
        if (np.abs(lengths - 1) > UNIT_TOLERANCE).any():
            raise ManifestError(f"expected unit centers in {self.path}, found length {lengths[np.abs(lengths - 1).argmax()]:.4g}")

    def image(self, name: str, channels: int) -> np.ndarray:
        pixels = self._pixels(name, channels)
        expected = (self.manifest["height"], self.manifest["width"])
        if pixels.shape[:2] != expected:
            size = f"{pixels.shape[1]}x{pixels.shape[0]}"
            raise ImageError(f"expected {expected[1]}x{expected[0]} texels in {self.folder / name}, found {size}")
        return pixels

    def table(self, name: str, shape: tuple[int, int], channels: int) -> np.ndarray:
        """A table of the manifest's key `name`, (rows, columns, channels) float32."""
        file = self.manifest[name]["file"]
        pixels = self._pixels(file, channels)
        if pixels.shape[:2] != shape:
            found = f"{pixels.shape[1]}x{pixels.shape[0]}"
            raise ImageError(f"expected {shape[1]}x{shape[0]} texels in {self.folder / file}, found {found}")
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
        path = files.inside(self.folder, name, self.folder / MANIFEST)
        expected = self.manifest.get("sha256", {}).get(name)
        if expected and path.is_file() and files.sha256_of(path) != expected:
            raise ImageError(f"expected {path} as it was written, found another checksum: damaged or changed since; fit or export again")
        return path

    def _pixels(self, name: str, channels: int) -> np.ndarray:
        path = self._checked(name)
        pixels = read_image(path, channels)
        require_finite(pixels, path)
        return pixels


def _read_layers(reader: AssetReader, layers: list[dict[str, Any]], channels: int, path: Path) -> ndarray:
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


def _method(manifest: dict[str, Any], path: Path) -> type[Method]:
    try:
        return method_named(str(manifest.get("method")))
    except InputError as error:
        raise ManifestError(f"{error} in {path}") from None


def layer_entries(stem: str, encoding: Encoding, scale: Float32[ndarray, "N C"], bias: Float32[ndarray, "N C"]) -> list[dict]:
    """The manifest's list of stored layers: file, encoding, scale, bias."""
    return [
        {
            "file": f"{stem}_{i:02d}.{SUFFIX[encoding]}",
            "encoding": encoding,
            "scale": scale[i].astype(float).tolist(),
            "bias": bias[i].astype(float).tolist(),
        }
        for i in range(len(scale))
    ]
