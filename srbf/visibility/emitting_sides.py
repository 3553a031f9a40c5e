"""Sides of surfaces that emit to where no free place is: the back of a picture lights the wall that it hangs on."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Int
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.surface_cells import OFFSET, Fragments

RAYS = 32  # of each side


def lighting_others(
    both: Fragments, objects: Int[ndarray, " T"], emission: Float32[ndarray, "T 3"], narrow: float
) -> tuple[Bool[ndarray, " T"], Bool[ndarray, " T"]]:
    """(sides, the backs after the fronts, that emit to where other objects are; those of them that are nearer than `narrow` m to them).

    The inside of a tube lights nothing but the tube. A gap that is narrow is finer than surfels.
    """
    found, gap = np.zeros(len(both.corners), bool), np.zeros(len(both.corners), bool)
    own = np.flatnonzero(emission.any(axis=1) & (both.areas > 0))
    normals, size = both.normals[own], float(np.ptp(both.corners.reshape(-1, 3), axis=0).max(initial=0))
    starts = np.repeat(both.centers[own] + OFFSET * size * normals, RAYS, axis=0)
    directions = cosine_directions(normals[:, None], RAYS, np.random.default_rng(0))[:, 0].reshape(-1, 3)
    triangle, distance, _ = EmbreeTriangles(both.corners[: len(both.corners) // 2]).first_hit(starts, directions)
    other = ((triangle >= 0) & (objects[triangle] != np.repeat(objects[own], RAYS))).reshape(-1, RAYS)
    found[own] = other.any(axis=1)
    gap[own] = (other & (distance.reshape(-1, RAYS) < narrow)).mean(axis=1) > 0.5
    return found, gap
