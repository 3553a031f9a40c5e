# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes whose light has a closed form.

`python closed_form_scenes.py NAME OUT.blend`, or `python closed_form_scenes.py hdri IN.blend ENVIRONMENT.exr OUT.npy`.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import bpy
import numpy as np

SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
UNIT_UV = [(0, 0), (1, 0), (1, 1), (0, 1)]


def quad(name, corners=SQUARE, uv=UNIT_UV, color=(1, 1, 1), location=(0, 0, 0)):
    """A quad with a diffuse material; uv None leaves it without a layer."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    if uv is not None:
        add_uv(mesh, "UV", uv)
    obj = bpy.data.objects.new(name, mesh)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)
    mesh.materials.append(material(name, color))
    return obj


def add_uv(mesh, name, uv):
    layer = mesh.uv_layers.new(name=name, do_init=False)
    for loop, coordinates in zip(layer.uv, uv, strict=True):
        loop.vector = coordinates


def material(name, color=(1, 1, 1), shader="ShaderNodeBsdfDiffuse", strength=None):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    node = nodes.new(shader)
    node.inputs["Color"].default_value = (*color, 1)
    if strength is not None:
        node.inputs["Strength"].default_value = strength
    made.node_tree.links.new(node.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def camera(kind="PERSP", location=(0, -4, 3)):
    data = bpy.data.cameras.new("Camera")
    obj = bpy.data.objects.new("Camera", data)
    obj.location = location
    obj.rotation_euler = (math.atan2(4, 3), 0, 0)
    data.type = kind
    data.dof.use_dof, data.dof.aperture_fstop = True, 8.0  # positions must not blur with the lens
    if kind == "PANO":
        target = data if hasattr(data, "panorama_type") else data.cycles
        target.panorama_type = "EQUIRECTANGULAR"
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.scene.camera = obj
    return obj


def point_light(name="PointLight", energy=500, location=(0, 0, 2)):
    obj = bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT"))
    obj.data.energy = energy
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)


def plane():
    """A white square, z = 0, moved to (10, 5, 0), with a bright light and world that a bake must switch off."""
    quad("Plane", location=(10, 5, 0))
    point_light(location=(10, 5, 2))
    camera()
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 3
    bpy.context.scene.world = world


def occluder():
    """The square with a black wall 0.5 m high standing on x = 0, from y = 0 to y = 1: nothing is symmetric."""
    quad("Plane")
    quad("Wall", corners=[(0, 0, 0), (0, 1, 0), (0, 1, 0.5), (0, 0, 0.5)], color=(0, 0, 0))
    camera()


def view(kind="PERSP"):
    """A colored plane before a camera, nothing around it."""
    quad("Plane", color=(0.8, 0.4, 0.2))
    camera(kind)


def pane():
    """The square half under a tinted pane 0.4 m up that shadow rays pass, and the black wall."""
    occluder()
    glass = quad("Pane", corners=[(-3, -3, 0.4), (-0.1, -3, 0.4), (-0.1, 3, 0.4), (-3, 3, 0.4)])
    glass.data.materials[0] = material("glass", (0.8, 0.4, 0.2), "ShaderNodeBsdfTransparent")


def leaves():
    """A card over the plane whose alpha a texture cuts out."""
    occluder()
    card = quad("Card", location=(0, 0, 1))
    made = bpy.data.materials.new("Leaf")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    checker = nodes.new("ShaderNodeTexChecker")
    links.new(checker.outputs["Fac"], nodes["Principled BSDF"].inputs["Alpha"])
    card.data.materials[0] = made


def sharp(kind="PERSP"):
    """A colored plane and the wall before a camera without depth of field."""
    quad("Plane", color=(0.8, 0.4, 0.2))
    quad("Wall", corners=[(0, 0, 0), (0, 1, 0), (0, 1, 0.5), (0, 0, 0.5)], color=(0.3, 0.5, 0.7))
    camera(kind)
    bpy.context.scene.camera.data.dof.use_dof = False


def emissive():
    """A white square under a small glowing one."""
    quad("Plane")
    glow = quad("Glow", corners=[(-0.2, -0.2, 1), (-0.2, 0.2, 1), (0.2, 0.2, 1), (0.2, -0.2, 1)])
    glow.data.materials[0] = material("glow", (1, 0.5, 0.25), "ShaderNodeEmission", 5)
    point_light(energy=100, location=(0.5, 0, 1.5))
    camera()


def metal():
    """Two faces: the left one metal, the right one diffuse."""
    mesh = bpy.data.meshes.new("Plane")
    corners = [(-1, -1, 0), (0, -1, 0), (1, -1, 0), (-1, 1, 0), (0, 1, 0), (1, 1, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 4, 3), (1, 2, 5, 4)])
    add_uv(mesh, "UV", [((x + 1) / 2, (y + 1) / 2) for face in ((0, 1, 4, 3), (1, 2, 5, 4)) for x, y, _ in (corners[i] for i in face)])
    mesh.materials.append(material("steel", (0.9, 0.9, 0.9), "ShaderNodeBsdfAnisotropic"))
    mesh.materials.append(material("paint", (0.5, 0.5, 0.5)))
    mesh.polygons[1].material_index = 1
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Plane", mesh))
    camera()


def layers():
    """Objects whose UVs do not fit: none, overlapping, out of range, eight bad ones; and a mesh without faces."""
    quad("NoUV", uv=None)
    quad("Tiled", uv=[(0, 0), (3, 0), (3, 3), (0, 3)], location=(3, 0, 0))
    full = quad("Full", uv=None, location=(6, 0, 0))
    for i in range(8):
        add_uv(full.data, f"bad {i}", [(0, 0)] * 4)
    second = quad("Second", uv=[(0, 0), (3, 0), (3, 3), (0, 3)], location=(9, 0, 0))
    add_uv(second.data, "fits", UNIT_UV)
    hidden = quad("Hidden", location=(12, 0, 0))
    hidden.hide_render = True
    empty = bpy.data.objects.new("Empty mesh", bpy.data.meshes.new("empty"))
    bpy.context.scene.collection.objects.link(empty)


def full():
    """The square with eight UV layers, as many as a mesh can have."""
    square = quad("Plane")
    for i in range(7):
        add_uv(square.data, f"other {i}", UNIT_UV)


def scattered():
    """The square with a geometry-nodes modifier that puts an instance of a black plate 0.3 m above its middle."""
    obj = quad("Plane")
    plate = quad(
        "Plate", corners=[(-0.3, -0.3, 0.3), (0.3, -0.3, 0.3), (0.3, 0.3, 0.3), (-0.3, 0.3, 0.3)], color=(0, 0, 0), location=(50, 0, 0)
    )
    group = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    nodes = {
        kind: group.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeJoinGeometry", "GeometryNodeObjectInfo")
    }
    info, join = nodes["GeometryNodeObjectInfo"], nodes["GeometryNodeJoinGeometry"]
    info.inputs["Object"].default_value = plate
    info.inputs["As Instance"].default_value = True
    group.links.new(info.outputs["Geometry"], join.inputs[0])
    group.links.new(nodes["NodeGroupInput"].outputs[0], join.inputs[0])
    group.links.new(join.outputs[0], nodes["NodeGroupOutput"].inputs[0])
    obj.modifiers.new("Scatter", "NODES").node_group = group
    camera()


def overriding():
    """A view layer with a bright world and many samples of its own."""
    plane()
    layer = bpy.context.view_layer
    layer.samples = 4096
    if hasattr(layer, "world_override"):
        layer.world_override = bpy.context.scene.world


def hostile():
    """A plane, a missing texture, a text that would write a file on load, and a driver that would."""
    obj = quad("Plane")
    camera()
    marker = Path(sys.argv[2]).with_suffix(".pwned")
    text = bpy.data.texts.new("run.py")
    text.write(f"open({str(marker)!r}, 'w').close()")
    text.use_module = True
    driver = obj.driver_add("location", 2).driver
    driver.type = "SCRIPTED"
    driver.expression = f"__import__('pathlib').Path({str(marker)!r}).touch() or 0"
    node = obj.data.materials[0].node_tree.nodes.new("ShaderNodeTexImage")
    image = bpy.data.images.new("brick", 4, 4)
    image.source = "FILE"
    image.filepath = "//textures/brick.png"
    node.image = image


def subdivided():
    """A cube-like dome: a plane with a displace-free subdivision modifier, sharing its mesh with a second object."""
    obj = quad("Plane")
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    modifier.levels, modifier.render_levels = 0, 3
    twin = bpy.data.objects.new("Twin", obj.data)
    twin.location = (5, 0, 0)
    bpy.context.scene.collection.objects.link(twin)
    camera()


def torus(around=48, across=24):
    """A smooth torus in four charts, each a quarter of it, turned against one another in UV, over a floor that lights it from below.

    Its seams: four circles across, where quarters meet, and one around, cut open underneath.
    """
    steps = [(2 * math.pi * i / around, 2 * math.pi * j / across - math.pi / 2) for i in range(around) for j in range(across)]
    corners = [((1 + 0.4 * math.cos(b)) * math.cos(a), (1 + 0.4 * math.cos(b)) * math.sin(a), 0.4 * math.sin(b)) for a, b in steps]
    mesh = bpy.data.meshes.new("Torus")
    cells = [(i, j) for i in range(around) for j in range(across)]
    faces = [[(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in cells]
    mesh.from_pydata(corners, [], [[(i % around) * across + j % across for i, j in face] for face in faces])
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    quarter = around // 4
    turns = [math.radians(angle) for angle in (0, 90, 17, -33)]
    coordinates = []
    for (i, _), face in zip(cells, faces, strict=True):
        chart = i // quarter
        cosine, sine = math.cos(turns[chart]), math.sin(turns[chart])
        for x, y in ((0.36 * ((a - chart * quarter) / quarter - 0.5), 0.36 * (b / across - 0.5)) for a, b in face):
            coordinates.append((0.25 + 0.5 * (chart % 2) + cosine * x - sine * y, 0.25 + 0.5 * (chart // 2) + sine * x + cosine * y))
    add_uv(mesh, "UV", coordinates)
    mesh.materials.append(material("Torus", (0.8, 0.8, 0.8)))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Torus", mesh))
    quad("Floor", corners=[(-3, -3, -0.6), (3, -3, -0.6), (3, 3, -0.6), (-3, 3, -0.6)], color=(0.7, 0.5, 0.3))
    camera()


def projected():
    """Three squares side by side that share no vertices, in UV apart: the second of another material, the third folded up by 40 degrees."""
    mesh = bpy.data.meshes.new("Strip")
    up, out = math.sin(math.radians(40)), 2 + math.cos(math.radians(40))
    rows = [[(0, 0), (1, 0)], [(1, 0), (2, 0)], [(2, 0), (out, up)]]
    corners = [(x, y, z) for (a, za), (b, zb) in rows for x, y, z in ((a, 0, za), (b, 0, zb), (b, 1, zb), (a, 1, za))]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11)])
    places = [(0.1, 0.1), (0.6, 0.1), (0.1, 0.6)]
    add_uv(mesh, "UV", [(u + 0.3 * x, v + 0.3 * y) for u, v in places for x, y in UNIT_UV])
    mesh.materials.append(material("one", (0.8, 0.8, 0.8)))
    mesh.materials.append(material("other", (0.2, 0.2, 0.2)))
    mesh.polygons[1].material_index = 1
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Strip", mesh))
    camera()


def blocks():
    """A floor with a closed block, mirrored and of vertices split at its edges, an open crate, and a room's walls, which look inwards."""
    quad("Plane", corners=[(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)])
    cube = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # outwards

    def box(name, corners, faces):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(corners, [], faces)
        mesh.materials.append(material(name))
        obj = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(obj)
        return obj

    block = box("Block", [cube[i] for side in sides for i in side], [tuple(range(4 * i, 4 * i + 4)) for i in range(6)])
    block.location, block.scale = (-1, 0, 1), (-0.5, 0.5, 0.5)  # mirrored: x from -1.5 to -0.5, z from 0.5 to 1.5
    crate = box("Crate", cube, sides[:-1])  # without a lid
    crate.location, crate.scale = (1, 0, 1), (0.5, 0.5, 0.5)
    walls = box("Walls", cube, [side[::-1] for side in sides])
    walls.location, walls.scale = (0, 0, 1.5), (2.5, 2.5, 2)


