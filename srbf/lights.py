"""Lights for relighting: directional, point, spot, environment. World frame, meters, radians, scene-linear Rec.709."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.errors import InputError
from srbf.sphere import Domain, normalize

Falloff = Literal["linear", "inverse-square"]
Triple = tuple[float, float, float]
WHITE: Triple = (1.0, 1.0, 1.0)
DEFAULT_RADIUS = 1e-4  # meters, the smallest distance counted, so that a light in a surface stays finite


@dataclass(frozen=True)
class DirectionalLight:
    """A distant light.

    Parameters
    ----------
    direction
        (x, y, z) from the surface to the light, of any length but 0; normalized.
    color
        Irradiance on a surface that faces the light, linear Rec.709.

    Raises
    ------
    InputError
        On a direction of length 0, and on numbers that are not three or not finite.

    Examples
    --------
    >>> DirectionalLight((0, 0, 2), color=(1.0, 0.9, 0.8)).direction
    (0.0, 0.0, 1.0)
    """

    direction: Triple
    color: Triple = WHITE

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _unit(self.direction))
        object.__setattr__(self, "color", triple(self.color, "color"))


@dataclass(frozen=True)
class PointLight:
    """A point light [Wong2005, "Attenuation"].

    Parameters
    ----------
    position
        (x, y, z) in the world, m.
    color
        Irradiance at the distance `a0` on a surface that faces the light, linear Rec.709.
    a0
        The distance at which the attenuation is 1, m; above 0.
    falloff
        `linear`, the article's a0/|L|, or `inverse-square`, (a0/|L|)^2.
    radius
        m, above 0: |L| is never less, so that a light in a surface stays finite.

    Raises
    ------
    InputError
        On `a0` or `radius` not above 0, on another falloff, and on numbers that are not three or not finite.

    Examples
    --------
    >>> lantern = PointLight((4.0, 3.0, 2.0), color=(1.0, 0.6, 0.3), a0=2.0, falloff="inverse-square")
    >>> relight(asset, [lantern]).shape
    (6, 8, 3)
    """

    position: Triple
    color: Triple = WHITE
    a0: float = 1.0
    falloff: Falloff = "linear"
    radius: float = DEFAULT_RADIUS

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", triple(self.position, "position"))
        object.__setattr__(self, "color", triple(self.color, "color"))
        for name in ("a0", "radius"):
            value = float(getattr(self, name))
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"expected {name} above 0, found {value:g}")
            object.__setattr__(self, name, value)
        if self.falloff not in get_args(Falloff):
            raise InputError(f"expected a falloff of linear, inverse-square, found {self.falloff!r}")


@dataclass(frozen=True, kw_only=True)
class SpotLight(PointLight):
    """A point light times a smooth cone about an axis: full inside the half-angle `inner`, none past `outer`.

    Parameters
    ----------
    position, color, a0, falloff, radius
        Of the point light.
    direction
        (x, y, z) of the axis, from the light; normalized.
    inner, outer
        Half-angles, rad: 0 <= inner <= outer <= pi.

    Raises
    ------
    InputError
        On half-angles out of range, and as `PointLight`.

    Examples
    --------
    >>> spot = SpotLight((4.0, 3.0, 2.0), direction=(0, 0, -1), inner=0.3, outer=0.5)
    >>> relight(asset, [spot]).shape
    (6, 8, 3)
    >>> SpotLight((0, 0, 0), direction=(0, 0, -1), inner=0.5, outer=0.3)
    Traceback (most recent call last):
    srbf.errors.InputError: expected spot half-angles 0 <= inner <= outer <= pi rad, found inner 0.5, outer 0.3
    """

    direction: Triple
    inner: float
    outer: float

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "direction", _unit(self.direction))
        inner, outer = float(self.inner), float(self.outer)
        if not 0 <= inner <= outer <= np.pi:
            raise InputError(f"expected spot half-angles 0 <= inner <= outer <= pi rad, found inner {inner:g}, outer {outer:g}")
        object.__setattr__(self, "inner", inner)
        object.__setattr__(self, "outer", outer)


@dataclass(frozen=True, eq=False)
class EnvironmentLight:
    """An equirectangular radiance map E: u = 1/2 - atan2(y, x) / 2 pi, top row towards +z.

    Parameters
    ----------
    image
        (H, W, 3) radiance, linear Rec.709; kept as float32.
    color
        Multiplies the image.
    rotation
        (3, 3): turns the map's directions, as `moved` does. By default none.

    Raises
    ------
    InputError
        On an image of another shape, or with NaN or Inf.

    Examples
    --------
    >>> overcast = EnvironmentLight(np.full((16, 32, 3), 0.5, np.float32))
    >>> relight(asset, [overcast]).shape
    (6, 8, 3)
    """

    image: Float32[ndarray, "H W 3"]
    color: Triple = WHITE
    rotation: Float64[ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        image = np.asarray(self.image, np.float32)
        if image.ndim != 3 or image.shape[2] != 3 or 0 in image.shape:
            raise InputError(f"expected an environment image of shape (H, W, 3), found {image.shape}")
        if not np.isfinite(image).all():
            raise InputError("expected a finite environment image, found NaN or Inf pixels")
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "color", triple(self.color, "color"))


Light = DirectionalLight | PointLight | SpotLight | EnvironmentLight
"""A light of any kind, as `relight` takes them."""

SPOT_SOFTNESS_MIN = 1e-6  # in cosine: an edge of inner = outer stays a step without dividing by zero


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
    >>> from srbf.lights import attenuation
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
    >>> from srbf.lights import spot_cone
    >>> spot_cone(np.array([1.0, 0.75, 0.5]), cos_inner=1.0, cos_outer=0.5).tolist()
    [1.0, 0.5, 0.0]
    """
    t = np.clip((cos_angle - cos_outer) / max(cos_inner - cos_outer, SPOT_SOFTNESS_MIN), 0, 1)
    return t * t * (3 - 2 * t)


