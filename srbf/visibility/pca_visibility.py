"""What points of surfaces see, as hemispherical depth maps compressed by principal components: shadows without rays or shadow maps.

A point keeps how far it sees in SIDE x SIDE directions, as a sum of a few axes that a cluster of points shares [Nowrouzezahrai2007]. A
light is seen if it is nearer than that. The depths in the four directions around the light are reconstructed and compared one by one, and
the four results are mixed: depths themselves are not interpolated across an edge.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.solve.bounded_pca import bounded_pca
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.hemisphere_map import SIDE, Axes, directions, four_around, hemisphere_frames, local_vectors, places
from srbf.visibility.patches import group

BIAS = 0.05  # of a light's distance, by which a depth may fall short: errors of the components shade less than they would
LOOKS = 5  # per side of an area light
POINTS_PER_CLUSTER, FEWEST_CLUSTERS, MOST_CLUSTERS = 1000, 32, 255
FEWEST_POINTS = 100  # of a cluster
PLACE_WEIGHT = 4.0  # of the points' longest side, beside their normals
CLEARANCE = 0.05  # m, around the free places: where lights may be
ROUNDS = 40
OUTLIER = 1.0  # m, above which errors of depth count in proportion
SUN_AT, OPEN_FROM = 1.05, 1.1  # of `far`: where a sun is, the least depth where no surface is met
MOST_AT_ONCE = 1 << 13  # points whose depths are reconstructed at a time
RAYS = 1 << 20


@dataclass(frozen=True, eq=False)
class PcaVisibility:
    """Compressed depths at P points in K clusters: depth d of point p is sum_j (2 byte_pj / 255 - 1) basis_kjd, of j = 0 the mean, once.

    `bases` are bytes with a `low` and a `span` (m) per row. `far` (m): no distance in the scene is larger.
    """

    normals: Float32[ndarray, "P 3"]
    clusters: Int[ndarray, " P"]
    coefficients: ndarray  # (P, n) uint8
    bases: ndarray  # (K, n + 1, SIDE * SIDE) uint8
    low: Float32[ndarray, "K m"]
    span: Float32[ndarray, "K m"]
    far: float

    @property
    def side(self) -> int:
        """Looks per side of an area light."""
        return LOOKS

    def visible(self, points: Int[ndarray, " n"], toward: Float[ndarray, "n 3"], distance: Float[ndarray, " n"] | None) -> ndarray:
        """(n,) how much of a light in the direction `toward` (unit vectors) each point sees, 0 to 1; distance in m, None: of suns."""
        result = np.empty(len(points))
        for first in range(0, len(points), MOST_AT_ONCE):
            part = slice(first, first + MOST_AT_ONCE)
            own = points[part]
            texels, weights = four_around(places(self.local(own, toward[part])), SIDE)
            reach = np.full(len(own), SUN_AT * self.far) if distance is None else (1 - BIAS) * np.asarray(distance[part])
            result[part] = (weights * (reach[:, None] <= self.depths(own, texels))).sum(axis=1)
        return result

    def local(self, points: Int[ndarray, " n"], vectors: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
        """Vectors in the frames of points."""
        across, up, out = self._frames
        return local_vectors(vectors, (across[points], up[points], out[points]))

    def depths(self, points: Int[ndarray, " n"], texels: Int[ndarray, "n t"]) -> Float32[ndarray, "n t"]:
        """Reconstructed depths (m) at texels of each point's map."""
        basis = self.decoded_bases[self.clusters[points][:, None], texels]  # (n, t, n + 1)
        return np.einsum("ntj,nj->nt", basis, self.decoded_coefficients[points])

    @functools.cached_property
    def decoded_bases(self) -> Float32[ndarray, "K D m"]:
        """(K, D, n + 1), m."""
        whole = self.bases * (self.span / 255)[:, :, None].astype(np.float32) + self.low[:, :, None]
        return np.ascontiguousarray(whole.transpose(0, 2, 1).astype(np.float32))

    @functools.cached_property
    def decoded_coefficients(self) -> Float32[ndarray, "P m"]:
        """(P, n + 1), the first of them 1: that of the mean."""
        return np.pad(self.coefficients.astype(np.float32) * np.float32(2 / 255) - 1, ((0, 0), (1, 0)), constant_values=1)

    @functools.cached_property
    def _frames(self) -> Axes:
        return hemisphere_frames(self.normals)

    def byte_count(self) -> int:
        """Bytes of all that it keeps beside the points, uncompressed."""
        return self.coefficients.nbytes + self.bases.nbytes + self.low.nbytes + self.span.nbytes + len(self.clusters)


