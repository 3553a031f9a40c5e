"""Point and spot lights for the figures, derived from the positions of the receivers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.asset import Asset
from srbf.lights import Light, PointLight, SpotLight, moved, triple

LIGHTS_PER_STRIP = 6
MARGIN_QUANTILE = 0.02  # of the positions at either end are ignored, so that a distant horizon does not move the lights away
INWARD = 0.15  # mean of n . (center - p) over the two horizontal axes, in half sizes: above this, walls face inward, as in a room
TOP_QUANTILE = 0.995  # of the receivers' height along `out`; the lights are above it
FLAT_NORMAL = 0.15  # a shorter mean normal does not define a front


@dataclass(frozen=True, eq=False)
class Stage:
    """Frame of the receivers: center, mean normal `out`, longest side `along` perpendicular to it, half sizes and top (m)."""

    center: Float64[ndarray, " 3"]
    out: Float64[ndarray, " 3"]
    along: Float64[ndarray, " 3"]
    half_along: float
    half_out: float
    top: float
    radius: float
    inside: bool

    def point_light_at(self, t: float, lift: float = 1.0) -> Float64[ndarray, " 3"]:
        """A position on the arc, t from 0 to 1: in front of the receivers, or among them if they face inward."""
        side = -np.cos(np.pi * (0.12 + 0.76 * t)) * self.half_along * (0.6 if self.inside else 0.95)
        bow = np.sin(np.pi * (0.12 + 0.76 * t))
        height = 0.35 * bow * self.half_out if self.inside else self.top + lift * self.radius * (0.16 + 0.14 * bow)
        return self.center + side * self.along + height * self.out


def stage_of(asset: Asset, covered: ndarray) -> Stage:
    """The stage of the covered positions, in the asset's frame; `out` is the mean normal, or +z without normals."""
    positions = asset.images["position"][covered].astype(np.float64)
    low, high = np.quantile(positions, [MARGIN_QUANTILE, 1 - MARGIN_QUANTILE], axis=0)
    center, half = (low + high) / 2, (high - low) / 2
    radius = max(float(np.linalg.norm(half)), 1e-3)
    out, inside = np.array([0.0, 0.0, 1.0]), False
    if "normal" in asset.images:
        normals = asset.images["normal"][covered].astype(np.float64)
        mean = normals.mean(axis=0)
        inward = (normals * (center - positions) / np.maximum(half, 1e-3 * radius)).mean(axis=0)
        inside = float(inward[:2].sum()) > INWARD
        if np.linalg.norm(mean) > FLAT_NORMAL and not inside:
            axis = int(np.argmax(np.abs(mean)))
            out = np.sign(mean[axis]) * np.eye(3)[axis]
    if asset.domain == "hemisphere" and out[2] < 0:
        out = np.array([0.0, 0.0, 1.0])
    across = half * (1 - np.abs(out))
    top = float(np.quantile((positions - center) @ out, TOP_QUANTILE))
    along = np.eye(3)[int(np.argmax(across))]
    return Stage(center, out, along, max(float(across.max()), 1e-3), float(half @ np.abs(out)), top, radius, inside)


def demonstration_point_lights(
    asset: Asset, covered: ndarray, given: Sequence[Light] | None
) -> tuple[tuple[PointLight, ...], tuple[SpotLight, ...]]:
    """(point lights, spot lights) in world space: those of `given`, else derived; none without covered positions.

    The a0 of a derived light is the distance from the middle of its path to the receivers' center: there, its irradiance at the
    center is 1, as that of a captured light.
    """
    if "position" not in asset.images or not covered.any():
        return (), ()
    stage = stage_of(asset, covered)
    world = np.linalg.inv(asset.asset_from_world)
    given = given or ()
    points: tuple[PointLight, ...] = tuple(light for light in given if isinstance(light, PointLight) and not isinstance(light, SpotLight))
    spots: tuple[SpotLight, ...] = tuple(light for light in given if isinstance(light, SpotLight))
    if not points:
        points = tuple(_point(stage, t, world) for t in np.linspace(0, 1, LIGHTS_PER_STRIP))
    if not spots:
        spots = tuple(_spot(stage, t, world) for t in np.linspace(0, 1, LIGHTS_PER_STRIP))
    return points, spots


def moving_point(asset: Asset, covered: ndarray, t: float) -> PointLight:
    """The derived point light at t in [0, 1] of its arc, in world space."""
    return _point(stage_of(asset, covered), t, np.linalg.inv(asset.asset_from_world))


def _point(stage: Stage, t: float, world: Float64[ndarray, "4 4"]) -> PointLight:
    position = stage.point_light_at(t)
    a0 = max(float(np.linalg.norm(stage.point_light_at(0.5) - stage.center)), 1e-3)
    return cast(PointLight, moved(PointLight(triple(position), a0=a0), world))


def _spot(stage: Stage, t: float, world: Float64[ndarray, "4 4"]) -> SpotLight:
    position = stage.point_light_at(0.5, lift=2.0)
    target = stage.center + (2 * t - 1) * 0.7 * stage.half_along * stage.along - stage.half_out * stage.out
    ray = target - position
    distance = max(float(np.linalg.norm(position - stage.center)), 1e-3)
    outer = float(np.arctan(0.4 * stage.radius / distance))
    spot = SpotLight(triple(position), a0=distance, direction=triple(ray), inner=0.6 * outer, outer=outer)
    return cast(SpotLight, moved(spot, world))
