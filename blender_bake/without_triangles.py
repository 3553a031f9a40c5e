# SPDX-License-Identifier: GPL-3.0-or-later
"""What casts shadows in Cycles and has no triangles for a scene file: hair, curves, points, volumes."""

from __future__ import annotations

import bpy
import numpy as np

from blender_bake.beside import authored_name

KINDS = {"CURVES": "hair curves", "POINTCLOUD": "point clouds", "VOLUME": "volumes"}
SHOWN = 4  # names per kind


def line(scene: bpy.types.Scene) -> str | None:
    """A warning of what direct light by rays or shadow maps will miss; None where that is nothing."""
    found: dict[str, dict[str, None]] = {}
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        obj = instance.object
        if obj.hide_render or not obj.visible_shadow:
            continue
        name = repr(authored_name(instance.parent if instance.is_instance and instance.parent else obj))
        if obj.type in KINDS:
            found.setdefault(KINDS[obj.type], {})[name] = None
        if obj.type == "MESH" and any(material and is_only_volume(material) for material in _used(obj)):
            found.setdefault("volumes", {})[name] = None
    for obj in scene.objects:
        if not obj.hide_render and obj.visible_shadow and any(_is_hair(system) for system in obj.particle_systems):
            found.setdefault("hair", {})[repr(authored_name(obj))] = None
    if not found:
        return None
    listed = [f"{kind} of {', '.join(list(names)[:SHOWN])}{', …' if len(names) > SHOWN else ''}" for kind, names in found.items()]
    return f"no triangles in scene.glb, so no shadow in direct light by rays or shadow maps: {'; '.join(listed)}"


def is_only_volume(material: bpy.types.Material) -> bool:
    """Whether a material has no surface that could stop light: its output holds a volume, or nothing."""
    if not material.use_nodes or material.node_tree is None:
        return False
    output = material.node_tree.get_output_node("CYCLES")
    return output is not None and bool(output.inputs["Volume"].links) and not output.inputs["Surface"].links


def _used(obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    """The materials of a mesh object that some face has."""
    slots = obj.material_slots
    of_faces = np.empty(len(obj.data.polygons), np.int32)
    obj.data.polygons.foreach_get("material_index", of_faces)
    return [slots[i].material for i in np.unique(of_faces) if i < len(slots)]


def _is_hair(system: bpy.types.ParticleSystem) -> bool:
    return system.settings.type == "HAIR" and system.settings.render_type == "PATH"
