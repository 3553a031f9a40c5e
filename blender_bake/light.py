# SPDX-License-Identifier: GPL-3.0-or-later
"""The only light of a light image: a sun or a point light of ours, of unit irradiance (at one meter), or one of the scene's own."""

from __future__ import annotations

import math
from typing import Any

import bpy
from mathutils import Matrix, Vector

from blender_bake.environment import EnvironmentWorld
from blender_bake.named_lights import NamedLights

AREA_WATTS = math.pi  # a Lambertian surface of P watts gives P / (pi d^2) on its axis, far away
POINT_WATTS = 4 * math.pi  # a point light of P watts gives the irradiance P / (4 pi d^2) at d meters


class SoleLight:
    """The light that shines: a sun or a point light of our own, one of the scene's `named` lights, or a patch of the surfaces.

    by_shadow_rays_alone: the sun's disc is not met by bounced rays. patches: the file of `EmissivePatches`, read when one is asked for.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        sun_angle: float,
        by_shadow_rays_alone: bool = False,
        named: NamedLights | None = None,
        patches: str | None = None,
    ) -> None:
        self._scene, self._named, self._file = scene, named, patches
        self._patches: Any = None
        self._sun = _point_light(scene, "SUN")
        self._sun.data.angle = sun_angle
        if by_shadow_rays_alone:  # bounced rays may not reach it
            self._sun.data.cycles.use_multiple_importance_sampling = False
        self._point = _point_light(scene, "POINT")
        self._point.data.shadow_soft_size = 0.0
        self._others: dict[str, bpy.types.Object] = {}
        self._environment: EnvironmentWorld | None = None

    def aim(self, light: dict[str, Any] | None) -> None:
        """Turn on `light` alone; None: no light.

        {kind: directional, direction} (towards the light, unit), {kind: point, position} (m), {kind: named, name}, {kind: patch, patch}; to
        measure others by, {kind: spot, position, direction, outer} (where it shines, half-angle in rad, a sharp edge) and {kind: area,
        position, u, v} (side vectors, m; it shines towards u x v), of unit irradiance at 1 m on the axis far away, and {kind: environment,
        file} (see `EnvironmentWorld`).
        """
        light = {"kind": None} if light is None else light
        kind = light["kind"]
        self._sun.data.energy = 1.0 if kind == "directional" else 0.0
        self._point.data.energy = POINT_WATTS if kind == "point" else 0.0
        if kind == "directional":
            # A sun shines along its local -z.
            self._sun.rotation_quaternion = Vector(light["direction"]).to_track_quat("Z", "Y")
        elif kind == "point":
            self._point.location = light["position"]
        self._aim_other(light)
        if kind == "environment" and self._environment is None:
            self._environment = EnvironmentWorld(self._scene)
        if self._environment is not None:
            self._environment.set(light.get("file"))
        if self._named is not None:
            self._named.aim(light["name"] if kind == "named" else None)
        if kind == "patch" and self._patches is None and self._file is not None:
            from blender_bake.emissive_patches import EmissivePatches

            self._patches = EmissivePatches(self._scene, self._file)
        if self._patches is not None:
            self._patches.aim(light["patch"] if kind == "patch" else None)

    def _aim_other(self, light: dict[str, Any]) -> None:
        """A spot or an area light, made when first asked for."""
        for kind, other in self._others.items():
            other.data.energy = 0.0 if kind != light["kind"] else other.data.energy
        if light["kind"] not in ("spot", "area"):
            return
        if light["kind"] not in self._others:
            self._others[light["kind"]] = _point_light(self._scene, light["kind"].upper())
        shining = self._others[light["kind"]]
        if light["kind"] == "spot":
            shining.data.energy, shining.data.shadow_soft_size = POINT_WATTS, 0.0
            shining.data.spot_size, shining.data.spot_blend = 2 * light["outer"], 0.0
            shining.location = light["position"]
            shining.rotation_quaternion = Vector(light["direction"]).to_track_quat("-Z", "Y")
            return
        u, v = Vector(light["u"]), Vector(light["v"])
        shining.data.energy, shining.data.shape = AREA_WATTS, "RECTANGLE"
        shining.data.size, shining.data.size_y = u.length, v.length
        frame = Matrix((u.normalized(), -v.normalized(), -u.cross(v).normalized())).transposed()  # it shines along its local -z
        shining.location, shining.rotation_quaternion = light["position"], frame.to_quaternion()


def _point_light(scene: bpy.types.Scene, kind: str) -> bpy.types.Object:
    data = bpy.data.lights.new(f"srbf {kind.lower()}", kind)
    data.energy = 0.0
    point_light = bpy.data.objects.new(data.name, data)
    point_light.rotation_mode = "QUATERNION"
    scene.collection.objects.link(point_light)
    return point_light
