# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffuse albedo and emission of fragments of meshes, by Cycles from the scene's own materials."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import bpy
import numpy as np

from blender_bake.vertex_albedo import ATTRIBUTE, bake_colors, corner_colors

Kinds = tuple[str, ...]  # of reflection that make up an albedo
EMISSION: Kinds = ("EMIT",)  # and what stands for emission, W/(m2 sr)
BRIGHTEST = 1e6  # radiance
GRAY = 0.8  # of a face without a material
EVEN = {  # nodes whose color is the same all over a surface, if that of their inputs is
    *("ShaderNodeMixShader", "ShaderNodeAddShader", "ShaderNodeRGB", "ShaderNodeValue", "ShaderNodeMath", "ShaderNodeMix"),
    *(
        "ShaderNodeMixRGB",
        "ShaderNodeValToRGB",
        "ShaderNodeInvert",
        "ShaderNodeGamma",
        "ShaderNodeHueSaturation",
        "ShaderNodeBrightContrast",
    ),
    *("ShaderNodeMapRange", "ShaderNodeClamp", "ShaderNodeSeparateColor", "ShaderNodeCombineColor", "ShaderNodeBlackbody"),
    *(
        "ShaderNodeLightPath",
        "ShaderNodeFresnel",
        "ShaderNodeLayerWeight",
        "ShaderNodeEmission",
        "ShaderNodeHoldout",
        "ShaderNodeWavelength",
    ),
    *("ShaderNodeRGBCurve", "ShaderNodeBackground", "ShaderNodeGroup", "NodeGroupInput", "NodeGroupOutput", "NodeReroute"),
}
KINDS = {"FLOAT": ("value", 1), "INT": ("value", 1), "FLOAT_VECTOR": ("vector", 3), "FLOAT2": ("vector", 2)}
COLORS = {"FLOAT_COLOR", "BYTE_COLOR"}


@dataclass
class Attributes:
    """What textures read of a mesh, at the corners of its triangles (3 T rows): UV layers, colors and other values by name."""

    uv: dict[str, np.ndarray] = field(default_factory=dict)
    colors: dict[str, np.ndarray] = field(default_factory=dict)
    values: dict[str, np.ndarray] = field(default_factory=dict)
    rendered_uv: str | None = None
    rendered_color: str | None = None
    texture_space: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0,) * 3, (1.0,) * 3)

    @staticmethod
    def of(mesh: bpy.types.Mesh, loops: np.ndarray, faces: np.ndarray) -> Attributes:
        """loops (3 T), faces (T): of the corners and of the triangles."""
        found = Attributes(texture_space=(tuple(mesh.texspace_location), tuple(mesh.texspace_size)))
        points = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", points)
        of_corner = {"CORNER": loops, "POINT": points[loops], "FACE": np.repeat(faces, 3)}
        layers = {layer.name: layer for layer in mesh.uv_layers}
        for name, layer in layers.items():
            found.uv[name] = _read(layer.uv, "vector", len(mesh.loops), 2)[loops]
            found.rendered_uv = name if layer.active_render else found.rendered_uv
        for attribute in mesh.attributes:
            if attribute.name in layers or attribute.name.startswith(".") or attribute.domain not in of_corner or attribute.is_internal:
                continue
            rows = of_corner[attribute.domain]
            if attribute.data_type in COLORS:
                found.colors[attribute.name] = _read(attribute.data, "color", len(attribute.data), 4)[rows]
            elif attribute.data_type in KINDS and attribute.name not in {"position", "material_index"}:
                key, width = KINDS[attribute.data_type]
                found.values[attribute.name] = _read(attribute.data, key, len(attribute.data), width)[rows]
        index = mesh.color_attributes.render_color_index
        if 0 <= index < len(mesh.color_attributes):
            found.rendered_color = mesh.color_attributes[index].name
        return found


def varies(material: bpy.types.Material | None) -> bool:
    """Whether a material's color may differ from place to place."""
    if material is None or not material.use_nodes or material.node_tree is None:
        return False
    return any(node.bl_idname not in EVEN and "Bsdf" not in node.bl_idname for node in _behind_colors(material.node_tree))


def faces_front(material: bpy.types.Material) -> bool:
    """Whether a material looks at which side of a face is seen, so that its back may emit nothing."""
    tree = material.node_tree if material.use_nodes else None
    return tree is not None and any(
        node.bl_idname == "ShaderNodeNewGeometry" and node.outputs["Backfacing"].is_linked for node in _behind_colors(tree)
    )


