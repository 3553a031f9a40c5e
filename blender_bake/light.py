# SPDX-License-Identifier: GPL-3.0-or-later
"""The only light of a light image: a sun of unit irradiance, or a point light of unit irradiance at one meter."""

from __future__ import annotations

import math
from typing import Any

import bpy
from mathutils import Vector

POINT_WATTS = 4 * math.pi  # a point light of P watts gives the irradiance P / (4 pi d^2) at d meters


class SoleLight:
    """A sun and a point light of our own, at most one of them on."""

    def __init__(self, scene: bpy.types.Scene, sun_angle: float, by_shadow_rays_alone: bool = False) -> None:
        self._sun = _point_light(scene, "SUN")
        self._sun.data.angle = sun_angle
        if by_shadow_rays_alone:  # bounced rays may not reach it
            self._sun.data.cycles.use_multiple_importance_sampling = False
        self._point = _point_light(scene, "POINT")
        self._point.data.shadow_soft_size = 0.0

    def aim(self, light: dict[str, Any] | None) -> None:
        """Turn on `light` {kind: directional, direction} (towards the light, unit) or {kind: point, position} (m); None: no light."""
        light = {"kind": None} if light is None else light
        kind = light["kind"]
        self._sun.data.energy = 1.0 if kind == "directional" else 0.0
        self._point.data.energy = POINT_WATTS if kind == "point" else 0.0
        if kind == "directional":
            # A sun shines along its local -z.
            self._sun.rotation_quaternion = Vector(light["direction"]).to_track_quat("Z", "Y")
        elif kind == "point":
            self._point.location = light["position"]


def _point_light(scene: bpy.types.Scene, kind: str) -> bpy.types.Object:
    data = bpy.data.lights.new(f"srbf {kind.lower()}", kind)
    data.energy = 0.0
    point_light = bpy.data.objects.new(data.name, data)
    point_light.rotation_mode = "QUATERNION"
    scene.collection.objects.link(point_light)
    return point_light
