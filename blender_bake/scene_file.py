# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers and occluders as a binary glTF: triangles in the world's frame, instances and modifiers applied, no lights, no cameras.

glTF is y-up: the one root node turns Blender's z-up frame into it, and its meshes hold Blender's world coordinates as they are.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from blender_bake import as_rendered, world_normals
from blender_bake.translucency import Curve
from blender_bake.without_triangles import is_only_volume

SOLID = {"MESH", "CURVE", "SURFACE", "FONT", "META"}  # kinds of objects with faces
Z_UP_TO_Y_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # quaternion x, y, z, w: -90 degrees about x
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
FLOAT, UNSIGNED_INT = 5126, 5125
TRIANGLES = 4


@dataclass(frozen=True)
class Part:
    """Triangles of one object and material: corners (V, 3), their normals (V, 3), and V / 3 triangles in order.

    `lightmap` (V, 2): lightmap coordinates of a receiver's corners, (0, 0) at the top left of the image; None for other objects.
    """

    object: str
    material: str | None
    casts: bool
    corners: np.ndarray
    normals: np.ndarray
    lightmap: np.ndarray | None = None


def show_as_rendered(scene: bpy.types.Scene) -> None:
    """Make the viewport's scene that of a render, visibility and subdivision, so that it can be read from Python."""
    for collection in bpy.data.collections:
        collection.hide_viewport = collection.hide_render
    layers = [bpy.context.view_layer.layer_collection]
    while layers:
        layer = layers.pop()
        layer.hide_viewport = False
        layers += layer.children
    for obj in tuple(bpy.context.view_layer.objects):  # showing one rebuilds the layer
        obj.hide_set(False)
    for obj in scene.objects:
        obj.hide_viewport = obj.hide_render
        as_rendered.settle_object(obj)
        if obj.type in {"CURVE", "SURFACE", "FONT"} and getattr(obj.data, "render_resolution_u", 0):
            obj.data.resolution_u = obj.data.render_resolution_u


def parts(receivers: Mapping[str, str] | None) -> Iterator[Part]:
    """Every renderable object that casts shadows or receives light, by material.

    `receivers`: the UV layer of each object of a lightmap; all that the camera sees receives light where None.
    """
    for shown in rendered():
        obj = shown.object
        casts = obj.visible_shadow
        if not (casts or (obj.visible_camera if receivers is None else shown.name in receivers)):
            continue
        mesh = obj.to_mesh()
        if mesh is not None:
            layer = None if receivers is None or shown.is_instance else mesh.uv_layers.get(receivers.get(shown.name, ""))
            yield from _by_material(shown, casts, mesh, layer)
            obj.to_mesh_clear()


@dataclass(frozen=True)
class Shown:
    """An evaluated object with faces, or an instance of one: name of the object that shows it, world matrix (4, 4)."""

    object: bpy.types.Object
    name: str
    is_instance: bool
    matrix: np.ndarray


def rendered() -> Iterator[Shown]:
    """All that renders of the scene, see `show_as_rendered`; each is valid until the next iteration."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type not in SOLID or obj.hide_render or not (instance.is_instance or instance.show_self):
            continue
        name = instance.parent.name if instance.is_instance and instance.parent else obj.name
        yield Shown(obj, name, instance.is_instance, np.array(instance.matrix_world))


@dataclass(frozen=True)
class Corners:
    """Triangles of a mesh in the world, T of them: the loop of each corner (3 T), its place and normal (3 T, 3), each one's slot (T)."""

    loops: np.ndarray
    places: np.ndarray
    normals: np.ndarray
    materials: np.ndarray


