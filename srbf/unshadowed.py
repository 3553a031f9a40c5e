"""Irradiance of lights with nothing between, in closed form."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.errors import InputError
from srbf.light_geometry import light_vectors, soft_cone
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight, SphereLight, SpotLight
from srbf.vectors import lengths


def irradiance_from(light: Light, points: Float[ndarray, "n 3"], normals: Float[ndarray, "n 3"]) -> Float64[ndarray, " n"]:
    """Irradiance of a white light on points of surfaces, with nothing between.

    Point, spot and directional lights: strength times cosine. Spheres and areas: exact as Lambertian emitters, cut off at the surface's
    horizon, and finite at any distance. Spots with a size: as spheres, times what their cone lets out to a point.

    Parameters
    ----------
    light
        Of any kind with a place or a direction; its color and its profile do not count.
    points
        (n, 3), m.
    normals
        (n, 3) unit vectors.

    Returns
    -------
    ndarray
        (n,) float64.

    Raises
    ------
    InputError
        For an environment or a named light.

    Examples
    --------
    >>> from srbf.unshadowed import irradiance_from
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> irradiance_from(PointLight((0.0, 0.0, 2.0), falloff="inverse-square"), np.zeros((1, 3)), up).tolist()
    [0.25]
    """
    points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
    if isinstance(light, DirectionalLight):
        return np.maximum(normals @ np.array(light.direction), 0)
    if isinstance(light, AreaLight):
        return area_irradiance(light, points, normals)
    if isinstance(light, SpotLight) and light.size > 0:
        return irradiance_from(light.without_cone(), points, normals) * soft_cone(light, points - np.array(light.position), normals)
    if isinstance(light, PointLight):
        toward, strength = light_vectors(light, points)
        cosine = np.einsum("nc,nc->n", toward, normals)
        if isinstance(light, SphereLight):
            distance = lengths(np.array(light.position) - points)
            return strength * sphere_cosine(cosine, np.minimum(light.size / np.maximum(distance, 1e-30), 1))
        return strength * np.maximum(cosine, 0)
    raise InputError(f"expected a light with a place or a direction, found {type(light).__name__}; leave it out")


def area_irradiance(light: AreaLight, points: Float64[ndarray, "n 3"], normals: Float64[ndarray, "n 3"]) -> Float64[ndarray, " n"]:
    """a0^2 / A times the integral of cos_l cos_x / r^2 over the parallelogram above the horizon: half the sum over its edges of the
    angle that an edge subtends, times the cosine between the surface and the plane through point and edge [Lambert1760].

    0 behind the light and in its plane.
    """
    u, v = np.array(light.u), np.array(light.v)
    corners = np.array(light.position) + np.array([-u - v, v - u, u + v, u - v]) / 2  # clockwise as seen from the lit side
    upward = np.ascontiguousarray(normals.T)  # coordinate by coordinate, which is several times as fast
    vertex = corners[:, :, None] - np.ascontiguousarray(points.T)  # (4, 3, n)
    height = np.einsum("kcn,cn->kn", vertex, upward)
    total = np.zeros(len(points))
    leaving, entering = np.zeros((2, 3, len(points)))
    for i in range(4):
        start, end = vertex[i], vertex[(i + 1) % 4]
        first, second = height[i], height[(i + 1) % 4]
        crosses = (first > 0) != (second > 0)
        if not crosses.any():
            total += np.where(first > 0, _edge(start, end, upward), 0)
            continue
        span = np.where(crosses, first - second, 1)
        middle = start + np.where(crosses, first, 0) / span * (end - start)  # where the edge meets the horizon
        down, up = crosses & (first > 0), crosses & (second > 0)
        leaving[:, down], entering[:, up] = middle[:, down], middle[:, up]
        part = _edge(np.where(up, middle, start), np.where(down, middle, end), upward)
        total += np.where((first > 0) | (second > 0), part, 0)
    total += _edge(leaving, entering, upward)  # along the horizon, where the light crosses it
    front = (points - np.array(light.position)) @ np.array(light.direction) > 0
    return np.where(front, np.maximum(total, 0), 0) * (light.a0**2 / (2 * light.area))


def sphere_cosine(cosine: Float64[ndarray, " n"], sine: Float64[ndarray, " n"]) -> Float64[ndarray, " n"]:
    """The mean cosine of a glowing sphere on a surface, relative to a point light in its center: max(0, cosine) unless the horizon
    cuts it [Snyder1996].

    `cosine`: between the normal and the center; `sine`: of half the angle that the sphere subtends, in (0, 1].
    """
    across = np.sqrt(np.maximum(1 - cosine**2, 0))
    cut = np.abs(cosine) < sine
    x = np.sqrt(np.maximum(1 / np.maximum(sine, 1e-30) ** 2 - 1, 0))
    y = np.clip(-x * cosine / np.maximum(across, 1e-30), -1, 1)
    rim = across * np.sqrt(1 - y * y)
    partly = ((cosine * np.arccos(y) - x * rim) * sine**2 + np.arctan2(rim, x)) / (np.pi * np.maximum(sine, 1e-30) ** 2)
    return np.where(cut, partly, np.maximum(cosine, 0))


def _edge(start: Float64[ndarray, "3 n"], end: Float64[ndarray, "3 n"], normals: Float64[ndarray, "3 n"]) -> Float64[ndarray, " n"]:
    """The angle between two vectors times the cosine between the normal and their plane's."""
    cross = np.cross(start, end, axis=0)
    sine = np.sqrt(np.einsum("cn,cn->n", cross, cross))
    angle = np.arctan2(sine, np.einsum("cn,cn->n", start, end))
    return np.einsum("cn,cn->n", cross, normals) * angle / np.maximum(sine, 1e-30)
