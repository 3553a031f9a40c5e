"""View clusters: groups of a view's pixels that gather light as one, and how pixels mix the nearest of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.solve.splitting import split_clusters
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.pixel_points import PixelPoints

MOST_CLUSTERS = 65_536  # indices are 16 bits
NORMAL_WEIGHT = 0.04  # of the scene's longest side, beside places
NEAREST, NEAREST_OF_SEVERAL = 10, 4  # of a point, and of one of several in a pixel
REACH = 1.1  # of the distance to the last of the nearest: where its weight would be 0
ONE_WAY = 0.3  # cosine of a member's normal to the mean one, below which the member's own is taken
LIFT = 0.25  # of the distance between a point and a cluster: how far off the surfaces it is tested whether they see each other
BATCH = 1 << 16


@dataclass(frozen=True, eq=False)
class ViewClusters:
    """C places (m) on surfaces and unit normals there, which gather for the points around; `scale`: what a normal counts, m."""

    places: Float64[ndarray, "C 3"]
    normals: Float64[ndarray, "C 3"]
    scale: float

    @staticmethod
    def of_pixels(pixels: PixelPoints, count: int, extent: float) -> ViewClusters:
        """`of_points`, of those of a view's pixels."""
        return ViewClusters.of_points(pixels.points[: pixels.clustered], pixels.normals[: pixels.clustered], count, extent)

    @staticmethod
    def of_points(points: Float[ndarray, "P 3"], normals: Float[ndarray, "P 3"], count: int, extent: float) -> ViewClusters:
        """At most `count`, by splitting the points on place and normal; a cluster is at the point nearest its mean.

        Its normal is the mean one, or that point's own where they differ. `extent`: the scene's longest side, m.
        """
        scale = NORMAL_WEIGHT * extent
        features = _features(points, normals, scale)
        labels = split_clusters(features, count)
        size = np.bincount(labels)
        mean = np.stack([np.bincount(labels, features[:, k]) for k in range(6)], axis=1) / size[:, None]
        away = ((features - mean[labels]) ** 2).sum(axis=1)
        nearest = np.lexsort((away, labels))[np.cumsum(size) - size]
        own = np.asarray(normals, np.float64)[nearest]
        normal = mean[:, 3:] / np.maximum(np.linalg.norm(mean[:, 3:], axis=1, keepdims=True), 1e-30)
        agrees = np.einsum("nk,nk->n", own, normal) >= ONE_WAY
        return ViewClusters(np.asarray(points, np.float64)[nearest], np.where(agrees[:, None], normal, own), scale)

    def of_each(self, pixels: PixelPoints, occluders: EmbreeTriangles) -> tuple[Int[ndarray, "P M"], Float32[ndarray, "P M"]]:
        """(clusters, weights) of every pixel: `mixed` at its point, or at each of several, by fewer clusters."""
        parts = []
        for part, nearest in ((slice(None, pixels.plain), NEAREST), (slice(pixels.plain, None), NEAREST_OF_SEVERAL)):
            parts.append(self.mixed(pixels.points[part], pixels.normals[part], occluders, nearest))
        width = max(clusters.shape[1] for clusters, _ in parts)
        padded = [[np.pad(array, ((0, 0), (0, width - array.shape[1]))) for array in arrays] for arrays in parts]
        clusters, weights = (np.concatenate(arrays) for arrays in zip(*padded, strict=True))
        return pixels.gathered(clusters, weights, _features(self.places, self.normals, self.scale))

    def mixed(
        self,
        points: Float[ndarray, "P 3"],
        normals: Float[ndarray, "P 3"],
        occluders: EmbreeTriangles | None = None,
        most: int = NEAREST,
    ) -> tuple[Int[ndarray, "P K"], Float32[ndarray, "P K"]]:
        """(the K nearest clusters of each point, their weights, which sum to 1): (1 - d / 1.1 d_K)^2 of the distance d in place and normal.

        K is `most`, or how many clusters there are. A cluster that does not see the point weighs 0, unless none does: light does not pass
        under a wall.
        """
        from scipy.spatial import cKDTree

        tree = cKDTree(_features(self.places, self.normals, self.scale))
        nearest = min(most, len(self.places))
        clusters = np.zeros((len(points), nearest), np.int64)
        weights = np.zeros((len(points), nearest), np.float32)
        for start in range(0, len(points), BATCH):
            part = slice(start, start + BATCH)
            distance, found = tree.query(_features(points[part], normals[part], self.scale), nearest, workers=-1)
            distance, found = distance.reshape(-1, nearest), found.reshape(-1, nearest)
            weight = (1 - distance / np.maximum(REACH * distance[:, -1:], 1e-30)) ** 2
            if occluders is not None:
                apart = weight * self._sees(np.asarray(points[part], np.float64), np.asarray(normals[part], np.float64), found, occluders)
                weight = np.where(apart.any(axis=1, keepdims=True), apart, weight)
            clusters[part], weights[part] = found, weight / weight.sum(axis=1, keepdims=True)
        return clusters, weights

    def _sees(self, points: ndarray, normals: ndarray, found: Int[ndarray, "P K"], occluders: EmbreeTriangles) -> ndarray:
        """(P, K) whether nothing stands between each point and its clusters, a little above both."""
        toward = self.places[found] - points[:, None]
        lift = LIFT * np.linalg.norm(toward, axis=2, keepdims=True) + 1e-6
        starts = (points[:, None] + lift * normals[:, None]).reshape(-1, 3)
        vector = (self.places[found] + lift * self.normals[found]).reshape(-1, 3) - starts
        distance = np.linalg.norm(vector, axis=1)
        unit = vector / np.maximum(distance, 1e-30)[:, None]
        return ~occluders.occluded(starts.astype(np.float32), unit, distance).reshape(found.shape)


def _features(points: Float[ndarray, "P 3"], normals: Float[ndarray, "P 3"], scale: float) -> Float64[ndarray, "P 6"]:
    return np.concatenate([np.asarray(points, np.float64), scale * np.asarray(normals, np.float64)], axis=1)
