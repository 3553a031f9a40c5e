# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights to relight by: suns as directions and irradiance, point lights as positions and irradiance at a distance a0."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np


@dataclass(frozen=True)
class Sun:
    """`direction` (unit) towards the light, `color` its irradiance on a surface facing it."""

    direction: tuple[float, float, float]
    color: tuple[float, float, float]


@dataclass(frozen=True)
class PointLight:
    """A point light; `color` is its irradiance at the distance a0."""

    position: tuple[float, float, float]
    color: tuple[float, float, float]


def lights_of(
    scene: bpy.types.Scene, a0: float, depsgraph: bpy.types.Depsgraph | None = None
) -> tuple[list[Sun], list[PointLight], list[str]]:
    """(suns, point lights, names of other lights, which are not shown) that would light a render of the scene.

    A sun of strength 1 has unit irradiance; a point light of P watts has P / (4 pi a0^2) at a0 meters.
    """
    suns, point_lights, others = [], [], []
    for obj in sorted((o for o in scene.objects if o.type == "LIGHT" and not o.hide_render), key=lambda o: o.name):
        evaluated = obj if depsgraph is None else obj.evaluated_get(depsgraph)
        light, matrix = evaluated.data, np.array(evaluated.matrix_world)
        if light.type == "SUN":
            axis = matrix[:3, 2]
            suns.append(Sun(_triple(axis / np.linalg.norm(axis)), _color(light, 1.0)))
        elif light.type == "POINT":
            point_lights.append(PointLight(_triple(matrix[:3, 3]), _color(light, 1 / (4 * math.pi * a0**2))))
        else:
            others.append(obj.name)
    return suns, point_lights, others


def _color(light: bpy.types.Light, scale: float) -> tuple[float, float, float]:
    """Color times power, and in later Blenders times exposure (stops) and the color of a temperature."""
    color = np.array(light.color) * light.energy * 2.0 ** getattr(light, "exposure", 0.0) * scale
    if getattr(light, "use_temperature", False):
        color *= np.array(light.temperature_color)
    return _triple(color)


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    return (float(vector[0]), float(vector[1]), float(vector[2]))
