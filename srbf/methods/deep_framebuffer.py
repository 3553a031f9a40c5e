"""The deep framebuffer: a view under any lights with all bounces, gathered from a pool of surfels by sparse links."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.channels import GLOSS, THROUGH
from srbf.encode.dilation import nearest_covered
from srbf.errors import ImageError, InputError, ManifestError
from srbf.light_domain import domain_of_capture
from srbf.lights import WHITE, Light, PointLight, refuse_named
from srbf.methods.carried import carried_images, common_manifest, required_scene
from srbf.methods.mixed_clusters import (
    BEHIND,
    MOST_NEAREST,
    NEIGHBOR_BYTES,
    check_nearest,
    neighbor_layers,
    neighbors,
    pictures,
    read_further_neighbors,
    size,
)
from srbf.methods.protocol import QUIET, FitRun, Method, setting
from srbf.stored_layers import layer_entries
from srbf.visibility.gather_operator import GatherOperator
from srbf.visibility.linked_light import LinkedLight, surfel_objects
from srbf.visibility.near_cells import NearCells
from srbf.visibility.near_sources import NearPool, NearReceivers
from srbf.visibility.packed_links import COLUMNS, LINK_BYTES, link_count, packed, share_within, unpacked
from srbf.visibility.received import occluders_of
from srbf.visibility.sparse_links import SparseLinks, radiosity_of
from srbf.visibility.surface_cells import Cells

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from srbf.gl.passes import Passes

MEGABYTE = 1e6
LEAST_SHARE = 1 / 32  # of the rays, that a budget leaves
POOL_FILE, VIEW = "pool.exr", "view_links"
FILES = {
    "pool": POOL_FILE,
    "view_links": "view_links.png",
    "view_rows": "view_rows.png",
    "exchange_links": "exchange_links.png",
    "exchange_rows": "exchange_rows.png",
}
POINTS = "view_points"
GLOSSY_FILES = {"gloss_links": "gloss_links.png", "gloss_rows": "gloss_rows.png", "gloss_neighbors": "gloss_neighbors.png"}
KEPT = 2  # assets whose links are ready


@dataclass(frozen=True)
class DeepFramebuffer(Method):
    """A view under any lights: I(p) = sum_j c_j(p) E_j, E = W B, B = sum_k (rho F)^k rho e     [Hasan2005, eq. 3, with all bounces]

    e is the direct irradiance that the lights lay on a pool of surfels; F are links of these to each other, W those of view clusters to
    them, by rays; a pixel mixes the clusters nearest to it in place and normal. Glossy pixels add their specular reflectance times what
    their lobes gather, G B / pi, of links G by rays of the lobes' density. The paper's gather samples belong to one cluster each and
    have one bounce. Translucent surfaces send on what falls on their backs: B = rho E + tau E', by surfels and clusters behind theirs.

    Parameters
    ----------
    nearest
        Clusters that a pixel mixes, 1 to 10.
    budget
        Megabytes (10^6) that pool, links and pixels take at most, before PNG packs them: fewer rays are kept. None: all of them.
    seed
        Of which rays are kept.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> DeepFramebuffer(budget=20).nearest
    10
    """

    name: ClassVar[str] = "deep-framebuffer"
    order: ClassVar[int] = 9
    layers: ClassVar[str] = "neighbors"
    tables: ClassVar[dict[str, str]] = FILES
    domains: ClassVar[tuple[str, ...]] = ("pool",)
    receivers: ClassVar[tuple[str, ...]] = ("view",)
    exportable: ClassVar[bool] = False
    filterable: ClassVar[bool] = False
    takes_profiles: ClassVar[bool] = True
    takes_links: ClassVar[bool] = True

    nearest: int = setting(MOST_NEAREST, "View clusters that a pixel mixes.")
    budget: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        check_nearest(self.nearest)
        if self.budget is not None and self.budget < 1:
            raise InputError(f"expected a `budget` of 1 megabyte or more, found {self.budget}")

    @classmethod
    def is_made_for(cls, capture: Capture) -> bool:
        return capture.kind in cls.domains and "links" in capture.manifest["gather"]

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Links as bytes, as many as the budget has room for, and the clusters of every pixel.

        Parameters
        ----------
        capture
            Of a gather.
        run
            Nothing of it is used: no image is read.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where the budget has no room, or the capture lacks its scene.
        ImageError
            Where its links cannot be read.

        Examples
        --------
        >>> DeepFramebuffer().encode(view).manifest["gather"]["clusters"]  # doctest: +SKIP
        20000
        """
        if "links" not in capture.manifest.get("gather", {}):
            raise InputError(f"expected links to a pool in {capture.folder}, found gather samples; leave `method` and `budget` out")
        operator = GatherOperator.read(capture.folder)
        scene = required_scene(capture)
        most = min(self.nearest, operator.nearest.shape[1])
        nearest = nearest_covered(capture.coverage())
        stored = neighbor_layers(capture, operator.nearest[:, :most], operator.weights[:, :most], nearest)
        near = {} if operator.points is None else {POINTS: operator.points, **NearCells.of(operator.cells, occluders_of(scene)).tables()}
        view = self._within(operator, most, capture.width * capture.height, near)
        scale, bias = np.ones((most, 3), np.float32), np.zeros((most, 3), np.float32)
        images = carried_images(capture, nearest)
        unused = (*(GLOSS if operator.gloss is None else ()), *((THROUGH,) if operator.behind is None else ()))
        images = {name: image for name, image in images.items() if name not in unused}
        manifest = common_manifest(capture, self.name, domain_of_capture(capture), images, asdict(self), {})
        manifest |= {name: {"file": file} for name, file in FILES.items()}
        manifest[self.layers] = layer_entries("neighbor", "uint8", scale, bias)
        bounces = capture.manifest["gather"].get("bounces")
        manifest["gather"] = {
            "surfels": len(operator.cells.places),
            "clusters": view.rows,
            "view_rays": view.rays,
            "exchange_rays": operator.exchange.rays,
            **({} if bounces is None else {"bounces": bounces}),
            **({} if operator.specular_albedo is None else {"specular_albedo": True}),
            **({"objects": objects} if (objects := capture.manifest["gather"].get("objects")) else {}),
        }
        tables = {"pool": operator.pool_image()}
        for name, links in (("view", view), ("exchange", operator.exchange)):
            tables[f"{name}_links"], tables[f"{name}_rows"] = packed(links)
        if operator.gloss is not None:
            gloss = operator.gloss
            tables["gloss_links"], tables["gloss_rows"] = packed(gloss.links)
            tables["gloss_neighbors"] = neighbors(gloss.nearest, gloss.weights).reshape(-1, capture.width, 3)
            manifest |= {name: {"file": file} for name, file in GLOSSY_FILES.items()}
            manifest["gather"] |= {"lobes": gloss.links.rows, "gloss_rays": gloss.links.rays}
        if near:
            tables |= near
            manifest |= {name: {"file": f"{name}.exr"} for name in near}
            manifest["gather"] |= {"near_levels": len(near["near_labels"]), "near_cells": near["near_places"].shape[1] - 1}
        if operator.behind is not None:
            tables[BEHIND] = neighbors(*operator.behind).reshape(-1, capture.width, 3)
            manifest |= {BEHIND: {"file": f"{BEHIND}.png"}}
        return Asset(manifest, stored, scale, bias, tables, images, scene)

    def _within(self, operator: GatherOperator, nearest: int, pixels: int, near: Mapping[str, ndarray]) -> SparseLinks:
        """The view's links within the budget, which `near` takes a part of."""
        if self.budget is None:
            return operator.view
        fixed = (
            sum(table.nbytes for table in near.values())
            + 48 * len(operator.cells.places)
            + NEIGHBOR_BYTES * nearest * pixels
            + LINK_BYTES * link_count(operator.exchange)
        )
        share = share_within(operator.view, (self.budget * MEGABYTE - fixed) / LINK_BYTES)
        if share < LEAST_SHARE:
            least = int(np.ceil((fixed + LINK_BYTES * link_count(operator.view, LEAST_SHARE)) / MEGABYTE))
            raise InputError(f"expected a `budget` of {least} megabytes or more for this view, found {self.budget}")
        return operator.view.thinned(share, self.seed)

    def __str__(self) -> str:
        return f"a deep framebuffer, {self.nearest} view clusters a pixel"

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[DeepFramebuffer]:
        """Bytes per texel say little of it."""
        yield cls()

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        told = reader.manifest["gather"]
        tables = {"pool": reader.table("pool", (4 if told.get("specular_albedo") else 3, told["surfels"]), 4)}
        for name in ("view", "exchange", *(("gloss",) if "lobes" in told else ())):
            for part in ("links", "rows"):
                pixels = reader.pixels(reader.manifest[f"{name}_{part}"]["file"], 3)
                if pixels.shape[1] != COLUMNS:
                    raise ImageError(f"expected {COLUMNS} columns of {name}_{part} in {reader.folder}, found {pixels.shape[1]}; fit again")
                tables[f"{name}_{part}"] = np.round(pixels * 255).astype(np.uint8)
        if POINTS in reader.manifest:
            if not {"near_labels", "near_places"} <= reader.manifest.keys():
                raise ManifestError(
                    f"expected near_labels beside {POINTS} in {reader.folder}, found an asset of an older version; fit again"
                )
            tables[POINTS] = reader.table(POINTS, (2, told["clusters"]), 3)
            tables["near_labels"] = reader.table("near_labels", (told["near_levels"], told["surfels"]), 1)
            tables["near_places"] = reader.table("near_places", (1, told["near_cells"] + 1), 3)
        return {**tables, **read_further_neighbors(reader)}

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        return cls.weighted(asset, cls.projected_weights(asset, lights)[None])[0]

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        lights = (PointLight((float(x), float(y), float(z)), falloff="inverse-square") for x, y, z in coordinates)
        return np.stack([cls.linear_response(asset, [light]) for light in lights])

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "C 3"]:
        """The irradiance of every view cluster, all bounces included, under all lights together; after these, pi times the radiance that
        every specular lobe gathers, over its reflectance."""
        refuse_named(lights, cls.name)
        if not lights:
            return np.zeros((asset.manifest["gather"]["clusters"] + asset.manifest["gather"].get("lobes", 0), 3))
        return _ready(asset).under(lights, asset.manifest["gather"].get("bounces"))

    @classmethod
    def weighted(cls, asset: Asset, weights: Float64[ndarray, "b C 3"]) -> Float32[ndarray, "b H W 3"]:
        """b pictures from the irradiance of the view clusters."""
        return pictures(asset, weights)

    @classmethod
    def local_lights(cls, lights: Sequence[Light]) -> list[PointLight]:
        return []

    @classmethod
    def gl_passes(cls) -> type[Passes]:
        from srbf.visibility.pool_passes import PoolPasses

        return PoolPasses

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return len(asset.stored)

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.manifest['gather']['clusters']} clusters"

    @classmethod
    def summary(cls, asset: Asset) -> str:
        told = asset.manifest["gather"]
        return f"{told['surfels']} surfels, {told['clusters']} view clusters of {told['view_rays']} rays, {size(asset) / MEGABYTE:.1f} MB"

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        return {**asset.manifest["gather"], "nearest": len(asset.stored), "gather_bytes": size(asset)}


