"""The frame of a directional light's shadow map, and numpy twins of the functions of `glsl/shadow/`, which tests compare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.io.scene_glb import KNOTS
from srbf.lights import triple

TERMINATOR = 0.1  # cosine below which a smooth surface's light is looked up on the rounded surface [Hanika2021], Cycles' default


@dataclass(frozen=True)
class SunFrame:
    """An orthographic shadow map's frame: three orthonormal axes, and the square (low, extent; meters) that it covers."""

    across: tuple[float, float, float]
    up: tuple[float, float, float]
    to_light: tuple[float, float, float]
    low: tuple[float, float]
    extent: float

    @staticmethod
    def around(points: Float[ndarray, "n 3"], direction: Float64[ndarray, " 3"], margin: float = 0.01) -> SunFrame:
        """The frame of a light at `direction` whose square holds all `points`, plus a share `margin` on every side."""
        across = np.cross(direction, [1.0, 0.0, 0.0] if abs(direction[0]) < 0.9 else [0.0, 1.0, 0.0])
        across /= np.linalg.norm(across)
        up = np.cross(direction, across)
        flat = np.stack([points @ across, points @ up], axis=1)
        lowest, highest = flat.min(axis=0), flat.max(axis=0)
        extent = max(float((highest - lowest).max()), 1e-6) * (1 + 2 * margin)
        low = (lowest + highest - extent) / 2
        return SunFrame(triple(across), triple(up), triple(direction), (float(low[0]), float(low[1])), extent)


def place(
    point: Float[ndarray, "n 3"],
    across: Float[ndarray, " 3"],
    up: Float[ndarray, " 3"],
    to_light: Float[ndarray, " 3"],
    low: Float[ndarray, " 2"],
    extent: float,
) -> Float[ndarray, "n 3"]:
    """Map coordinates (0 to 1) and height towards the light (m) of points [Williams1978]."""
    flat = (np.stack([point @ across, point @ up], axis=-1) - low) / extent
    return np.concatenate([flat, (point @ to_light)[..., None]], axis=-1)


def fraction(
    heights: Float[ndarray, "H W"], uv: Float[ndarray, "n 2"], height: Float[ndarray, " n"], slope: Float[ndarray, "n 2"], bias: float
) -> Float[ndarray, " n"]:
    """The share of 3 x 3 texels that is not above a receiver whose plane rises by `slope` (m per texel) [Reeves1987]."""
    size = np.array(heights.shape[::-1])
    at = uv * size - 0.5
    base = np.floor(at)
    part = at - base
    lit = np.zeros(len(uv))
    for j in range(-1, 3):
        for i in range(-1, 3):
            weight = [1 - part[:, a] if k == -1 else part[:, a] if k == 2 else 1.0 for a, k in ((0, i), (1, j))]
            tap = base + [i, j]
            column, row = np.clip(tap, 0, size - 1).astype(int).T
            plane = height + ((tap - at) * slope).sum(axis=1)
            lit += (heights[row, column] <= plane + bias) * weight[0] * weight[1]
    return lit / 9


def transmittance(curve: Float[ndarray, "n KNOTS 3"], cosine: Float[ndarray, " n"]) -> Float[ndarray, "n 3"]:
    """Transmittance of one wall at a cosine between light and normal, from either side."""
    at = np.minimum(np.abs(cosine), 1) * (KNOTS - 1)
    knot = np.minimum(at.astype(int), KNOTS - 2)
    part = (at - knot).astype(curve.dtype)[:, None]
    rows = np.arange(len(curve))
    return curve[rows, knot] * (1 - part) + curve[rows, knot + 1] * part


def direct(normal: Float[ndarray, "n 3"], to_light: Float[ndarray, " 3"], visibility: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
    """N.L times visibility: the irradiance by a directional light of unit irradiance."""
    return np.maximum(normal @ to_light, 0)[:, None] * visibility


def rounded_share(NoL: Float[ndarray, " n"], NgL: Float[ndarray, " n"]) -> Float[ndarray, " n"]:
    """How far the lookup of a smooth surface moves from its triangle (0) to the rounded surface (1) [Hanika2021].

    `NoL`, `NgL`: cosines of the light to the shading normal and to the triangle's.
    """
    return np.clip(np.where(NoL < TERMINATOR, 2 - (NgL + NoL) / TERMINATOR, 1 - NgL / TERMINATOR), 0, 1)
