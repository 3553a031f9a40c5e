"""The clustered eigen map: an eigen map whose light functions are each cluster of texels' own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import Capture, OnImage
from srbf.encode.light_function_fit import functions_through
from srbf.encode.model_selection import TexelSample
from srbf.encode.uv_seams import Stitch
from srbf.encode.weighted_rows import LightSpace
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.methods.coefficient_maps import (
    StitchedComponents,
    check_plane_settings,
    coefficient_maps_asset,
    directional_responses,
    linear_response,
    projected_weights,
    relight,
)
from srbf.methods.receivers import covered_texels
from srbf.solve.clustered_pca import Clusters, cluster
from srbf.solve.grouped_product import GroupedProduct
from srbf.solve.pca import principal_axes
from srbf.solve.streamed_product import StreamedProduct, in_tasks
from srbf.sphere import Domain, domain_of

__all__ = ["ClusteredEigenMap", "directional_responses", "projected_weights", "linear_response", "relight"]

MOST_CLUSTERS = 256  # a texel's index is a byte
SAMPLE_TEXELS = 1 << 14  # at least; and so many a cluster:
TEXELS_PER_CLUSTER = 96
FEATURES = 48  # numbers a texel by which it finds its cluster


@dataclass(frozen=True)
class ClusteredEigenMap:
    """Light transport is low-dimensional locally: texels in clusters, each with a mean and principal components of its own.

    T(p, L, c) ~ w_{m,0}(L, c) + sum_j a_j(p) w_{m,j}(L, c), m the cluster of p, j = 1 … `scalars`     [Sloan2003; Kristensen2005]

    Clusters grow axis by axis on a texel sample with texels re-assigned in between; then every texel joins the cluster that holds
    it best. A cluster's scalars span its own range, so that bytes serve them as well as half floats. Light functions are smooth as those
    of the eigen map. Planes must not be filtered across clusters: reconstruct, then filter.
    """

    clusters: int = 64
    scalars: int = 8
    domain: Literal["auto"] | Domain = "auto"
    spread: Literal["auto"] | float = "auto"
    ridge: Literal["auto"] | float = "auto"
    encoding: Encoding = "half"
    seed: int = 0

    def __post_init__(self) -> None:
        check_plane_settings(self.scalars, self.spread, self.ridge, self.encoding)
        if not 1 <= self.clusters <= MOST_CLUSTERS:
            raise InputError(f"expected 1 to {MOST_CLUSTERS} clusters, found {self.clusters}")

    def encode(
        self,
        capture: Capture,
        progress: Callable[[int, int], None] = lambda done, total: None,
        on_image: OnImage = lambda row, image: None,
        stitch: Stitch | None = None,
    ) -> Asset:
        """Clusters from a texel sample; a pass over the images to assign every texel, another to project it.

        Peak memory, whatever the number of lights: about 4 (FEATURES + 2 `scalars`) + 40 bytes a texel, two blocks of
        `capture.STREAM_BYTES`, twice the sample (12 bytes a light and sampled texel), what `on_image` keeps, and some 0.2 GB of libraries.
        Scalars of two clusters cannot be compared, so `stitch` closes the seams of the images, and what its texels show is read once
        more: both sides then agree as well as their clusters hold them.
        InputError where there are no train lights, or fewer than 3 times as many numbers a texel as scalars.
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if self.scalars > 3 * len(train):
            raise InputError(f"expected at most {3 * len(train)} scalars for {len(train)} lights, found {self.scalars}")
        # From every row: clusters are of places, and those of a few strips of rows serve the rows between badly.
        sample = TexelSample.of(capture, max(SAMPLE_TEXELS, TEXELS_PER_CLUSTER * self.clusters), share=1.0)
        directions = capture.directions(train)
        domain = domain_of(directions) if self.domain == "auto" else self.domain
        space = LightSpace.of(sample, "plain")
        features, _ = principal_axes(space.centered, FEATURES)
        found = cluster(space.centered, np.ascontiguousarray(features.T), self.clusters, self.scalars, self.seed)
        seen = StreamedProduct(space.weights(features))
        for first, block in capture.stream(train, on_image):
            seen.add(first, block)
            progress(first + len(block), 2 * len(train))
        columns = seen.result if stitch is None else _with_stitched(seen.result, stitch)
        index = _assigned(columns, space, features, found)
        del seen, columns
        axes = found.axes.transpose(0, 2, 1)  # (C, S, M)
        weights = np.stack([space.weights(a) for a in axes]).astype(np.float32)
        texels = capture.width * capture.height
        product = GroupedProduct(weights, index[:texels])
        for first, block in capture.stream(train):
            product.add(first, block)
            progress(len(train) + first + len(block), 2 * len(train))
        projected, covered = product.result, covered_texels(capture)
        del product
        stitched = None
        if stitch is not None:
            again = GroupedProduct(weights, index[texels:])
            for first, block in stitch.blocks(capture, train):
                again.add(first, block)
            # The stitched texels come first; what they would be without stands behind, where it sets no range.
            loose, loose_index = projected[:, stitch.sources], index[stitch.sources]
            projected[:, stitch.texels], index[stitch.texels] = again.result, index[texels:]
            projected = np.concatenate([projected, loose], axis=1)
            index = np.concatenate([index[:texels], loose_index])
            covered = np.concatenate([covered, np.zeros(len(loose_index), bool)])
        planes, values = _in_own_range(projected, index, covered, space, found)
        if stitch is not None:
            stitched = StitchedComponents(planes[:, texels:], index[texels:])
            planes, index = planes[:, :texels], index[:texels]
        functions, fit = functions_through(sample, values, domain, self.spread, self.ridge)
        return coefficient_maps_asset(
            capture, "clustered-eigen-map", domain, planes, functions, self.encoding, asdict(self), fit, index, stitch, stitched
        )


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
    count, scalars = len(found.means), len(projected)
    planes = np.zeros_like(projected)
    values = np.zeros((space.sample.train, count, scalars + 1, 3))
    for number in range(count):
        axes = np.ascontiguousarray(found.axes[number].T)  # (S, M)
        functions = space.functions(axes, found.means[number])  # (L, S + 1, 3)
        offsets = space.offsets(axes, found.means[number])
        members = index == number
        own = projected[:, members] - offsets[:, None]
        real = own[:, covered[members]]
        low, high = (real.min(axis=1), real.max(axis=1)) if real.shape[1] else (np.zeros(scalars), np.zeros(scalars))
        middle, half = (low + high) / 2, (high - low) / 2
        half = np.where(half > 0, half, 1)
        planes[:, members] = np.clip((own - middle[:, None]) / half[:, None], -1, 1)
        values[:, number, 0] = functions[:, 0] + np.tensordot(functions[:, 1:], middle.astype(np.float64), ([1], [0]))
        values[:, number, 1:] = functions[:, 1:] * half[:, None]
    return planes, values.reshape(len(values), -1, 3)
