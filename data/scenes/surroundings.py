# SPDX-License-Identifier: GPL-3.0-or-later
"""All that a mesh of a scene must tell apart, each once: `python surroundings.py NAME OUT.blend`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

from closed_form_scenes import SQUARE, UNIT_UV, add_uv, camera, material, quad

CUBE = [(x, y, z) for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.2, 0.2)]
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # outwards


def thing(name, corners, faces, location, *materials):
    """A mesh object."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    for made in materials:
        mesh.materials.append(made)
    obj = bpy.data.objects.new(name, mesh)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)
    return obj


def nodes_of(name):
    """(material, its nodes, a function that links, the output's surface) of an empty material."""
    made = material(name)
    tree = made.node_tree
    tree.nodes.clear()
    return made, tree.nodes, tree.links.new, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]


def graded():
    """Diffuse; red grows along x of the object's bounds from 0 to 1, green along y."""
    made, nodes, link, surface = nodes_of("graded")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    link(nodes.new("ShaderNodeTexCoord").outputs["Generated"], diffuse.inputs["Color"])
    link(diffuse.outputs[0], surface)
    return made


def ramped_metal():
    """Metal of a color ramp from (1, 0.5, 0) to (0.5, 0.5, 0.5) over a noise."""
    made, nodes, link, surface = nodes_of("ramped metal")
    ramp, shader = nodes.new("ShaderNodeValToRGB"), nodes.new("ShaderNodeBsdfPrincipled")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0.5, 0, 1), (0.5, 0.5, 0.5, 1)
    link(nodes.new("ShaderNodeTexNoise").outputs[0], ramp.inputs[0])
    link(ramp.outputs[0], shader.inputs["Base Color"])
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.3
    link(shader.outputs[0], surface)
    return made


def water():
    """A Principled BSDF in a group that is given its color, muted nodes and reroutes on the way."""
    group = bpy.data.node_groups.new("liquid", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketShader")
    kinds = ("NodeGroupInput", "NodeReroute", "ShaderNodeBsdfPrincipled", "NodeGroupOutput")
    given, way, shader, out = (group.nodes.new(kind) for kind in kinds)
    values = {"Transmission Weight": 1.0, "IOR": 1.33, "Roughness": 0.1}
    for name, number in values.items():
        shader.inputs[name].default_value = number
    group.links.new(given.outputs[0], way.inputs[0])
    group.links.new(way.outputs[0], shader.inputs["Base Color"])
    group.links.new(shader.outputs[0], out.inputs[0])
    made, nodes, link, surface = nodes_of("water")
    outer, gamma = nodes.new("ShaderNodeGroup"), nodes.new("ShaderNodeGamma")
    outer.node_tree = group
    gamma.inputs["Color"].default_value, gamma.inputs["Gamma"].default_value = (0.3, 0.6, 0.9, 1), 5.0
    gamma.mute = True
    link(gamma.outputs[0], outer.inputs[0])
    link(outer.outputs[0], surface)
    return made


def window():
    """Glass to the camera, clear to shadow rays and to diffuse ones."""
    made, nodes, link, surface = nodes_of("window")
    path, either, mix = (nodes.new(kind) for kind in ("ShaderNodeLightPath", "ShaderNodeMath", "ShaderNodeMixShader"))
    either.operation = "MAXIMUM"
    link(path.outputs["Is Shadow Ray"], either.inputs[0])
    link(path.outputs["Is Diffuse Ray"], either.inputs[1])
    link(either.outputs[0], mix.inputs[0])
    bent = nodes.new("ShaderNodeBsdfGlass")
    bent.inputs["Color"].default_value, bent.inputs["IOR"].default_value = (0.9, 1, 0.8, 1), 1.45
    link(bent.outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    link(mix.outputs[0], surface)
    return made


def veil():
    """A quarter transparent, the rest diffuse and blue."""
    made, nodes, link, surface = nodes_of("veil")
    mix, cloth = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfDiffuse")
    cloth.inputs["Color"].default_value = (0.1, 0.2, 0.8, 1)
    mix.inputs[0].default_value = 0.25
    link(cloth.outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    link(mix.outputs[0], surface)
    return made


def ground():
    """A square 2 m wide about (3, -1, 0.5) with a lightmap layer a quarter turned."""
    ground = quad("Ground", uv=[(2 * u, 2 * v) for u, v in UNIT_UV], location=(3, -1, 0.5))
    ground.data.materials[0] = graded()
    add_uv(ground.data, "lightmap", [(0.1 + 0.7 * v, 0.3 + 0.6 * (1 - u)) for u, v in UNIT_UV])


def surroundings():
    """The ground, and around it one thing of each kind."""
    ground()
    thing("Wall", [(-1, 0, 0), (1, 0, 0), (1, 0.5, 0), (-1, 0.5, 0)], [(0, 1, 2, 3)], (0, 5, 0), graded())
    thing("Wedge", [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], (0, 0, 0)).scale = (-1, 1, 2)
    fine = quad("Fine", uv=None, location=(0, -5, 0))
    modifier = fine.modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type, modifier.levels, modifier.render_levels = "SIMPLE", 0, 2
    pair = [*SQUARE, *((x, y, z + 1) for x, y, z in SQUARE)]
    both = thing("Pair", pair, [(0, 1, 2, 3), (4, 5, 6, 7)], (0, 0, 3), material("red", (0.7, 0.1, 0.05)), ramped_metal())
    both.data.polygons[1].material_index = 1
    thing("Cup", CUBE, SIDES, (0, 0, 6), water())
    thing("Window", SQUARE, [(0, 1, 2, 3)], (0, 0, 7), window())
    thing("Veil", SQUARE, [(0, 1, 2, 3)], (0, 0, 8), veil())
    thing("Glow", SQUARE, [(0, 1, 2, 3)], (0, 0, 9), material("glow", (1, 0.5, 0.25), "ShaderNodeEmission", 5))
    curve = bpy.data.curves.new("Rod", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    spline.points[1].co = (0, 0, 1, 1)
    rod = bpy.data.objects.new("Rod", curve)
    rod.location = (-3, 0, 0)
    bpy.context.scene.collection.objects.link(rod)
    quad("Hidden", location=(0, 0, 20)).hide_render = True
    quad("Ghost", location=(0, 0, 21)).visible_camera = False
    camera(location=(1, -4, 3)).data.lens = 36  # of a sensor 36 mm wide: the picture is as wide as it is far
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 200, 100


SCENES = {"ground": ground, "surroundings": surroundings}

if __name__ == "__main__":
    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[sys.argv[1]]()
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], check_existing=False)
    os._exit(0)
