"""The deep framebuffer in the form of its paper: gather samples of each view cluster, which every light lights, and one bounce."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.channels import GLOSS, THROUGH
from srbf.encode.dilation import nearest_covered
from srbf.errors import InputError
from srbf.light_domain import domain_of_capture
from srbf.lights import Light, PointLight, refuse_named
from srbf.methods.carried import carried_images, common_manifest, required_scene
from srbf.methods.mixed_clusters import (
    GLOSS_NEIGHBORS,
    MOST_NEAREST,
    check_nearest,
    neighbor_layers,
    neighbors,
    pictures,
    read_further_neighbors,
    size,
)
from srbf.methods.protocol import QUIET, FitRun, Method, setting
from srbf.stored_layers import layer_entries
from srbf.visibility.gathered_samples import RAYS, GatheredSamples, light_on_clusters
from srbf.visibility.received import occluders_of

MEGABYTE = 1e6
FILES = {
    "sample_places_low": "sample_places_low.png",
    "sample_places_high": "sample_places_high.png",
    "sample_normals": "sample_normals.exr",
    "sample_reflectance": "sample_reflectance.exr",
}


@dataclass(frozen=True)
class GatherSamples(Method):
    """A view under any lights: I(p) = sum_k c_k(p) sum_j w_kj rho_kj D(g_kj)     [Hasan2005, eq. 3]

    g_kj are the gather samples of view cluster k, D the direct irradiance that the lights lay on them, each with a shadow ray; a pixel
    mixes the clusters nearest to it in place and normal. Glossy pixels add what clusters of their lobes gather. This is the paper's own
    form, to be compared with: `deep-framebuffer` has all bounces, a shader and mostly less error.

    Parameters
    ----------
    nearest
        Clusters that a pixel mixes, 1 to 10.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> GatherSamples().nearest
    10
    """

    name: ClassVar[str] = "gather-samples"
    order: ClassVar[int] = 9
    layers: ClassVar[str] = "neighbors"
    tables: ClassVar[dict[str, str]] = FILES
    domains: ClassVar[tuple[str, ...]] = ("pool",)
    receivers: ClassVar[tuple[str, ...]] = ("view",)
    has_shader: ClassVar[bool] = False
    on_page: ClassVar[bool] = False
    exportable: ClassVar[bool] = False
    filterable: ClassVar[bool] = False

    nearest: int = setting(MOST_NEAREST, "View clusters that a pixel mixes.")

    def __post_init__(self) -> None:
        check_nearest(self.nearest)

    @classmethod
    def is_made_for(cls, capture: Capture) -> bool:
        return capture.kind in cls.domains and "samples" in capture.manifest["gather"]

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """The capture's samples, and the clusters of every pixel as bytes.

        Parameters
        ----------
        capture
            Of a gather with a number of samples.
        run
            Nothing of it is used: no image is read.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where the capture has links to a pool instead, or lacks its scene.
        ImageError
            Where its samples cannot be read.

        Examples
        --------
        >>> GatherSamples().encode(view).manifest["gather"]["samples"]  # doctest: +SKIP
        120
        """
        if "samples" not in capture.manifest.get("gather", {}):
            raise InputError(f"expected gather samples in {capture.folder}, found links to a pool; bake with `gather`, a number of samples")
        found = GatheredSamples.read(capture.folder)
        scene = required_scene(capture)
        most = min(self.nearest, found.nearest.shape[1])
        nearest = nearest_covered(capture.coverage())
        stored = neighbor_layers(capture, found.nearest[:, :most], found.weights[:, :most], nearest)
        scale, bias = np.ones((most, 3), np.float32), np.zeros((most, 3), np.float32)
        unused = (THROUGH, *(() if found.lobes else GLOSS))
        images = {name: image for name, image in carried_images(capture, nearest).items() if name not in unused}
        manifest = common_manifest(capture, self.name, domain_of_capture(capture), images, asdict(self), {})
        manifest |= {name: {"file": file} for name, file in FILES.items()}
        manifest[self.layers] = layer_entries("neighbor", "uint8", scale, bias)
        manifest["gather"] = {
            "samples": found.places.shape[1],
            "clusters": found.diffuse,
            "rays": RAYS,
            "box": found.box.tolist(),
            "bounces": capture.manifest["gather"]["bounces"],
        }
        tables = {
            "sample_places_low": (found.places & 255).astype(np.uint8),
            "sample_places_high": (found.places >> 8).astype(np.uint8),
            "sample_normals": found.normals,
            "sample_reflectance": found.reflectance,
        }
        if found.gloss_nearest is not None and found.gloss_weights is not None:
            tables[GLOSS_NEIGHBORS] = neighbors(found.gloss_nearest, found.gloss_weights).reshape(-1, capture.width, 3)
            manifest[GLOSS_NEIGHBORS] = {"file": f"{GLOSS_NEIGHBORS}.png"}
            manifest["gather"]["lobes"] = found.lobes
        return Asset(manifest, stored, scale, bias, tables, images, scene)

    def __str__(self) -> str:
        return f"gather samples, {self.nearest} view clusters a pixel"

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[GatherSamples]:
        """None: it is here to be compared with."""
        return ()

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        told = reader.manifest["gather"]
        shape = (told["clusters"] + told.get("lobes", 0), told["samples"])
        tables = {}
        for name in FILES:
            pixels = reader.table(name, shape, 3)
            tables[name] = pixels.astype(np.float16) if FILES[name].endswith(".exr") else np.round(pixels * 255).astype(np.uint8)
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
        """The irradiance of every view cluster, of one bounce of all lights together; after these, of every cluster of lobes, pi times the
        radiance that it gathers, over its reflectance."""
        refuse_named(lights, cls.name)
        told, tables = asset.manifest["gather"], asset.tables
        if not lights or told["bounces"] == 0:
            return np.zeros((told["clusters"] + told.get("lobes", 0), 3))
        places = tables["sample_places_low"] + (tables["sample_places_high"].astype(np.uint16) << 8)
        box = np.array(told["box"], np.float64)
        return light_on_clusters(
            places, box, tables["sample_normals"], tables["sample_reflectance"], occluders_of(asset.required_scene()), lights
        )

    @classmethod
    def weighted(cls, asset: Asset, weights: Float64[ndarray, "b C 3"]) -> Float32[ndarray, "b H W 3"]:
        """b pictures from the irradiance of the view clusters."""
        return pictures(asset, weights)

    @classmethod
    def local_lights(cls, lights: Sequence[Light]) -> list[PointLight]:
        return []

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return len(asset.stored)

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.manifest['gather']['samples']} gather samples"

    @classmethod
    def summary(cls, asset: Asset) -> str:
        told = asset.manifest["gather"]
        lobes = f" and {told['lobes']} of lobes" if "lobes" in told else ""
        return f"{told['clusters']} view clusters{lobes}, {told['samples']} gather samples each, {size(asset) / MEGABYTE:.1f} MB"

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        told = {name: value for name, value in asset.manifest["gather"].items() if name != "box"}
        return {**told, "nearest": len(asset.stored), "gather_bytes": size(asset)}


METHOD = GatherSamples
