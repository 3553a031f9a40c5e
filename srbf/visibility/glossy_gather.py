"""What the specular lobes of a view gather from a pool of surfels: sparse links of lobe clusters, by rays of the lobes' own density."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.compute.threads import each
from srbf.microfacets import albedo_terms, fresnel, sampled
from srbf.solve.splitting import split_clusters
from srbf.visibility.behind import Behind
from srbf.visibility.glossy_direct import GlossyPixels, has_gloss
from srbf.visibility.hemisphere import GOLDEN
from srbf.visibility.receivers import Receivers
from srbf.visibility.sparse_links import SparseLinks
from srbf.visibility.surface_cells import OFFSET, frames
from srbf.visibility.surfels import Surfels

MOST_LOBES = 20_000  # rows, of a view with more glossy pixels
RAYS, STEPS = 256, 16  # of a lobe; a share is stored as so many parts of a ray
NEAREST = 4  # lobes that a pixel mixes
NORMAL_WEIGHT, ALPHA_WEIGHT = 0.3, 0.05  # of the scene's longest side, beside places
REACH = 1.1  # as of view clusters
BATCH = 1 << 10  # rows traced at a time


@dataclass(frozen=True, eq=False)
class GlossyGather:
    """Links from R lobes to S surfels; `nearest` (P, K) lobes of every pixel, `weights` of each, 0 of pixels without gloss.

    The radiance of a pixel is its specular reflectance times the mean over its lobes of links times radiosity, over pi.
    """

    links: SparseLinks
    nearest: Int[ndarray, "P K"]
    weights: Float32[ndarray, "P K"]

    def arrays(self) -> dict[str, ndarray]:
        """As a file holds them."""
        own = {"gloss_nearest": self.nearest.astype(np.uint16), "gloss_weights": self.weights.astype(np.float16)}
        return {**self.links.arrays("gloss"), **own}

    @staticmethod
    def of_arrays(stored: Mapping[str, ndarray], surfel_count: int) -> GlossyGather | None:
        """From `arrays`, None where there are none; ValueError where they do not fit each other."""
        if "gloss_nearest" not in stored:
            return None
        links = SparseLinks.of_arrays(stored, "gloss", surfel_count)
        nearest, weights = stored["gloss_nearest"].astype(np.int64), stored["gloss_weights"].astype(np.float32)
        if nearest.shape != weights.shape or int(nearest.max(initial=0)) >= links.rows:
            raise ValueError("lobes that fit each other")
        return GlossyGather(links, nearest, weights)

    @staticmethod
    def traced(
        pool: Surfels,
        lobes: Lobes,
        most: int = MOST_LOBES,
        seed: int = 0,
        progress: Callable[[int, int], None] = lambda done, total: None,
        passing: Behind | None = None,
    ) -> GlossyGather:
        """By RAYS rays of every lobe. `most`: rows; `passing`: the surfels of the pool that let light through."""
        from scipy.sparse import csr_array, vstack

        extent = float(np.ptp(pool.cells.places, axis=0).max(initial=0))
        chosen, nearest, weights = lobes.clustered(extent, most)
        starts = list(range(0, len(chosen), BATCH))
        parts: list[csr_array] = [None] * len(starts)

        def trace(number: int) -> None:
            own = chosen[starts[number] : starts[number] + BATCH]
            origins, directions, shares = lobes.rays(own, RAYS, np.random.default_rng([seed, number]), OFFSET * extent)
            surfel, _ = pool.met_along(origins.reshape(-1, 3), directions.reshape(-1, 3))
            known = np.flatnonzero((surfel >= 0) & (shares.ravel() > 0))
            row = np.repeat(np.arange(len(own)), RAYS)[known]
            found = csr_array((shares.ravel()[known].astype(np.float32), (row, surfel[known])), shape=(len(own), pool.count))
            found.sum_duplicates()
            parts[number] = found
            progress(min(starts[number] + BATCH, len(chosen)), len(chosen))

        each(trace, len(starts))
        shares = vstack([csr_array((0, pool.count), dtype=np.float32), *parts], format="csr")
        links = SparseLinks.of_shares(shares if passing is None else passing.met(shares), RAYS * STEPS)
        return GlossyGather(links, *lobes.of_pixels(nearest, weights))


@dataclass(frozen=True, eq=False)
class Lobes:
    """The specular lobes of a view's glossy pixels, at their centers: points (G, 3), m, and normals."""

    pixels: GlossyPixels
    points: Float64[ndarray, "G 3"]
    normals: Float64[ndarray, "G 3"]
    size: int

    @staticmethod
    def of(receivers: Receivers) -> Lobes | None:
        """None where nothing is glossy, or no camera is known."""
        if not has_gloss(receivers):
            return None
        pixels = GlossyPixels(receivers)
        points, normals = (receivers.images[name].reshape(-1, 3)[pixels.texels].astype(np.float64) for name in ("position", "normal"))
        if not len(points):
            return None
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        return Lobes(pixels, points, normals, receivers.width * receivers.height)

    def clustered(self, extent: float, most: int) -> tuple[Int[ndarray, " R"], Int[ndarray, "G K"], Float32[ndarray, "G K"]]:
        """(numbers of the lobes that stand for those around, the nearest of these to each lobe, their weights, which sum to 1)."""
        from scipy.spatial import cKDTree

        count = len(self.points)
        if count <= most:
            return np.arange(count), np.arange(count)[:, None], np.ones((count, 1), np.float32)
        features = np.concatenate(
            [
                self.points,
                NORMAL_WEIGHT * extent * self.normals,
                ALPHA_WEIGHT * extent * np.sqrt(self.pixels.alpha[self.pixels.texels, None]),
            ],
            axis=1,
        )
        labels = split_clusters(features, most)
        size = np.bincount(labels)
        mean = np.stack([np.bincount(labels, own) for own in features.T], axis=1) / size[:, None]
        away = ((features - mean[labels]) ** 2).sum(axis=1)
        chosen = np.lexsort((away, labels))[np.cumsum(size) - size]
        distance, nearest = cKDTree(features[chosen]).query(features, min(NEAREST, len(chosen)), workers=-1)
        weight = (1 - distance / np.maximum(REACH * distance[:, -1:], 1e-30)) ** 2
        return chosen, nearest, (weight / weight.sum(axis=1, keepdims=True)).astype(np.float32)

    def of_pixels(self, nearest: Int[ndarray, "G K"], weights: Float32[ndarray, "G K"]) -> tuple[ndarray, ndarray]:
        """(nearest, weights) of all pixels of the view."""
        found, amount = (np.zeros((self.size, nearest.shape[1]), kind) for kind in (np.int64, np.float32))
        found[self.pixels.texels], amount[self.pixels.texels] = nearest, weights
        return found, amount

    def rays(
        self, chosen: Int[ndarray, " n"], count: int, rng: np.random.Generator, lift: float
    ) -> tuple[Float64[ndarray, "n c 3"], Float64[ndarray, "n c 3"], Float64[ndarray, "n c"]]:
        """(origins, unit directions, shares of the lobe's reflectance, of sum 1 with those from below the surface, which are 0)."""
        points, normals, texels = self.points[chosen], self.normals[chosen], self.pixels.texels[chosen]
        alpha = self.pixels.alpha[texels]
        tangent, bitangent = frames(normals)
        basis = np.stack([tangent, bitangent, normals], axis=1)  # rows
        view = np.einsum("nik,nk->ni", basis, self.pixels.view(points))
        view[:, 2] = np.maximum(view[:, 2], 1e-3)
        view /= np.linalg.norm(view, axis=1, keepdims=True)
        square = (np.arange(count)[None, :, None] * np.array(GOLDEN) + rng.uniform(size=(len(chosen), 1, 2))) % 1
        light, VoH, weight = sampled(np.repeat(view[:, None], count, axis=1), alpha, square)
        _, grazing = albedo_terms(view[:, 2], alpha)
        row = np.repeat(np.arange(len(chosen)), count)
        color, share = self.pixels.color[texels], self.pixels.share[texels]
        term = fresnel(VoH.ravel(), color[row], share[row], grazing[row]).mean(axis=1).reshape(-1, count)
        shares = weight * term
        shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1e-30)
        directions = np.einsum("nci,nik->nck", light, basis)
        origins = np.broadcast_to((points + lift * normals)[:, None], directions.shape)
        return origins, directions, shares
