# SPDX-License-Identifier: GPL-3.0-or-later
"""A glossy rabbit of smooth shapes in a closed room with a red and a blue wall, after [Kristensen2005, fig. 9].

The room is |x| < 1.5, |y| < 1.5, 0 < z < 2.4 (m). Receivers: `Rabbit` (11,000 triangles, or --triangles; half diffuse, half a gloss as wide
as Phong's of exponent 12: light that leaves it depends on the viewer), `Pedestal` (glossy too) and `Room`, each with the UV layer
"lightmap". A point light is for viewing.

    python data/scenes/glossy_figure.py OUT.blend [--triangles 11000] [--gloss 12]
"""

import sys
from math import radians

import bpy
from house import lathe, node, profile, surface
from interior import add, arguments_of, carved, light, save, split
from lightmap_charts import unwrap_curved
from mathutils import Euler, Matrix, Vector
from staging import add_camera, start_cycles

RED, BLUE, WHITE = (0.62, 0.07, 0.05), (0.06, 0.14, 0.60), (0.74, 0.74, 0.72)
STAND, FINE = 0.5, 0.012  # m: the pedestal's height; the mesh of the figure before it is thinned out
# Ellipsoids: center and half axes (m), turn about x and y (degrees); the figure looks along -y and is 1.1 m high
SHAPES = (
    ((0.00, 0.10, 0.30), (0.27, 0.36, 0.30), (-12, 0)),  # body
    ((0.00, -0.10, 0.36), (0.19, 0.20, 0.25), (20, 0)),  # chest
    ((0.00, -0.27, 0.63), (0.15, 0.19, 0.16), (12, 0)),  # head
    ((0.00, -0.41, 0.59), (0.08, 0.08, 0.08), (0, 0)),  # muzzle
    ((0.09, -0.17, 0.90), (0.055, 0.045, 0.24), (-14, 14)),  # ears
    ((-0.09, -0.14, 0.88), (0.055, 0.045, 0.24), (-28, -16)),
    ((0.20, 0.12, 0.17), (0.13, 0.22, 0.17), (0, 0)),  # thighs
    ((-0.20, 0.12, 0.17), (0.13, 0.22, 0.17), (0, 0)),
    ((0.19, -0.12, 0.06), (0.075, 0.20, 0.06), (0, 0)),  # hind feet
    ((-0.19, -0.12, 0.06), (0.075, 0.20, 0.06), (0, 0)),
    ((0.09, -0.30, 0.15), (0.055, 0.065, 0.17), (10, 0)),  # front legs
    ((-0.09, -0.30, 0.15), (0.055, 0.065, 0.17), (10, 0)),
    ((0.00, 0.45, 0.28), (0.09, 0.09, 0.09), (0, 0)),  # tail
)


def glossy(name, color, exponent):
    """Half diffuse, half a glossy lobe as wide as that of a Phong exponent: the GGX width is sqrt(2 / (n + 2)), roughness its root."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    mix = node(tree, "MixShader", Fac=0.5)
    tree.links.new(node(tree, "BsdfDiffuse", Color=(*color, 1)).outputs[0], mix.inputs[1])
    lobe = node(tree, "BsdfAnisotropic", Color=(0.9, 0.9, 0.9, 1), Roughness=(2 / (exponent + 2)) ** 0.25)
    tree.links.new(lobe.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def figure(triangles, material):
    """Ellipsoids joined by voxels, smoothed, and thinned out to the number of triangles."""
    for place, half, (x, y) in SHAPES:
        turn = Euler((radians(x), radians(y), 0)).to_matrix().to_4x4()
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1)
        bpy.context.object.matrix_world = Matrix.Translation(place) @ turn @ Matrix.Diagonal((*half, 1))
    bpy.ops.object.select_all(action="DESELECT")
    for thing in bpy.context.scene.objects:
        thing.select_set(thing.name.startswith("Sphere"))
    bpy.ops.object.transform_apply()
    bpy.ops.object.join()
    thing = bpy.context.object
    thing.name = thing.data.name = "Rabbit"
    modifiers = thing.modifiers
    modifiers.new("Join", "REMESH").mode = "VOXEL"
    modifiers["Join"].voxel_size = FINE
    smooth = modifiers.new("Smooth", "SMOOTH")
    smooth.factor, smooth.iterations = 0.5, 30
    modifiers.new("Triangles", "TRIANGULATE")
    for name in ("Join", "Smooth", "Triangles"):
        bpy.ops.object.modifier_apply(modifier=name)
    modifiers.new("Fewer", "DECIMATE").ratio = min(1.0, triangles / len(thing.data.polygons))
    bpy.ops.object.modifier_apply(modifier="Fewer")
    low = min(vertex.co.z for vertex in thing.data.vertices)
    thing.data.transform(Matrix.Translation((0, 0, -low)))
    thing.data.polygons.foreach_set("use_smooth", [True] * len(thing.data.polygons))
    thing.data.materials.clear()
    thing.data.materials.append(material)
    for layer in list(thing.data.uv_layers):
        thing.data.uv_layers.remove(layer)
    unwrap_curved(thing)
    thing.matrix_world = Matrix.Translation((0, 0, STAND + 0.004)) @ Matrix.Rotation(radians(35), 4, "Z")


def build(triangles, gloss):
    figure(triangles, glossy("Porcelain", (0.75, 0.68, 0.58), gloss))
    white, red, blue = (surface(name, color, 1.0) for name, color in (("White", WHITE), ("Red", RED), ("Blue", BLUE)))
    shell = carved(((-2, -2, -1), (2, 2, 3)), [((-1.5, -1.5, 0), (1.5, 1.5, 2.4))], step=0.15)
    add("Room", split(shell, lambda middle, normal: red if normal.x > 0.5 else blue if normal.x < -0.5 else white), None)
    turned = lathe(profile("1 0.2, 44 0.2, 46 2, 46 6, 42 9, 38 14, 37 38, 41 43, 46 46, 46 49, 45 50, 1 50"), 48)
    add("Pedestal", [turned], glossy("Glaze", (0.30, 0.42, 0.36), gloss), flat=False)
    light("Light", "POINT", (0.4, -0.9, 2.1), 60, shadow_soft_size=0.05)
    add_camera((0.25, -1.42, 1.35), Vector((0, 0, 0.95)), 20)
    cycles = start_cycles(bpy.context.scene)
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 12, 12, 12
    cycles.blur_glossy = 0.0


if __name__ == "__main__":
    options = arguments_of("glossy_figure", sys.argv[1:], triangles=11000, gloss=12.0)
    sys.exit(save(options.out, lambda: build(options.triangles, options.gloss)))
