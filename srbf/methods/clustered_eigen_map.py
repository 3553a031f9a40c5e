"""The clustered eigen map: an eigen map whose light functions are each cluster of texels' own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.asset import Asset, AssetReader
from srbf.capture import Capture
from srbf.encode.light_function_fit import functions_through
from srbf.encode.model_selection import TexelSample
from srbf.encode.uv_seams import Stitch
from srbf.encode.weighted_rows import LightSpace
from srbf.errors import InputError, ManifestError
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_capture
from srbf.methods.carried import covered_texels
from srbf.methods.coefficient_maps import CoefficientMaps, StitchedComponents, check_settings, coefficient_maps_asset
from srbf.methods.protocol import QUIET, FitRun, setting
from srbf.solve.clustered_pca import Clusters, cluster
from srbf.solve.grouped_product import GroupedProduct
from srbf.solve.pca import principal_axes
from srbf.solve.streamed_product import StreamedProduct, in_tasks
from srbf.sphere import Domain

MOST_CLUSTERS = 256  # a texel's index is a byte
SAMPLE_TEXELS = 1 << 14  # at least; and so many a cluster:
TEXELS_PER_CLUSTER = 96
FEATURES = 48  # numbers per texel by which it finds its cluster

TRIED_CLUSTERS = (16, 64, 256)
MOST_TRIED = 64  # components of a candidate
LEAST_TEXELS = 64  # per cluster of a candidate: with fewer, functions and not components would hold the picture

_GLSL = """
/* All directional and environment lights of this asset: a row of weights a cluster, bilinear between texels. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, highp sampler2D clusters, vec2 uv, highp sampler2D weights) {
    return srbfClusteredDirectionalFiltered(layers, clusters, uv, 0, weights, srbfScale, srbfBias);
}

/* One point or spot light of this asset, bilinear between texels; table is w_table.exr. */
vec3 srbfAssetPoint(highp sampler2DArray layers, highp sampler2D clusters, vec2 uv, highp sampler2D table, vec3 receiver,
        SrbfPointLight pointLight) {
    return srbfClusteredPointFiltered(layers, clusters, uv, 0, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLight);
}

/* All lights of this asset at once, bilinear between texels: weights as above or 0, point lights in fours
   as srbfUnpackPointLight takes them. */
