"""Numpy twins of the functions of `glsl/shadow/` for lights inside the scene, which tests compare."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Int


def cube_face(from_light: Float[ndarray, "n 3"]) -> Int[ndarray, " n"]:
    """The face of a cube about a point light that each place is seen through: 0 +x, 1 -x, 2 +y, 3 -y, 4 +z, 5 -z.

    A place on an edge belongs to the face of the first axis.
    """
    axis = np.abs(from_light).argmax(axis=1)
    return 2 * axis + (np.take_along_axis(from_light, axis[:, None], 1)[:, 0] < 0)


def place(
    from_light: Float[ndarray, "n 3"],
    across: Float[ndarray, " 3"],
    up: Float[ndarray, " 3"],
    ahead: Float[ndarray, " 3"],
    reach: float,
) -> Float[ndarray, "n 3"]:
    """Coordinates (0 to 1) on a perspective map of half-angle atan(`reach`), and one over the depth (1/m) [Williams1978].

    One over the depth of a plane is linear on the map: what `srbf.visibility.shadow.fraction` takes as a height.
    """
    nearness = 1 / (from_light @ ahead)
    tangents = np.stack([from_light @ across, from_light @ up], axis=-1) * nearness[..., None]
    return np.concatenate([tangents / (2 * reach) + 0.5, nearness[..., None]], axis=-1)


def slope(
    from_light: Float[ndarray, "n 3"],
    normal: Float[ndarray, "n 3"],
    across: Float[ndarray, " 3"],
    up: Float[ndarray, " 3"],
    steepest: Float[ndarray, " n"],
) -> Float[ndarray, "n 2"]:
    """How one over the depth (1/m) of each receiver's plane rises over a perspective map, per unit of the tangent [Reeves1987]."""
    offset = np.einsum("nc,nc->n", normal, from_light)
    rise = np.stack([normal @ across, normal @ up], axis=-1) / offset[:, None]
    return np.clip(rise, -steepest[:, None], steepest[:, None])
