"""Points on surfaces that stand for the pixels of a view: their centers, and where a pixel shows several surfaces, several points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.visibility.rays import RayTracer, Samples
from srbf.visibility.receivers import Receivers

FEW, MANY = 4, 32  # samples by which an edge is known, and of an edge
CLUSTERED = 8  # of these, that clusters are made of
SAME_COS, OFF_PLANE = 0.95, 0.1  # of samples of one surface: their normals, and their distance off its plane over that from each other
MOST_MIXED, MOST_FOUND = 10, 32  # clusters of a pixel, and of those that its points mix
LEAST_SHARE = 1e-3
FAR = 1e30  # of a cluster from itself, which it is not merged with
BATCH = 1 << 9  # pixels whose clusters are merged at a time


@dataclass(frozen=True, eq=False)
class PixelPoints:
    """N points (m), unit normals, the pixel of each, and its share of the pixel's light; `size`: how many pixels there are.

    The first `plain` are the only ones of their pixels. Clusters are made of the first `clustered`, None: of all.
    """

    points: Float64[ndarray, "N 3"]
    normals: Float64[ndarray, "N 3"]
    pixels: Int[ndarray, " N"]
    shares: Float32[ndarray, " N"]
    size: int
    plain: int = 0
    clustered: int | None = None

    @staticmethod
    def of_centers(receivers: Receivers) -> PixelPoints:
        """Of every covered pixel what its center shows."""
        return PixelPoints.of_view(replace(receivers, sampling={**receivers.sampling, "camera": None}))

    @staticmethod
    def of_view(receivers: Receivers) -> PixelPoints:
        """Of every covered pixel: its center, or MANY samples of the pixel's filter where these show different surfaces.

        The samples of an edge weigh as much as they reflect. Without a camera that rays can follow, centers alone.
        """
        positions, normals = (receivers.images[name].reshape(-1, 3).astype(np.float64) for name in ("position", "normal"))
        coverage = receivers.images.get("coverage")
        size = receivers.width * receivers.height
        covered = np.ones(size, bool) if coverage is None else coverage.ravel() > 0
        length = np.linalg.norm(normals, axis=1)
        has_center = length > 0.5
        centered = np.flatnonzero(covered & has_center)
        normals = normals / np.maximum(length, 1e-30)[:, None]
        if receivers.camera is None:
            shares = np.ones(len(centered), np.float32)
            return PixelPoints(positions[centered], normals[centered], centered, shares, size, len(centered))
        tracer = RayTracer(receivers)
        texels = np.flatnonzero(covered)
        maybe = np.union1d(several_surfaces(tracer, texels, positions, has_center), np.intersect1d(tracer.edges(), texels))
        many = tracer.samples(maybe, range(FEW, FEW + MANY))
        edges = np.zeros(size, bool)
        edges[maybe] = _differ(many, len(maybe), positions[maybe], has_center[maybe])
        real = np.flatnonzero((many.weight > 0) & edges[many.texel])
        share = np.broadcast_to(many.share, many.point.shape)[real].mean(axis=1) + LEAST_SHARE
        total = np.bincount(many.texel[real], share, size)
        plain = np.setdiff1d(centered, np.flatnonzero(total > 0))
        points = np.concatenate([positions[plain], many.point[real].astype(np.float64)])
        facing = np.concatenate([normals[plain], many.normal[real].astype(np.float64)])
        shares = np.concatenate([np.ones(len(plain)), share / total[many.texel[real]]])
        pixels = np.concatenate([plain, many.texel[real]])
        clustered = len(plain) + int(np.searchsorted(real, CLUSTERED * len(maybe)))
        return PixelPoints(points, facing, pixels, shares.astype(np.float32), size, len(plain), clustered)

    def gathered(
        self, clusters: Int[ndarray, "N K"], weights: Float[ndarray, "N K"], features: Float[ndarray, "C d"] | None = None
    ) -> tuple[Int[ndarray, "P M"], Float32[ndarray, "P M"]]:
        """(clusters, weights) of the pixels from those of the points: at most M of each pixel, which sum to 1; 0 of pixels without.

        Of pixels with more, the clusters that are nearest to each other become one, by the `features` of all clusters (Ward's cost: what
        little a pixel shows of a far surface stays); without any the heaviest are kept.
        """
        count = int(clusters.max(initial=0)) + 1
        most = min(MOST_MIXED, count)
        keys = np.repeat(self.pixels, clusters.shape[1]) * count + clusters.ravel()
        order = np.argsort(keys, kind="stable")
        own, first = np.unique(keys[order], return_index=True)
        weight = np.add.reduceat((self.shares[:, None] * weights).ravel().astype(np.float64)[order], first) if len(own) else np.zeros(0)
        own, weight = own[weight > 0], weight[weight > 0]
        pixel, cluster = np.divmod(own, count)
        order = np.lexsort((-weight, pixel))
        pixel, cluster, weight = pixel[order], cluster[order], weight[order]
        place = np.arange(len(pixel)) - np.searchsorted(pixel, np.arange(self.size))[pixel]
        kept = place < (most if features is None else MOST_FOUND)
        width = max(most, int(place[kept].max(initial=0)) + 1)
        found, amount = np.zeros((self.size, width), np.int64), np.zeros((self.size, width))
        found[pixel[kept], place[kept]] = cluster[kept]
        amount[pixel[kept], place[kept]] = weight[kept]
        if features is not None and width > most:
            _merge(found, amount, np.asarray(features, np.float64), most)
        order = np.argsort(-amount, axis=1, kind="stable")[:, :most]
        found, amount = np.take_along_axis(found, order, axis=1), np.take_along_axis(amount, order, axis=1)
        found[amount == 0] = 0
        return found, (amount / np.maximum(amount.sum(axis=1, keepdims=True), 1e-30)).astype(np.float32)


def _merge(found: Int[ndarray, "P w"], amount: Float64[ndarray, "P w"], features: Float64[ndarray, "C d"], most: int) -> None:
    """Give the lighter of two clusters of a pixel to the heavier, where that changes least, until each pixel has `most`."""
    many = np.flatnonzero((amount > 0).sum(axis=1) > most)
    for start in range(0, len(many), BATCH):
        own = many[start : start + BATCH]
        weight = amount[own]
        place = features[found[own]]
        apart = ((place[:, :, None] - place[:, None]) ** 2).sum(axis=3)
        apart[:, np.arange(weight.shape[1]), np.arange(weight.shape[1])] = FAR
        open_ = np.arange(len(own))
        while len(open_ := open_[(weight[open_] > 0).sum(axis=1) > most]):
            one, other = weight[open_][:, :, None], weight[open_][:, None]
            cost = np.where((one > 0) & (other > 0), one * other / np.maximum(one + other, 1e-30) * apart[open_], np.inf)
            first, second = np.divmod(cost.reshape(len(open_), -1).argmin(axis=1), weight.shape[1])
            swap = weight[open_, first] < weight[open_, second]
            first, second = np.where(swap, second, first), np.where(swap, first, second)
            weight[open_, first] += weight[open_, second]
            weight[open_, second] = 0
        amount[own] = weight


def several_surfaces(
    tracer: RayTracer, pixels: Int[ndarray, " e"], positions: Float[ndarray, "P 3"], has_center: Bool[ndarray, " P"]
) -> Int[ndarray, " d"]:
    """Those of some pixels of a view where FEW samples, and the center's position (m) if there is one, are not all on one surface."""
    few = tracer.samples(pixels, range(FEW))
    return pixels[_differ(few, len(pixels), positions[pixels].astype(np.float64), has_center[pixels])]


def _differ(few: Samples, pixels: int, center: Float64[ndarray, "P 3"], has_center: Bool[ndarray, " P"]) -> Bool[ndarray, " P"]:
    """Whether a pixel's samples, ordered by sample, and its center are not all on one surface; of pixels that show any."""
    if not pixels:
        return np.zeros(0, bool)
    point, normal = few.point.reshape(-1, pixels, 3), few.normal.reshape(-1, pixels, 3)
    real = few.weight.reshape(-1, pixels) > 0
    every = np.concatenate([point, center[None]])
    known = np.concatenate([real, has_center[None]])
    vector = every - point[:1]
    away = np.abs(np.einsum("spk,pk->sp", vector, few.face.reshape(-1, pixels, 3)[0]))
    off = away > OFF_PLANE * np.linalg.norm(vector, axis=2)
    turned = np.einsum("spk,spk->sp", normal, np.broadcast_to(normal[:1], normal.shape)) < SAME_COS
    return ((off & known).any(axis=0) | (turned & real).any(axis=0) | ~has_center | ~real[0]) & real.any(axis=0)