def even_albedo(scene: bpy.types.Scene, materials: list[bpy.types.Material], kinds: Kinds) -> dict[bpy.types.Material, np.ndarray]:
    """(3,) albedo, or emission, of each material that does not vary. Hides all other objects."""
    if not materials:
        return {}
    count = len(materials)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32) + np.array([2, 0, 0], np.float32) * np.arange(count)[:, None, None]
    colors = bake(scene, _mesh(corners, np.arange(count), materials, Attributes()), np.eye(4), kinds)
    return dict(zip(materials, colors, strict=True))


def varying_albedo(
    scene: bpy.types.Scene,
    corners: np.ndarray,
    slots: np.ndarray,
    materials: list[bpy.types.Material | None],
    attributes: Attributes,
    matrix: np.ndarray,
    kinds: Kinds,
) -> np.ndarray:
    """(F, 3) albedo, or emission, of fragments, `corners` (F, 3, 3) in the frame that `matrix` (4, 4) puts into the world.

    slots (F,): of `materials`.

    attributes: at the fragments' corners, and the mesh's texture space, which generated coordinates depend on. Hides all other objects.
    """
    return bake(scene, _mesh(corners, slots, materials, attributes), matrix, kinds)


def bake(scene: bpy.types.Scene, mesh: bpy.types.Mesh, matrix: np.ndarray, kinds: Kinds = ("DIFFUSE",)) -> np.ndarray:
    """(F, 3) color of the mesh's triangles, the sum over `kinds`, the mean of their corners. The mesh is removed."""
    colors = np.zeros((len(mesh.loops), 3), np.float32)
    for kind in kinds:
        (obj,) = bake_colors(scene, [(mesh, matrix)], kind)
        colors += corner_colors(mesh, BRIGHTEST if kind in EMISSION else 1.0)
        mesh.color_attributes.remove(mesh.color_attributes[ATTRIBUTE])
        bpy.data.objects.remove(obj)
    bpy.data.meshes.remove(mesh)
    return (colors if kinds == EMISSION else np.minimum(colors, 1)).reshape(-1, 3, 3).mean(axis=1)


def _behind_colors(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Node]:
    """The nodes of a tree, inside groups too, that its surface depends on, except through normals, volume and displacement."""
    output = tree.get_output_node("CYCLES") if hasattr(tree, "get_output_node") else None
    ends = [output] if output is not None else [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    waiting = [socket for end in ends for socket in end.inputs if output is None or socket.name == "Surface"]
    seen: set[int] = set()
    while waiting:
        for link in waiting.pop().links:
            node = link.from_node
            if node.as_pointer() in seen:
                continue
            seen.add(node.as_pointer())
            yield node
            if node.type == "GROUP" and node.node_tree is not None:
                yield from _behind_colors(node.node_tree)
            waiting += [socket for socket in node.inputs if socket.name not in {"Normal", "Coat Normal", "Tangent"}]


def _mesh(
    corners: np.ndarray, slots: np.ndarray, materials: list[bpy.types.Material | None] | list[bpy.types.Material], attributes: Attributes
) -> bpy.types.Mesh:
    count = 3 * len(corners)
    mesh = bpy.data.meshes.new(ATTRIBUTE)
    mesh.vertices.add(count)
    mesh.loops.add(count)
    mesh.polygons.add(len(corners))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(corners, np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", np.arange(count, dtype=np.int32))
    mesh.polygons.foreach_set("loop_start", np.arange(0, count, 3, dtype=np.int32))
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", np.ascontiguousarray(slots, np.int32))
    for name, values in attributes.uv.items():
        layer = mesh.uv_layers.new(name=name, do_init=False)
        layer.uv.foreach_set("vector", np.ascontiguousarray(values, np.float32).ravel())
        layer.active_render = name == attributes.rendered_uv
    for name, values in attributes.colors.items():
        made = mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        made.data.foreach_set("color", np.ascontiguousarray(values, np.float32).ravel())
    for name, values in attributes.values.items():
        kind, key = {1: ("FLOAT", "value"), 2: ("FLOAT2", "vector"), 3: ("FLOAT_VECTOR", "vector")}[values.shape[1]]
        mesh.attributes.new(name, kind, "CORNER").data.foreach_set(key, np.ascontiguousarray(values, np.float32).ravel())
    if attributes.rendered_color is not None:
        names = [attribute.name for attribute in mesh.color_attributes]
        mesh.color_attributes.render_color_index = names.index(attributes.rendered_color)
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = attributes.texture_space
    mesh.update(calc_edges=True)
    return mesh


def _read(rows: bpy.types.bpy_prop_collection, key: str, count: int, width: int) -> np.ndarray:
    values = np.empty(count * width, np.float32)
    if key == "value" and count and isinstance(rows[0].value, int):
        integers = np.empty(count, np.int32)
        rows.foreach_get(key, integers)
        return integers.astype(np.float32)[:, None]
    rows.foreach_get(key, values)
    return values.reshape(count, width)