@dataclass(frozen=True, eq=False)
class _Ready:
    """What relighting needs of an asset's tables."""

    tables: dict[str, ndarray]
    scene: bytes
    view: csr_array
    exchange: csr_array
    gloss: csr_array | None
    cells: Cells
    received: LinkedLight
    near: tuple[NearPool, NearReceivers] | None  # clusters, and after them surfels, receive
    specular_albedo: Float32[ndarray, "S 3"] | None

    def under(self, lights: Sequence[Light], bounces: int | None) -> Float64[ndarray, "C 3"]:
        """What view clusters and lobes gather under lights, whose brightest surfels light the clusters and other surfels in closed form."""
        albedo, clusters = self.cells.albedo, self.view.shape[0]
        direct, taken = np.zeros((2, *albedo.shape), np.float32)  # irradiance of all lights, and its part on bright surfels
        sent = np.zeros((clusters + len(albedo), 3), np.float32)  # what that part lays on clusters and surfels
        for light in lights:
            color = np.array(light.color, np.float32)
            irradiance = self.received.irradiance(replace(light, color=WHITE)).astype(np.float32)
            direct += color * irradiance
            if self.near is not None and bounces != 0:
                pool, receivers = self.near
                bright = pool.sources(albedo * irradiance, light)
                if bright.count:
                    sent += color * receivers.irradiance(bright)
                    taken += color * bright.taken(irradiance)
        radiosity = radiosity_of(self.exchange, albedo, direct - taken, bounces)
        if taken.any():
            radiosity += radiosity_of(self.exchange, albedo, sent[clusters:], None if bounces is None else bounces - 1)
        found = (self.view @ radiosity + sent[:clusters]).astype(np.float64)
        if self.gloss is None:
            return found
        seen = radiosity + albedo * taken
        if self.specular_albedo is not None and bounces != 0:
            seen = seen + self.specular_albedo * (direct + self.exchange @ radiosity + sent[clusters:])
        return np.concatenate([found, self.gloss @ seen])


