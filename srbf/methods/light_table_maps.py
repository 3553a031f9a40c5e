"""Component maps whose functions are a table: a value per function and captured light (or patch), weighed once per frame.

What light mixing and the light cloud share. A frame's lights become one weight per function and color on the CPU, by one small matrix
product; the cost per texel is then the same under any number of lights, and the shader is that of distant lights.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float16, Float32, Float64, Int
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import COVERED, Capture
from srbf.compute.full_precision import by_channel, times_columns
from srbf.encode.clustered_components import Zones, clustered_components
from srbf.encode.component_filter import without_noise
from srbf.encode.dilation import nearest_covered
from srbf.encode.light_values import light_values
from srbf.encode.mixed_rows import MixedSpace
from srbf.encode.model_selection import sampled_texels
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.io.packed_table import Packed, fits
from srbf.light_domain import domain_of_capture
from srbf.lights import Light, PointLight
from srbf.methods.carried import carried_images, carried_scene, common_manifest
from srbf.methods.component_maps import ComponentMaps, check_layers, components_of, read_cluster_index, stored_components
from srbf.methods.protocol import FitRun
from srbf.methods.seam_report import seam_report
from srbf.solve.row_sample import bright_rows
from srbf.solve.zones import split_zones

VALUES_FILE = "light_values.exr"
MOST_COMPONENTS = 1024
MOST_CLUSTERS = 256  # the index per texel is one byte
SAMPLE_TEXELS = 1 << 14  # at least; and so many a cluster:
TEXELS_PER_CLUSTER = 96
HALF_TOP = 4096.0  # the largest stored value: a millionth of it is still a normal half


class LightTableMaps(ComponentMaps):
    """A method whose light functions are columns of `light_values`, (F, N, 3): of named lights, of patches, or of captured point lights.

    (F, N, 1) where the columns have no color.
    """

    tables: ClassVar[dict[str, str]] = {"light_values": VALUES_FILE, "cluster_index": "cluster_index.png"}
    filterable: ClassVar[bool] = False

    clusters: int
    mean_components: Literal["auto"] | float = "auto"
    smooth: bool = True  # take the noise of few samples out of the components

    def __str__(self) -> str:
        return f"{self.clusters} clusters of {self.components} components{' as bytes' if self.encoding == 'uint8' else ''}"

    def on_sample(self, ratio: float) -> LightTableMaps:
        """As many texels per cluster as there will be."""
        settings: Any = self  # of the dataclass that it is
        return self if self.clusters == 1 else replace(settings, clusters=max(2, int(np.ceil(self.clusters / ratio))))

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        shape = (check_layers(reader), int(reader.manifest["light_values"]["lights"]))
        channels = int(reader.manifest["light_values"].get("channels", 3))
        tables = {"light_values": reader.half_table("light_values", shape, channels)}
        return {**tables, "cluster_index": read_cluster_index(reader)} if "cluster_index" in reader.manifest else tables

    @classmethod
    @abstractmethod
    def column_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "N 3"]:
        """How much of each column of the table all lights together take, by color."""

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        if not lights:
            return np.zeros((len(asset.tables["light_values"]), 3))
        values = by_channel(asset.tables["light_values"])
        columns = cls.column_weights(asset, lights) * asset.manifest["light_values"]["scale"]
        if len(values) == 1:
            return times_columns(values[0], columns.astype(np.float32)).astype(np.float64)
        return np.stack([values[c] @ columns[:, c].astype(np.float32) for c in range(3)], axis=1).astype(np.float64)

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        return cls.weighted(asset, cls.projected_weights(asset, lights)[None])[0]

    @classmethod
    def local_lights(cls, lights: Sequence[Light]) -> list[PointLight]:
        return []

    @classmethod
    def shader_stem(cls, asset: Asset) -> str:
        return "clustered_eigen_map" if "cluster_index" in asset.tables else "eigen_map"

    @classmethod
    def columns(cls, asset: Asset, chosen: Sequence[int]) -> Float32[ndarray, "b H W 3"]:
        """Responses to single columns of the table."""
        values = asset.tables["light_values"][:, list(chosen)].astype(np.float64) * asset.manifest["light_values"]["scale"]
        return cls.weighted(asset, np.broadcast_to(values.transpose(1, 0, 2), (len(chosen), len(values), 3)))

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        return {**super().describe(asset), "lights": asset.tables["light_values"].shape[1]}


def encode_table(
    method: LightTableMaps,
    capture: Capture,
    run: FitRun,
    mixtures: Float64[ndarray, "V L"],
    clusters: int,
    seed: int,
    zones: int = 1,
    respond: Callable[[Asset, Capture, Sequence[int]], ndarray] | None = None,
    energy: Float32[ndarray, " P"] | None = None,
) -> Asset:
    """Clusters and components by the responses to V mixtures of the captured lights, then the table of all of them, in three passes.

    `respond`: what an asset of this table shows under lights of the capture, by default the method's `captured_responses`. With `zones`,
    every cluster is of one part of the scene, by the receivers' positions; `cluster_zone` of the manifest says which. `energy` of each
    texel: clusters are made for bright ones more than for dim ones; None: for all evenly.
    The manifest has no keys of the table's own meaning yet. InputError without train lights, or with more components than numbers per
    texel. Peak memory: that of a clustered eigen map, and 12 (V + L) bytes per sampled texel.
    """
    train = capture.indices("train")
    if not train:
        raise InputError(f"expected train lights in {capture.folder}, found none")
    components = min(method.components, 3 * len(train))
    clusters = max(1, min(clusters, int((capture.coverage() >= COVERED).sum()) // (components + 1)))
    texels = _sampled(capture, max(SAMPLE_TEXELS, TEXELS_PER_CLUSTER * clusters), energy, seed)
    space = MixedSpace.of(capture.sample(train, texels), mixtures)
    steps = 3 * len(train)
    parts = zones_of(capture, texels, zones)
    found = clustered_components(
        capture,
        space,
        clusters,
        components,
        seed,
        run.stitch,
        run.on_image,
        lambda images: run.progress(images, steps),
        parts,
        refinement(capture) if method.smooth else lambda projected, index: projected,
        None if method.mean_components == "auto" else float(method.mean_components),
    )
    clusters = clusters if found.cluster_zone is None else len(found.cluster_zone)
    own = stored_components(capture, method.encoding, found.components, found, run.stitch)
    assert own.index is not None
    if clusters == 1:
        own = replace(own, index=None, unstitched_index=None)
    images = carried_images(capture, nearest_covered(capture.coverage()))
    domain = domain_of_capture(capture)
    settings: Any = method  # of the dataclass that it is
    manifest = common_manifest(capture, method.name, domain, images, asdict(settings), {})
    manifest |= own.entries(clusters)
    manifest["cluster_zone"] = [0] * clusters if found.cluster_zone is None else found.cluster_zone.tolist()
    asset = Asset(manifest, own.stored, own.scale, own.bias, own.tables(), images, carried_scene(capture))
    planes = components_of(asset.coefficients(), components).reshape(components, -1)
    index = found.index if own.index is None else own.index.reshape(-1).astype(np.int64)
    values = light_values(capture, planes, index, clusters, lambda images: run.progress(2 * len(train) + images, steps))
    asset.tables["light_values"], entry = stored_values(values)
    manifest |= entry
    if run.stitch is not None and own.unstitched is not None:
        manifest["seams"] = seam_report(
            asset, capture, run.stitch, own.unstitched, respond or method.captured_responses, own.unstitched_index
        )
    return asset


def _sampled(capture: Capture, count: int, energy: Float32[ndarray, " P"] | None, seed: int) -> Int[ndarray, " n"]:
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    if energy is None or len(covered) <= count:
        return sampled_texels(capture, count)
    return covered[bright_rows(energy[covered], count, np.random.default_rng(seed))[0]]


def refinement(capture: Capture) -> Callable[[ndarray, ndarray], ndarray]:
    """What takes the noise of a capture out of components, see `component_filter`; nothing does without positions and normals."""
    positions, normals = capture.geometry("position"), capture.geometry("normal")
    covered = capture.coverage().ravel() >= COVERED

    def refine(components: ndarray, index: ndarray) -> ndarray:
        if positions is None or normals is None:
            return components
        return without_noise(components, index, covered, positions.reshape(-1, 3), normals.reshape(-1, 3))

    return refine


def zones_of(capture: Capture, texels: Int[ndarray, " n"], count: int) -> Zones | None:
    """The zone of every texel, by its position; None for one zone. InputError on a capture without positions."""
    if count == 1:
        return None
    positions = capture.geometry("position")
    if positions is None:
        raise InputError(f"expected positions of the receivers in {capture.folder} for `zones`, found none; leave `zones` out")
    covered = capture.coverage().ravel() >= COVERED
    every = np.zeros(covered.shape, np.int64)
    every[covered] = split_zones(positions.reshape(-1, 3)[covered], count)[0]
    return Zones(every, every[texels])


def check_table_settings(components: int, clusters: int, encoding: str) -> None:
    """InputError on settings that no such maps can have."""
    if not 1 <= components <= MOST_COMPONENTS:
        raise InputError(f"expected 1 to {MOST_COMPONENTS} `components`, found {components}")
    if not 1 <= clusters <= MOST_CLUSTERS:
        raise InputError(f"expected 1 to {MOST_CLUSTERS} clusters, found {clusters}")
    if encoding not in get_args(Encoding):
        raise InputError(f"expected an encoding of half, float, uint8, found {encoding!r}")


def pack_table(asset: Asset, name: str, by: Packed) -> None:
    """Let a table of half floats be saved as bytes, where its rows or columns are multiples of a step: see `srbf.io.packed_table`."""
    if fits(asset.tables[name], by):
        asset.manifest[name] = {**asset.manifest[name], "file": f"{name}.png", "packed": by}


def stored_values(values: Float32[ndarray, "F N c"]) -> tuple[Float16[ndarray, "F N c"], dict[str, Any]]:
    """(the table as halves, the manifest's key `light_values`)."""
    table, scale = scaled_halves(values)
    return table, {"light_values": {"file": VALUES_FILE, "lights": values.shape[1], "scale": scale}}


def scaled_halves(values: Float32[ndarray, "F N c"]) -> tuple[Float16[ndarray, "F N c"], float]:
    """(a table as halves, scale): value = stored times the scale, a power of two that keeps halves precise."""
    largest = float(np.abs(values).max()) if values.size else 0.0
    scale = float(2.0 ** np.ceil(np.log2(largest / HALF_TOP))) if largest > 0 else 1.0
    return (values / np.float32(scale)).astype(np.float16), scale
