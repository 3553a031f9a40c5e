"""The clustered eigen map: an eigen map whose light functions are each cluster of texels' own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy import ndarray

from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.encode.clustered_components import clustered_components
from srbf.encode.cubemap_functions import functions_between
from srbf.encode.light_function_fit import functions_through
from srbf.encode.model_selection import TexelSample
from srbf.encode.weighted_rows import LightSpace
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_capture
from srbf.methods.coefficient_maps import CoefficientMaps, check_settings, coefficient_maps_asset
from srbf.methods.component_maps import read_cluster_index
from srbf.methods.protocol import QUIET, FitRun, setting
from srbf.sphere import Domain

MOST_CLUSTERS = 256  # a texel's index is a byte
SAMPLE_TEXELS = 1 << 14  # at least; and so many a cluster:
TEXELS_PER_CLUSTER = 96
MOST_PER_CLUSTER = 192  # as far as SAMPLE_BYTES allow
SAMPLE_BYTES = 1 << 28

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
    it best. A cluster's components span its own range, so that bytes serve them as well as half floats. Light functions are smooth as those
    of the eigen map. Coefficient maps must not be filtered across clusters: reconstruct, then filter.

    Parameters
    ----------
    clusters
        1 to 256: a texel's index is a byte.
    components
        How many numbers per texel, at most three per train light.
    domain
        `sphere` or `hemisphere`; `auto`: where the lights are.
    spread
        Width of the light functions' kernel, rad, above 0; `auto` as of the eigen map.
    ridge
        Added to the diagonal of the kernel matrix, above 0; `auto` as of the eigen map.
    encoding
        Of the layers on disk: `half`, `float` or `uint8`.
    seed
        Of the clustering's random numbers.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> clustered = fit(capture, ClusteredEigenMap(clusters=2, components=4, encoding="uint8"))
    >>> clustered.clusters, clustered.bytes_per_texel()["directional"]  # with the cluster's index
    (2, 5)
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

        Peak memory, whatever the number of lights: about 4 (48 + 2 `components`) + 40 bytes per texel, two blocks of
        `capture.STREAM_BYTES`, twice the sample (12 bytes per light and sampled texel), what `run.on_image` keeps, and some 0.2 GB of
        libraries.

        Parameters
        ----------
        capture
            With train lights.
        run
            `stitch` closes the seams of the images, since components of two clusters cannot be compared, and what its texels show is read
            once more: both sides then agree as well as their clusters hold them.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where there are no train lights, or more components than captured numbers per texel.

        Examples
        --------
        >>> ClusteredEigenMap(clusters=2, components=4).encode(capture).tables["cluster_index"].shape
        (6, 8)
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if self.components > 3 * len(train):
            raise InputError(f"expected at most {3 * len(train)} components for {len(train)} lights, found {self.components}")
        # From every row: clusters are of places, and those of a few strips of rows serve the rows between badly.
        sample = TexelSample.of(capture, self._sampled(capture, len(train)), share=1.0)
        domain = domain_of_capture(capture, self.domain)
        found = clustered_components(
            capture,
            LightSpace.of(sample, "plain"),
            self.clusters,
            self.components,
            self.seed,
            run.stitch,
            run.on_image,
            lambda images: run.progress(images, 2 * len(train)),
        )
        if capture.is_cubemap and self.spread == self.ridge == "auto":
            functions, fit = functions_between(sample.coordinates[: sample.train], found.functions)
        else:
            functions, fit = functions_through(sample, found.functions, domain, self.spread, self.ridge)
        return coefficient_maps_asset(self, capture, domain, found.components, functions, fit, found, run.stitch)

    def _sampled(self, capture: Capture, lights: int) -> int:
        """How many texels clusters are made of."""
        least = 0 if capture.is_cubemap else SAMPLE_TEXELS  # whose rows are of thousands of lights
        affordable = SAMPLE_BYTES // (12 * lights * self.clusters)
        return max(least, self.clusters * min(max(TEXELS_PER_CLUSTER, affordable), MOST_PER_CLUSTER))

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
        return {**super().read_tables(reader), "cluster_index": read_cluster_index(reader)}

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.components} components, {asset.clusters} clusters"

    @classmethod
    def summary(cls, asset: Asset) -> str:
        return f"{asset.clusters} clusters of {asset.components} components"


METHOD = ClusteredEigenMap
