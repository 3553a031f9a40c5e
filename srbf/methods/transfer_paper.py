"""Transfer as patch-to-patch matrices over bases of direct light, its result on surfels that receivers show as splats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import COVERED, Capture
from srbf.encode.dilation import dilate, nearest_covered
from srbf.errors import InputError, ManifestError
from srbf.light_domain import domain_of_capture
from srbf.lights import Light, NamedLight, PointLight
from srbf.methods import kept_visibility
from srbf.methods.carried import carried_images, carried_scene, common_manifest
from srbf.methods.kept_visibility import RECEIVER_VISIBILITY_HELP, VISIBILITY_HELP, check_visibility, light_on_patches
from srbf.methods.light_table_maps import stored_values
from srbf.methods.over_lights import row_chunks
from srbf.methods.protocol import QUIET, FitRun, Method, setting
from srbf.stored_layers import layer_entries
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.patch_transfer import Exchange, PatchTransfer, example_light, patch_transfer, surfel_clusters, thinned
from srbf.visibility.received import ReceivedLight
from srbf.visibility.splats import splats_at
from srbf.visibility.surface_cells import Cells
from srbf.visibility.transfer_operator import TransferOperator

PAPER = "paper"
SPLATS = 4  # of a receiver: a layer of their weights, one of the low and one of the high bytes of their surfels
MOST_COEFFICIENTS = 256
_matrices: WeakKeyDictionary[Asset, list[Any]] = WeakKeyDictionary()


@dataclass(frozen=True)
class TransferPaper(Method):
    """Indirect light of lights inside the scene by patch-to-patch matrices, in the form that articles have given it [Lehtinen2008].

    L_r = sum_s S_rs (D_s e_s), s and r clusters of surfels; T(p) = sum_i w_i L_{r_i}

    e_s is the direct irradiance on cluster s, the rows of D_s are the leading axes of the direct light of examples there, S_rs is what
    each axis sends to cluster r, all bounces included. A receiver shows the normalized mixture of four elliptical Gaussians about surfels.
    `transfer` has less error at the same bytes per texel and a shader; this is here to be compared with.

    Parameters
    ----------
    basis
        `paper`: names this form of the method transfer.
    d2
        How many coefficients per cluster, 1 to 256.
    cluster_size
        About how many surfels make a cluster; `auto`: 1000, or of fewer than 48,000 surfels 48 clusters.
    dropped
        How much of a surfel's light, rms over the examples, the entries of the matrices may hold that are set to 0, `none` or below 1.
    visibility
        `pca:COUNT`: keep what each surfel sees as so many coefficients, for light without rays [Nowrouzezahrai2007]; `none`.
    receiver_visibility
        Keep what each receiver sees as well, for direct light without shadow maps.
    seed
        Of random numbers.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> TransferPaper(d2=10).cluster_size
    'auto'
    """

    name: ClassVar[str] = "transfer-paper"
    order: ClassVar[int] = 9
    layers: ClassVar[str] = "splats"
    tables: ClassVar[dict[str, str]] = {
        "cells": "cells.exr",
        "direct_bases": "direct_bases.exr",
        "patch_matrices": "patch_matrices.exr",
        **kept_visibility.FILES,
    }
    domains: ClassVar[tuple[str, ...]] = ("surfels",)
    receivers: ClassVar[tuple[str, ...]] = ("lightmap", "view", "vertices")
    implied_by: ClassVar[tuple[str, ...]] = ("d2", "basis=paper")
    has_shader: ClassVar[bool] = False
    on_page: ClassVar[bool] = False
    filterable: ClassVar[bool] = False
    exportable: ClassVar[bool] = False
    takes_profiles: ClassVar[bool] = True

    basis: Literal["paper"] | str = setting(PAPER, "Patch-to-patch matrices over bases of direct light, of captures of surfels.")
    d2: int = setting(10, "Coefficients of direct light per cluster of surfels.")
    cluster_size: Literal["auto"] | int = setting("auto", "Surfels per cluster.", words=("auto",))
    dropped: Literal["none"] | float = setting(0.02, "Share of light that small entries of the matrices hold, set to 0.", words=("none",))
    visibility: str = setting("none", VISIBILITY_HELP)
    receiver_visibility: bool = setting(False, RECEIVER_VISIBILITY_HELP)
    seed: int = 0

    def __post_init__(self) -> None:
        if self.basis != PAPER:
            raise InputError(f"expected a basis of {PAPER} for method {self.name}, found {self.basis!r}")
        if not 1 <= self.d2 <= MOST_COEFFICIENTS:
            raise InputError(f"expected 1 to {MOST_COEFFICIENTS} coefficients, found `d2={self.d2}`")
        if self.cluster_size != "auto" and not self.cluster_size >= 1:
            raise InputError(f"expected `cluster_size` auto or 1 or more, found {self.cluster_size}")
        if self.dropped != "none" and not 0 <= self.dropped < 1:
            raise InputError(f"expected `dropped` none or a share from 0 to below 1, found {self.dropped:g}")
        check_visibility(self.visibility, self.receiver_visibility)

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Bases of example light, and what they send by the capture's form factors; no light is rendered.

        Parameters
        ----------
        capture
            Of surfels.
        run
            Unused: seams need no closing, since both sides show the same surfels.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where the capture lacks its scene, or positions and normals of its receivers, or has no surfels.
        ImageError
            Where its form factors cannot be read.

        Examples
        --------
        >>> TransferPaper(d2=20).encode(inside).manifest["direct_bases"]["coefficients"]  # doctest: +SKIP
        20
        """
        operator = TransferOperator.read(capture.folder)
        if not len(operator.cells.places):
            raise InputError(f"expected surfels in {capture.folder}, found none that light can reach; choose other `light_bounds`")
        return self.of_transfer(capture, *self.transfer(capture, operator))

    def transfer(self, capture: Capture, operator: TransferOperator) -> tuple[CloudLights, PatchTransfer]:
        """(the surfels cluster by cluster, bases and matrices with all their entries)."""
        inside = CloudLights.of(capture)
        clusters = surfel_clusters(operator.cells, None if self.cluster_size == "auto" else int(self.cluster_size), self.seed)
        order = np.argsort(clusters, kind="stable")
        cells = _at(operator.cells, order)
        inside = replace(inside, cells=cells)
        examples = example_light(ReceivedLight(cells, inside.occluders), cells.areas, inside.free, self.seed)
        bounces = capture.manifest["surfels"].get("bounces")
        exchange = Exchange(operator.exchange[order][:, order], cells, bounces, self.seed)
        return inside, patch_transfer(exchange, cells, clusters[order], examples, self.d2)

    def of_transfer(self, capture: Capture, inside: CloudLights, found: PatchTransfer) -> Asset:
        """The asset of what `transfer` found."""
        if self.dropped != "none":
            found = replace(found, matrices=thinned(found, float(self.dropped)))
        nearest = nearest_covered(capture.coverage())
        images = carried_images(capture, nearest)
        stored = np.stack([dilate(layer, nearest) for layer in _splat_layers(capture, inside)])
        scale = np.ones((len(stored), 4), np.float32) * np.array([[1], [255], [255 * 256]], np.float32)
        bias = np.zeros_like(scale)
        manifest = common_manifest(capture, self.name, domain_of_capture(capture), images, asdict(self), {})
        manifest[self.layers] = layer_entries("splat", "uint8", scale, bias)
        tables: dict[str, ndarray] = {"cells": inside.cells.image()}
        for name, table in (("direct_bases", found.bases[:, :, None]), ("patch_matrices", found.matrices)):
            tables[name], entry = stored_values(table)
            manifest[name] = {"file": self.tables[name], "scale": entry["light_values"]["scale"]}
        manifest["cells"] = {"file": self.tables["cells"]}
        manifest["direct_bases"] |= {"coefficients": len(found.bases), "clusters": found.sizes.tolist()}
        manifest["source"]["fit"]["train_lights"] = found.examples
        asset = Asset(manifest, stored, scale, bias, tables, images, carried_scene(capture))
        kept_visibility.add_visibility(asset, inside, self.visibility, self.receiver_visibility)
        return asset

    def __str__(self) -> str:
        return f"{self.d2} coefficients of direct light per cluster of surfels"

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        sizes = reader.manifest["direct_bases"]["clusters"]
        count, surfels = int(reader.manifest["direct_bases"]["coefficients"]), int(sum(sizes))
        cells = reader.rows("cells", 2, 4)
        if cells.shape[1] != surfels:
            raise ManifestError(f"expected clusters of {cells.shape[1]} surfels in {reader.path}, found {surfels}")
        bases = reader.table("direct_bases", (count, surfels), 1).astype(np.float16)
        matrices = reader.table("patch_matrices", (count * len(sizes), surfels), 3).astype(np.float16)
        tables = {"cells": cells, "direct_bases": bases, "patch_matrices": matrices}
        return {**tables, **kept_visibility.read_visibility(reader)}

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "S 3"]:
        """The indirect light on every surfel: direct light on them, its coefficients, their matrices."""
        if any(isinstance(light, NamedLight) for light in lights):
            raise InputError(
                f"expected lights inside the scene for a {cls.name} asset, found a named one; fit with `editable`, method transfer"
            )
        received = np.zeros((asset.tables["cells"].shape[1], 3))
        on_patches = light_on_patches(asset) if lights else None
        for light in lights:
            assert on_patches is not None
            received += on_patches(light)
        return light_on_surfels(asset, received)

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        return on_receivers(asset, cls.projected_weights(asset, lights))

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        lights = [PointLight((x, y, z), falloff="inverse-square") for x, y, z in coordinates.tolist()]
        return np.stack([cls.linear_response(asset, [light]) for light in lights])

    @classmethod
    def local_lights(cls, lights: Sequence[Light]) -> list[PointLight]:
        return []

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return SPLATS

    @classmethod
    def label(cls, asset: Asset) -> str:
        told = asset.manifest["direct_bases"]
        return f"{told['coefficients']} coefficients, {len(told['clusters'])} clusters"

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        told = asset.manifest["direct_bases"]
        return {"surfels": sum(told["clusters"]), "surfel_clusters": len(told["clusters"]), "coefficients": told["coefficients"]}

    @classmethod
    def summary(cls, asset: Asset) -> str:
        told, matrices = asset.manifest["direct_bases"], asset.tables["patch_matrices"]
        kept = float(matrices.any(axis=2).mean())
        surfels = sum(told["clusters"])
        return (
            f"{surfels} surfels in {len(told['clusters'])} clusters of {told['coefficients']} coefficients, {kept:.0%} of the matrices kept"
        )


