"""Lights for relighting: directional, point, spot, sphere, area, named, environment. World frame, meters, radians, scene-linear Rec.709."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.errors import InputError
from srbf.light_linking import Objects
from srbf.light_profile import Profile, axes_of, roll_of
from srbf.sphere import normalize

Falloff = Literal["linear", "inverse-square"]
Triple = tuple[float, float, float]
WHITE: Triple = (1.0, 1.0, 1.0)
DOWN: Triple = (0.0, 0.0, -1.0)
PARALLEL = 1e-9  # sine of the angle between an area light's sides up to which they are parallel
NEARLY_FLAT = 1.57  # rad: a half-angle from which on no image fills a cone
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
    angle
        Angular diameter, rad, 0 to pi: how soft its shadows are. None: as the asset says, that of the capture's sun.
    receivers, blockers
        Which objects of the scene it shines on, and which shadow it; None: all.

    Raises
    ------
    InputError
        On a direction of length 0, an angle out of range, and on numbers that are not three or not finite.

    Examples
    --------
    >>> DirectionalLight((0, 0, 2), color=(1.0, 0.9, 0.8)).direction
    (0.0, 0.0, 1.0)
    """

    direction: Triple
    color: Triple = WHITE
    angle: float | None = field(default=None, kw_only=True)
    receivers: Objects | None = field(default=None, kw_only=True)
    blockers: Objects | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _unit(self.direction))
        object.__setattr__(self, "color", triple(self.color, "color"))
        if self.angle is not None:
            object.__setattr__(self, "angle", _above_zero(self.angle, "a sun's angle", or_zero=True))
            if self.angle > np.pi:
                raise InputError(f"expected a sun's angle of at most pi rad, found {self.angle:g}")

    def angle_or(self, usual: float) -> float:
        """The angular diameter, `usual` where the light does not say it, rad."""
        return usual if self.angle is None else self.angle


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
    direction
        (x, y, z) that a profile's axis points along, from the light; normalized. By default straight down.
    roll
        Turns a profile about that, rad: see `srbf.light_profile.axes_of`.
    profile
        What share of the strength goes into each direction: a factor on `color`. None: all of it into every direction. Projected ones are
        of spots.
    receivers, blockers
        Which objects of the scene it shines on, and which shadow it; None: all.

    Raises
    ------
    InputError
        On `a0` or `radius` not above 0, on another falloff, on a projected profile, and on numbers that are not three or not finite.

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
    direction: Triple = field(default=DOWN, kw_only=True)
    roll: float = field(default=0.0, kw_only=True)
    profile: Profile | None = field(default=None, kw_only=True)
    receivers: Objects | None = field(default=None, kw_only=True)
    blockers: Objects | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", triple(self.position, "position"))
        object.__setattr__(self, "direction", _unit(self.direction))
        object.__setattr__(self, "roll", triple((self.roll, 0, 0), "a roll and two zeros")[0])
        object.__setattr__(self, "color", triple(self.color, "color"))
        for name in ("a0", "radius"):
            object.__setattr__(self, name, _above_zero(getattr(self, name), name))
        if self.falloff not in get_args(Falloff):
            raise InputError(f"expected a falloff of linear, inverse-square, found {self.falloff!r}")
        if self.profile is not None and self.profile.projected and self.tangent == 0:
            raise InputError("expected a spot of an outer half-angle below pi / 2 to project an image, found another light")

    @property
    def tangent(self) -> float:
        """Of a spot's outer half-angle, 0 where there is none below pi / 2: half of a projected image's width, 1 m ahead."""
        return 0.0

    def factors(self, away: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
        """The profile's factors on the color in directions away from the light.

        Parameters
        ----------
        away
            (n, 3) vectors from the light, of any length.

        Returns
        -------
        ndarray
            (n, 3) float64; 1 without a profile.

        Examples
        --------
        >>> PointLight((0.0, 0.0, 2.0)).factors(np.array([[0.0, 0.0, -1.0]])).tolist()
        [[1.0, 1.0, 1.0]]
        """
        if self.profile is None:
            return np.ones((len(away), 3))
        return self.profile.at(np.asarray(away, np.float64) @ np.stack(axes_of(self.direction, self.roll), axis=1), self.tangent)


@dataclass(frozen=True, kw_only=True)
class SpotLight(PointLight):
    """A point light, or a sphere, times a smooth cone about an axis: full inside the half-angle `inner`, none past `outer`.

    Parameters
    ----------
    position, color, a0, falloff, roll, profile, receivers, blockers
        Of the point light.
    radius
        As of the point light, at least `size`.
    direction
        (x, y, z) of the axis, of the cone and of a profile, from the light; normalized.
    inner, outer
        Half-angles, rad: 0 <= inner <= outer <= pi.
    size
        Radius of a glowing sphere, m; 0: a point. Each point of the sphere shines into the cone, whose edge is as soft as shadows then.

    Raises
    ------
    InputError
        On half-angles out of range, a negative size, and as `PointLight`.

    Examples
    --------
    >>> spot = SpotLight((4.0, 3.0, 2.0), direction=(0, 0, -1), inner=0.3, outer=0.5)
    >>> relight(asset, [spot]).shape
    (6, 8, 3)
    >>> SpotLight((0, 0, 0), direction=(0, 0, -1), inner=0.5, outer=0.3)
    Traceback (most recent call last):
    srbf.errors.InputError: expected spot half-angles 0 <= inner <= outer <= pi rad, found inner 0.5, outer 0.3
    """

    direction: Triple = field()  # without the default of a point light
    inner: float
    outer: float
    size: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", _above_zero(self.size, "a spot's size", or_zero=True))
        inner, outer = float(self.inner), float(self.outer)
        if not 0 <= inner <= outer <= np.pi:
            raise InputError(f"expected spot half-angles 0 <= inner <= outer <= pi rad, found inner {inner:g}, outer {outer:g}")
        object.__setattr__(self, "inner", inner)
        object.__setattr__(self, "outer", outer)
        super().__post_init__()
        object.__setattr__(self, "radius", max(self.radius, self.size))

    @property
    def tangent(self) -> float:
        return float(np.tan(self.outer)) if 0 < self.outer < NEARLY_FLAT else 0.0

    def without_cone(self) -> PointLight:
        """The point light, or the sphere, that shines all around as this one does inside its cone; without a profile."""
        shared: dict[str, Any] = {name: getattr(self, name) for name in ("position", "color", "a0", "falloff", "radius")}
        return SphereLight(**shared, size=self.size) if self.size > 0 else PointLight(**shared)


@dataclass(frozen=True, kw_only=True)
class SphereLight(PointLight):
    """A glowing sphere: lights as a point light in its center, with soft shadows.

    Parameters
    ----------
    position, color, a0, falloff, direction, roll, profile, receivers, blockers
        Of the point light in the center; the falloff is `inverse-square` unless it is said.
    size
        Radius of the sphere, m, above 0.
    radius
        As of the point light, at least `size`: inside the sphere the light is as strong as on its surface.

    Raises
    ------
    InputError
        On a size not above 0, and as `PointLight`.

    Examples
    --------
    >>> globe = SphereLight((4.0, 3.0, 2.0), size=0.15)
    >>> globe.radius, globe.falloff
    (0.15, 'inverse-square')
    """

    size: float
    falloff: Falloff = "inverse-square"

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", _above_zero(self.size, "size"))
        super().__post_init__()
        object.__setattr__(self, "radius", max(self.radius, self.size))


@dataclass(frozen=True)
class AreaLight:
    """A glowing parallelogram that shines to one side, evenly and diffusely.

    E(x) = color a0^2 / A * integral of cos_l cos_x / r^2 dA: far away as a point light times the cosine at the light.

    Parameters
    ----------
    position
        (x, y, z) of its center, m.
    u, v
        Its sides as vectors of full length, m, not parallel. It shines towards u x v.
    color
        Irradiance at the distance `a0` straight in front, by the law that holds far away; linear Rec.709.
    a0
        m, above 0.
    receivers, blockers
        Which objects of the scene it shines on, and which shadow it; None: all.

    Raises
    ------
    InputError
        On parallel sides, on `a0` not above 0, and on numbers that are not three or not finite.

    Examples
    --------
    >>> panel = AreaLight((4.0, 3.0, 2.0), u=(0.6, 0, 0), v=(0, -0.6, 0))
    >>> panel.direction, round(panel.area, 2)
    ((0.0, 0.0, -1.0), 0.36)
    """

    position: Triple
    u: Triple
    v: Triple
    color: Triple = WHITE
    a0: float = 1.0
    receivers: Objects | None = field(default=None, kw_only=True)
    blockers: Objects | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        for name in ("position", "u", "v", "color"):
            object.__setattr__(self, name, triple(getattr(self, name), name))
        object.__setattr__(self, "a0", _above_zero(self.a0, "a0"))
        if not self.area > PARALLEL * np.linalg.norm(self.u) * np.linalg.norm(self.v):
            raise InputError(f"expected an area light's sides of some length and not parallel, found u {self.u}, v {self.v}")

    @property
    def area(self) -> float:
        """In square meters."""
        return float(np.linalg.norm(np.cross(self.u, self.v)))

    @property
    def direction(self) -> Triple:
        """Unit vector that it shines towards."""
        return _unit(np.cross(self.u, self.v))


@dataclass(frozen=True)
class NamedLight:
    """One of the scene's own lights, by its name; only assets of named lights know it.

    Parameters
    ----------
    name
        As the asset lists it.
    color
        Intensity times color: 1 is as the scene has the light set, 0 is off.

    Raises
    ------
    InputError
        On an empty name, and on a color of numbers that are not three or not finite.

    Examples
    --------
    >>> NamedLight("Window", (0.5, 0.5, 0.5)).color
    (0.5, 0.5, 0.5)
    """

    name: str
    color: Triple = WHITE

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise InputError(f"expected the name of a light, found {self.name!r}")
        object.__setattr__(self, "color", triple(self.color, "color"))


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

    def turned(self, angle: float) -> EnvironmentLight:
        """The map turned about the world's vertical.

        Parameters
        ----------
        angle
            Radians, counterclockwise seen from above.

        Returns
        -------
        EnvironmentLight
            What shone from azimuth a shines from a + `angle`.

        Examples
        --------
        >>> overcast = EnvironmentLight(np.full((8, 16, 3), 0.5, np.float32)).turned(np.pi / 2)
        >>> (overcast.rotation @ [1.0, 0.0, 0.0]).round(6).tolist()
        [0.0, 1.0, 0.0]
        """
        c, s = np.cos(float(angle)), np.sin(float(angle))
        return replace(self, rotation=np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ self.rotation)


def radius_of(light: object) -> float:
    """The radius of a light that is a sphere, m; 0 of others."""
    return light.size if isinstance(light, (SphereLight, SpotLight)) else 0.0


def has_size(light: object) -> bool:
    """Whether a light inside the scene has soft shadows."""
    return isinstance(light, AreaLight) or radius_of(light) > 0


Light = DirectionalLight | PointLight | SpotLight | SphereLight | AreaLight | EnvironmentLight | NamedLight
"""A light of any kind, as `relight` takes them."""


def moved(light: Light, matrix: Float64[ndarray, "4 4"]) -> Light:
    """A light carried by a rigid motion and uniform scale: its lengths scale along, an environment map turns, a named light stays.

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
    >>> light.position, round(light.a0, 6)
    ((2.0, 0.0, 1.0), 2.0)
    """
    linear = matrix[:3, :3]
    if isinstance(light, NamedLight) or np.array_equal(matrix, np.eye(4)):
        return light
    if isinstance(light, EnvironmentLight):
        return replace(light, rotation=linear / np.cbrt(np.linalg.det(linear)) @ light.rotation)
    if isinstance(light, DirectionalLight):
        return replace(light, direction=_unit(linear @ light.direction))
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    position = triple(linear @ light.position + matrix[:3, 3], "position")
    if isinstance(light, AreaLight):
        u, v = triple(linear @ light.u, "u"), triple(linear @ light.v, "v")
        return replace(light, position=position, u=u, v=v, a0=light.a0 * scale)
    changes: dict[str, Any] = {"position": position, "a0": light.a0 * scale, "radius": light.radius * scale}
    if isinstance(light, SpotLight) or light.profile is not None:
        direction = _unit(linear @ light.direction)
        changes["direction"] = direction
        if light.profile is not None:
            changes["roll"] = roll_of(direction, linear @ axes_of(light.direction, light.roll)[0])
    if isinstance(light, (SphereLight, SpotLight)):
        changes["size"] = light.size * scale
    return replace(light, **changes)


def refuse_named(lights: Sequence[Light], method: str) -> None:
    """InputError where one of the lights of an asset that wants lights inside its scene is one of the scene's own, by name."""
    if any(isinstance(light, NamedLight) for light in lights):
        raise InputError(f"expected lights inside the scene for a {method} asset, found a named one; bake `light_set=named` to mix lights")


def triple(value: object, name: str = "a vector") -> Triple:
    """Three finite numbers as a tuple of floats; InputError for others, with `name` in its text."""
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"expected {name} as three finite numbers, found {value!r}") from error
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError(f"expected {name} as three finite numbers, found {value!r}")
    return (float(array[0]), float(array[1]), float(array[2]))


def _above_zero(value: Any, name: str, or_zero: bool = False) -> float:
    expected = f"expected {name} of at least 0" if or_zero else f"expected {name} above 0"
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise InputError(f"{expected}, found {value!r}") from error
    if not np.isfinite(number) or number < 0 or (number == 0 and not or_zero):
        raise InputError(f"{expected}, found {number:g}")
    return number


def _unit(value: object) -> Triple:
    x, y, z = normalize(np.array(triple(value, "direction")))
    return (float(x), float(y), float(z))
