# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers of every kind, small and with known results: `python real_scenes.py NAME OUT.blend`.

Objects that must not shade each other stand FAR meters apart.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

from closed_form_scenes import SQUARE, UNIT_UV, add_uv, camera, material, quad

FAR = 100.0
HALF = [(0, 0), (0.45, 0), (0.45, 1), (0, 1)]


def twin(obj, name, location, rotation=(0, 0, 0), scale=(1, 1, 1)):
    """Another object of the same mesh."""
    made = bpy.data.objects.new(name, obj.data)
    made.location, made.rotation_euler, made.scale = location, rotation, scale
    bpy.context.scene.collection.objects.link(made)
    return made


def shared():
    """Three objects of one mesh: one flat, one tilted by 0.5 rad about x, one mirrored and turned about y; one square is their layer."""
    flat = quad("Flat")
    twin(flat, "Tilted", (FAR, 0, 0), (0.5, 0, 0), (2, 1, 1))
    twin(flat, "Mirrored", (2 * FAR, 0, 0), (0, 0.7, 0), (-1, 1, 1))


def side_by_side():
    """Two objects whose layers lie beside each other, the right one of two materials on two faces."""
    quad("Left", uv=HALF)
    right = quad("Right", uv=[(u + 0.5, v) for u, v in HALF], location=(FAR, 0, 0), color=(0.5, 0.25, 0.125))
    mesh = bpy.data.meshes.new("two faces")
    corners = [(-1, -1, 0), (0, -1, 0), (1, -1, 0), (-1, 1, 0), (0, 1, 0), (1, 1, 0)]
    faces = [(0, 1, 4, 3), (1, 2, 5, 4)]
    mesh.from_pydata(corners, [], faces)
    add_uv(mesh, "UV", [(0.5 + 0.2 * (x + 1), (y + 1) / 2) for face in faces for x, y, _ in (corners[i] for i in face)])
    mesh.materials.append(right.data.materials[0])
    mesh.materials.append(material("green", (0.1, 0.8, 0.1)))
    mesh.polygons[1].material_index = 1
    right.data = mesh