def light_on_surfels(asset: Asset, received: Float64[ndarray, "S 3"]) -> Float64[ndarray, "S 3"]:
    """Indirect irradiance on the surfels from the direct one."""
    told = asset.manifest["direct_bases"]
    starts = np.cumsum([0, *told["clusters"][:-1]])
    bases = asset.tables["direct_bases"].reshape(told["coefficients"], -1).astype(np.float32)
    scale = told["scale"] * asset.manifest["patch_matrices"]["scale"]
    columns = []
    for c, matrix in enumerate(_sparse(asset)):
        coefficients = np.add.reduceat(bases * received[:, c].astype(np.float32), starts, axis=1)  # (d, K)
        columns.append(matrix @ coefficients.T.ravel() * scale)
    return np.stack(columns, axis=1).astype(np.float64)


def _sparse(asset: Asset) -> list[Any]:
    """The matrices of each color, (S, K d), without their zeros; kept from call to call of one asset."""
    from scipy.sparse import csr_array

    if asset not in _matrices:
        table = asset.tables["patch_matrices"]
        _matrices[asset] = [csr_array(np.ascontiguousarray(table[:, :, c].T).astype(np.float32)) for c in range(3)]
    return _matrices[asset]


def on_receivers(asset: Asset, light: Float64[ndarray, "S 3"]) -> Float32[ndarray, "H W 3"]:
    """What receivers show of light on the surfels, in the asset's quantity."""
    result = np.empty((asset.height, asset.width, 3), np.float32)
    values = light.astype(np.float32)
    for rows in row_chunks(asset):
        weights, low, high = asset.coefficients(rows)
        surfels = np.round(low + high).astype(np.int64)
        result[rows] = np.einsum("hwn,hwnc->hwc", weights, values[surfels])
    if asset.quantity == "radiance":
        result *= asset.images["albedo"] / np.float32(np.pi)
    return result