vec3 srbfAssetLights(highp sampler2DArray layers, highp sampler2D clusters, vec2 uv, highp sampler2D weights, highp sampler2D table,
                     vec3 receiver, vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    return srbfClusteredLightsFiltered(layers, clusters, uv, 0, weights, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLights,
                                       pointLightCount);
}
"""


@dataclass(frozen=True)
class ClusteredEigenMap(CoefficientMaps):
    """Light transport is low-dimensional locally: texels in clusters, each with a mean and principal components of its own.

    T(p, L, c) ~ w_{m,0}(L, c) + sum_j a_j(p) w_{m,j}(L, c), m the cluster of p, j = 1 … `components`     [Sloan2003; Kristensen2005]

    Clusters grow axis by axis on a texel sample with texels re-assigned in between; then every texel joins the cluster that holds
    it best. A cluster's scalars span its own range, so that bytes serve them as well as half floats. Light functions are smooth as those
    of the eigen map. Planes must not be filtered across clusters: reconstruct, then filter.
    """

    name: ClassVar[str] = "clustered-eigen-map"
    order: ClassVar[int] = 3
    tables: ClassVar[dict[str, str]] = {**CoefficientMaps.tables, "cluster_index": "cluster_index.png"}
    implied_by: ClassVar[tuple[str, ...]] = ("clusters",)
    filterable: ClassVar[bool] = False
    functions_text: ClassVar[str] = _GLSL

    clusters: int = setting(64, "How many clusters, at most 256.")
    components: int = setting(8, "How many numbers per texel.")
    domain: Literal["auto"] | Domain = setting("auto", "Where light can come from; auto: where the lights are.")
    spread: Literal["auto"] | float = setting("auto", "Width of the light functions' kernel, rad.", words=("auto",))
    ridge: Literal["auto"] | float = setting("auto", "Added to the diagonal of the kernel matrix.", words=("auto",))
    encoding: Encoding = setting("half", "Of the layers on disk.")
    seed: int = 0

    def __post_init__(self) -> None:
        check_settings(self.components, self.spread, self.ridge, self.encoding)
        if not 1 <= self.clusters <= MOST_CLUSTERS:
            raise InputError(f"expected 1 to {MOST_CLUSTERS} clusters, found {self.clusters}")

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Clusters from a texel sample; a pass over the images to assign every texel, another to project it.

        Peak memory, whatever the number of lights: about 4 (FEATURES + 2 `components`) + 40 bytes per texel, two blocks of
        `capture.STREAM_BYTES`, twice the sample (12 bytes per light and sampled texel), what `run.on_image` keeps, and some 0.2 GB of
        libraries. Components of two clusters cannot be compared, so `run.stitch` closes the seams of the images, and what its texels show
        is read once more: both sides then agree as well as their clusters hold them.
        InputError where there are no train lights, or more components than captured numbers per texel.
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if self.components > 3 * len(train):
            raise InputError(f"expected at most {3 * len(train)} components for {len(train)} lights, found {self.components}")
        # From every row: clusters are of places, and those of a few strips of rows serve the rows between badly.
        sample = TexelSample.of(capture, max(SAMPLE_TEXELS, TEXELS_PER_CLUSTER * self.clusters), share=1.0)
        domain = domain_of_capture(capture, self.domain)
        space = LightSpace.of(sample, "plain")
        features, _ = principal_axes(space.centered, FEATURES)
        found = cluster(space.centered, np.ascontiguousarray(features.T), self.clusters, self.components, self.seed)
        seen = StreamedProduct(space.weights(features))
        for first, block in capture.stream(train, run.on_image):
            seen.add(first, block)
            run.progress(first + len(block), 2 * len(train))
        stitch = run.stitch
        columns = seen.result if stitch is None else _with_stitched(seen.result, stitch)
        index = _assigned(columns, space, features, found)
        del seen, columns
        axes = found.axes.transpose(0, 2, 1)  # (C, S, M)
        weights = np.stack([space.weights(a) for a in axes]).astype(np.float32)
        texels = capture.width * capture.height
        product = GroupedProduct(weights, index[:texels])
        for first, block in capture.stream(train):
            product.add(first, block)
            run.progress(len(train) + first + len(block), 2 * len(train))
        projected, covered = product.result, covered_texels(capture)
        del product
        stitched = None
        if stitch is not None:
            again = GroupedProduct(weights, index[texels:])
            for first, block in stitch.blocks(capture, train):
                again.add(first, block)
            # The stitched texels come first; what they would be without stands behind, where it sets no range.
            unstitched, unstitched_index = projected[:, stitch.sources], index[stitch.sources]
            projected[:, stitch.texels], index[stitch.texels] = again.result, index[texels:]
            projected = np.concatenate([projected, unstitched], axis=1)
            index = np.concatenate([index[:texels], unstitched_index])
            covered = np.concatenate([covered, np.zeros(len(unstitched_index), bool)])
        components, values = _in_own_range(projected, index, covered, space, found)
        if stitch is not None:
            stitched = StitchedComponents(components[:, texels:], index[texels:])
            components, index = components[:, :texels], index[:texels]
        functions, fit = functions_through(sample, values, domain, self.spread, self.ridge)
        return coefficient_maps_asset(self, capture, domain, components, functions, fit, index, stitch, stitched)

    def __str__(self) -> str:
        return f"{self.clusters} clusters of {self.components} components{' as bytes' if self.encoding == 'uint8' else ''}"

    def on_sample(self, ratio: float) -> ClusteredEigenMap:
        """As many texels per cluster as there will be."""
        return replace(self, clusters=max(2, int(np.ceil(self.clusters / ratio))))

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[ClusteredEigenMap]:
        """Bytes, four to a layer, and one for the cluster."""
        components = min((size - 1) // 4 * 4, MOST_TRIED, numbers)
        if components >= 1:
            for clusters in TRIED_CLUSTERS:
                if clusters * LEAST_TEXELS <= texels and clusters <= MOST_CLUSTERS:
                    yield cls(clusters=clusters, components=components, encoding="uint8")

    @classmethod
    def compared(cls) -> tuple[ClusteredEigenMap, ...]:
        return tuple(cls(clusters=64, components=s, encoding="uint8") for s in (4, 8, 16))

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        tables, manifest = super().read_tables(reader), reader.manifest
        clusters = manifest.get("clusters", 1)
        index = np.round(reader.table("cluster_index", (manifest["height"], manifest["width"]), 1)[:, :, 0] * 255).astype(np.uint8)
        if index.max() >= clusters:
            raise ManifestError(f"expected cluster indices below {clusters} in {reader.path}, found {index.max()}")
        return {**tables, "cluster_index": index}

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.components} components, {asset.clusters} clusters"

    @classmethod
    def summary(cls, asset: Asset) -> str:
        return f"{asset.clusters} clusters of {asset.components} components"


def _with_stitched(seen: Float32[ndarray, "D P"], stitch: Stitch) -> Float32[ndarray, "D Q"]:
    """Features of all texels, and behind them those of the stitch's texels once their (dilated) images are: features are sums."""
    values = seen[:, stitch.sources].T
    return np.concatenate([seen, (values + stitch.change(values)).T.astype(np.float32)], axis=1)


