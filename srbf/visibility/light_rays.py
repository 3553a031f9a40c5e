"""Where the shadow rays of samples go: towards a sun's disc, a point light, or points of a light with a size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.light_geometry import attenuation, light_vectors, points_on, spot_cone
from srbf.lights import AreaLight, DirectionalLight, PointLight, SphereLight, SpotLight, has_size, radius_of
from srbf.unshadowed import irradiance_from
from srbf.vectors import largest_component, lengths
from srbf.visibility.receivers import disc_points

SHORT_OF_LIGHT = 1e-4  # m, plus this share of the distance from the origin: rays end before the surface that glows
MIN_IMPORTANCE = 1e-6  # of samples whose point of the light is below their horizon

CastingLight = DirectionalLight | PointLight | AreaLight  # with a direct light of its own


@dataclass(frozen=True)
class LightRays:
    """n rays: unit vectors to the light, distance (m; None: endless), unshadowed irradiance (white light, without a spot's cone), what
    a spot's cone and a profile let out, and weight in the mean of its texel."""

    direction: Float[ndarray, "n 3"]
    distance: Float64[ndarray, " n"] | None
    irradiance: Float64[ndarray, " n"]
    opening: Float64[ndarray, "n 3"]
    importance: Float64[ndarray, " n"]


def has_extent(light: object, sun_angle: float) -> bool:
    """Whether a light's shadows are soft; `sun_angle`: of suns that do not say their own, rad."""
    return has_size(light) or (isinstance(light, DirectionalLight) and light.angle_or(sun_angle) > 0)


def rays_towards(
    light: CastingLight,
    point: Float32[ndarray, "n 3"],
    normal: Float32[ndarray, "n 3"],
    sun_angle: float,
    square: Callable[[], Float64[ndarray, "n 2"]],
) -> LightRays:
    """The rays of samples at `point`.

    `sun_angle`: of suns that do not say their own, rad. `square`: makes the place of each on a light with a size or on a sun's disc, in
    [0, 1)^2.
    A light with a size has its exact irradiance times the visible part: a ray counts as much as its point of the light would add. So
    samples that nothing shades have no noise.
    """
    if isinstance(light, AreaLight):
        vector = points_on(light, square()) - point
        distance = lengths(vector)
        unit = vector / np.maximum(distance, 1e-30)[:, None]
        added = np.maximum(-(unit @ np.array(light.direction)), 0) * _cosine(unit, normal) * light.a0**2 / np.maximum(distance, 1e-30) ** 2
        return _weighted(light, point, normal, unit, distance, added)
    if isinstance(light, SphereLight):
        return _towards_sphere(light, point, normal, square())
    if isinstance(light, SpotLight) and light.size > 0:
        rays = _towards_sphere(light.without_cone(), point, normal, square())
        cone = spot_cone(-(rays.direction @ np.array(light.direction)), np.cos(light.inner), np.cos(light.outer))
        return replace(rays, opening=cone[:, None] * light.factors(point - np.array(light.position)))
    if isinstance(light, PointLight):
        vector = np.array(light.position) - point
        distance = lengths(vector)
        unit = vector / np.maximum(distance, 1e-30)[:, None]
        opening = light.factors(-vector)
        if isinstance(light, SpotLight):
            opening = opening * spot_cone(-(unit @ np.array(light.direction)), np.cos(light.inner), np.cos(light.outer))[:, None]
        return LightRays(unit, distance, attenuation(distance, light) * _cosine(unit, normal), opening, np.ones(len(point)))
    axis = np.array(light.direction)
    unit = np.broadcast_to(axis, point.shape)
    if (angle := light.angle_or(sun_angle)) > 0:
        unit = _turned(unit, disc_points(square()) * np.tan(angle / 2))
    return LightRays(unit, None, _cosine(unit, normal), np.ones((len(point), 3)), np.ones(len(point)))


def _towards_sphere(
    light: PointLight, point: Float32[ndarray, "n 3"], normal: Float32[ndarray, "n 3"], square: Float64[ndarray, "n 2"]
) -> LightRays:
    """Directions spread evenly over the solid angle of a sphere; from inside of it, over the half in front of its center."""
    axis, strength = light_vectors(light, point)
    size = radius_of(light)
    center = lengths(np.array(light.position) - point)
    sine = np.minimum(size / np.maximum(center, 1e-30), 1)
    lowest = np.sqrt(1 - sine**2)
    cosine = 1 - square[:, 0] * (1 - lowest)
    turn = 2 * np.pi * square[:, 1]
    around = np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(cosine, 1e-6)
    unit = _turned(axis, np.stack([around * np.cos(turn), around * np.sin(turn)], axis=1))
    added = strength * _cosine(unit, normal) * 2 / (1 + lowest)
    half_chord = np.sqrt(np.maximum(size**2 - (center**2 * (1 - cosine**2)), 0))
    distance = np.maximum(center * cosine - half_chord, 0)  # to the side that is seen
    return _weighted(light, point, normal, unit, distance, added)


def _weighted(
    light: PointLight | AreaLight, point: ndarray, normal: ndarray, unit: ndarray, distance: ndarray, added: Float64[ndarray, " n"]
) -> LightRays:
    """`added`: irradiance by the point of the light that each ray meets, if all of the light were as that point."""
    exact = irradiance_from(light, point, normal)
    importance = np.where(exact > 0, np.maximum(added / np.maximum(exact, 1e-300), MIN_IMPORTANCE), 1)
    short = SHORT_OF_LIGHT * (1 + largest_component(point))
    opening = light.factors(point - np.array(light.position)) if isinstance(light, PointLight) else np.ones((len(point), 3))
    return LightRays(unit, np.maximum(distance - short, 0), exact, opening, importance)


def _cosine(unit: ndarray, normal: ndarray) -> Float64[ndarray, " n"]:
    return np.maximum(np.einsum("nc,nc->n", unit, normal, dtype=np.float64), 0)


def _turned(axis: Float64[ndarray, "n 3"], offset: Float64[ndarray, "n 2"]) -> Float64[ndarray, "n 3"]:
    """Unit vectors along axis + offset in the plane across it."""
    across = np.cross(axis, np.where(np.abs(axis[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    across /= np.maximum(lengths(across), 1e-30)[:, None]
    unit = axis + offset[:, :1] * across + offset[:, 1:] * np.cross(axis, across)
    return unit / np.maximum(lengths(unit), 1e-30)[:, None]
