"""A deep framebuffer: what each part of a view gathers from a pool of surfels, and these from each other, traced once, for any light.

The paper stores gather samples for each pixel [Hasan2005]; here all pixels share one pool, in which later bounces live as well.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.errors import ImageError
from srbf.io import files
from srbf.io.image import read_image, write_image
from srbf.visibility.behind import Behind
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.form_factors import RayOrigins, form_factors
from srbf.visibility.glossy_gather import GlossyGather, Lobes
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.sparse_links import SparseLinks
from srbf.visibility.surface_cells import Cells
from srbf.visibility.surfels import Surfels
from srbf.visibility.view_clusters import MOST_CLUSTERS, ViewClusters

POOL_FILE = "pool.exr"
GATHER_FILE = "gather.npz"
BEHIND = ("behind_nearest", "behind_weights")
VIEW_RAYS, MOST_VIEW_RAYS = 512, 2048  # of a view cluster: more where there are fewer than DEFAULT_CLUSTERS
SURFEL_RAYS = 64
SURFEL_POINTS = 4  # of a surfel, that its rays start from
ROWS = 1 << 12  # traced between two reports of progress
DEFAULT_CLUSTERS = 20_000  # of a view with more pixels
Progress = Callable[[int, int], None]  # (rows done, of how many)


@dataclass(frozen=True, eq=False)
class GatherOperator:
    """Links from C view clusters to a pool of S surfels, and between surfels; `nearest` (P, K) clusters of every pixel, `weights` of each.

    Irradiance at clusters is `view` times the radiosity of the pool, in pixels the weighted sum over their clusters. `gloss`: what specular
    lobes gather, where there are any. `behind`: as `nearest` and `weights`, of what falls on the backs of pixels that let light through.
    `points`: places (m) and normals of the clusters, None of older captures. `specular_albedo`: what surfels reflect, beyond their albedo,
    where a lobe sees them. `objects`: the number of each surfel's object, 0 where the bake did not keep them.
    """

    cells: Cells
    view: SparseLinks
    exchange: SparseLinks
    nearest: Int[ndarray, "P K"]
    weights: Float32[ndarray, "P K"]
    gloss: GlossyGather | None = None
    behind: tuple[Int[ndarray, "P K"], Float32[ndarray, "P K"]] | None = None
    points: Float32[ndarray, "2 C 3"] | None = None
    specular_albedo: Float32[ndarray, "S 3"] | None = None
    objects: Int[ndarray, " S"] | None = None

    @staticmethod
    def traced(
        pool: Surfels,
        pixels: PixelPoints,
        occluders: EmbreeTriangles,
        clusters: int,
        seed: int = 0,
        progress: Progress = lambda done, total: None,
        lobes: Lobes | None = None,
        backs: PixelPoints | None = None,
    ) -> GatherOperator:
        """By cosine rays from every cluster and surfel, and by rays of the density of specular lobes.

        `backs`: points behind translucent pixels. What these let through has clusters and surfels of its own, after the others.
        """
        extent = float(np.ptp(pool.cells.places, axis=0).max(initial=0))
        passing, behind = Behind.of(pool), None
        of_backs = 0 if backs is None else max(1, int(clusters * len(np.unique(backs.pixels)) / len(np.unique(pixels.pixels))))
        found = ViewClusters.of_pixels(pixels, min(clusters, MOST_CLUSTERS - of_backs), extent)
        nearest, weights = found.of_each(pixels, occluders)
        if backs is not None:
            own = ViewClusters.of_pixels(backs, of_backs, extent)
            back_nearest, back_weights = own.of_each(backs, occluders)
            behind = np.where(back_weights > 0, back_nearest + len(found.places), 0), back_weights
            found = ViewClusters(np.concatenate([found.places, own.places]), np.concatenate([found.normals, own.normals]), found.scale)
        total = len(found.places) + pool.count + len(passing.surfels)
        rays = int(np.clip(VIEW_RAYS * DEFAULT_CLUSTERS // max(1, len(found.places)), VIEW_RAYS, MOST_VIEW_RAYS))
        origins = RayOrigins.even(found.places[:, None], found.normals[:, None])
        view = _traced(pool, passing, origins, rays, seed, lambda n: progress(n, total))
        spread, facing = pool.spread(SURFEL_POINTS, seed)
        spread, facing = (np.concatenate([every, sign * every[passing.surfels]]) for every, sign in ((spread, 1), (facing, -1)))
        exchange = _traced(
            pool, passing, RayOrigins.even(spread, facing), SURFEL_RAYS, seed + 1, lambda n: progress(len(found.places) + n, total)
        )
        gloss = None if lobes is None else GlossyGather.traced(pool, lobes, seed=seed + 2, passing=passing)
        points = np.stack([found.places, found.normals]).astype(np.float32)
        specular_albedo = None if pool.gloss is None or gloss is None else np.pad(pool.gloss, ((0, len(passing.surfels)), (0, 0)))
        objects = np.concatenate([pool.objects, pool.objects[passing.surfels]])
        cells = passing.with_backs(pool.cells)
        return GatherOperator(cells, view, exchange, nearest, weights, gloss, behind, points, specular_albedo, objects)

    def write(self, folder: Path, key: str) -> None:
        """pool.exr and gather.npz; `key` tells what they are of."""
        write_image(folder / POOL_FILE, self.pool_image(), "float")
        arrays = {
            **self.view.arrays("view"),
            **self.exchange.arrays("exchange"),
            "nearest": self.nearest.astype(np.uint16),
            "weights": self.weights.astype(np.float16),
            **({} if self.gloss is None else self.gloss.arrays()),
            **({} if self.points is None else {"points": self.points}),
            **({} if self.behind is None else {BEHIND[0]: self.behind[0].astype(np.uint16), BEHIND[1]: self.behind[1].astype(np.float16)}),
        }
        with files.atomic_path(folder / GATHER_FILE) as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, key=np.array(key), **arrays)

    def pool_image(self) -> Float32[ndarray, "n S 4"]:
        """Rows (x, y, z, area), (normal, 0), (albedo, object), and (what lobes see beyond it, 0) where there is any."""
        objects = np.zeros(len(self.cells.places)) if self.objects is None else self.objects
        rows = [*self.cells.image(), np.column_stack([self.cells.albedo, objects])]
        if self.specular_albedo is not None:
            rows.append(np.pad(self.specular_albedo, ((0, 0), (0, 1))))
        return np.stack(rows).astype(np.float32)

    @staticmethod
    def read(folder: Path) -> GatherOperator:
        """ImageError where the files are missing, damaged, or not of one bake."""
        path = folder / GATHER_FILE
        image = read_image(folder / POOL_FILE, 4)
        if len(image) not in (3, 4):
            raise ImageError(f"expected 3 or 4 rows in {folder / POOL_FILE}, found {len(image)}; bake again with `force=True`")
        count = image.shape[1]
        try:
            with np.load(path) as stored:
                arrays = {name: stored[name] for name in stored.files}
            view, own = (SparseLinks.of_arrays(arrays, name, count) for name in ("view", "exchange"))
            nearest, weights = arrays["nearest"].astype(np.int64), arrays["weights"].astype(np.float32)
            if own.rows != count or int(nearest.max(initial=0)) >= view.rows or nearest.shape != weights.shape:
                raise ValueError("rows that fit each other")
            gloss = GlossyGather.of_arrays(arrays, count)
            behind = None
            if BEHIND[0] in arrays:
                behind = arrays[BEHIND[0]].astype(np.int64), arrays[BEHIND[1]].astype(np.float32)
                if int(behind[0].max(initial=0)) >= view.rows or behind[0].shape != behind[1].shape or len(behind[0]) != len(nearest):
                    raise ValueError("backs that fit their pixels")
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as error:
            raise ImageError(f"expected links of a view in {path}, found none to read; bake again with `force=True`") from error
        cells = replace(Cells.of_image(image[:2]), albedo=np.ascontiguousarray(image[2, :, :3]))
        points = arrays.get("points")
        if points is not None and points.shape != (2, view.rows, 3):
            raise ImageError(f"expected places of {view.rows} clusters in {path}, found {points.shape}; bake again with `force=True`")
        specular_albedo = np.ascontiguousarray(image[3, :, :3]) if len(image) > 3 else None
        objects = np.round(image[2, :, 3]).astype(np.int64)
        return GatherOperator(cells, view, own, nearest, weights, gloss, behind, points, specular_albedo, objects)


def is_gathered(folder: Path, key: str) -> bool:
    """Whether a folder has the links of this `key`."""
    try:
        with np.load(folder / GATHER_FILE) as stored:
            return (folder / POOL_FILE).is_file() and str(stored["key"]) == key
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
        return False


def cluster_count(asked: int | None, pixels: int, most: int = DEFAULT_CLUSTERS) -> int:
    """How many view clusters: those asked for, or one a pixel up to `most`."""
    return min(pixels, most if asked is None else asked)


def _traced(pool: Surfels, passing: Behind, origins: RayOrigins, rays: int, seed: int, progress: Callable[[int], None]) -> SparseLinks:
    from scipy.sparse import csr_array, vstack

    parts = [csr_array((0, pool.count), dtype=np.float32)]
    for start in range(0, len(origins.points), ROWS):
        part = slice(start, start + ROWS)
        own = RayOrigins(origins.points[part], origins.normals[part], origins.weights[part])
        parts.append(form_factors(pool, own, rays // own.weights.shape[1], (seed * 0x9E3779B1 + start * 0x85EBCA77) & 0x7FFFFFFF))
        progress(min(start + ROWS, len(origins.points)))
    return SparseLinks.of_shares(passing.met(vstack(parts, format="csr")), rays)
