"""The transfer operator of a scene: how much light surfels send to receivers and to each other, traced once, for any light."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.errors import ImageError
from srbf.io import files
from srbf.io.image import read_image, write_image
from srbf.visibility.aimed_factors import AimedFactors
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.environment_cells import EnvironmentRows, Openings
from srbf.visibility.form_factors import RayOrigins, factors_and_environment, form_factors
from srbf.visibility.lightmap_points import LightmapPoints
from srbf.visibility.receivers import Receivers, spread_points
from srbf.visibility.surface_cells import Cells
from srbf.visibility.surfels import Surfels

if TYPE_CHECKING:
    from scipy.sparse import csr_array

SURFELS_FILE = "surfels.exr"
OPERATOR_FILE = "operator.npz"
POINTS = 16  # of a receiver, and of a surfel
RAYS, FEWEST_RAYS, MOST_RAYS = 1.5e8, 768, 3072  # of all receivers; of each
SURFEL_RAYS = 2048
RECEIVERS = 1 << 14  # traced between two reports of progress
Progress = Callable[[int, int], None]  # (points done, of how many)


@dataclass(frozen=True, eq=False)
class TransferOperator:
    """Form factors from P receivers (P, S) and from surfels (S, S) to S surfels, sparse, float32.

    Irradiance at receivers is `receivers` times the radiosity of the surfels. `objects` (S,): the number of each surfel's object.
    `emission` (S, 3): radiance that it emits itself. `environment`: what the surfels see of it, S rows; None where no ray left the scene,
    or the capture is older than this.
    """

    cells: Cells
    objects: Int[ndarray, " S"]
    emission: Float32[ndarray, "S 3"]
    receivers: csr_array
    exchange: csr_array
    environment: EnvironmentRows | None = None

    @staticmethod
    def traced(
        surfels: Surfels, receivers: Receivers, is_lightmap: bool, seed: int = 0, progress: Progress = lambda done, total: None
    ) -> TransferOperator:
        """By rays from every surfel and every covered receiver; in a lightmap from points all over the footprint of each texel."""
        from scipy.sparse import csr_array, vstack

        coverage = receivers.images.get("coverage")
        texels = receivers.width * receivers.height
        chosen = np.arange(texels) if coverage is None else np.flatnonzero(coverage.ravel() > 0)
        rays = rays_of_each(len(chosen))
        points = _LightmapPoints(receivers, seed) if is_lightmap else _Centers(receivers)
        total = len(chosen) + surfels.count
        aimed = AimedFactors(surfels, seed)
        parts = [csr_array((0, surfels.count), dtype=np.float32)]
        for start in range(0, len(chosen), RECEIVERS):
            rows = chosen[start : start + RECEIVERS]
            origins = points.origins(rows)
            factors = form_factors(surfels, origins, rays // origins.weights.shape[1], _hash(seed, start))
            parts.append(aimed.put(factors, origins, len(chosen), _hash(seed, start)))
            progress(start + len(rows), total)
        spread = RayOrigins.even(*surfels.spread(POINTS, seed))
        own, environment = factors_and_environment(surfels, Openings(receivers.triangles), spread, SURFEL_RAYS // POINTS, _hash(seed, -1))
        own = aimed.put(own, spread, len(chosen), _hash(seed, -1))
        leave_gaps_out(own, surfels)
        progress(total, total)
        traced = vstack(parts, format="csr")
        counts = np.zeros(texels + 1, np.int64)
        counts[chosen + 1] = np.diff(traced.indptr)
        every = csr_array((traced.data, traced.indices, np.cumsum(counts)), shape=(texels, surfels.count))
        seen = environment if len(environment.cells) else None
        return TransferOperator(surfels.cells, surfels.objects, surfels.emission, every, own, seen)

    def write(self, folder: Path, key: str) -> None:
        """surfels.exr, rows (x, y, z, area), (normal, patch), (albedo, object) and, if any emits, (emission, 0), and operator.npz.

        `key` tells what they are of.
        """
        rows = [*self.cells.image(), np.column_stack([self.cells.albedo, self.objects])]
        if self.emission.any():
            rows.append(np.pad(self.emission, ((0, 0), (0, 1))))
        write_image(folder / SURFELS_FILE, np.stack(rows).astype(np.float32), "float")
        arrays = {}
        for name in ("receivers", "exchange"):
            matrix = getattr(self, name)
            arrays[f"{name}_starts"] = matrix.indptr.astype(np.int64)
            arrays[f"{name}_surfels"] = matrix.indices.astype(np.uint16)
            arrays[f"{name}_shares"] = matrix.data.astype(np.float16)
        if self.environment is not None:
            cells, shares = self.environment.cells.astype(np.uint16), self.environment.shares.astype(np.float16)
            arrays |= {
                "environment_side": np.array(self.environment.side),
                "environment_starts": self.environment.starts,
                "environment_cells": cells,
                "environment_shares": shares,
            }
        with files.atomic_path(folder / OPERATOR_FILE) as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, key=np.array(key), **arrays)

    @staticmethod
    def read(folder: Path) -> TransferOperator:
        """ImageError where the files are missing, damaged, or not of one bake."""
        from scipy.sparse import csr_array

        path = folder / OPERATOR_FILE
        image = read_image(folder / SURFELS_FILE, 4)
        if len(image) not in (3, 4):
            raise ImageError(f"expected 3 or 4 rows in {folder / SURFELS_FILE}, found {len(image)}; bake again with `force=True`")
        count = image.shape[1]
        found = {}
        try:
            with np.load(path) as stored:
                for name in ("receivers", "exchange"):
                    starts, surfels, shares = (stored[f"{name}_{part}"] for part in ("starts", "surfels", "shares"))
                    if surfels.max(initial=0) >= count:
                        raise ImageError(f"expected surfels below {count} in {path}, found {surfels.max()}; bake again with `force=True`")
                    found[name] = csr_array((shares.astype(np.float32), surfels.astype(np.int32), starts), shape=(len(starts) - 1, count))
                environment = _read_environment(stored, path)
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as error:
            raise ImageError(f"expected form factors of surfels in {path}, found none to read; bake again with `force=True`") from error
        cells = replace(Cells.of_image(image[:2]), albedo=np.ascontiguousarray(image[2, :, :3]))
        objects = np.round(image[2, :, 3]).astype(np.int64)
        emission = np.ascontiguousarray(image[3, :, :3]) if len(image) == 4 else np.zeros((count, 3), np.float32)
        return TransferOperator(cells, objects, emission, found["receivers"], found["exchange"], environment)


def _read_environment(stored: Any, path: Path) -> EnvironmentRows | None:
    """None where the file has none."""
    if "environment_starts" not in stored:
        return None
    side, starts, cells, shares = (stored[f"environment_{part}"] for part in ("side", "starts", "cells", "shares"))
    if cells.max(initial=0) >= side**2:
        raise ImageError(f"expected cells of the environment below {side**2} in {path}, found {cells.max()}; bake again with `force=True`")
    return EnvironmentRows(starts, cells.astype(np.int64), shares.astype(np.float32), int(side))


def rays_of_each(receivers: int) -> int:
    """How many rays start at each of so many receivers."""
    return int(np.clip(RAYS / max(1, receivers), FEWEST_RAYS, MOST_RAYS))


def leave_gaps_out(exchange: csr_array, surfels: Surfels) -> None:
    """Take what surfels exchange in gaps, where bounces stay, out of form factors between them (S, S)."""
    hidden = surfels.hidden[np.repeat(np.arange(surfels.count), np.diff(exchange.indptr))] | surfels.hidden[exchange.indices]
    exchange.data[hidden] = 0
    exchange.eliminate_zeros()


def is_traced(folder: Path, key: str) -> bool:
    """Whether a folder has the operator of this `key`."""
    try:
        with np.load(folder / OPERATOR_FILE) as stored:
            return (folder / SURFELS_FILE).is_file() and str(stored["key"]) == key
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
        return False


class _Centers:
    """The places that the receivers' images say."""

    def __init__(self, receivers: Receivers) -> None:
        self._positions, self._normals = (receivers.images[name].reshape(-1, 3).astype(np.float64) for name in ("position", "normal"))

    def origins(self, rows: Int[ndarray, " n"]) -> RayOrigins:
        return RayOrigins.even(self._positions[rows, None], _unit(self._normals[rows])[:, None])


class _LightmapPoints:
    """Points all over each texel's footprint, as a bake samples it."""

    def __init__(self, receivers: Receivers, seed: int) -> None:
        self._points = LightmapPoints(receivers, EmbreeTriangles(receivers.triangles.corners).first_hit)
        self._square = spread_points(POINTS)[:, :2]
        self._seed = seed

    def origins(self, rows: Int[ndarray, " n"]) -> RayOrigins:
        turn = np.random.default_rng(_hash(self._seed, int(rows[0]))).uniform(size=(len(rows), 2))
        found = [self._points.at(rows, (square + turn) % 1) for square in self._square]
        points, normals, weights = (np.stack([getattr(at, key) for at in found], axis=1) for key in ("point", "normal", "weight"))
        return RayOrigins(points, _unit(normals.astype(np.float64)), weights)


def _unit(vectors: Float64[ndarray, "*n 3"]) -> Float64[ndarray, "*n 3"]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def _hash(seed: int, number: int) -> int:
    """A seed of its own for each part."""
    return (seed * 0x9E3779B1 + number * 0x85EBCA77) & 0x7FFFFFFF
