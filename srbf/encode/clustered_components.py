"""Components of texels in clusters: from a sample of T's rows to the components of every texel, by two passes over the images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.capture import Capture
from srbf.encode.uv_seams import Stitch
from srbf.light_images import OnImage
from srbf.solve.adaptive_clustered_pca import adaptive_cluster
from srbf.solve.clustered_pca import Clusters, cluster
from srbf.solve.grouped_product import GroupedProduct
from srbf.solve.pca import principal_axes
from srbf.solve.streamed_product import StreamedProduct, in_tasks

FEATURES = 48  # numbers per texel by which it finds its cluster


Refine = Callable[[ndarray, ndarray], ndarray]


@runtime_checkable
class RowSpace(Protocol):
    """Rows of T as n vectors of M numbers that can be compared, and the way back: see `weighted_rows.LightSpace`."""

    @property
    def centered(self) -> Float32[ndarray, "n M"]: ...
    @property
    def scale(self) -> float: ...
    def weights(self, axes: Float32[ndarray, "S M"]) -> Float64[ndarray, "S L 3"]: ...
    def offsets(self, axes: Float32[ndarray, "S M"], mean: Float32[ndarray, " M"] | None = None) -> Float32[ndarray, " S"]: ...
    def functions(self, axes: Float32[ndarray, "S M"], mean: Float32[ndarray, " M"] | None = None) -> Float64[ndarray, "V F 3"]: ...


@dataclass(frozen=True, eq=False)
class ClusteredComponents:
    """Components (S, P) that span -1 to 1 in each cluster, the cluster of every texel, and functions (V, C (S + 1), 3) of the row space.

    Function (S + 1) m + j is that of component j in cluster m, j = 0 the mean's. With a stitch, `unstitched` (S, n) and
    `unstitched_index` (n,) are what its texels have without.
    """

    components: Float32[ndarray, "S P"]
    index: Int[ndarray, " P"]
    functions: Float64[ndarray, "V F 3"]
    unstitched: Float32[ndarray, "S n"] | None = None
    unstitched_index: Int[ndarray, " n"] | None = None
    cluster_zone: Int[ndarray, " C"] | None = None


@dataclass(frozen=True, eq=False)
class Zones:
    """Parts of the scene that share no cluster: the zone of every texel, and of the sampled ones."""

    texels: Int[ndarray, " P"]
    sample: Int[ndarray, " n"]


def clustered_components(
    capture: Capture,
    space: RowSpace,
    clusters: int,
    components: int,
    seed: int,
    stitch: Stitch | None,
    on_image: OnImage,
    progress: Callable[[int], None],
    zones: Zones | None = None,
    refine: Refine = lambda projected, index: projected,
    mean: float | None = None,
) -> ClusteredComponents:
    """Clusters grow axis by axis on the sample, then every texel joins the cluster that holds it best.

    One pass over the train images assigns the texels, another projects them: `on_image` sees each image in the first, `progress` counts
    the images of both. `refine(components, index)` may change the components of texels before they get their ranges. `mean`:
    the mean number of components per texel, in clusters of differing numbers; None: all have all. `stitch` closes the
    seams of the images, since components of two clusters cannot be compared, and what its texels show is read once more: both sides then
    agree as well as their clusters hold them.
    """
    train = capture.indices("train")
    features, _ = principal_axes(space.centered, FEATURES)
    found, of_zone = _clusters_in_zones(space, np.ascontiguousarray(features.T), clusters, components, seed, zones, mean)
    seen = StreamedProduct(space.weights(features))
    for first, block in capture.stream(train, on_image):
        seen.add(first, block)
        progress(first + len(block))
    columns = seen.result if stitch is None else _with_stitched(seen.result, stitch)
    of_texels = None
    if zones is not None:
        of_texels = zones.texels if stitch is None else np.concatenate([zones.texels, zones.texels[stitch.sources]])
    index = _assigned(columns, space, features, found, of_zone, of_texels)
    del seen, columns
    axes = found.axes.transpose(0, 2, 1)  # (C, S, M)
    weights = np.stack([space.weights(a) for a in axes]).astype(np.float32)
    texels = capture.width * capture.height
    product = GroupedProduct(weights, index[:texels])
    for first, block in capture.stream(train):
        product.add(first, block)
        progress(len(train) + first + len(block))
    projected, covered = refine(product.result, index[:texels]), capture.coverage().ravel() > 0
    del product
    if stitch is None:
        return ClusteredComponents(*_in_own_range(projected, index, covered, space, found), cluster_zone=of_zone)
    again = GroupedProduct(weights, index[texels:])
    for first, block in stitch.blocks(capture, train):
        again.add(first, block)
    # The stitched texels come first; what they would be without stands behind, where it sets no range.
    unstitched, unstitched_index = projected[:, stitch.sources], index[stitch.sources]
    projected[:, stitch.texels], index[stitch.texels] = again.result, index[texels:]
    projected = np.concatenate([projected, unstitched], axis=1)
    index = np.concatenate([index[:texels], unstitched_index])
    covered = np.concatenate([covered, np.zeros(len(unstitched_index), bool)])
    every, index, functions = _in_own_range(projected, index, covered, space, found)
    return ClusteredComponents(every[:, :texels], index[:texels], functions, every[:, texels:], index[texels:], of_zone)


def _clusters_in_zones(
    space: RowSpace, features: Float32[ndarray, "M D"], count: int, axes: int, seed: int, zones: Zones | None, mean: float | None
) -> tuple[Clusters, Int[ndarray, " C"] | None]:
    """(clusters, the zone of each): as many in each zone as its share of the sample asks for, one at least."""

    def made(vectors: ndarray, count: int) -> Clusters:
        if mean is None:
            return cluster(vectors, features, count, axes, seed)
        grown = adaptive_cluster(vectors, features, count, mean, seed, axes)
        return Clusters(grown.means, np.pad(grown.axes, ((0, 0), (0, 0), (0, axes - grown.axes.shape[2]))))

    if zones is None:
        return made(space.centered, count), None
    found, owners = [], []
    for zone in np.unique(zones.texels):
        rows = np.flatnonzero(zones.sample == zone)
        if not len(rows):  # too small for the sample: its texels join the zone of the first cluster
            continue
        own = made(space.centered[rows], max(1, round(count * len(rows) / len(zones.sample))))
        found.append(own)
        owners += [int(zone)] * len(own.means)
    means = np.concatenate([one.means for one in found])
    return Clusters(means, np.concatenate([one.axes for one in found])), np.array(owners, np.int64)


def _with_stitched(seen: Float32[ndarray, "D P"], stitch: Stitch) -> Float32[ndarray, "D Q"]:
    """Features of all texels, and behind them those of the stitch's texels once their (dilated) images are: features are sums."""
    values = seen[:, stitch.sources].T
    return np.concatenate([seen, (values + stitch.change(values)).T.astype(np.float32)], axis=1)