def bake_under_hdri(blend, environment, out):
    """Irradiance of Plane under an equirectangular environment map, by Cycles, (32, 32, 3), row 0 at the top."""
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    world = bpy.data.worlds.new("Environment")
    world.use_nodes = True
    nodes = world.node_tree.nodes
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(environment)
    texture.image.colorspace_settings.name = "Non-Color"
    world.node_tree.links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    scene.world = world
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1024
    scene.cycles.use_adaptive_sampling = False
    image = bpy.data.images.new("bake", 32, 32, alpha=True, float_buffer=True)
    obj = scene.objects["Plane"]
    target = obj.data.materials[0].node_tree.nodes.new("ShaderNodeTexImage")
    target.image = image
    obj.data.materials[0].node_tree.nodes.active = target
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=0, use_clear=True)
    pixels = np.empty(32 * 32 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    np.save(out, pixels.reshape(32, 32, 4)[::-1, :, :3] * math.pi)


SCENES = {
    "plane": plane,
    "occluder": occluder,
    "view": view,
    "ortho": lambda: view("ORTHO"),
    "pano": lambda: view("PANO"),
    "pane": pane,
    "leaves": leaves,
    "sharp": sharp,
    "sharp ortho": lambda: sharp("ORTHO"),
    "emissive": emissive,
    "metal": metal,
    "layers": layers,
    "full": full,
    "hostile": hostile,
    "subdivided": subdivided,
    "scattered": scattered,
    "torus": torus,
    "projected": projected,
    "blocks": blocks,
    "overriding": overriding,
    "no camera": lambda: quad("Plane"),
}

if __name__ == "__main__":
    if sys.argv[1] == "hdri":
        bake_under_hdri(*sys.argv[2:5])
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        SCENES[sys.argv[1]]()
        bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], check_existing=False)
    os._exit(0)  # after a driver that failed, Blender can hang in its own shutdown
