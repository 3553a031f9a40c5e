# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as a FRAMES.json writes them, made in Blender, all of them on: what the values of `scene_lights` are turned back into."""

from __future__ import annotations

import math
from typing import Any

import bpy
from mathutils import Matrix, Vector

from blender_bake.ipc import WorkerError
from blender_bake.light import AREA_WATTS, POINT_WATTS
from blender_bake.light_frame import rotation

TYPES = {"directional": "SUN", "point": "POINT", "sphere": "POINT", "spot": "SPOT", "area": "AREA"}


def make(scene: bpy.types.Scene, lights: list[dict[str, Any]], sun_angle: float = 0.0) -> None:
    """Add the lights to the scene. WorkerError for kinds that Blender lacks.

    `sun_angle`: angular diameter of suns that do not say their `angle`, rad. A `profile` is the path of its file, an IES file or an image.
    """
    for light in lights:
        kind = light["kind"]
        if kind not in TYPES:
            raise WorkerError(f"expected lights of {', '.join(TYPES)}, found {kind}")
        data = bpy.data.lights.new(f"srbf given {kind}", TYPES[kind])
        color = [float(value) for value in light.get("color", (1, 1, 1))]
        most = max(max(color), 0.0)
        data.color = [value / most for value in color] if most else (0, 0, 0)
        data.energy = most * _watts(light)
        obj = bpy.data.objects.new(data.name, data)
        obj.matrix_world = _placed(light, data, sun_angle)
        if light.get("falloff") == "linear" or "profile" in light:
            _with_nodes(data, light)
        scene.collection.objects.link(obj)
        for link, place in (("receivers", "receiver_collection"), ("blockers", "blocker_collection")):
            if link in light:
                setattr(obj.light_linking, place, _collection(scene, light[link]))


def _collection(scene: bpy.types.Scene, chosen: dict[str, list[str]]) -> bpy.types.Collection:
    """Of light linking. WorkerError for objects that the scene lacks.

    `only` none is of one that nothing renders: a collection without any chooses all.
    """
    collection = bpy.data.collections.new("srbf linked")
    states = dict.fromkeys(chosen.get("only", ()), "INCLUDE") | dict.fromkeys(chosen.get("without", ()), "EXCLUDE")
    for name in states:
        if name not in scene.objects:
            raise WorkerError(f"expected objects of the scene that a light is linked to, found {name!r}; give the .blend of the bake")
        collection.objects.link(scene.objects[name])
    for member, obj in zip(collection.collection_objects, collection.objects, strict=True):
        member.light_linking.link_state = states[obj.name]
    if "only" in chosen and "INCLUDE" not in states.values():
        collection.objects.link(bpy.data.objects.new("srbf nothing", None))
    return collection


def _watts(light: dict[str, Any]) -> float:
    """Watts, or irradiance of a sun, of a light whose irradiance at a0 is 1."""
    if light["kind"] == "directional":
        return 1.0
    a0 = light.get("a0", 1.0)
    if light["kind"] == "area":
        return AREA_WATTS * a0**2
    return POINT_WATTS * (a0 if light.get("falloff") == "linear" else a0**2)


def _placed(light: dict[str, Any], data: bpy.types.Light, sun_angle: float) -> Matrix:
    """Sets what only its type has; where it is."""
    kind = light["kind"]
    if kind == "directional":
        data.angle = light.get("angle", sun_angle)
        return Vector(light["direction"]).to_track_quat("Z", "Y").to_matrix().to_4x4()
    place = Matrix.Translation(light["position"])
    profile = "profile" in light
    turned = rotation(Vector(light.get("direction", (0, 0, -1))), light.get("roll", 0.0)) if profile else Matrix()
    if kind in ("point", "sphere"):
        data.shadow_soft_size = light.get("size", 0.0)
        return place @ turned
    if kind == "spot":
        edge = math.cos(light["outer"])
        data.shadow_soft_size, data.spot_size = light.get("size", 0.0), 2 * light["outer"]
        data.use_soft_falloff = False  # else it is a disk that turns to each receiver
        data.spot_blend = min(1.0, (math.cos(light["inner"]) - edge) / max(1 - edge, 1e-9))
        return place @ (turned if profile else Vector(light["direction"]).to_track_quat("-Z", "Y").to_matrix().to_4x4())
    u, v = Vector(light["u"]), Vector(light["v"])
    data.shape, data.size, data.size_y = "RECTANGLE", u.length, v.length
    axes = (u.normalized(), -v.normalized(), -u.cross(v).normalized())  # it shines along its local -z
    return place @ Matrix(axes).transposed().to_4x4()


def _with_nodes(data: bpy.types.Light, light: dict[str, Any]) -> None:
    """Let it fall with 1 / d in place of 1 / d2 where that is asked for, and shine by its profile where it has one."""
    data.use_nodes = True
    nodes, links = data.node_tree.nodes, data.node_tree.links
    nodes.clear()
    emission = nodes.new("ShaderNodeEmission")
    strength = emission.inputs["Strength"]
    links.new(emission.outputs[0], nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    path = light.get("profile", "")
    if path.lower().endswith(".ies"):
        shape = nodes.new("ShaderNodeTexIES")
        shape.mode, shape.filepath = "EXTERNAL", path
        shape.inputs["Strength"].default_value = 1.0
        links.new(shape.outputs["Fac"], strength)
        strength = shape.inputs["Strength"]
    elif path:
        image, place = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeTexCoord")
        image.image, image.extension = bpy.data.images.load(path), "EXTEND"
        links.new(place.outputs["UV"], image.inputs["Vector"])
        links.new(image.outputs["Color"], emission.inputs["Color"])
    if light.get("falloff") == "linear":
        falloff = nodes.new("ShaderNodeLightFalloff")
        falloff.inputs["Strength"].default_value = 1.0
        links.new(falloff.outputs["Linear"], strength)
