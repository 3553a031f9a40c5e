"""What a light lays on the cells of the surfaces, by one shadow ray a cell and point of the light: its fingerprint."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.compute.threads import each
from srbf.io.scene_glb import read_triangles
from srbf.light_geometry import environment_samples, soft_cone
from srbf.light_linking import Objects
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Light, PointLight, SpotLight
from srbf.vectors import lengths
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.linked_triangles import casting
from srbf.visibility.surface_cells import OFFSET, Cells, frames

SIDE = 4  # points per side of an area light
DIRECTIONS = 512  # of an environment map
NEAR, PARTS = 8.0, 4  # sides of a cell, closer than which it is measured by so many points a side;
NEAR_CONE, WIDEST = 64.0, 2 * np.pi / 3  # of a spot of a half-angle below that, rad, whose cone may end in it
Strength = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]  # (n, 1), or (n, 3) by a profile


def occluders_of(scene: bytes, blockers: Objects | None = None) -> EmbreeTriangles:
    """What casts shadows in a scene.glb, ready for rays, `blockers` alone where a light chooses; MissingLibraryError without embreex."""
    return _occluders(scene, blockers)


@functools.lru_cache(maxsize=16)
def _occluders(scene: bytes, blockers: Objects | None) -> EmbreeTriangles:
    triangles = casting(read_triangles(scene), blockers)
    return EmbreeTriangles(triangles.corners[triangles.occluders])


@runtime_checkable
class Shadows(Protocol):
    """What cells see of lights."""

    @property
    def side(self) -> int:
        """Looks per side of an area light."""

    def visible(self, points: Int[ndarray, " n"], toward: Float[ndarray, "n 3"], distance: Float[ndarray, " n"] | None) -> ndarray:
        """(n,) how much of a light in the direction `toward` some cells see, 0 to 1; distance (m), None: of suns."""


class RayShadows:
    """By one ray each from `starts` (m)."""

    side = SIDE

    def __init__(self, starts: Float32[ndarray, "N 3"], occluders: EmbreeTriangles) -> None:
        self._starts, self._occluders = starts, occluders

    def visible(self, points: Int[ndarray, " n"], toward: Float[ndarray, "n 3"], distance: Float[ndarray, " n"] | None) -> ndarray:
        """(n,) bool."""
        return ~self._occluders.occluded(self._starts[points], toward, distance)


def starts_of(positions: Float[ndarray, "n 3"], normals: Float[ndarray, "n 3"], lift: float | None = None) -> Float32[ndarray, "n 3"]:
    """Where shadow rays from surfaces start: a little above them, or `lift`, m."""
    return (positions + (lift_of(positions) if lift is None else lift) * normals).astype(np.float32)


def lift_of(positions: Float[ndarray, "n 3"]) -> float:
    """How far above surfaces that is, m."""
    return OFFSET * float(np.ptp(positions, axis=0).max()) if len(positions) else 0.0


class ReceivedLight:
    """Irradiance of lights on N cells, shadowed by rays to `occluders`, or otherwise; `lift`: how far above them rays start, m."""

    def __init__(self, cells: Cells, occluders: EmbreeTriangles | Shadows, lift: float | None = None) -> None:
        self._cells = cells
        self._normals = cells.normals.astype(np.float64)
        self._places = cells.places.astype(np.float64)
        self._starts = starts_of(self._places, self._normals, lift)
        self._shadows: Shadows = RayShadows(self._starts, occluders) if isinstance(occluders, EmbreeTriangles) else occluders
        self._areas = cells.areas.astype(np.float64)

    def irradiance(self, light: Light) -> Float64[ndarray, "N 3"]:
        """On every cell, in the light's units; 0 for lights without a place or a direction."""
        if isinstance(light, AreaLight):
            return self._of_area(light) * np.array(light.color)
        if isinstance(light, PointLight):
            return self._of_point(light) * np.array(light.color)
        if isinstance(light, DirectionalLight):
            return self._from(np.array(light.direction))[:, None] * np.array(light.color)
        if isinstance(light, EnvironmentLight):
            return self._of_environment(light)
        return np.zeros((len(self._places), 3))

    def on_patches(self, light: Light) -> Float64[ndarray, "K 3"]:
        """The mean irradiance of every patch."""
        return patch_means(self._cells, self.irradiance(light))

    def white_on_patches(self, lights: Sequence[Light]) -> Float32[ndarray, "K n"]:
        """The mean irradiance of every patch under each of n white lights, which are taken in turn by one thread per core."""
        found = np.empty((self._cells.patch_count, len(lights)), np.float32)

        def measure(number: int) -> None:
            found[:, number] = self.on_patches(lights[number])[:, 0]

        each(measure, len(lights))
        return found

    def _of_point(self, light: PointLight) -> Float64[ndarray, "N _"]:
        """cos a0^2 / r^2 of what sees the light, or a0 / r for a linear falloff; times a spot's cone and a profile."""

        def strength(squared: ndarray, unit: ndarray, least: ndarray) -> ndarray:
            near = np.maximum(np.maximum(squared, light.radius**2), least)
            found = light.a0**2 / near if light.falloff == "inverse-square" else light.a0 / np.sqrt(near)
            if isinstance(light, SpotLight):
                found = found * soft_cone(light, -unit * np.sqrt(squared)[:, None])
            return found[:, None] if light.profile is None else found[:, None] * light.factors(-unit)

        sides = NEAR_CONE if isinstance(light, SpotLight) and light.outer < WIDEST else NEAR
        return self._from_place(np.array(light.position), strength, sides)

    def _of_area(self, light: AreaLight) -> Float64[ndarray, "N 1"]:
        """The mean of a grid of points, each a Lambertian emitter: cos_l cos a0^2 / r^2."""
        u, v, center = np.array(light.u), np.array(light.v), np.array(light.position)
        facing = np.cross(u, v)
        facing /= np.linalg.norm(facing)

        def strength(squared: ndarray, unit: ndarray, least: ndarray) -> ndarray:
            return (np.maximum(-(unit @ facing), 0) * light.a0**2 / np.maximum(squared, least))[:, None]

        side = self._shadows.side
        steps = (np.arange(side) + 0.5) / side - 0.5
        places = [center + s * u + t * v for s in steps for t in steps]
        return np.sum([self._from_place(place, strength) for place in places], axis=0) / side**2

    def _from_place(self, place: Float64[ndarray, " 3"], strength: Strength, sides: float = NEAR) -> Float64[ndarray, "N _"]:
        """The mean of cos times `strength` over every cell that sees a place.

        Cells are taken as squares: at their middles far away, by PARTS x PARTS points closer than so many `sides`. r^2 is at least
        A / 2 pi, so that no part takes more than half of a light.
        """
        least = self._areas / (2 * np.pi)
        vector = place - self._places
        squared = np.einsum("nk,nk->n", vector, vector)
        amount = _falling(vector, squared, self._normals, least, strength)
        near = np.flatnonzero(squared < sides**2 * self._areas)
        if len(near):
            tangent, bitangent = frames(self._normals[near])
            steps = (np.arange(PARTS) + 0.5) / PARTS - 0.5
            side = np.sqrt(self._areas[near])[:, None]
            found = np.zeros((len(near), amount.shape[1]))
            for s in steps:
                for t in steps:
                    part = vector[near] - side * (s * tangent + t * bitangent)
                    far = np.einsum("nk,nk->n", part, part)
                    found += _falling(part, far, self._normals[near], least[near] / PARTS**2, strength)
            amount[near] = found / PARTS**2
        return self._shadowed(amount, place)

    def _of_environment(self, light: EnvironmentLight) -> Float64[ndarray, "N 3"]:
        """A sum over about DIRECTIONS blocks of the map, each as a distant light from its middle."""
        height, width = light.image.shape[:2]
        rows = max(1, int(np.ceil(height / np.sqrt(DIRECTIONS / 2))))
        columns = max(1, int(np.ceil(width / np.sqrt(DIRECTIONS * 2))))
        directions, solid_angle = environment_samples(light.image, "sphere", light.rotation)
        total = np.zeros((len(self._places), 3))
        for top in range(0, height, rows):
            for left in range(0, width, columns):
                block = (slice(top, top + rows), slice(left, left + columns))
                radiance = np.einsum("hwc,hw->c", light.image[block], solid_angle[block]) * np.array(light.color)
                middle = np.einsum("hwk,hw->k", directions[block], solid_angle[block])
                if radiance.any() and np.linalg.norm(middle) > 0:
                    total += self._from(middle / np.linalg.norm(middle))[:, None] * radiance
        return total

    def _from(self, direction: Float64[ndarray, " 3"]) -> Float64[ndarray, " N"]:
        cosine = self._normals @ direction
        front = np.flatnonzero(cosine > 0)
        toward = np.broadcast_to(direction, (len(front), 3))
        result = np.zeros(len(cosine))
        result[front] = cosine[front] * self._shadows.visible(front, toward, None)
        return result

    def _shadowed(self, amount: Float64[ndarray, "N c"], place: Float64[ndarray, " 3"]) -> Float64[ndarray, "N c"]:
        """`amount` where it is above 0 and nothing stands between a cell and `place`."""
        front = np.flatnonzero((amount > 0).any(axis=1))
        vector = place - self._starts[front]
        distance = lengths(vector)
        result = np.zeros_like(amount)
        visible = self._shadows.visible(front, vector / np.maximum(distance, 1e-30)[:, None], distance)
        result[front] = amount[front] * np.asarray(visible)[:, None]
        return result


def _falling(vector: ndarray, squared: ndarray, normals: ndarray, least: ndarray, strength: Strength) -> Float64[ndarray, "n _"]:
    """cos times `strength` of (r^2, unit vectors to the light, the least r^2); 0 from behind."""
    unit = vector / np.sqrt(np.maximum(squared, 1e-30))[:, None]
    cosine = np.einsum("nk,nk->n", unit, normals)
    return np.where(cosine > 0, cosine, 0.0)[:, None] * strength(squared, unit, least)


def patch_means(cells: Cells, values: Float64[ndarray, "N 3"]) -> Float64[ndarray, "K 3"]:
    """The mean over the cells of every patch, by area."""
    count = cells.patch_count
    area = np.maximum(np.bincount(cells.patches, cells.areas, count), 1e-30)
    return np.stack([np.bincount(cells.patches, cells.areas * values[:, c], count) for c in range(3)], axis=1) / area[:, None]
