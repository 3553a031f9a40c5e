"""Points on surfaces that stand for the pixels of a view: their centers, and where a pixel shows several surfaces, several points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.visibility.rays import RayTracer, Samples
from srbf.visibility.receivers import Receivers

FEW, MANY = 4, 16  # samples by which an edge is known, and of an edge
SAME_COS, OFF_PLANE = 0.95, 0.1  # of samples of one surface: their normals, and their distance off its plane over that from each other
MOST_MIXED = 10  # clusters of a pixel
LEAST_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class PixelPoints:
    """N points (m), unit normals, the pixel of each, and its share of the pixel's light; `size`: how many pixels there are."""

    points: Float64[ndarray, "N 3"]
    normals: Float64[ndarray, "N 3"]
    pixels: Int[ndarray, " N"]
    shares: Float32[ndarray, " N"]
    size: int

    @staticmethod
    def of_centers(receivers: Receivers) -> PixelPoints:
        """Of every covered pixel what its center shows."""
        return PixelPoints.of_view(replace(receivers, sampling={**receivers.sampling, "camera": None}))

    @staticmethod
    def of_view(receivers: Receivers) -> PixelPoints:
        """Of every covered pixel: its center, or MANY samples of the pixel's filter where FEW of them show different surfaces.

        The samples of an edge weigh as much as they reflect. Without a camera that rays can follow, centers alone.
        """
        positions, normals = (receivers.images[name].reshape(-1, 3).astype(np.float64) for name in ("position", "normal"))
        coverage = receivers.images.get("coverage")
        size = receivers.width * receivers.height
        covered = np.ones(size, bool) if coverage is None else coverage.ravel() > 0
        length = np.linalg.norm(normals, axis=1)
        centered = np.flatnonzero(covered & (length > 0.5))
        normals = normals / np.maximum(length, 1e-30)[:, None]
        if receivers.camera is None:
            return PixelPoints(positions[centered], normals[centered], centered, np.ones(len(centered), np.float32), size)
        tracer = RayTracer(receivers)
        edges = several_surfaces(tracer, np.flatnonzero(covered), positions, length > 0.5)
        many = tracer.samples(edges, range(FEW, FEW + MANY))
        real = np.flatnonzero(many.weight > 0)
        share = np.broadcast_to(many.share, many.point.shape)[real].mean(axis=1) + LEAST_SHARE
        total = np.bincount(many.texel[real], share, size)
        lost = edges[total[edges] == 0]
        plain = np.setdiff1d(centered, np.setdiff1d(edges, lost))
        points = np.concatenate([positions[plain], many.point[real].astype(np.float64)])
        facing = np.concatenate([normals[plain], many.normal[real].astype(np.float64)])
        shares = np.concatenate([np.ones(len(plain)), share / total[many.texel[real]]])
        return PixelPoints(points, facing, np.concatenate([plain, many.texel[real]]), shares.astype(np.float32), size)

    def gathered(
        self, clusters: Int[ndarray, "N K"], weights: Float[ndarray, "N K"]
    ) -> tuple[Int[ndarray, "P M"], Float32[ndarray, "P M"]]:
        """(clusters, weights) of the pixels from those of the points: the M heaviest of each pixel, which sum to 1; 0 of pixels without."""
        most = min(MOST_MIXED, int(clusters.max(initial=0)) + 1)
        pixel = np.repeat(self.pixels, clusters.shape[1])
        keys = pixel * (int(clusters.max(initial=0)) + 1) + clusters.ravel()
        order = np.argsort(keys, kind="stable")
        own, first = np.unique(keys[order], return_index=True)
        weight = np.add.reduceat((self.shares[:, None] * weights).ravel().astype(np.float64)[order], first) if len(own) else np.zeros(0)
        pixel, cluster = np.divmod(own, int(clusters.max(initial=0)) + 1)
        order = np.lexsort((-weight, pixel))
        pixel, cluster, weight = pixel[order], cluster[order], weight[order]
        begins = np.searchsorted(pixel, np.arange(self.size))
        place = np.arange(len(pixel)) - begins[pixel]
        kept = place < most
        found = np.zeros((self.size, most), np.int64)
        amount = np.zeros((self.size, most), np.float32)
        found[pixel[kept], place[kept]] = cluster[kept]
        amount[pixel[kept], place[kept]] = weight[kept]
        return found, amount / np.maximum(amount.sum(axis=1, keepdims=True), 1e-30)


def several_surfaces(
    tracer: RayTracer, pixels: Int[ndarray, " e"], positions: Float[ndarray, "P 3"], has_center: Bool[ndarray, " P"]
) -> Int[ndarray, " d"]:
    """Those of some pixels of a view where FEW samples, and the center's position (m) if there is one, are not all on one surface."""
    few = tracer.samples(pixels, range(FEW))
    return pixels[_differ(few, len(pixels), positions[pixels].astype(np.float64), has_center[pixels])]


def _differ(few: Samples, pixels: int, center: Float64[ndarray, "P 3"], has_center: Bool[ndarray, " P"]) -> Bool[ndarray, " P"]:
    """Whether a pixel's samples, ordered by sample, and its center are not all on one surface; of pixels that show any."""
    point, normal = few.point.reshape(-1, pixels, 3), few.normal.reshape(-1, pixels, 3)
    real = few.weight.reshape(-1, pixels) > 0
    every = np.concatenate([point, center[None]])
    known = np.concatenate([real, has_center[None]])
    vector = every - point[:1]
    away = np.abs(np.einsum("spk,pk->sp", vector, few.face.reshape(-1, pixels, 3)[0]))
    off = away > OFF_PLANE * np.linalg.norm(vector, axis=2)
    turned = np.einsum("spk,spk->sp", normal, np.broadcast_to(normal[:1], normal.shape)) < SAME_COS
    return ((off & known).any(axis=0) | (turned & real).any(axis=0) | ~has_center | ~real[0]) & real.any(axis=0)