@dataclass(frozen=True, eq=False)
class DepthMaps:
    """Hemispherical depth maps of points that start at `starts` (n, 3), m, as rays find them."""

    starts: Float32[ndarray, "P 3"]
    normals: Float32[ndarray, "P 3"]
    occluders: EmbreeTriangles
    far: float

    def trace(self, points: Int[ndarray, " n"]) -> tuple[Float32[ndarray, "n D"], Float32[ndarray, "n D 3"]]:
        """(depths (m) of some points, inf where nothing is met; the directions (n, D, 3) of their texels)."""
        axes = [axis[points] for axis in hemisphere_frames(self.normals)]
        local = directions(SIDE)
        toward = np.einsum("dk,knc->ndc", local, np.array(axes)).astype(np.float32)
        depth = np.empty(toward.shape[:2], np.float32)
        step = max(1, RAYS // len(local))
        for first in range(0, len(points), step):
            part = slice(first, first + step)
            origins = np.repeat(self.starts[points[part]], len(local), axis=0)
            hit, distance, _ = self.occluders.first_hit(origins, toward[part].reshape(-1, 3))
            depth[part] = np.where(hit >= 0, distance, np.inf).reshape(-1, len(local))
        return depth, toward


def clusters_of(positions: Float32[ndarray, "P 3"], normals: Float32[ndarray, "P 3"]) -> Int[ndarray, " P"]:
    """Clusters of points that lie near each other and face the same way: about POINTS_PER_CLUSTER, or FEWEST_CLUSTERS of few."""
    most = max(1, len(positions) // FEWEST_POINTS)
    count = int(np.clip(len(positions) // POINTS_PER_CLUSTER, min(FEWEST_CLUSTERS, most), MOST_CLUSTERS))
    extent = max(float(np.ptp(positions, axis=0).max(initial=0)), 1e-9)
    return group(np.concatenate([PLACE_WEIGHT * positions / extent, normals], axis=1), np.ones(len(positions)), count)


def pca_visibility(
    starts: Float32[ndarray, "P 3"],
    normals: Float32[ndarray, "P 3"],
    occluders: EmbreeTriangles,
    free: Float64[ndarray, "F 3"],
    count: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> PcaVisibility:
    """Depths at `starts` (m) in `count` coefficients a point, by rays; lights are taken to be within the box of the `free` places.

    What a surface hides outside of that box is no light's, so a depth past it may be approximated by any larger one, and a depth below
    CLEARANCE by any smaller one. Peak memory: 100 MB for clusters of 1000 points.
    """
    far = max(1.0, float(np.linalg.norm(np.ptp(np.concatenate([starts, free]), axis=0))))
    maps = DepthMaps(starts, normals, occluders, far)
    labels = clusters_of(starts, normals)
    clusters = int(labels.max()) + 1
    coefficients = np.zeros((len(starts), count), np.uint8)
    bases = np.zeros((clusters, count + 1, SIDE * SIDE), np.uint8)
    low, span = np.zeros((clusters, count + 1), np.float32), np.zeros((clusters, count + 1), np.float32)
    for number in range(clusters):
        own = np.flatnonzero(labels == number)
        start, bounds = bounded_depths(maps, own, free)
        mean, axes, scores = bounded_pca(start, *bounds, count, ROUNDS, OUTLIER)
        largest = np.maximum(np.abs(scores).max(axis=0), 1e-6)
        coefficients[own] = np.round((scores / largest + 1) * 127.5)
        rows = np.concatenate([mean[None], axes * largest[:, None]])
        low[number], span[number] = rows.min(axis=1), np.ptp(rows, axis=1)
        bases[number] = np.round((rows - low[number, :, None]) * (255 / np.maximum(span[number], 1e-9))[:, None])
        progress(number + 1, clusters)
    return PcaVisibility(normals, labels, coefficients, bases, low, span, far)


def bounded_depths(
    maps: DepthMaps, points: Int[ndarray, " n"], free: Float64[ndarray, "F 3"]
) -> tuple[Float32[ndarray, "n D"], tuple[Float32[ndarray, "n D"], Float32[ndarray, "n D"]]]:
    """(depths of points, (the least, the largest depths that light no light within the box of `free` places otherwise)), m."""
    depth, toward = maps.trace(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        faces = [(free.min(axis=0) - CLEARANCE), (free.max(axis=0) + CLEARANCE)]
        ends = [(face.astype(np.float32) - maps.starts[points][:, None]) / toward for face in faces]
        leaves = np.nan_to_num(np.maximum(*ends), nan=np.inf).min(axis=2)
    leaves = np.maximum(leaves, 0)  # how far along each direction a light may be
    open_ = np.isinf(depth)
    start = np.minimum(depth, np.float32(maps.far))
    low = np.where(start < CLEARANCE, -np.inf, np.minimum(start, leaves))
    high = np.where(start >= leaves, np.float32(maps.far), start)
    start = np.where(open_, np.float32(OPEN_FROM * maps.far), start)
    low, high = np.where(open_, start, low), np.where(open_, np.inf, high)
    return start, (low.astype(np.float32), high.astype(np.float32))