def moved(light: Light, matrix: Float64[ndarray, "4 4"]) -> Light:
    """A light carried by a rigid motion and uniform scale: a0 and radius scale along, an environment map turns.

    Parameters
    ----------
    light
        Of any kind.
    matrix
        (4, 4) float64, acts on columns (x, y, z, 1).

    Returns
    -------
    Light
        Of the same kind and color.

    Raises
    ------
    InputError
        Where the matrix leaves the light without a direction, position, a0 or radius.

    Examples
    --------
    >>> from srbf.lights import moved
    >>> up = np.diag([2.0, 2.0, 2.0, 1.0])
    >>> up[2, 3] = 1.0
    >>> light = moved(PointLight((1.0, 0.0, 0.0), a0=1.0), up)
    >>> light.position, light.a0
    ((2.0, 0.0, 1.0), 2.0)
    """
    linear = matrix[:3, :3]
    if np.array_equal(matrix, np.eye(4)):
        return light
    if isinstance(light, EnvironmentLight):
        return replace(light, rotation=linear / np.cbrt(np.linalg.det(linear)) @ light.rotation)
    if isinstance(light, DirectionalLight):
        return replace(light, direction=_unit(linear @ light.direction))
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    position = triple(linear @ light.position + matrix[:3, 3], "position")
    changes: dict[str, Any] = {"position": position, "a0": light.a0 * scale, "radius": light.radius * scale}
    if isinstance(light, SpotLight):
        return replace(light, direction=_unit(linear @ light.direction), **changes)
    return replace(light, **changes)


def light_vectors(light: PointLight, positions: Float32[ndarray, "*p 3"]) -> tuple[Float64[ndarray, "*p 3"], Float64[ndarray, "*p"]]:
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
        (...) float64, the factor on the light's irradiance.

    Examples
    --------
    >>> from srbf.lights import light_vectors
    >>> directions, strength = light_vectors(PointLight((0.0, 0.0, 2.0)), np.zeros((1, 3), np.float32))
    >>> directions.tolist(), strength.tolist()
    ([[0.0, 0.0, 1.0]], [0.5])
    """
    vectors = np.array(light.position) - positions  # L = S - P, eq. 3
    distance = np.linalg.norm(vectors, axis=-1)
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
    >>> from srbf.lights import environment_samples
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


def triple(value: object, name: str = "a vector") -> Triple:
    """Three finite numbers as a tuple of floats; InputError for others, with `name` in its text."""
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"expected {name} as three finite numbers, found {value!r}") from error
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError(f"expected {name} as three finite numbers, found {value!r}")
    return (float(array[0]), float(array[1]), float(array[2]))


def _unit(value: object) -> Triple:
    x, y, z = normalize(np.array(triple(value, "direction")))
    return (float(x), float(y), float(z))
