# SPDX-License-Identifier: GPL-3.0-or-later
"""A closed room of 4 x 3 x 2.5 m for what surfels find hard: objects that emit, and materials that are not diffuse.

The free space is 0 < x < 4, 0 < y < 3, 0 < z < 2.5 (m). Receivers, each with the UV layer "lightmap": `Room`, `Table`, `Block`.
`Picture` hangs on the wall y = 3 and emits a texture, `Tube` is a neon tube of 1 m and 2 cm under the ceiling, `Television` is black and
only its `Screen` emits; with --unlit nothing emits, and all four are black. With --shiny the floor is lacquer, `Block` is metal, the wall
x = 4 has stripes of 10 cm, and `Curtain` is of translucent cloth.

    python data/scenes/studio.py OUT.blend [--unlit] [--shiny]
"""

import sys

import bpy
from house import box, calculate, circle, node, ramp, skin, surface
from interior import add, arguments_of, carved, glow, save, split
from mathutils import Matrix, Vector
from staging import add_camera, start_cycles

SIZE = (4.0, 3.0, 2.5)  # m
STRIPES = 62.8  # rad per meter: a stripe each 10 cm


def striped(tree):
    """Dark and pale stripes along y."""
    y = node(tree, "SeparateXYZ", Vector=node(tree, "TexCoord").outputs["Object"]).outputs[1]
    wave = calculate(tree, "SINE", calculate(tree, "MULTIPLY", y, STRIPES), 0)
    return ramp(tree, calculate(tree, "GREATER_THAN", wave, 0), (0.0, (0.10, 0.12, 0.30)), (1.0, (0.85, 0.75, 0.55)))


def picture():
    """Emission that falls from left to right, from warm to cold."""
    material = glow("Picture", (1, 1, 1), 6.0)
    tree = material.node_tree
    emission = next(one for one in tree.nodes if one.bl_idname == "ShaderNodeEmission")
    x = node(tree, "SeparateXYZ", Vector=node(tree, "TexCoord").outputs["Object"]).outputs[0]
    along = calculate(tree, "MULTIPLY_ADD", x, 0.833)
    along.node.inputs[2].default_value = 0.5
    color = ramp(tree, along, (0.0, (1.0, 0.55, 0.15)), (1.0, (0.02, 0.05, 0.20)))
    tree.links.new(color, emission.inputs["Color"])
    return material


def translucent(name="Cloth", reflected=(0.4, 0.4, 0.35), passed=(0.4, 0.4, 0.35)):
    """Cloth that lets light through; half of it, unless told otherwise."""
    material = surface(name, reflected, 1.0)
    tree = material.node_tree
    diffuse = next(one for one in tree.nodes if one.bl_idname == "ShaderNodeBsdfDiffuse")
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(diffuse.outputs[0], both.inputs[0])
    tree.links.new(node(tree, "BsdfTranslucent", Color=(*passed, 1)).outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], next(one for one in tree.nodes if "Output" in one.bl_idname).inputs["Surface"])
    return material


def build(unlit, shiny):
    white, red, black = (surface(*told, 1.0) for told in (("White", (0.7,) * 3), ("Red", (0.6, 0.12, 0.08)), ("Black", (0, 0, 0))))
    floor = surface("Lacquer", (0.35, 0.2, 0.1), 0.25) if shiny else surface("Boards", (0.35, 0.2, 0.1), 1.0)
    stripes = surface("Stripes", striped, 1.0) if shiny else white

    def of(middle, normal):
        return floor if normal.z > 0.9 else red if normal.x > 0.9 else stripes if normal.x < -0.9 else white

    hull = (tuple(-0.1 for _ in SIZE), tuple(side + 0.1 for side in SIZE))
    add("Room", split(carved(hull, [((0, 0, 0), SIZE)]), of), None)
    legs = [box((x, y, 0.002), (x + 0.06, y + 0.06, 0.698)) for x in (1.3, 2.24) for y in (1.0, 1.64)]
    add("Table", [box((1.25, 0.95, 0.7), (2.35, 1.75, 0.74)), *legs], white)
    block = surface("Steel", (0.75, 0.7, 0.65), 0.3, metallic=1.0) if shiny else white
    add("Block", [box((3.0, 2.0, 0.002), (3.6, 2.6, 0.9))], block)
    add("Picture", [box((-0.6, 0, 0), (0.6, 0.01, 0.8))], black if unlit else picture(), matrix=Matrix.Translation((1.8, 2.985, 1.0)))
    rings = [[Vector((x, p.x, p.y)) for p in circle(0.01, 0, 12)] for x in (0.0, 1.0)]
    tube = glow("Neon", (1.0, 0.25, 0.4), 60.0)
    add("Tube", [skin(rings)], black if unlit else tube, flat=False, matrix=Matrix.Translation((2.2, 0.8, 2.1)))
    body, screen = box((-0.5, -0.03, 0), (0.5, 0.03, 0.62)), box((-0.46, -0.032, 0.04), (0.46, -0.031, 0.58))
    place = Matrix.Translation((0.1, 1.2, 0.9)) @ Matrix.Rotation(1.5708, 4, "Z")
    add("Television", [body], black, matrix=place)
    add("Screen", [screen], black if unlit else glow("Screen", (0.5, 0.7, 1.0), 5.0), matrix=place)
    if shiny:
        add(
            "Curtain",
            [([Vector(p) for p in ((2.7, 0.3, 0.2), (2.7, 1.5, 0.2), (2.7, 1.5, 2.0), (2.7, 0.3, 2.0))], [(0, 1, 2, 3)])],
            translucent(),
        )
    add_camera((0.4, 0.3, 1.6), (2.6, 2.2, 0.9), 18)
    cycles = start_cycles(bpy.context.scene, 600, 450)
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 12


if __name__ == "__main__":
    options = arguments_of("studio", sys.argv[1:], unlit=False, shiny=False)
    sys.exit(save(options.out, lambda: build(options.unlit, options.shiny)))
