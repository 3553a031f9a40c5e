"""Gather samples of view clusters: what each part of a view sees of the scene, as a few weighted points that are lit [Hasan2005].

The form of the paper. `srbf.visibility.gather_operator` shares one pool of surfels among all clusters in place of samples of each.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float16, Float32, Float64, Int
from srbf.compute.threads import each
from srbf.errors import ImageError
from srbf.io import files
from srbf.lights import Light
from srbf.solve.two_phase_kmeans import two_phase, two_phase_sets
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.glossy_gather import Lobes
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.received import ReceivedLight
from srbf.visibility.receivers import Receivers
from srbf.visibility.surface_cells import OFFSET, Cells, Fragments
from srbf.visibility.view_clusters import ONE_WAY, ViewClusters

SAMPLES_FILE = "gather_samples.npz"
RAYS = 2000  # of a view cluster, from which its samples are made [Hasan2005, section 5]
FEWEST = 8  # samples
DEFAULT_CLUSTERS = 40_000  # of a view with more pixels [Hasan2005, section 5]
OPPOSITE = 0.5  # what a normal counts, of the scene's longest side: opposite ones are as distant as points across the scene
AT_ONCE = 1 << 18  # rays, or samples that are lit
STEPS = 65_535  # of a coordinate in the scene's box
NO_AREA = 1e-9  # square meters: a sample is a point
SAMPLE_BYTES = 18  # [Hasan2005, section 4]
LINK_BYTES = 3  # of a pixel, for each of its clusters
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Hits:
    """What N rays of each of B clusters meet: points (m), unit normals toward the ray, albedo, and the ray's share; 0 of rays that miss."""

    points: Float32[ndarray, "B N 3"]
    normals: Float32[ndarray, "B N 3"]
    albedo: Float32[ndarray, "B N 3"]
    shares: Float32[ndarray, "B N"]


@dataclass(frozen=True, eq=False)
class Samples:
    """G gather samples of each of B clusters: points (m), unit normals, and reflectance, which is albedo times the sample's weight.

    Irradiance of a cluster is the sum of reflectance times the irradiance of its samples [Hasan2005, eq. 3].
    """

    points: Float32[ndarray, "B G 3"]
    normals: Float32[ndarray, "B G 3"]
    reflectance: Float32[ndarray, "B G 3"]

    @staticmethod
    def of_hits(hits: Hits, count: int, scale: float) -> Samples:
        """At most `count` of each cluster, by two-phase k-means of its hits on place and normal; `scale`: what a normal counts, m.

        A sample is at the hit nearest to the middle of its group, with its mean normal and albedo, and has the shares of its rays
        [Hasan2005, section 3.3.2]. Samples beyond the number of hits are black.
        """
        sets, rays = hits.shares.shape
        count = min(count, rays)
        features = np.concatenate([hits.points, np.float32(scale) * hits.normals], axis=2)
        labels = two_phase_sets(features, hits.shares > 0, count)
        known = np.flatnonzero(labels.ravel() >= 0)
        flat = (labels + count * np.arange(sets)[:, None]).ravel()[known]
        order = np.argsort(flat, kind="stable")
        known, flat = known[order], flat[order]
        used, begins = np.unique(flat, return_index=True)
        made = [np.zeros((sets * count, 3), np.float32) for _ in range(3)]
        if len(used):
            size = np.diff(np.append(begins, len(flat)))
            share = hits.shares.reshape(-1)[known].astype(np.float64)[:, None]
            point, normal, albedo = (own.reshape(-1, 3)[known].astype(np.float64) for own in (hits.points, hits.normals, hits.albedo))
            weight = np.add.reduceat(share, begins)
            middle = np.add.reduceat(point * share, begins) / weight
            away = ((point - np.repeat(middle, size, axis=0)) ** 2).sum(axis=1)
            least = np.flatnonzero(away == np.repeat(np.minimum.reduceat(away, begins), size))
            nearest = least[np.searchsorted(least, begins)]
            mean = np.add.reduceat(normal * share, begins)
            length = np.linalg.norm(mean, axis=1, keepdims=True)
            made[0][used] = point[nearest]
            made[1][used] = np.where(length > ONE_WAY * weight, mean / np.maximum(length, 1e-30), normal[nearest])
            made[2][used] = np.add.reduceat(albedo * share, begins)
        places, facing, reflectance = (own.reshape(sets, count, 3) for own in made)
        return Samples(places, facing, reflectance)


