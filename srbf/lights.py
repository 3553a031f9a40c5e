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
    """A distant light: `direction` points from the surface to the light, `color` is its irradiance on a surface facing it."""

    direction: Triple
    color: Triple = WHITE

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _unit(self.direction))
        object.__setattr__(self, "color", triple(self.color, "color"))


@dataclass(frozen=True)
class PointLight:
    """A point light at `position` (m); `color` is its irradiance at the distance a0 [Wong2005, "Attenuation"].

    falloff `linear` is the article's a0/|L|, `inverse-square` is (a0/|L|)^2; |L| is never less than `radius` (m).
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
    """A point light times a smooth cone about `direction` (its axis): full inside the half-angle `inner`, none past `outer`."""

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
    """An equirectangular radiance map E: u = 1/2 - atan2(y, x) / 2 pi, top row towards +z; `image` is (H, W, 3) float32.

    `rotation` (3, 3) turns the map's directions, as `moved` does.
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

SPOT_SOFTNESS_MIN = 1e-6  # in cosine: an edge of inner = outer stays a step without dividing by zero


def attenuation(distance: Float[ndarray, "*shape"], light: PointLight) -> Float[ndarray, "*shape"]:
    """a0/|L|, or its square, with |L| >= radius [Wong2005, fig. 10]."""
    ratio = light.a0 / np.maximum(distance, light.radius)
    return ratio if light.falloff == "linear" else ratio * ratio


def spot_cone(cos_angle: Float[ndarray, "*shape"], cos_inner: float, cos_outer: float) -> Float[ndarray, "*shape"]:
    """Smoothstep from 0 at the outer half-angle to 1 at the inner one, in the cosine of the angle off the spot's axis."""
    t = np.clip((cos_angle - cos_outer) / max(cos_inner - cos_outer, SPOT_SOFTNESS_MIN), 0, 1)
    return t * t * (3 - 2 * t)


def moved(light: Light, matrix: Float64[ndarray, "4 4"]) -> Light:
    """A light carried by a 4 x 4 rigid motion and uniform scale: a0 and radius scale along, an environment map turns."""
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
    """Unit direction to the light and its strength, attenuation times a spot's cone, at `positions` of its frame [Wong2005, fig. 8-10]."""
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
    """Directions of an equirectangular map's texel centers turned by `rotation`, and the solid angle (sr) of each texel.

    On the hemisphere only directions above the horizon count. Without rotation this is exact: a row across the horizon is cut there,
    and its center moves to the middle of the remaining part.
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
