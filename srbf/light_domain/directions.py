"""The light domain of directions: lights at infinity, on the whole sphere or above the horizon."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.light_domain.protocol import LightDomain
from srbf.light_geometry import environment_samples, light_vectors
from srbf.lights import AreaLight, DirectionalLight, EnvironmentLight, Falloff, Light, NamedLight, PointLight
from srbf.sphere import Domain, all_around, domain_of, mean_spacing, normalize, point_set

PIECE = 1 << 16  # texels of an environment map weighed at a time
BELOW = 3.0  # spacings: how far dense centers go on below the horizon, where a cosine would otherwise bend towards zero
BAND = 0.4  # spacings of the lights: half the height of a left-out band
BANDED_LIGHTS = 64  # at most so many bands, their middle lights evenly spaced in the list
LOWEST = np.radians(15)  # of arcs over the zenith: lower, images darken and every measure grows
CIRCLES: dict[Domain, int] = {"hemisphere": 3, "sphere": 2}


@dataclass(frozen=True)
class Directions(LightDomain):
    """Unit vectors from the surface to the light, in the `region` sphere or hemisphere (z > 0)."""

    kind: ClassVar[str] = "directions"
    captured_kinds: ClassVar[tuple[str, ...]] = ("directional",)
    falloff: ClassVar[Falloff] = "linear"
    region: Domain

    @classmethod
    def of_capture(cls, capture: Capture, region: str = "auto") -> Directions:
        """`region` auto: the hemisphere where all train lights are above the horizon. InputError on a hemisphere without lights."""
        if region not in ("auto", *get_args(Domain)):
            raise InputError(f"expected a domain of auto, sphere, hemisphere, found {region!r}")
        directions = cls.captured(capture, capture.indices("train"))
        if region == "auto":
            return cls(domain_of(directions))
        if region == "hemisphere" and len(directions) and (directions[:, 2] <= 0).all():
            raise InputError(
                f"expected train lights above the horizon (z > 0) for domain hemisphere, found all {len(directions)} below; leave it out"
            )
        return cls("sphere" if region == "sphere" else "hemisphere")

    @classmethod
    def of_manifest(cls, manifest: dict[str, Any]) -> Directions:
        return cls(manifest["domain"])

    def manifest(self) -> dict[str, Any]:
        return {"domain": self.region}

    @staticmethod
    def captured(capture: Capture, lights: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        return capture.directions(lights)

    def light(self, coordinates: Float64[ndarray, " 3"]) -> DirectionalLight:
        x, y, z = coordinates.tolist()
        return DirectionalLight((x, y, z))

    @staticmethod
    def moved(coordinates: Float64[ndarray, "n 3"], matrix: Float64[ndarray, "4 4"]) -> Float64[ndarray, "n 3"]:
        return normalize(coordinates @ matrix[:3, :3].T)

    def shared(self, lights: Sequence[Light]) -> list[tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]]:
        """Directional lights, and the texels of environment maps: radiance times solid angle, no cosine (T holds it)."""
        for light in lights:
            if isinstance(light, (AreaLight, NamedLight)):
                kind = "an area" if isinstance(light, AreaLight) else "a named"
                raise InputError(
                    f"expected directional, point, spot, sphere or environment lights for an asset of directions, found {kind} light; "
                    "capture patches for lights inside the scene, or named lights"
                )
        pieces = []
        distant = [light for light in lights if isinstance(light, DirectionalLight)]
        if distant:
            pieces.append((normalize(np.array([light.direction for light in distant])), np.array([light.color for light in distant])))
        for light in lights:
            if isinstance(light, EnvironmentLight):
                directions, solid_angle = environment_samples(light.image, self.region, light.rotation)
                height, width = light.image.shape[:2]
                rows_per_piece = max(1, PIECE // width)
                for start in range(0, height, rows_per_piece):
                    rows = slice(start, start + rows_per_piece)
                    radiance = light.image[rows] * solid_angle[rows, :, None] * np.array(light.color)
                    pieces.append((directions[rows].reshape(-1, 3), radiance.reshape(-1, 3)))
        return pieces

    def toward(self, light: PointLight, positions: Float32[ndarray, "*p 3"]) -> tuple[Float64[ndarray, "*p 3"], Float64[ndarray, "*p"]]:
        """The direction and attenuation at every receiver: the paper's approximation of a point light [Wong2005, fig. 8-10]."""
        return light_vectors(light, positions)

    @staticmethod
    def extent(coordinates: Float64[ndarray, "L 3"]) -> dict[str, Any]:
        """`elevations`: of the lowest and the highest light, rad above the horizon."""
        if not len(coordinates):
            return {}
        elevations = np.arcsin(np.clip(coordinates[:, 2], -1, 1))
        return {"elevations": [float(elevations.min()), float(elevations.max())]}

    def outside(self, lights: Sequence[Light], positions: Float32[ndarray, "n 3"] | None, fit: dict[str, Any]) -> list[str]:
        """Lights below a captured hemisphere; on a sphere, lights far above or below all train lights."""
        if self.region == "sphere":
            return _beyond_elevations(lights, fit)
        notes = []
        for i, light in enumerate(lights):
            if isinstance(light, DirectionalLight) and light.direction[2] <= 0:
                notes.append(
                    f"light {i} comes from below the captured hemisphere (z = {light.direction[2]:.3g}): its response is extrapolated"
                )
            elif isinstance(light, PointLight) and positions is not None:
                below = float((light.position[2] <= positions[:, 2]).mean()) if len(positions) else 0.0
                if below > 0:
                    notes.append(f"light {i} is below {below:.0%} of the receivers, outside the captured hemisphere: extrapolated there")
        return notes

    def spacing(self, coordinates: Float64[ndarray, "L 3"]) -> float:
        return mean_spacing(coordinates) if len(coordinates) > 1 else 1.0

    def quadrature(self, coordinates: Float64[ndarray, "L 3"]) -> Float64[ndarray, " L"]:
        """One over the density of lights: lights nearer than half the spacing count, the less the farther.

        The weights are equal on a lattice, and half for two lights in one place. A light at the edge of a dome weighs no more than its
        neighbors: the part of the sphere that was never lit does not count.
        """
        angles = np.arccos(np.clip(coordinates @ coordinates.T, -1, 1))
        density = np.maximum(0, 1 - angles / (0.5 * mean_spacing(coordinates))).sum(axis=1)
        shares = 1 / density
        return shares / shares.mean()

    def left_out_groups(self, coordinates: Float64[ndarray, "L 3"]) -> list[Int[ndarray, "_ _"]]:
        """Lights of about one elevation, each group led by the light in its middle; groups of one size are one array.

        Domes carry their lights on rings. A light of a ring is predicted by its neighbors on the ring, however badly the gap between two
        rings is filled. With the ring left out, the prediction has to come across the gap.
        """
        height = BAND * mean_spacing(coordinates)
        elevation = np.arcsin(np.clip(coordinates[:, 2], -1, 1))
        middles = np.unique(np.linspace(0, len(coordinates) - 1, min(len(coordinates), BANDED_LIGHTS)).astype(np.int64))
        found = []
        for i in middles:
            members = np.flatnonzero(np.abs(elevation - elevation[i]) < height)
            found.append([int(i), *(int(m) for m in members if m != i)])
        sizes = sorted({len(group) for group in found})
        return [np.array([group for group in found if len(group) == size], np.int64) for size in sizes]

    def centers(self, count: int, point_set_name: str) -> Float64[ndarray, "k 3"]:
        """Of the point set `hammersley`, `hammersley3` or `fibonacci`; on the hemisphere exactly `count` above the horizon."""
        return point_set(point_set_name, count, self.region)  # type: ignore[arg-type]

    def dense_centers(self, coordinates: Float64[ndarray, "L 3"], least: int = 1) -> Float64[ndarray, "B 3"]:
        """A Fibonacci set as dense as the lights, of at least `least`; on the hemisphere it goes on BELOW spacings under the horizon."""
        count = max(len(coordinates), least)
        if self.region == "sphere":
            return point_set("fibonacci", count, "sphere")
        spacing = np.sqrt(2 * np.pi / count)
        points = point_set("fibonacci", 2 * count, "sphere")
        return points[points[:, 2] > -np.sin(min(BELOW * spacing, np.pi / 2))]

    def probes(self, count: int | None = None) -> Float64[ndarray, "n 3"]:
        """A Fibonacci set; without a count about 2048 directions on the sphere, half of them on the hemisphere."""
        return all_around(self.region) if count is None else point_set("fibonacci", count, self.region)

    def nearest(self, coordinates: Float64[ndarray, "n 3"], among: Float64[ndarray, "L 3"]) -> Int[ndarray, " n"]:
        return (coordinates @ among.T).argmax(axis=1)

    def paths(self, frames: int, count: int | None = None) -> Iterator[tuple[str, Float64[ndarray, "f 3"]]]:
        """Great circles of even speed; `count` of them, by default 3 arcs over the zenith or 2 whole circles.

        On the hemisphere arcs run at evenly spaced azimuths from LOWEST above the horizon to LOWEST above it beyond; on the sphere the
        last frame of a circle is its first. InputError where a circle has fewer than 3 frames.
        """
        count = CIRCLES[self.region] if count is None else count
        each = frames // max(count, 1)
        if count < 1 or each < 3:
            raise InputError(f"expected at least one great circle of at least 3 frames, found {frames} frames for {count} circles")
        i = np.arange(count)
        if self.region == "hemisphere":
            azimuth = np.pi * (i + 0.3) / count  # off the axes, where point sets have their symmetries
            start = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(count)], axis=1)
            over = np.broadcast_to([0.0, 0.0, 1.0], (count, 3))
            angle = np.linspace(LOWEST, np.pi - LOWEST, each)
        else:
            normals = point_set("fibonacci", count, "sphere")
            start = np.cross(normals, [0.6, 0.0, 0.8])
            start /= np.linalg.norm(start, axis=1, keepdims=True)
            over = np.cross(normals, start)
            angle = np.linspace(0, 2 * np.pi, each)
        for number in i:
            path = start[number] * np.cos(angle)[:, None] + over[number] * np.sin(angle)[:, None]
            yield f"great circle {number + 1}", path


def _beyond_elevations(lights: Sequence[Light], fit: dict[str, Any]) -> list[str]:
    """A line for each directional light farther above or below all train lights than they are from each other on a whole sphere.

    None for assets that do not say where their train lights were.
    """
    if "elevations" not in fit:
        return []
    lowest, highest = fit["elevations"]
    spacing = np.sqrt(4 * np.pi / fit["train_lights"])
    notes = []
    for i, light in enumerate(lights):
        if not isinstance(light, DirectionalLight):
            continue
        elevation = float(np.arcsin(np.clip(light.direction[2] / np.linalg.norm(light.direction), -1, 1)))
        if not lowest - spacing <= elevation <= highest + spacing:
            notes.append(
                f"light {i} is at {np.degrees(elevation):.0f} degrees of elevation, far from all captured lights "
                f"({np.degrees(lowest):.0f} to {np.degrees(highest):.0f}): its response is extrapolated, likely black"
            )
    return notes