def _splat_layers(capture: Capture, inside: CloudLights) -> ndarray:
    """(3, H, W, 4) bytes: weights of the splats of each receiver, and low and high bytes of their surfels' numbers."""
    positions, normals = capture.geometry("position"), capture.geometry("normal")
    if positions is None or normals is None:
        raise InputError(f"expected position and normal of the receivers in {capture.folder}, found none; bake again")
    if capture.quantity == "radiance" and capture.geometry("albedo") is None:
        raise InputError(f"expected the albedo of the receivers in {capture.folder}, found none; bake again")
    covered = capture.coverage() >= COVERED
    points, directions = positions[covered].astype(np.float64), normals[covered].astype(np.float64)
    is_view = (capture.manifest.get("receiver") or {}).get("kind") == "view"
    surfels, weights = splats_at(points, directions, inside.cells, inside.occluders, SPLATS, is_view)
    layers = np.zeros((3, *covered.shape, SPLATS), np.uint8)
    layers[0, covered], layers[1, covered], layers[2, covered] = _bytes(weights), surfels % 256, surfels // 256
    return layers


def _bytes(weights: Float64[ndarray, "P n"]) -> ndarray:
    """Weights in 255ths that add up to 255, as they add up to 1; or to 0."""
    rounded = np.round(weights * 255).astype(np.int64)
    total = np.where(weights.any(axis=1), 255, 0)
    rounded[np.arange(len(weights)), weights.argmax(axis=1)] += total - rounded.sum(axis=1)
    return rounded.astype(np.uint8)


def _at(cells: Cells, order: Int[ndarray, " S"]) -> Cells:
    """Cells in another order, each a patch of its own."""
    return Cells(cells.places[order], cells.normals[order], cells.areas[order], cells.albedo[order], np.arange(len(order)))


METHOD = TransferPaper