def _assigned(
    seen: Float32[ndarray, "D P"],
    space: RowSpace,
    features: Float32[ndarray, "D M"],
    found: Clusters,
    of_zone: Int[ndarray, " C"] | None,
    zones: Int[ndarray, " P"] | None,
) -> Int[ndarray, " P"]:
    """The cluster of every texel, by its features: of those of its zone, where there are zones."""
    clusters = found.through(np.ascontiguousarray(features.T))
    offsets = space.offsets(features)
    index = np.zeros(seen.shape[1], np.int64)
    if of_zone is not None and zones is not None:
        for zone in np.unique(of_zone):
            own, members = np.flatnonzero(of_zone == zone), np.flatnonzero(zones == zone)
            rows = np.ascontiguousarray((seen[:, members] - offsets[:, None]).T) * np.float32(space.scale)
            index[members] = own[Clusters(clusters.means[own], clusters.axes[own]).assign(rows)[0]]
        return index

    def work(task: slice) -> None:
        index[task] = clusters.assign(np.ascontiguousarray((seen[:, task] - offsets[:, None]).T) * np.float32(space.scale))[0]

    in_tasks(work, seen.shape[1])
    return index


def _in_own_range(
    projected: Float32[ndarray, "S P"], index: Int[ndarray, " P"], covered: Bool[ndarray, " P"], space: RowSpace, found: Clusters
) -> tuple[Float32[ndarray, "S P"], Int[ndarray, " P"], Float64[ndarray, "V F 3"]]:
    """(components, index, functions) with every scalar of a cluster spanning -1 to 1 over its covered texels."""
    components = len(projected)
    planes = np.zeros_like(projected)
    values = []
    for number in range(len(found.means)):
        axes = np.ascontiguousarray(found.axes[number].T)  # (S, M)
        functions = space.functions(axes, found.means[number])  # (V, S + 1, 3)
        offsets = space.offsets(axes, found.means[number])
        members = index == number
        own = projected[:, members] - offsets[:, None]
        real = own[:, covered[members]]
        low, high = (real.min(axis=1), real.max(axis=1)) if real.shape[1] else (np.zeros(components), np.zeros(components))
        middle, half = (low + high) / 2, (high - low) / 2
        half = np.where(half > 0, half, 1)
        planes[:, members] = np.clip((own - middle[:, None]) / half[:, None], -1, 1)
        first = functions[:, 0] + np.tensordot(functions[:, 1:], middle.astype(np.float64), ([1], [0]))
        values.append(np.concatenate([first[:, None], functions[:, 1:] * half[:, None]], axis=1))
    return planes, index, np.concatenate(values, axis=1)
