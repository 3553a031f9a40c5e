"""From where, and through which maps, shadow maps look at a scene from lights inside it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.gl.uniforms import point_light_uniforms, profile_uniforms
from srbf.light_geometry import area_samples
from srbf.lights import AreaLight, PointLight, SpotLight, Triple, radius_of, triple
from srbf.sphere import point_set

GUARD = 3  # texels past a face's edge, for filtering across it
WIDEST = np.radians(75)  # half-angle of a spot that one map holds
NEAREST = 1e-4  # m, plus this share of the distance from the origin: what is nearer to a light casts no shadow
Axes = tuple[Triple, Triple, Triple]
WORLD: Axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Look:
    """One place that shines: a point or spot light of unit irradiance, the normal of the surface that it is on (0: of none), axes of a
    cube about it, and which faces of the cube it shines through; no face where one map along the last axis holds all its light."""

    light: PointLight
    facing: Triple
    axes: Axes
    faces: tuple[int, ...]

    def maps(self, size: int) -> Iterator[dict[str, Any]]:
        """The uniforms of each perspective map of `size` texels per side."""
        guard = size / (size - 2 * GUARD)
        nearest = NEAREST * (1 + max(map(abs, self.light.position)))
        shared = {
            "pointLight": point_light_uniforms(self.light),
            **profile_uniforms(self.light),
            "light": self.light.position,
            "facing": self.facing,
            "nearest": nearest,
            **dict(zip(("cubeX", "cubeY", "cubeZ"), self.axes, strict=True)),
        }
        if not self.faces:
            assert isinstance(self.light, SpotLight)
            across, up, ahead = self.axes
            yield {**shared, "across": across, "up": up, "ahead": ahead, "reach": np.tan(self.light.outer) * guard, "cubeFace": -1}
        for face in self.faces:
            axis, behind = divmod(face, 2)
            ahead = triple(np.array(self.axes[axis]) * (-1 if behind else 1))
            across, up = self.axes[(axis + 1) % 3], self.axes[(axis + 2) % 3]
            yield {**shared, "across": across, "up": up, "ahead": ahead, "reach": guard, "cubeFace": face}


def look_of(light: PointLight) -> Look:
    """Of a point or spot light."""
    white = replace(light, color=(1.0, 1.0, 1.0))
    if not isinstance(light, SpotLight):
        return Look(white, (0.0, 0.0, 0.0), WORLD, (0, 1, 2, 3, 4, 5))
    narrow = light.outer <= WIDEST
    return Look(white, (0.0, 0.0, 0.0), _axes_to(light.direction), () if narrow else (0, 1, 2, 3, 4, 5))


def looks_over(light: PointLight | AreaLight, count: int) -> list[Look]:
    """`count` places spread over a light with a size, each shining to its side of the surface, a spot's into its cone.

    Their sum is the light up to a factor.
    """
    lift = NEAREST * (1 + max(map(abs, light.position)))
    if isinstance(light, AreaLight):
        places, _ = area_samples(light, count)
        normals = np.broadcast_to(np.array(light.direction), places.shape)
        across = np.array(light.u) / np.linalg.norm(light.u)
        axes = [(triple(across), triple(np.cross(light.direction, across)), light.direction)] * count
    else:
        normals = point_set("fibonacci", count, "sphere")
        places = np.array(light.position) + radius_of(light) * normals
        axes = [_axes_to(triple(normal)) for normal in normals]
    lights = [PointLight(triple(place + lift * normal), falloff="inverse-square") for place, normal in zip(places, normals, strict=True)]
    if isinstance(light, SpotLight):
        spots = [replace(light, position=one.position, a0=1.0, falloff="inverse-square", size=0.0, profile=None) for one in lights]
        return [replace(look_of(spot), facing=triple(normal)) for spot, normal in zip(spots, normals, strict=True)]
    return [Look(one, triple(normal), own, (0, 1, 2, 3, 4)) for one, normal, own in zip(lights, normals, axes, strict=True)]


def _axes_to(direction: Triple) -> Axes:
    """Orthonormal axes of which the last is `direction`."""
    axis: Float64[ndarray, " 3"] = np.array(direction)
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    return triple(across), triple(np.cross(axis, across)), direction
