"""An asset on disk: what a fit leaves to ship, and all that relighting may look at."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf import schemas
from srbf.arrays import Bool, Float32, Float64, Int
from srbf.asset_reader import ASSET_MANIFEST, AssetReader, read_layers
from srbf.basis.gaussian import GaussianBasis
from srbf.basis.harmonics import HARMONICS, PolynomialTextureMap, SphericalHarmonics
from srbf.basis.light_functions import LightFunctions
from srbf.capture import COVERED
from srbf.channels import GLOSS, THROUGH
from srbf.errors import InputError, ManifestError
from srbf.io import files
from srbf.io.containers.texture_array import level_bytes, level_size
from srbf.io.image import Encoding, write_images
from srbf.io.packed_table import pack
from srbf.probe_grid import ProbeGrid, probes_of
from srbf.receiver_images import Quantity
from srbf.registry import method_named
from srbf.schemas import check_version
from srbf.sphere import Domain
from srbf.stored_layers import DTYPE, ENCODING, TEXEL_BITS, LayerEncoding, layer_entries

if TYPE_CHECKING:
    from srbf.methods.protocol import Method

MANIFEST = ASSET_MANIFEST
GEOMETRY = ("position", "normal", "coverage", "ambient", "albedo", *GLOSS, THROUGH)
AT_TEXELS = ("normal", "albedo", *GLOSS, THROUGH)  # what relighting of some texels needs
SCENE_FILE = "scene.glb"


@dataclass(eq=False)
class Asset:
    """What a fit leaves to ship: stored layers, the functions that they weigh, and the receivers' geometry.

    A layer's value is stored * scale + bias. Relighting maps are N = K layers of C = 3, one per Gaussian; coefficient maps are four to a
    layer, C = 4. What is in memory is exactly what the files say.

    Parameters
    ----------
    manifest
        The content of asset.json.
    stored
        (N, H, W, C) float16, float32 or uint8, as on disk. A byte counts as byte / 255; BC7 and BC1 are decoded to bytes; of mip levels the
        full size alone is kept.
    scale, bias
        (N, C) float32.
    tables
        What the method looks up, by the manifest's key: `r_table` (n,) float32; or `light_coefficients` (F, B, 3) float32 or float16,
        `w_table` (rows, columns, 3) float16 and, where there are clusters, `cluster_index` (H, W) uint8.
    images
        position (m), normal, albedo (H, W, 3) float32, coverage (H, W) and ambient (H, W, 3), each optional; of views with gloss `glossy`
        (H, W, 3), what lobes reflect toward the camera, and `lobe` (H, W, 3), of translucent views `transmission` (H, W, 3), see
        `srbf.channels`.
    scene
        scene.glb of an indirect asset: what casts the shadows of the light to be added.
    probes
        Where they are, of an asset whose receivers are probes: see `srbf.relighting.probe_light`.

    Examples
    --------
    >>> asset.k, asset.encoding
    (9, 'half')
    >>> asset.stored.shape, asset.basis.centers.shape
    ((9, 6, 8, 3), (9, 3))
    """

    manifest: dict[str, Any]
    stored: ndarray
    scale: Float32[ndarray, "N C"]
    bias: Float32[ndarray, "N C"]
    tables: dict[str, ndarray]
    images: dict[str, ndarray] = field(default_factory=dict)
    scene: bytes | None = None  # scene.glb of an indirect asset: what casts the shadows of the light to be added
    probes: ProbeGrid | None = None

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
        """How many components per texel: coefficient maps, four to a layer."""
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
        """`view`, `lightmap`, `vertices` or `probes`; a picture of which nothing is known is a view."""
        return str(self.receiver.get("kind") or "view")

    @property
    def encoding(self) -> LayerEncoding:
        return self.layers[0]["encoding"]

    @property
    def held(self) -> Encoding:
        """What `stored` is in memory: blocks are bytes there."""
        return ENCODING[self.stored.dtype.name]

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
        """w_f(L) of eigen maps: function (S + 1) m + j is that of component j in cluster m, j = 0 the mean's.

        Examples
        --------
        >>> eigen = fit(capture, components=4)
        >>> eigen.light_functions.evaluate(np.array([[0.0, 0.0, 1.0]])).shape  # (L, F, 3)
        (1, 5, 3)
        """
        basis = self.manifest["light_basis"]
        coefficients = self.tables["light_coefficients"].astype(np.float32, copy=False)
        return LightFunctions(np.array(basis["centers"], np.float64), np.array(basis["spreads"]), coefficients)

    @property
    def domain(self) -> Domain:
        return self.manifest["domain"]

    @property
    def basis(self) -> GaussianBasis:
        """The Gaussians that relighting maps weigh.

        Returns
        -------
        GaussianBasis
            `centers` (K, 3), normalized here, and `spread`, rad.

        Raises
        ------
        InputError
            On an asset of other functions.

        Examples
        --------
        >>> asset.basis.centers.shape, asset.basis.spread > 0
        ((9, 3), True)
        """
        basis = self.manifest.get("basis", {"kind": self.method})
        if basis["kind"] != "gaussian":
            raise InputError(f"expected relighting maps of Gaussians, found {basis['kind']}")
        centers = np.array(basis["centers"], np.float64)
        return GaussianBasis(centers / np.linalg.norm(centers, axis=1, keepdims=True), float(basis["spread"]))

    @property
    def map_functions(self) -> GaussianBasis | SphericalHarmonics | PolynomialTextureMap:
        """The functions that relighting maps weigh, Gaussians or a baseline's.

        Examples
        --------
        >>> asset.map_functions.evaluate(np.array([[0.0, 0.0, 1.0]])).shape  # (L, K)
        (1, 9)
        """
        kind = self.manifest["basis"]["kind"]
        return self.basis if kind == "gaussian" else HARMONICS[kind](self.k)

    @property
    def asset_from_world(self) -> Float64[ndarray, "4 4"]:
        """World to the frame that the asset was captured in: identity until an instance moves it.

        Returns
        -------
        ndarray
            (4, 4) float64, acts on columns (x, y, z, 1).

        Examples
        --------
        >>> bool((asset.asset_from_world == np.eye(4)).all())
        True
        """
        return np.array(self.manifest.get("asset_from_world", np.eye(4).tolist()), np.float64)

    @property
    def covered(self) -> Bool[ndarray, "H W"]:
        """Which texels are real; all of them where the asset says nothing.

        Returns
        -------
        ndarray
            (H, W) bool.

        Examples
        --------
        >>> asset.covered.shape, bool(asset.covered.all())
        ((6, 8), True)
        """
        coverage = self.images.get("coverage")
        return np.ones((self.height, self.width), bool) if coverage is None else coverage >= COVERED

    def coefficients(self, rows: slice = slice(None)) -> Float32[ndarray, "N h W C"]:
        """The decoded layers: c_i of relighting maps, a_j of eigen maps.

        Parameters
        ----------
        rows
            Some rows of texels; by default all.

        Returns
        -------
        ndarray
            (N, h, W, C) float32, linear.

        Examples
        --------
        >>> asset.coefficients().shape, asset.coefficients(slice(0, 2)).shape
        ((9, 6, 8, 3), (9, 2, 8, 3))
        """
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
        """An asset of some texels alone, of their geometry with normals and reflectances only: to relight it, not to save.

        Parameters
        ----------
        texels
            (n,) flat indices, row by row from the top.

        Returns
        -------
        Asset
            Of height 1 and width n.

        Examples
        --------
        >>> sun = DirectionalLight((0.0, 0.0, 1.0))
        >>> bool(np.allclose(relight(asset.at(np.array([9])), [sun])[0, 0], relight(asset, [sun])[1, 1]))
        True
        """
        stored = self.stored.reshape(len(self.stored), -1, self.stored.shape[3])[:, texels]
        tables = {name: table.reshape(-1)[texels][None] if name == "cluster_index" else table for name, table in self.tables.items()}
        for name in ("gloss_neighbors", "behind_neighbors"):
            if name in tables:
                tables[name] = tables[name].reshape(-1, self.height * self.width, 3)[:, texels]
        manifest = {**self.manifest, "height": 1, "width": len(texels)}
        images = {name: image.reshape(-1, 3)[texels][None] for name, image in self.images.items() if name in AT_TEXELS}
        return replace(self, manifest=manifest, stored=stored[:, None], tables=tables, images=images)

    def bytes_per_texel(self) -> dict[str, int | float]:
        """What a shader reads of a texel's own data, by kind of light: its layers and its cluster's index.

        Three channels count as four, since no GPU keeps three, blocks by their sixteenth. The position that point and spot lights need is
        left out.

        Returns
        -------
        dict
            Bytes by `directional`, `point`, `spot` and `environment`.

        Examples
        --------
        >>> asset.bytes_per_texel()["directional"]  # 9 maps of 4 half floats
        72
        """
        bits = TEXEL_BITS[self.encoding] * len(self.stored) + (8 if "cluster_index" in self.tables else 0)
        own = bits / 8 if bits % 8 else bits // 8
        return {"directional": own, "point": own, "spot": own, "environment": own}

    def layer_bytes(self) -> int:
        """The layers as GPU memory, with the mip levels they have, and the clusters' index.

        Returns
        -------
        int
            Bytes of all texels.

        Examples
        --------
        >>> asset.layer_bytes() == 9 * asset.width * asset.height * 8  # 9 maps of 4 half floats
        True
        """
        sizes = [level_size(self.width, self.height, level) for level in range(self.levels)]
        form = self.encoding
        a_layer = sum(2 * level_bytes("half", *size) if form == "float" else level_bytes(form, *size) for size in sizes)
        return len(self.stored) * a_layer + (self.width * self.height if "cluster_index" in self.tables else 0)

    def required_scene(self) -> bytes:
        """scene.glb: what casts the shadows of lights inside; InputError where the asset lacks it.

        Returns
        -------
        bytes
            Binary glTF.

        Raises
        ------
        InputError
            Where there is none.

        Examples
        --------
        >>> asset.required_scene()
        Traceback (most recent call last):
        srbf.errors.InputError: expected scene.glb in the asset, found none: lights need what casts shadows; fit again
        """
        if self.scene is None:
            raise InputError("expected scene.glb in the asset, found none: lights need what casts shadows; fit again")
        return self.scene

    def resident_bytes(self) -> int:
        """Everything the folder holds, as GPU memory.

        Returns
        -------
        int
            Bytes of layers, position, normal, albedo, ambient (RGBA float), coverage, the tables, the scene and where probes are.

        Examples
        --------
        >>> asset.resident_bytes() > asset.layer_bytes() == 72 * asset.width * asset.height
        True
        """
        texels = self.width * self.height
        channels = sum(1 if name == "coverage" else 4 for name in self.images)
        tables = {name: table for name, table in self.tables.items() if name != "cluster_index"}
        looked_up = sum(table.nbytes if table.ndim != 3 else table.nbytes // 3 * 4 for table in tables.values())
        probes = 0 if self.probes is None else self.probes.nearness.nbytes + 16 * self.probes.count
        return self.layer_bytes() + texels * 4 * channels + looked_up + len(self.scene or b"") + probes

    def save(self, folder: Path, force: bool = False) -> None:
        """Write the folder whole or not at all, one image per layer; fills in `sha256` of the manifest.

        Parameters
        ----------
        folder
            Made with its parents.
        force
            Replace an asset that is there.

        Raises
        ------
        OutputExistsError
            Where the folder exists and `force` is not set, or it holds something else than an asset.

        Examples
        --------
        >>> asset.save(folder / "saved")
        >>> asset.save(folder / "saved")
        Traceback (most recent call last):
        srbf.errors.OutputExistsError: ...
        >>> asset.save(folder / "saved", force=True)
        """
        with files.atomic_folder(folder, force, MANIFEST) as temporary:
            if "layer" in self.layers[0]:  # read from a texture array: saved as what it decoded to
                self.manifest[self.layers_key] = layer_entries(self.layers_key[:-1], self.held, self.scale, self.bias)
            self.write(temporary)

    def write(self, folder: Path, layers: bool = True) -> None:
        """Fill an existing folder; fills in `sha256` of all that lies there. Without `layers`, they lie there already."""
        images: list[tuple[Path, ndarray, Encoding, bool]] = []
        if layers:
            images += [(folder / entry["file"], stored, self.held, False) for entry, stored in zip(self.layers, self.stored, strict=True)]
        for name, table in self.tables.items():
            entry = self.manifest[name]
            pixels = pack(table, entry["packed"]) if "packed" in entry else np.atleast_3d(table[None] if table.ndim == 1 else table)
            images.append((folder / entry["file"], pixels, ENCODING[pixels.dtype.name], "packed" in entry))
        write_images([*images, *((folder / self.manifest[name], image, "float", False) for name, image in self.images.items())])
        if self.scene is not None:
            (folder / self.manifest["scene"]).write_bytes(self.scene)
        if self.probes is not None:
            self.probes.write(folder)
        self.manifest["sha256"] = files.checksums(folder, MANIFEST)
        schemas.check_asset(self.manifest, method_named(self.method).stem(), MANIFEST)
        files.write_json(folder / MANIFEST, self.manifest)

    @staticmethod
    def open(folder: Path | str) -> Asset:
        """Read an asset, all of it.

        Parameters
        ----------
        folder
            What `save`, `srbf fit` or `srbf export` wrote.

        Returns
        -------
        Asset
            Exactly what the files say.

        Raises
        ------
        ManifestError, ImageError
            In one line, where a file is missing, damaged or not what asset.json says.

        Examples
        --------
        >>> Asset.open(folder / "asset").quantity
        'irradiance'
        """
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
            stored = read_layers(reader, layers, channels, path)
        else:
            stored = np.empty((len(layers), manifest["height"], manifest["width"], channels), DTYPE[encoding])
            for target, entry in zip(stored, layers, strict=True):
                pixels = reader.image(entry["file"], channels)
                target[...] = np.round(pixels * 255) if encoding == "uint8" else pixels
        images = {name: reader.image(manifest[name], 1 if name == "coverage" else 3) for name in GEOMETRY if name in manifest}
        if "coverage" in images:
            images["coverage"] = images["coverage"][:, :, 0]
        scale = np.array([entry["scale"] for entry in layers], np.float32)
        bias = np.array([entry["bias"] for entry in layers], np.float32)
        scene = reader.bytes(manifest["scene"]) if "scene" in manifest else None
        return Asset(manifest, stored, scale, bias, tables, images, scene, probes_of(manifest.get("receiver", {}), reader.pixels))


def _method(manifest: dict[str, Any], path: Path) -> type[Method]:
    try:
        return method_named(str(manifest.get("method")))
    except InputError as error:
        raise ManifestError(f"{error} in {path}") from None
