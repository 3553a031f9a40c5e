"""Form factors from rays: what share of a point's hemisphere, weighted by the cosine, each surfel fills."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float
from srbf.compute.threads import each
from srbf.visibility.environment_cells import EnvironmentRows, Openings
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.surface_cells import OFFSET
from srbf.visibility.surfels import Surfels

if TYPE_CHECKING:
    from scipy.sparse import csr_array

RAYS = 1 << 18  # traced at a time


@dataclass(frozen=True, eq=False)
class RayOrigins:
    """q points of each of n receivers, unit normals, and weights of the points in their receiver's mean."""

    points: Float[ndarray, "n q 3"]
    normals: Float[ndarray, "n q 3"]
    weights: Float[ndarray, "n q"]

    @staticmethod
    def even(points: Float[ndarray, "n q 3"], normals: Float[ndarray, "n q 3"]) -> RayOrigins:
        """Points that weigh the same."""
        return RayOrigins(points, normals, np.ones(points.shape[:2]))


def form_factors(
    surfels: Surfels, origins: RayOrigins, rays: int, seed: int = 0, progress: Callable[[int], None] = lambda done: None
) -> csr_array:
    """(n, S) float32: shares of cosine-distributed rays from each receiver, `rays` from every point, that meet each surfel.

    So irradiance at the receivers is this times the radiosity of the surfels; the rest of the rays meets black or nothing. All rays of a
    receiver are one stratified set, shifted at random by `seed`. `progress` counts receivers.
    """
    return _traced(surfels, origins, rays, seed, progress, None)[0]


def factors_and_environment(
    surfels: Surfels, openings: Openings, origins: RayOrigins, rays: int, seed: int = 0
) -> tuple[csr_array, EnvironmentRows]:
    """`form_factors`, and of the rays that leave the scene the shares that come from each cell of the environment."""
    factors, environment = _traced(surfels, origins, rays, seed, lambda done: None, openings)
    assert environment is not None
    return factors, environment


def _traced(
    surfels: Surfels, origins: RayOrigins, rays: int, seed: int, progress: Callable[[int], None], openings: Openings | None
) -> tuple[csr_array, EnvironmentRows | None]:
    from scipy.sparse import csr_array, vstack

    count, of_each = origins.weights.shape
    size = float(np.ptp(surfels.cells.places, axis=0).max(initial=0))
    batch = max(1, RAYS // (rays * of_each))
    starts = list(range(0, count, batch))
    parts: list[csr_array] = [None] * len(starts)
    environments: list[Any] = [None] * len(starts)
    done = [0]

    def trace(number: int) -> None:
        part = slice(starts[number], starts[number] + batch)
        normals = np.asarray(origins.normals[part], np.float64)
        weights = np.asarray(origins.weights[part], np.float64)
        places = origins.points[part] + OFFSET * size * normals
        directions = cosine_directions(normals, rays, np.random.default_rng([seed, number])).reshape(-1, 3)
        places = np.repeat(places.reshape(-1, 3), rays, axis=0)
        surfel, met = surfels.met_along(places, directions)
        shares = np.repeat(weights / (rays * np.maximum(weights.sum(axis=1, keepdims=True), 1e-30)), rays)
        row = np.repeat(np.arange(len(weights)), rays * of_each)
        if openings is not None:
            environments[number] = openings.rows(len(weights), row, shares, places, directions, met)
        known = surfel >= 0
        matrix = csr_array((shares[known].astype(np.float32), (row[known], surfel[known])), shape=(len(weights), surfels.count))
        matrix.sum_duplicates()
        parts[number] = matrix
        done[0] += len(weights)
        progress(min(done[0], count))

    each(trace, len(starts))
    if not parts:
        return csr_array((0, surfels.count), dtype=np.float32), None if openings is None else EnvironmentRows.none(0, openings.channels)
    return vstack(parts, format="csr"), None if openings is None else EnvironmentRows.stacked(environments)
