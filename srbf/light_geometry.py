"""What lights are to a receiver: directions, strengths, and the samples that stand for lights with an extent."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.lights import AreaLight, PointLight, SpotLight
from srbf.sphere import Domain
from srbf.vectors import lengths

SPOT_SOFTNESS_MIN = 1e-6  # in cosine: an edge of inner = outer stays a step without dividing by zero
GOLDEN = (5**0.5 - 1) / 2
CONE_POINTS = 64  # of a sphere, by which the edge of its cone is known


def attenuation(distance: Float[ndarray, "*shape"], light: PointLight) -> Float[ndarray, "*shape"]:
    """a0/|L|, or its square, with |L| >= radius [Wong2005, fig. 10].

    Parameters
    ----------
    distance
        |L|, m, of any shape.
    light
        Gives `a0`, `falloff` and `radius`.

    Returns
    -------
    ndarray
        Of the same shape: the factor on the light's irradiance, 1 at the distance a0.

    Examples
    --------
    >>> from srbf.light_geometry import attenuation
    >>> attenuation(np.array([1.0, 2.0, 4.0]), PointLight((0, 0, 0), a0=2.0)).tolist()
    [2.0, 1.0, 0.5]
    """
    ratio = light.a0 / np.maximum(distance, light.radius)
    return ratio if light.falloff == "linear" else ratio * ratio


def spot_cone(cos_angle: Float[ndarray, "*shape"], cos_inner: float, cos_outer: float) -> Float[ndarray, "*shape"]:
    """Smoothstep from 0 at the outer half-angle to 1 at the inner one, in the cosine of the angle off the spot's axis.

    Parameters
    ----------
    cos_angle
        Cosine of the angle off the axis, of any shape.
    cos_inner, cos_outer
        Cosines of the half-angles, cos_inner >= cos_outer. Where they are equal the edge is a step.

    Returns
    -------
    ndarray
        Of the shape of `cos_angle`, 0 to 1.

    Examples
    --------
    >>> from srbf.light_geometry import spot_cone
    >>> spot_cone(np.array([1.0, 0.75, 0.5]), cos_inner=1.0, cos_outer=0.5).tolist()
    [1.0, 0.5, 0.0]
    """
    t = np.clip((cos_angle - cos_outer) / max(cos_inner - cos_outer, SPOT_SOFTNESS_MIN), 0, 1)
    return t * t * (3 - 2 * t)


def soft_cone(light: SpotLight, away: Float[ndarray, "n 3"], normals: Float[ndarray, "n 3"] | None = None) -> Float64[ndarray, " n"]:
    """What a spot's cone lets out to receivers: the mean over the solid angle of its sphere of the cone in each direction.

    Parameters
    ----------
    light
        Of any size; of size 0 this is `spot_cone`.
    away
        (n, 3) vectors from the middle of the light to the receivers, m.
    normals
        (n, 3) unit vectors of the receivers, whose cosines weigh the directions; None: all weigh the same.

    Returns
    -------
    ndarray
        (n,) float64, 0 to 1.

    Examples
    --------
    >>> from srbf.light_geometry import soft_cone
    >>> spot = SpotLight((0, 0, 2), direction=(0, 0, -1), inner=0.5, outer=0.5, size=0.3)
    >>> float(soft_cone(spot, 2 * np.array([[np.sin(0.5), 0, -np.cos(0.5)]]))[0].round(1))  # half of the sphere is past the edge
    0.5
    """
    edges, direction = (np.cos(light.inner), np.cos(light.outer)), np.array(light.direction)
    distance = lengths(away)
    axis = away / np.maximum(distance, 1e-30)[:, None]
    cosine = axis @ direction
    found = spot_cone(cosine, *edges)
    if light.size == 0:
        return found
    sine = np.minimum(light.size / np.maximum(distance, 1e-30), 1)
    off, reach = np.arccos(np.clip(cosine, -1, 1)), np.arcsin(sine)
    crossed = np.flatnonzero((off + reach > light.inner) & (off - reach < light.outer) & (sine > 0))
    if not len(crossed):
        return found
    axis, lowest = axis[crossed], np.sqrt(1 - sine[crossed] ** 2)
    across = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    across /= np.maximum(lengths(across), 1e-30)[:, None]
    frame = np.stack([axis, across, np.cross(axis, across)], axis=1)
    along = frame @ direction
    facing = None if normals is None else -np.einsum("nfk,nk->nf", frame, normals[crossed])
    total, whole = np.zeros((2, len(axis)))
    for i in range(CONE_POINTS):
        ahead = 1 - (i + 0.5) / CONE_POINTS * (1 - lowest)
        radius, turn = np.sqrt(np.maximum(1 - ahead**2, 0)), 2 * np.pi * GOLDEN * i
        part = np.stack([ahead, radius * np.cos(turn), radius * np.sin(turn)], axis=1)
        weight = np.ones(len(axis)) if facing is None else np.maximum(np.einsum("nf,nf->n", part, facing), 0)
        total += weight * spot_cone(np.einsum("nf,nf->n", part, along), *edges)
        whole += weight
    found[crossed] = total / np.maximum(whole, 1e-30)
    return found


def light_vectors(light: PointLight, positions: Float[ndarray, "*p 3"]) -> tuple[Float64[ndarray, "*p 3"], Float64[ndarray, "*p"]]:
    """Unit directions to a light and its strength: attenuation times a spot's cone [Wong2005, fig. 8-10].

    Parameters
    ----------
    light
        A point or spot light.
    positions
        (..., 3) of receivers in the light's frame, m.

    Returns
    -------
    directions
        (..., 3) float64 from the receivers to the light; 0 where a receiver is at the light.
    strength
        (...) float64, the factor on the light's irradiance, without a profile's.

    Examples
    --------
    >>> from srbf.light_geometry import light_vectors
    >>> directions, strength = light_vectors(PointLight((0.0, 0.0, 2.0)), np.zeros((1, 3), np.float32))
    >>> directions.tolist(), strength.tolist()
    ([[0.0, 0.0, 1.0]], [0.5])
    """
    vectors = np.array(light.position) - positions  # L = S - P, eq. 3
    distance = lengths(vectors)
    unit = vectors / np.maximum(distance, 1e-30)[..., None]
    strength = attenuation(distance, light)
    if isinstance(light, SpotLight):
        cos_angle = -(unit @ np.array(light.direction))
        strength = strength * spot_cone(cos_angle, np.cos(light.inner), np.cos(light.outer))
    return unit, strength


def environment_samples(
    image: Float32[ndarray, "H W 3"], domain: Domain, rotation: Float64[ndarray, "3 3"]
) -> tuple[Float64[ndarray, "H W 3"], Float64[ndarray, "H W"]]:
    """Directions of an equirectangular map's texel centers, and the solid angle of each texel.

    On the hemisphere only directions above the horizon count. Where z stays up this is exact: a row across the horizon is cut there,
    and its center moves to the middle of the remaining part.

    Parameters
    ----------
    image
        (H, W, 3), of which the size counts.
    domain
        `sphere` or `hemisphere`.
    rotation
        (3, 3): turns the directions.

    Returns
    -------
    directions
        (H, W, 3) float64 unit vectors in the world.
    solid_angle
        (H, W) float64, sr; 0 below the horizon of a hemisphere.

    Examples
    --------
    >>> from srbf.light_geometry import environment_samples
    >>> _, solid_angle = environment_samples(np.zeros((8, 16, 3), np.float32), "sphere", np.eye(3))
    >>> bool(np.isclose(solid_angle.sum(), 4 * np.pi))
    True
    """
    height, width = image.shape[:2]
    elevation = np.pi / 2 - np.arange(height + 1) * (np.pi / height)
    upright = np.allclose(rotation[2], [0, 0, 1])
    if domain == "hemisphere" and upright:
        elevation = np.maximum(elevation, 0)
    sine = np.sin(elevation)
    center = (elevation[:-1] + elevation[1:]) / 2
    azimuth = (0.5 - (np.arange(width) + 0.5) / width) * (2 * np.pi)
    horizontal, vertical = np.cos(center), np.sin(center)
    directions = np.empty((height, width, 3))
    directions[..., 0] = horizontal[:, None] * np.cos(azimuth)
    directions[..., 1] = horizontal[:, None] * np.sin(azimuth)
    directions[..., 2] = vertical[:, None]
    directions = directions @ rotation.T
    solid_angle = np.repeat((sine[:-1] - sine[1:])[:, None] * (2 * np.pi / width), width, axis=1)
    if domain == "hemisphere" and not upright:
        solid_angle = np.where(directions[..., 2] > 0, solid_angle, 0)
    return directions, solid_angle


def area_samples(light: AreaLight, count: int) -> tuple[Float64[ndarray, "n 3"], Float64[ndarray, " n"]]:
    """Points spread evenly over an area light, and the share of its area that each stands for.

    Parameters
    ----------
    light
        Of which position, u and v count.
    count
        At least 1; a golden lattice.

    Returns
    -------
    points
        (count, 3) float64, m.
    shares
        (count,) float64, of sum 1.

    Examples
    --------
    >>> from srbf.light_geometry import area_samples
    >>> points, shares = area_samples(AreaLight((0.0, 0.0, 2.0), u=(1.0, 0.0, 0.0), v=(0.0, 1.0, 0.0)), 16)
    >>> points.shape, float(shares.sum())
    ((16, 3), 1.0)
    """
    middle = np.arange(count) + 0.5
    return points_on(light, np.stack([middle / count, middle * GOLDEN % 1], axis=1)), np.full(count, 1 / count)


def points_on(light: AreaLight, square: Float64[ndarray, "n 2"]) -> Float64[ndarray, "n 3"]:
    """The points (m) of an area light at `square` in [0, 1]^2."""
    offset = square - 0.5
    return np.array(light.position) + offset[:, :1] * np.array(light.u) + offset[:, 1:] * np.array(light.v)