_kept: OrderedDict[tuple[int, int], _Ready] = OrderedDict()


def _ready(asset: Asset) -> _Ready:
    """Made once for an asset, and for those of some of its pixels."""
    scene = asset.required_scene()
    key = (id(asset.tables["view_links"]), id(scene))
    found = _kept.get(key)
    if found is None or found.tables["view_links"] is not asset.tables["view_links"] or found.scene is not scene:
        told, tables = asset.manifest["gather"], asset.tables
        cells = replace(Cells.of_image(tables["pool"][:2]), albedo=np.ascontiguousarray(tables["pool"][2, :, :3]))
        try:
            view, exchange, *gloss = (
                unpacked(tables[f"{name}_links"], tables[f"{name}_rows"], rows, told[f"{name}_rays"], told["surfels"]).matrix()
                for name, rows in (("view", told["clusters"]), ("exchange", told["surfels"]), ("gloss", told.get("lobes", 0)))
                if rows
            )
        except ValueError as error:
            raise ImageError(f"{error}; fit again") from error
        occluders = occluders_of(scene)
        near = None
        if POINTS in tables:
            surfels = np.stack([cells.places, cells.normals]).astype(np.float32)
            places, normals = np.concatenate([tables[POINTS][:2], surfels], axis=1)
            near_cells = NearCells.of_asset(asset)
            near = NearPool(cells, near_cells), NearReceivers(places, normals, near_cells, occluders)
        lobes = gloss[0] if gloss else None
        specular = np.ascontiguousarray(tables["pool"][3, :, :3]) if len(tables["pool"]) > 3 else None
        names = told.get("objects", ())
        received = LinkedLight(cells, scene, names, surfel_objects(tables["pool"], names))
        found = _Ready(tables, scene, view, exchange, lobes, cells, received, near, specular)
        _kept[key] = found
        while len(_kept) > KEPT:
            _kept.popitem(last=False)
    return found


METHOD = DeepFramebuffer
