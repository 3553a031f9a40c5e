# SPDX-License-Identifier: GPL-3.0-or-later
"""A figure on a ground of 29,241 vertices, as all-frequency transport is measured on: `python figure.py NAME OUT.blend [ROUGHNESS]`.

`head` (7,958 vertices), `stone` (a bumpy ball of 10,242), `large` (the head with 31,658) and `bench` (seats of thin slats, and posts).
The objects are called Figure and Ground; both are diffuse, with a ROUGHNESS glossy: the figure a coat of plastic with half as much
metal, the ground plastic.
"""

from __future__ import annotations

import math
import sys

import bpy
from staging import add_camera, start_cycles

SIDE = 170  # squares of the ground, of 4 m a side
CUT = 0.06  # m, the longest side of a piece of the bench


def diffuse(name, color):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    node = nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (*color, 1)
    made.node_tree.links.new(node.outputs["BSDF"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def glossy(name, color, roughness, metallic):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    node = made.node_tree.nodes["Principled BSDF"]
    for key, value in (("Base Color", (*color, 1)), ("Roughness", roughness), ("Metallic", metallic)):
        node.inputs[key].default_value = value
    return made


def subdivided(levels):
    obj = bpy.context.object
    obj.modifiers.new("Subdivided", "SUBSURF").levels = levels
    bpy.ops.object.modifier_apply(modifier="Subdivided")
    obj.data.shade_smooth()
    return obj


def head(levels=2):
    bpy.ops.mesh.primitive_monkey_add(size=1.2, location=(0, 0, 0.62))
    return subdivided(levels)


def large():
    return head(3)


def stone():
    """Waves of two lengths on an icosphere of 1 m."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6, radius=0.5, location=(0, 0, 0.62))
    obj = bpy.context.object
    for vertex in obj.data.vertices:
        x, y, z = vertex.co
        waves = 0.12 * math.sin(7 * x + 1) * math.sin(8 * y) * math.sin(6 * z + 2) + 0.03 * math.sin(23 * x) * math.sin(21 * y) * math.sin(
            25 * z
        )
        vertex.co *= 1 + 2 * waves
    obj.data.shade_smooth()
    return obj


def part(x, y, z, width, depth, height):
    """Corners and quads of a box in pieces, so that its vertices show where light changes."""
    count = [max(1, math.ceil(size / CUT)) for size in (width, depth, height)]
    places, faces = [], []
    low, size = (x - width / 2, y - depth / 2, z), (width, depth, height)
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, 1):
            first = len(places)
            for i in range(count[u] + 1):
                for j in range(count[v] + 1):
                    place = list(low)
                    place[axis] += end * size[axis]
                    place[u] += size[u] * i / count[u]
                    place[v] += size[v] * j / count[v]
                    places.append(place)
            row = count[v] + 1
            for i in range(count[u]):
                for j in range(count[v]):
                    corners = [first + i * row + j, first + (i + 1) * row + j, first + (i + 1) * row + j + 1, first + i * row + j + 1]
                    faces.append(corners if end else corners[::-1])
    return places, faces


def bench():
    """Two benches of slats, back to back, and a post beside each."""
    boxes = []
    for side in (-1, 1):
        boxes += [(0, side * (0.15 + 0.09 * i), 0.42, 1.8, 0.05, 0.03) for i in range(5)]
        boxes += [(0, side * 0.08, 0.5 + 0.1 * i, 1.8, 0.03, 0.05) for i in range(4)]
        boxes += [(x, side * y, 0, 0.05, 0.05, 0.42) for x in (-0.8, 0.8) for y in (0.15, 0.5)]
        boxes += [(x, side * 0.08, 0.42, 0.05, 0.03, 0.5) for x in (-0.8, 0.8)]
        boxes += [(side * 1.3, 0, 0, 0.05, 0.05, 1.4), (side * 1.3, 0, 1.4, 0.25, 0.25, 0.2)]
    places, faces = [], []
    for box in boxes:
        own, quads = part(*box)
        faces += [[len(places) + corner for corner in quad] for quad in quads]
        places += own
    mesh = bpy.data.meshes.new("Figure")
    mesh.from_pydata(places, [], faces)
    obj = bpy.data.objects.new("Figure", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


FIGURES = {"head": head, "stone": stone, "large": large, "bench": bench}


def shown(name, color, roughness, metallic):
    return diffuse(name, color) if roughness is None else glossy(name, color, roughness, metallic)


def main():
    """Build the scene that the command line names."""
    if len(sys.argv) not in (3, 4) or sys.argv[1] not in FIGURES or not sys.argv[2].endswith(".blend"):
        print(f"usage: python data/scenes/figure.py {'|'.join(FIGURES)} OUT.blend [ROUGHNESS]", file=sys.stderr)
        return 2
    roughness = float(sys.argv[3]) if len(sys.argv) > 3 else None
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=SIDE, y_subdivisions=SIDE, size=4)
    ground = bpy.context.object
    ground.name = "Ground"
    ground.data.materials.append(shown("Ground", (0.6, 0.6, 0.6), roughness, 0))
    figure = FIGURES[sys.argv[1]]()
    figure.name = "Figure"
    figure.data.materials.clear()
    figure.data.materials.append(shown("Figure", (0.7, 0.45, 0.3), roughness, 0.5))
    add_camera((3.2, -4.2, 2.6), (0, 0, 0.4), 50)
    cycles = start_cycles(bpy.context.scene)
    cycles.max_bounces = cycles.diffuse_bounces = 4
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], check_existing=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