def corners_of(mesh: bpy.types.Mesh, matrix: np.ndarray) -> Corners:
    """The mesh's triangles where `matrix` (4, 4) puts them."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops = np.empty(count * 3, np.int32)
    materials = np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("material_index", materials)
    vertices = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    normals = np.empty(len(mesh.loops) * 3, np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    corners = points.reshape(-1, 3)[vertices[loops]] @ matrix[:3, :3].T + matrix[:3, 3]
    turned = world_normals.of_mesh(normals.reshape(-1, 3)[loops], matrix[:3, :3])
    return Corners(loops, corners, turned, materials)


def _by_material(shown: Shown, casts: bool, mesh: bpy.types.Mesh, layer: bpy.types.MeshUVLoopLayer | None) -> Iterator[Part]:
    found, slots = corners_of(mesh, shown.matrix), shown.object.material_slots
    lightmap = None
    if layer is not None:
        uv = np.empty(len(mesh.loops) * 2, np.float32)
        layer.uv.foreach_get("vector", uv)
        lightmap = (uv.reshape(-1, 2) * [1, -1] + [0, 1])[found.loops].astype("<f4")
    for index in np.unique(found.materials):
        chosen = np.repeat(found.materials == index, 3)
        slot = slots[index].material if index < len(slots) else None
        if slot is not None and is_only_volume(slot):
            continue
        places, normals = found.places[chosen].astype("<f4"), found.normals[chosen].astype("<f4")
        yield Part(shown.name, slot.name if slot else None, casts, places, normals, None if lightmap is None else lightmap[chosen])


def write_glb(parts: list[Part], transmittances: Mapping[str, Curve]) -> bytes:
    """The parts as one .glb. transmittances: of one wall of the materials that light passes without scattering, by name.

    They are written twice: the mean, as a transmission that any reader understands, and by cosine in the extras `tint_by_cosine`.
    An object that casts no shadow has `casts_shadow: false` in its node's extras. A receiver's lightmap coordinates are the attribute
    `_LIGHTMAP`.
    """
    names = sorted({part.material for part in parts if part.material is not None})
    meshes: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    views: list[dict[str, Any]] = []
    body = bytearray()

    def put(array: np.ndarray, component: int, kind: str, target: int, **limits: Any) -> int:
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": array.nbytes, "target": target})
        body.extend(array.tobytes())
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind, **limits})
        return len(accessors) - 1

    for part in parts:
        columns = [part.corners, part.normals, *([] if part.lightmap is None else [part.lightmap])]
        both, index = np.unique(np.concatenate(columns, axis=1), axis=0, return_inverse=True)
        corners, normals = np.ascontiguousarray(both[:, :3]), np.ascontiguousarray(both[:, 3:6])
        limits = {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()}
        primitive: dict[str, Any] = {
            "attributes": {
                "POSITION": put(corners, FLOAT, "VEC3", ARRAY_BUFFER, **limits),
                "NORMAL": put(normals, FLOAT, "VEC3", ARRAY_BUFFER),
            },
            "indices": put(index.ravel().astype("<u4"), UNSIGNED_INT, "SCALAR", ELEMENT_ARRAY_BUFFER),
            "mode": TRIANGLES,
        }
        if part.lightmap is not None:
            primitive["attributes"]["_LIGHTMAP"] = put(np.ascontiguousarray(both[:, 6:]), FLOAT, "VEC2", ARRAY_BUFFER)
        if part.material is not None:
            primitive["material"] = names.index(part.material)
        meshes.append({"name": part.object, "primitives": [primitive]})
        nodes.append({"name": part.object, "mesh": len(meshes) - 1, **({} if part.casts else {"extras": {"casts_shadow": False}})})
    root = {"name": "z-up to y-up", "rotation": Z_UP_TO_Y_UP, "children": list(range(len(nodes)))}
    passing = any(name in transmittances for name in names)
    document = {
        "asset": {"version": "2.0", "generator": "srbf"},
        **({"extensionsUsed": ["KHR_materials_transmission"]} if passing else {}),
        "scene": 0,
        "scenes": [{"nodes": [len(nodes)]}],
        "nodes": [*nodes, root],
        "meshes": meshes,
        **({"materials": [_material(name, transmittances.get(name)) for name in names]} if names else {}),
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(body)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body.extend(b"\0" * (-len(body) % 4))
    head = struct.pack("<4sIIII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(body), len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(body), 0x004E4942) + bytes(body)


def _material(name: str, transmittance: Curve | None) -> dict[str, Any]:
    if transmittance is None:
        return {"name": name, "doubleSided": True}
    mean = np.clip(np.mean(transmittance, axis=0), 0, 1)
    return {
        "name": name,
        "doubleSided": True,
        "pbrMetallicRoughness": {"baseColorFactor": [*(round(float(m), 5) for m in mean), 1.0], "metallicFactor": 0.0},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.0}},
        "extras": {"tint_by_cosine": transmittance},
    }
