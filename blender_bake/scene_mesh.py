# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as it is rendered, for a glTF of it: triangles with their UVs and colors by object and material, materials, the camera."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_bake import scene_file
from blender_bake.ipc import WorkerError, hand_over
from blender_bake.pbr_material import PbrMaterial, pbr_material_of
from blender_bake.receiver_objects import prepare
from blender_bake.unwrap import layer_coordinates
from blender_bake.vertex_albedo import AlbedoBakes
from blender_bake.vertices import texel_middles

SHORTEST = 1e-12


def response(scene: bpy.types.Scene, job: dict[str, Any]) -> dict[str, Any]:
    """What `job["mesh"]` asks for: `parts`, `materials` and `camera`.

    mesh.receivers: those of a capture: {object, uv_layer, per_loop: a file of (loops, 2) coordinates where the bake made the layer}, or
        {object, vertices: their number}
    parts: {object, material (index), file, columns: [[name, width], ...]}: float32 rows of every corner, three per triangle; columns are
        position, normal, uv (of the layer that renders), lightmap (a receiver's), color (baked albedo), the last three optional
    materials: see `PbrMaterial.record`
    camera: {name, pose (4 x 4, rows), ...} or null, see `_camera`
    Objects that the camera cannot see are left out, unless they are receivers.
    """
    scratch = Path(job["scratch"])
    scene_file.show_as_rendered(scene)
    lightmaps = _lightmaps(scene, job["mesh"]["receivers"], scratch)
    bakes = AlbedoBakes()
    pieces = list(_pieces(lightmaps, bakes))
    if not pieces:
        raise WorkerError(f"expected objects that render in scene {scene.name!r}, found none; enable them in renders and save the .blend")
    albedo = bakes.bake(scene)
    surfaces = list(dict.fromkeys(piece.surface for piece in pieces))
    parts = []
    for i, piece in enumerate(pieces):
        columns = dict(piece.columns)
        if piece.bake is not None:
            columns["color"] = albedo[piece.bake][piece.loops]
        file = hand_over(scratch, f"part_{i}", np.concatenate(list(columns.values()), axis=1))
        parts.append(
            {
                "object": piece.object,
                "material": surfaces.index(piece.surface),
                "file": file,
                "columns": [[name, values.shape[1]] for name, values in columns.items()],
            }
        )
    return {"parts": parts, "materials": [surface.record() for surface in surfaces], "camera": _camera(scene)}


@dataclass(frozen=True, eq=False)
class _Piece:
    """An object's triangles of one surface: values at the corners by column, the loops of these, and which bake has their colors."""

    object: str
    surface: PbrMaterial
    loops: np.ndarray
    columns: dict[str, np.ndarray]
    bake: str | None


def _lightmaps(scene: bpy.types.Scene, receivers: list[dict[str, Any]], scratch: Path) -> dict[str, np.ndarray]:
    """(loops, 2) coordinates in the image of each receiver, v up; its modifiers are applied as a bake applies them."""
    prepare(scene, [receiver["object"] for receiver in receivers])
    found = {}
    for receiver in receivers:
        name, layer = receiver["object"], receiver.get("uv_layer")
        mesh = scene.objects[name].data
        if "vertices" in receiver:
            if len(mesh.vertices) != receiver["vertices"]:
                raise WorkerError(
                    f"expected {name!r} with the {receiver['vertices']} vertices of the capture, found {len(mesh.vertices)}; "
                    "give the .blend that it was baked from"
                )
            found[name] = texel_middles(mesh)
        elif receiver["per_loop"] is not None:
            found[name] = np.load(scratch / receiver["per_loop"])
            if found[name].shape != (len(mesh.loops), 2):
                raise WorkerError(
                    f"expected {name!r} with the {len(found[name])} face corners that the capture has UVs of, found {len(mesh.loops)}; "
                    "give the .blend that it was baked from"
                )
        elif layer in mesh.uv_layers:
            found[name] = layer_coordinates(mesh, layer)
        else:
            there = ", ".join(repr(one.name) for one in mesh.uv_layers) or "none"
            raise WorkerError(
                f"expected the capture's UV layer {layer!r} on {name!r}, found {there}; give the .blend that it was baked from"
            )
    return found


