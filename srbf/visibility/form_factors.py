"""Form factors from rays: what share of a point's hemisphere, weighted by the cosine, each surfel fills."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.compute.threads import each
from srbf.visibility.surface_cells import OFFSET, frames
from srbf.visibility.surfels import Surfels

if TYPE_CHECKING:
    from scipy.sparse import csr_array

RAYS = 1 << 18  # traced at a time
GOLDEN = (0.7548776662466927, 0.5698402909980532)  # steps of the additive sequence R2 [Roberts2018]


def form_factors(
    surfels: Surfels,
    points: Float[ndarray, "n 3"],
    normals: Float[ndarray, "n 3"],
    rays: int,
    seed: int = 0,
    progress: Callable[[int], None] = lambda done: None,
) -> csr_array:
    """(n, S) float32: shares of `rays` cosine-distributed rays from each point that meet each surfel; the rest meets black or nothing.

    So irradiance at the points is this times the radiosity of the surfels. The rays of a point are a stratified set of its own, by
    `seed`. `progress` counts points.
    """
    from scipy.sparse import csr_array, vstack

    size = float(np.ptp(surfels.cells.places, axis=0).max(initial=0))
    batch = max(1, RAYS // rays)
    starts = list(range(0, len(points), batch))
    parts: list[csr_array] = [None] * len(starts)
    done = [0]

    def trace(number: int) -> None:
        part = slice(starts[number], starts[number] + batch)
        place, normal = np.asarray(points[part], np.float64), np.asarray(normals[part], np.float64)
        directions = cosine_directions(normal, rays, np.random.default_rng([seed, number]))
        origins = np.repeat(place + OFFSET * size * normal, rays, axis=0)
        flat = directions.reshape(-1, 3)
        surfel = surfels.seen_along(origins, flat)
        row = np.repeat(np.arange(len(place)), rays)[surfel >= 0]
        found = surfel[surfel >= 0]
        ones = np.full(len(found), 1 / rays, np.float32)
        matrix = csr_array((ones, (row, found)), shape=(len(place), surfels.count))
        matrix.sum_duplicates()
        parts[number] = matrix
        done[0] += len(place)
        progress(min(done[0], len(points)))

    each(trace, len(starts))
    if not parts:
        return csr_array((0, surfels.count), dtype=np.float32)
    return vstack(parts, format="csr")


def cosine_directions(normals: Float64[ndarray, "n 3"], count: int, rng: np.random.Generator) -> Float64[ndarray, "n c 3"]:
    """`count` directions around each normal, of density cosine / pi: an even set, shifted at random for each."""
    steps = np.arange(count)[:, None] * np.array(GOLDEN)
    u, v = np.moveaxis((steps[None] + rng.uniform(size=(len(normals), 1, 2))) % 1, 2, 0)
    radius, angle = np.sqrt(u), 2 * np.pi * v
    tangent, bitangent = frames(normals)
    return (
        (radius * np.cos(angle))[..., None] * tangent[:, None]
        + (radius * np.sin(angle))[..., None] * bitangent[:, None]
        + np.sqrt(np.maximum(1 - u, 0))[..., None] * normals[:, None]
    )
