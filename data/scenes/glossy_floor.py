# SPDX-License-Identifier: GPL-3.0-or-later
"""A closed room with what a picture's gloss is made of: a lacquered floor, a ball of brushed metal, a bumpy stone, a wall of tiles.

The free space is 0 < x < 4, 0 < y < 3, 0 < z < 2.5 (m). `Floor` is lacquer of roughness 0.2, `Ball` metal of 0.3, `Stone` a detailed mesh
(20,000 triangles) of glazed ceramic inside a node group, `Tiles` have a bump map and a roughness
that varies, `Room` and `Crate` are Lambert.

    python data/scenes/glossy_floor.py OUT.blend
"""

import sys

import bpy
from house import box, node, noise, surface
from interior import add, arguments_of, carved, save, split
from mathutils import Vector
from mathutils.noise import fractal
from staging import add_camera, start_cycles

SIZE = (4.0, 3.0, 2.5)  # m


def tiles():
    """Bump and roughness by noise."""
    material = surface("Tiles", (0.25, 0.4, 0.35), 0.35)
    tree = material.node_tree
    shader = next(one for one in tree.nodes if one.bl_idname == "ShaderNodeBsdfPrincipled")
    height = noise(tree, 9.0, 1.0)
    bump = node(tree, "Bump", Strength=0.6, Distance=0.05, Height=height)
    tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    tree.links.new(node(tree, "MapRange", Value=height, **{"To Min": 0.25, "To Max": 0.5}).outputs[0], shader.inputs["Roughness"])
    return material


def ceramic():
    """Half diffuse, half a lobe without a Fresnel term, in a node group."""
    group = bpy.data.node_groups.new("Glaze", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    mix = node(group, "MixShader", Fac=0.3)
    group.links.new(node(group, "BsdfDiffuse", Color=(0.55, 0.35, 0.2, 1)).outputs[0], mix.inputs[1])
    group.links.new(node(group, "BsdfAnisotropic", Color=(0.9, 0.9, 0.9, 1), Roughness=0.4).outputs[0], mix.inputs[2])
    group.links.new(mix.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    material = surface("Ceramic", (0.5, 0.5, 0.5), 1.0)
    tree = material.node_tree
    made = tree.nodes.new("ShaderNodeGroup")
    made.node_tree = group
    tree.links.new(made.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    return material


def shaped(name, radius, place, material, steps, roughness):
    """A smooth ball, or with `roughness` (m) a rock."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=steps, radius=radius, location=place)
    thing = bpy.context.object
    thing.name = thing.data.name = name
    if roughness:
        for vertex in thing.data.vertices:
            own = vertex.co.normalized()
            vertex.co += own * roughness * fractal(own * 2.5, 0.8, 2.0, 6)
    thing.data.polygons.foreach_set("use_smooth", [True] * len(thing.data.polygons))
    thing.data.materials.append(material)


def build():
    white, red, blue = (surface(*told, 1.0) for told in (("White", (0.7,) * 3), ("Red", (0.6, 0.12, 0.08)), ("Blue", (0.1, 0.2, 0.5))))
    lacquer = surface("Lacquer", (0.35, 0.2, 0.1), 0.2)

    def of(middle, normal):
        return red if normal.x > 0.9 else blue if normal.x < -0.9 else white

    hull = (tuple(-0.1 for _ in SIZE), tuple(side + 0.1 for side in SIZE))
    add("Room", split(carved(hull, [((0, 0, 0), SIZE)]), of), None)
    add("Floor", [box((0.001, 0.001, 0.001), (3.999, 2.999, 0.02))], lacquer)
    add("Tiles", [box((0.8, 2.96, 0.3), (3.2, 2.999, 1.5))], tiles())
    add("Crate", [box((2.9, 1.9, 0.021), (3.6, 2.6, 0.7))], white)
    shaped("Ball", 0.35, (1.6, 1.7, 0.371), surface("Metal", (0.9, 0.7, 0.4), 0.3, metallic=1.0), 5, 0.0)
    shaped("Stone", 0.36, (2.4, 1.2, 0.4), ceramic(), 5, 0.08)
    add_camera((0.35, 0.3, 1.5), Vector((2.3, 2.0, 0.5)), 20)
    cycles = start_cycles(bpy.context.scene, 600, 450)
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 12
    cycles.blur_glossy = 0.0


if __name__ == "__main__":
    sys.exit(save(arguments_of("glossy_floor", sys.argv[1:]).out, build))