@dataclass(frozen=True, eq=False)
class GatheredSamples:
    """G samples of each of C view clusters, and the K clusters that every pixel mixes, with weights that sum to 1 or are 0.

    `places` (C, G, 3) uint16 are in STEPS of the `box` (m, its corners). The last clusters gather for specular lobes, from `diffuse` on:
    `gloss_nearest` numbers them from 0, and a pixel's radiance is its specular reflectance times their mean irradiance, over pi.
    """

    places: ndarray
    box: Float64[ndarray, "2 3"]
    normals: Float16[ndarray, "C G 3"]
    reflectance: Float16[ndarray, "C G 3"]
    diffuse: int
    nearest: Int[ndarray, "P K"]
    weights: Float32[ndarray, "P K"]
    gloss_nearest: Int[ndarray, "P L"] | None = None
    gloss_weights: Float32[ndarray, "P L"] | None = None

    @property
    def lobes(self) -> int:
        return len(self.places) - self.diffuse

    @staticmethod
    def traced(
        surfaces: Fragments,
        receivers: Receivers,
        clusters: int,
        count: int,
        seed: int = 0,
        progress: Progress = lambda done, total: None,
    ) -> GatheredSamples:
        """By RAYS rays of each of `clusters` view clusters, `count` samples each. Memory: the result, and blocks of AT_ONCE rays.

        Clusters are for diffuse light and for lobes as their energies in the view are, by two-phase k-means of the pixels' centers. The
        weight of a pixel's clusters is (1 - d / 1.1 d_10)^2: the paper says that they are radial basis functions, and not which.
        """
        pixels, lobes = PixelPoints.of_centers(receivers), Lobes.of(receivers)
        corners = np.concatenate([surfaces.corners.reshape(-1, 3), pixels.points.astype(np.float32)])
        box = np.stack([corners.min(axis=0), corners.max(axis=0)]).astype(np.float64)
        extent = float((box[1] - box[0]).max())
        scale, lift = OPPOSITE * extent, OFFSET * extent
        of_lobes = 0 if lobes is None else lobe_clusters(receivers, clusters, len(lobes.points))
        _, own = clusters_of(pixels.points, pixels.normals, max(1, clusters - of_lobes), scale)
        nearest, weights = pixels.gathered(*own.mixed(pixels.points, pixels.normals))
        diffuse = len(own.places)
        chosen, gloss = np.zeros(0, np.int64), None
        if lobes is not None:
            chosen, groups = clusters_of(lobes.points, lobes.normals, of_lobes, scale)
            gloss = lobes.of_pixels(*groups.mixed(lobes.points, lobes.normals))
        total = diffuse + len(chosen)
        places = np.zeros((total, count, 3), np.uint16)
        normals, reflectance = (np.zeros((total, count, 3), np.float16) for _ in range(2))
        triangles, facing = EmbreeTriangles(surfaces.corners), surfaces.normals
        rows = max(1, AT_ONCE // RAYS)
        blocks = [(start, min(start + rows, diffuse)) for start in range(0, diffuse, rows)]
        blocks += [(start, min(start + rows, total)) for start in range(diffuse, total, rows)]
        done = [0]

        def gather(number: int) -> None:
            start, stop = blocks[number]
            rng = np.random.default_rng([seed, start])
            if start < diffuse:
                axes = own.normals[start:stop]
                directions = cosine_directions(axes[:, None], RAYS, rng)[:, 0]
                origins = np.broadcast_to((own.places[start:stop] + lift * axes)[:, None], directions.shape)
                shares = np.full(directions.shape[:2], 1 / RAYS)
            else:
                assert lobes is not None
                origins, directions, shares = lobes.rays(chosen[start - diffuse : stop - diffuse], RAYS, rng, lift)
            found = Samples.of_hits(_met(triangles, facing, surfaces.albedo, origins, directions, shares), count, scale)
            made = found.points.shape[1]
            places[start:stop, :made] = np.round((found.points - box[0]) / np.maximum(box[1] - box[0], 1e-12) * STEPS).clip(0, STEPS)
            normals[start:stop, :made], reflectance[start:stop, :made] = found.normals, found.reflectance
            done[0] += stop - start
            progress(min(done[0], total), total)

        each(gather, len(blocks))
        return GatheredSamples(places, box, normals, reflectance, diffuse, nearest, weights, *(gloss or ()))

    def write(self, folder: Path, key: str) -> None:
        """gather_samples.npz; `key` tells what it is of."""
        gloss = self.gloss_nearest, self.gloss_weights
        arrays = {"places": self.places, "box": self.box, "normals": self.normals, "reflectance": self.reflectance}
        arrays |= {"diffuse": np.array(self.diffuse)}
        for name, nearest, weights in (("", self.nearest, self.weights), ("gloss_", *gloss)):
            if nearest is not None and weights is not None:
                arrays |= {f"{name}nearest": nearest.astype(np.uint16), f"{name}weights": weights.astype(np.float16)}
        with files.atomic_path(folder / SAMPLES_FILE) as temporary, open(temporary, "wb") as file:
            np.savez(file, key=np.array(key), **arrays)

    @staticmethod
    def read(folder: Path) -> GatheredSamples:
        """ImageError where the file is missing, damaged, or of parts that do not fit."""
        path = folder / SAMPLES_FILE
        try:
            with np.load(path) as stored:
                arrays = {name: stored[name] for name in stored.files}
            mixed = [
                (arrays[f"{name}nearest"].astype(np.int64), arrays[f"{name}weights"].astype(np.float32))
                for name in ("", "gloss_")
                if f"{name}nearest" in arrays
            ]
            places, diffuse = arrays["places"], int(arrays["diffuse"])
            fits = places.shape == arrays["normals"].shape == arrays["reflectance"].shape
            for (near, own), most in zip(mixed, (diffuse, len(places) - diffuse), strict=False):
                fits &= near.shape == own.shape and int(near.max(initial=0)) < most
            if not fits:
                raise ValueError("samples that fit each other")
            (nearest, weights), *gloss = mixed
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as error:
            raise ImageError(f"expected gather samples of a view in {path}, found none to read; bake again with `force=True`") from error
        return GatheredSamples(places, arrays["box"], arrays["normals"], arrays["reflectance"], diffuse, nearest, weights, *sum(gloss, ()))


def is_sampled(folder: Path, key: str) -> bool:
    """Whether a folder has the samples of this `key`."""
    try:
        with np.load(folder / SAMPLES_FILE) as stored:
            return str(stored["key"]) == key
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
        return False


def light_on_clusters(
    places: ndarray,
    box: Float64[ndarray, "2 3"],
    normals: Float16[ndarray, "C G 3"],
    reflectance: Float16[ndarray, "C G 3"],
    occluders: EmbreeTriangles,
    lights: Sequence[Light],
) -> Float64[ndarray, "C 3"]:
    """The irradiance of every cluster, one bounce of all lights together: sum_j reflectance_j e_j, visibility of each sample by a ray.

    Memory: blocks of AT_ONCE samples.
    """
    count = places.shape[1]
    rows = max(1, AT_ONCE // count)
    starts = range(0, len(places), rows)
    lift = OFFSET * float((box[1] - box[0]).max())
    total = np.zeros((len(places), 3))

    def light_up(number: int) -> None:
        part = slice(starts[number], starts[number] + rows)
        reflects = reflectance[part].reshape(-1, 3).astype(np.float32)
        kept = np.flatnonzero(reflects.any(axis=1))
        points = (box[0] + places[part].reshape(-1, 3)[kept] * ((box[1] - box[0]) / STEPS)).astype(np.float32)
        facing = normals[part].reshape(-1, 3)[kept].astype(np.float32)
        cells = Cells(points, facing, np.full(len(kept), NO_AREA, np.float32), reflects[kept], np.zeros(len(kept), np.int64))
        received = ReceivedLight(cells, occluders, lift)
        found = np.zeros((len(kept), 3))
        for light in lights:
            found += received.irradiance(light)
        row = kept // count
        for c in range(3):
            total[part, c] = np.bincount(row, reflects[kept, c] * found[:, c], len(reflects) // count)

    each(light_up, len(starts))
    return total


def clusters_of(
    points: Float[ndarray, "P 3"], normals: Float[ndarray, "P 3"], count: int, scale: float
) -> tuple[Int[ndarray, " C"], ViewClusters]:
    """(numbers of the points that clusters are at, the clusters): at most `count` by two-phase k-means on place and normal.

    A cluster is at the point nearest to its middle, with the mean normal [Hasan2005, section 3.3.2], or that point's own where they differ.
    """
    labels = two_phase(np.concatenate([np.asarray(points, np.float64), scale * np.asarray(normals, np.float64)], axis=1), count)
    size = np.bincount(labels)
    middle, mean = (np.stack([np.bincount(labels, own) for own in of.T], axis=1) / size[:, None] for of in (points, normals))
    away = ((points - middle[labels]) ** 2).sum(axis=1)
    chosen = np.lexsort((away, labels))[np.cumsum(size) - size]
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-30)
    own = np.asarray(normals, np.float64)[chosen]
    agrees = np.einsum("nk,nk->n", own, mean) >= ONE_WAY
    return chosen, ViewClusters(np.asarray(points, np.float64)[chosen], np.where(agrees[:, None], mean, own), scale)


def lobe_clusters(receivers: Receivers, clusters: int, lobes: int) -> int:
    """How many of the clusters gather for specular lobes: by the energy that pixels reflect so in even light [Hasan2005, section 3.3.2]."""
    specular, diffuse = (float(receivers.images[name].sum(dtype=np.float64)) for name in ("glossy", "albedo"))
    share = specular / max(specular + diffuse, 1e-30)
    return int(np.clip(round(clusters * share), 1, max(1, min(lobes, clusters - 1))))


def _met(
    triangles: EmbreeTriangles,
    facing: Float64[ndarray, "T 3"],
    albedo: Float32[ndarray, "T 3"],
    origins: Float64[ndarray, "B N 3"],
    directions: Float64[ndarray, "B N 3"],
    shares: Float64[ndarray, "B N"],
) -> Hits:
    """Of rays from `origins` (m)."""
    shape = directions.shape
    start, toward = (own.reshape(-1, 3).astype(np.float32) for own in (origins, directions))
    triangle, distance, _ = triangles.first_hit(start, toward)
    met = triangle >= 0
    points = start + np.where(met, distance, 0)[:, None] * toward
    normals = facing[triangle].astype(np.float32)
    normals *= np.where(np.einsum("nk,nk->n", normals, toward) > 0, -1, 1).astype(np.float32)[:, None]
    own = np.where(met, shares.ravel(), 0).astype(np.float32).reshape(shape[:2])
    return Hits(points.reshape(shape), normals.reshape(shape), albedo[triangle].reshape(shape), own)