def kit():
    """A collection `Kit` with a plate, one under a modifier, one hidden and, in a child, another; and an empty that shows it 10 m up."""
    scene = bpy.context.scene
    whole, inner = bpy.data.collections.new("Kit"), bpy.data.collections.new("Inner")
    scene.collection.children.link(whole)
    whole.children.link(inner)
    for name, x, where in (("Plate", 0, whole), ("Doubled", FAR, whole), ("Deep", 2 * FAR, inner), ("Hidden", 3 * FAR, whole)):
        obj = quad(name, location=(x, 0, 0))
        scene.collection.objects.unlink(obj)
        where.objects.link(obj)
        if name == "Doubled":
            modifier = obj.modifiers.new("Array", "ARRAY")
            modifier.count = 2
            modifier.use_relative_offset, modifier.use_constant_offset = False, True
            modifier.constant_offset_displace = (0, FAR, 0)
        obj.hide_render = name == "Hidden"
    empty = bpy.data.objects.new("Set", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", whole
    empty.location, empty.rotation_euler = (0, -3 * FAR, 10), (0.5, 0, 0)
    scene.collection.objects.link(empty)


def linked():
    """`kit` as a library beside the file: its collection linked into the scene, and an empty of ours that shows it, tilted."""
    kit()
    library = str(Path(sys.argv[2]).with_suffix(".library.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=library, check_existing=False)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(library, link=True, relative=False) as (_, wanted):
        wanted.collections = ["Kit"]
    found = bpy.data.collections["Kit"]
    bpy.context.scene.collection.children.link(found)
    empty = bpy.data.objects.new("Set", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", found
    empty.location, empty.rotation_euler = (0, -3 * FAR, 10), (0.5, 0, 0)
    bpy.context.scene.collection.objects.link(empty)


def box(name, low, high, faces=range(6), uv=True, inward=False):
    """An axis-aligned box, or some of its faces (-x, +x, -y, +y, -z, +z), each with a chart of its own in a 3 x 2 grid."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    every = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    chosen = [every[i][::-1] if inward else every[i] for i in faces]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], chosen)
    if uv:
        spots = [((i % 3) / 3, (i // 3) / 2) for i in faces]
        add_uv(mesh, "UV", [(u + 0.02 + 0.29 * a, v + 0.02 + 0.46 * b) for u, v in spots for a, b in UNIT_UV])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    mesh.materials.append(material(name))
    return obj


def cube():
    """A white cube with corners at -1 and 1, mirrored in x and stretched in z, and a lone vertex that no face has."""
    obj = box("Cube", (-1, -1, -1), (1, 1, 1))
    obj.data.vertices.add(1)
    obj.scale = (-1, 1, 2)


def fan():
    """A flat square whose middle vertex has four unlike triangles, beside a half that is metal."""
    mesh = bpy.data.meshes.new("Fan")
    mesh.from_pydata([*SQUARE, (0.6, 0.3, 0)], [], [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    obj = bpy.data.objects.new("Fan", mesh)
    bpy.context.scene.collection.objects.link(obj)
    mesh.materials.append(material("paint", (0.5, 0.5, 0.5)))
    mesh.materials.append(material("steel", (0.9, 0.9, 0.9), "ShaderNodeBsdfAnisotropic"))
    mesh.polygons[0].material_index = 1


def closed_room():
    """A white room, 2 m each way, closed on all sides; its ceiling an object of its own."""
    box("Room", (-1, -1, 0), (1, 1, 2), faces=range(5), inward=True)
    box("Ceiling", (-1, -1, 0), (1, 1, 2), faces=[5], inward=True)


def open_room():
    """The room with no ceiling at all."""
    box("Room", (-1, -1, 0), (1, 1, 2), faces=range(5), inward=True)


def lattice():
    """A white floor under five black slats along y, each 0.2 m wide, 0.4 m apart, 0.5 m up."""
    quad("Floor")
    for i in range(5):
        x = -0.8 + 0.4 * i
        quad(f"Slat {i}", corners=[(x - 0.1, -9, 0.5), (x + 0.1, -9, 0.5), (x + 0.1, 9, 0.5), (x - 0.1, 9, 0.5)], color=(0, 0, 0))


def normal_mapped():
    """A white square whose normal map leans every texel 0.5 rad towards +x."""
    obj = quad("Plane")
    nodes, links = obj.data.materials[0].node_tree.nodes, obj.data.materials[0].node_tree.links
    lean = nodes.new("ShaderNodeNormalMap")
    lean.space = "TANGENT"
    lean.uv_map = "UV"
    lean.inputs["Color"].default_value = (0.5 + 0.5 * math.sin(0.5), 0.5, 0.5 + 0.5 * math.cos(0.5), 1)
    links.new(lean.outputs["Normal"], next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfDiffuse").inputs["Normal"])


def glossy():
    """A rough metal square: seen from above it shines towards lights near the zenith, and has no diffuse part."""
    obj = quad("Plane")
    obj.data.materials[0] = material("metal", (0.8, 0.8, 0.8), "ShaderNodeBsdfAnisotropic")
    shader = next(n for n in obj.data.materials[0].node_tree.nodes if n.bl_idname == "ShaderNodeBsdfAnisotropic")
    shader.inputs["Roughness"].default_value = 0.4


def moved():
    """The square and its wall, and the same ones carried 3 m along x, turned by 0.8 rad about z: one scene twice."""
    floor = quad("Plane")
    wall = quad("Wall", corners=[(0, 0, 0), (0, 1, 0), (0, 1, 0.5), (0, 0, 0.5)], color=(0, 0, 0))
    for obj in (floor, wall):
        twin(obj, f"Moved {obj.name}", (FAR, 5, 2), (0, 0, 0.8))


def overlapping():
    """Layers that no lightmap can have: two faces on one square, and one of them off it."""
    for name, corners in (
        ("Stacked", [*UNIT_UV, *UNIT_UV]),
        ("Outside", [*UNIT_UV, *((u + 1.5, v) for u, v in UNIT_UV)]),
    ):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([*SQUARE, *((x + 3, y, z) for x, y, z in SQUARE)], [], [(0, 1, 2, 3), (4, 5, 6, 7)])
        add_uv(mesh, "UV", corners)
        mesh.materials.append(material(name))
        obj = bpy.data.objects.new(name, mesh)
        obj.location = (0, FAR * (name == "Outside"), 0)
        bpy.context.scene.collection.objects.link(obj)


def views():
    """A floor and a wall before three cameras without depth of field: perspective, with a shifted lens, orthographic."""
    quad("Plane", color=(0.8, 0.4, 0.2))
    quad("Wall", corners=[(0, 0, 0), (0, 1, 0), (0, 1, 0.5), (0, 0, 0.5)], color=(0.3, 0.5, 0.7))
    for name, kind, shift in (("Straight", "PERSP", (0, 0)), ("Shifted", "PERSP", (0.2, -0.15)), ("Flat", "ORTHO", (0, 0.1))):
        obj = camera(kind)
        obj.name = name
        obj.data.dof.use_dof = False
        obj.data.shift_x, obj.data.shift_y = shift
        obj.data.ortho_scale = 4


SCENES = {
    "shared": shared,
    "side by side": side_by_side,
    "kit": kit,
    "linked": linked,
    "cube": cube,
    "fan": fan,
    "closed room": closed_room,
    "open room": open_room,
    "lattice": lattice,
    "normal mapped": normal_mapped,
    "glossy": glossy,
    "moved": moved,
    "overlapping": overlapping,
    "views": views,
}

if __name__ == "__main__":
    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[sys.argv[1]]()
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], check_existing=False)
    os._exit(0)
