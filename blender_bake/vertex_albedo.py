# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo of networks of textures, baked by Cycles to the corners of faces."""

from __future__ import annotations

import bpy
import numpy as np

from blender_bake.ipc import WorkerError
from blender_bake.receiver_objects import select

ATTRIBUTE = "srbf albedo"


class AlbedoBakes:
    """Copies of evaluated objects, gathered while the scene is read and then baked together.

    Textures in object coordinates use its transform, generated ones the bounds of its mesh after modifiers.
    """

    def __init__(self) -> None:
        self._meshes: dict[str, tuple[bpy.types.Mesh, np.ndarray]] = {}

    def add(self, key: str, obj: bpy.types.Object, matrix: np.ndarray, materials: list[bpy.types.Material | None]) -> None:
        """Keep an evaluated object's mesh under a key, with the `materials` of its slots; one that is there already stays."""
        if key in self._meshes:
            return
        depsgraph = bpy.context.evaluated_depsgraph_get()
        mesh = bpy.data.meshes.new_from_object(obj, preserve_all_data_layers=True, depsgraph=depsgraph)
        mesh.materials.clear()
        for material in materials:
            mesh.materials.append(material.original if material else None)
        self._meshes[key] = (mesh, matrix)

    def bake(self, scene: bpy.types.Scene) -> dict[str, np.ndarray]:
        """(corners, 3) linear albedo by key. It hides every other object of the scene from rendering."""
        if not self._meshes:
            return {}
        bake_colors(scene, list(self._meshes.values()))
        return {key: corner_colors(mesh) for key, (mesh, _) in self._meshes.items()}


def bake_colors(scene: bpy.types.Scene, placed: list[tuple[bpy.types.Mesh, np.ndarray]], kind: str = "DIFFUSE") -> list[bpy.types.Object]:
    """Objects of meshes and transforms, whose attribute is now the color of every corner; all else is hidden from rendering.

    kind: DIFFUSE; GLOSSY, what its gloss reflects of light along the normal; or EMIT.
    """
    for other in scene.objects:
        other.hide_render = True
    objects = []
    for mesh, matrix in placed:
        obj = bpy.data.objects.new(ATTRIBUTE, mesh)
        obj.matrix_world = [list(map(float, row)) for row in matrix]
        scene.collection.objects.link(obj)
        mesh.color_attributes.new(ATTRIBUTE, "FLOAT_COLOR", "CORNER")
        mesh.color_attributes.active_color = mesh.color_attributes[ATTRIBUTE]
        objects.append(obj)
    select(objects)
    scene.cycles.samples, scene.cycles.seed = 1, 0
    try:
        result = bpy.ops.object.bake(
            type=kind,
            pass_filter={"COLOR"},
            target="VERTEX_COLORS",
            use_clear=True,
            margin=0,
            use_selected_to_active=False,
            use_cage=False,
        )
    except RuntimeError as error:
        reason = str(error).replace("Error: ", "").strip().replace("\n", " ")
        raise WorkerError(f"Blender could not bake the albedo of {len(objects)} objects: {reason}") from error
    if result != {"FINISHED"}:
        raise WorkerError(f"Blender's bake of the albedo of {len(objects)} objects ended as {', '.join(result)}, without a reason")
    return objects


def corner_colors(mesh: bpy.types.Mesh, most: float = 1.0) -> np.ndarray:
    """(corners, 3) linear colors, 0 to `most`, of a mesh that was baked."""
    colors = np.empty(len(mesh.loops) * 4, np.float32)
    mesh.color_attributes[ATTRIBUTE].data.foreach_get("color", colors)
    return np.clip(np.nan_to_num(colors.reshape(-1, 4)[:, :3]), 0, most)