def _assigned(seen: Float32[ndarray, "D P"], space: LightSpace, features: Float32[ndarray, "D M"], found: Clusters) -> Int[ndarray, " P"]:
    """The cluster of every texel, by its features."""
    clusters = found.through(np.ascontiguousarray(features.T))
    offsets = space.offsets(features)
    index = np.empty(seen.shape[1], np.int64)

    def work(task: slice) -> None:
        index[task] = clusters.assign(np.ascontiguousarray((seen[:, task] - offsets[:, None]).T) * np.float32(space.scale))[0]

    in_tasks(work, seen.shape[1])
    return index


def _in_own_range(
    projected: Float32[ndarray, "S P"], index: Int[ndarray, " P"], covered: Bool[ndarray, " P"], space: LightSpace, found: Clusters
) -> tuple[Float32[ndarray, "S P"], Float64[ndarray, "L F 3"]]:
    """(planes, values of the functions at the train lights) with every scalar of a cluster spanning -1 to 1 over its covered texels."""
    count, components = len(found.means), len(projected)
    planes = np.zeros_like(projected)
    values = np.zeros((space.sample.train, count, components + 1, 3))
    for number in range(count):
        axes = np.ascontiguousarray(found.axes[number].T)  # (S, M)
        functions = space.functions(axes, found.means[number])  # (L, S + 1, 3)
        offsets = space.offsets(axes, found.means[number])
        members = index == number
        own = projected[:, members] - offsets[:, None]
        real = own[:, covered[members]]
        low, high = (real.min(axis=1), real.max(axis=1)) if real.shape[1] else (np.zeros(components), np.zeros(components))
        middle, half = (low + high) / 2, (high - low) / 2
        half = np.where(half > 0, half, 1)
        planes[:, members] = np.clip((own - middle[:, None]) / half[:, None], -1, 1)
        values[:, number, 0] = functions[:, 0] + np.tensordot(functions[:, 1:], middle.astype(np.float64), ([1], [0]))
        values[:, number, 1:] = functions[:, 1:] * half[:, None]
    return planes, values.reshape(len(values), -1, 3)


METHOD = ClusteredEigenMap