def _pieces(lightmaps: dict[str, np.ndarray], bakes: AlbedoBakes) -> Iterator[_Piece]:
    for shown in scene_file.rendered():
        obj = shown.object
        lightmap = None if shown.is_instance else lightmaps.get(shown.name)
        if not obj.visible_camera and lightmap is None:
            continue
        mesh = obj.to_mesh()
        if mesh is None:
            continue
        yield from _of_mesh(shown, mesh, lightmap, bakes)
        obj.to_mesh_clear()


def _of_mesh(shown: scene_file.Shown, mesh: bpy.types.Mesh, lightmap: np.ndarray | None, bakes: AlbedoBakes) -> Iterator[_Piece]:
    corners = scene_file.corners_of(mesh, shown.matrix)
    columns = {"position": corners.places, "normal": _unit_normals(corners)}
    layer = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
    if layer is not None:
        columns["uv"] = layer_coordinates(mesh, layer)[corners.loops]
    if lightmap is not None:
        columns["lightmap"] = lightmap[corners.loops]
    order = np.arange(len(corners.loops)).reshape(-1, 3)
    if np.linalg.det(shown.matrix[:3, :3]) < 0:  # a mirror flips the triangles
        order = order[:, ::-1]
    sound = np.isfinite(corners.places).all(axis=1).reshape(-1, 3).all(axis=1)
    materials = _materials(shown.object, mesh)
    slots = np.minimum(corners.materials, len(materials) - 1)
    surfaces = [pbr_material_of(material) for material in materials]
    key = f"{shown.object.name_full}\n{mesh.name}\n{len(mesh.loops)}"
    for slot in np.unique(slots[sound]):
        surface = surfaces[slot]
        chosen = order[sound & (slots == slot)].ravel()
        baked = key if surface.varies and surface.is_diffuse else None
        if baked is not None:
            bakes.add(key, shown.object, shown.matrix, materials)
        yield _Piece(shown.name, surface, corners.loops[chosen], {name: values[chosen] for name, values in columns.items()}, baked)


def _unit_normals(corners: scene_file.Corners) -> np.ndarray:
    """(corners, 3) the mesh's normals, those of the triangles where it has none, up where these have none."""
    normals = np.nan_to_num(corners.normals)
    lacking = np.linalg.norm(normals, axis=1) < 0.5
    if lacking.any():
        a, b, c = (corners.places[i::3] for i in range(3))
        flat = np.nan_to_num(np.cross(b - a, c - a))
        length = np.linalg.norm(flat, axis=1, keepdims=True)
        flat = np.where(length > SHORTEST, flat / np.maximum(length, SHORTEST), [0, 0, 1])
        normals[lacking] = np.repeat(flat, 3, axis=0)[lacking]
    return normals


def _materials(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> list[bpy.types.Material | None]:
    """Of the slots, the object's own before the mesh's; at least one."""
    slots = [slot.material for slot in obj.material_slots]
    of_mesh = list(mesh.materials)
    count = max(len(slots), len(of_mesh), 1)
    slots += [None] * (count - len(slots))
    of_mesh += [None] * (count - len(of_mesh))
    return [own or other for own, other in zip(slots, of_mesh, strict=True)]


def _camera(scene: bpy.types.Scene) -> dict[str, Any] | None:
    """The scene's camera: `yfov` (rad) or `ymag` (half the height, m), `aspect` (width / height), `near` and `far` (m).

    None where there is none, or one that is neither perspective nor orthographic. A shifted lens is straightened.
    """
    obj = scene.camera
    if obj is None or obj.type != "CAMERA" or obj.data.type not in {"PERSP", "ORTHO"}:
        return None
    corners = np.array(obj.data.view_frame(scene=scene))
    width, height, away = *np.ptp(corners[:, :2], axis=0), abs(corners[0, 2])
    pose = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.normalized()
    shape = {"yfov": 2 * math.atan(height / 2 / away)} if obj.data.type == "PERSP" else {"ymag": height / 2}
    return {
        "name": obj.name,
        "pose": [list(row) for row in pose],
        "aspect": float(width / height),
        "near": obj.data.clip_start,
        "far": obj.data.clip_end,
        **{key: float(value) for key, value in shape.items()},
    }
