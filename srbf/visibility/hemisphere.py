"""Directions over hemispheres, as diffuse surfaces send and receive light."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.visibility.surface_cells import frames

GOLDEN = (0.7548776662466927, 0.5698402909980532)  # steps of the additive sequence R2 [Roberts2018]


def cosine_directions(normals: Float64[ndarray, "n q 3"], count: int, rng: np.random.Generator) -> Float64[ndarray, "n q c 3"]:
    """`count` directions around each normal, of density cosine / pi: those of q normals together an even set, shifted at random."""
    of_each = normals.shape[1]
    steps = np.arange(count)[None, :, None] * of_each + np.arange(of_each)[:, None, None]
    u, v = np.moveaxis((steps[None] * np.array(GOLDEN) + rng.uniform(size=(len(normals), 1, 1, 2))) % 1, 3, 0)
    radius, angle = np.sqrt(u), 2 * np.pi * v
    tangent, bitangent = (axis.reshape(normals.shape) for axis in frames(normals.reshape(-1, 3)))
    return (
        (radius * np.cos(angle))[..., None] * tangent[:, :, None]
        + (radius * np.sin(angle))[..., None] * bitangent[:, :, None]
        + np.sqrt(np.maximum(1 - u, 0))[..., None] * normals[:, :, None]
    )
