# SPDX-License-Identifier: GPL-3.0-or-later
"""A plain of 100 m under a low sun, in numbers from a seed: sticks of 2 to 6 cm before the camera, and blocks up to 60 m behind them.

python data/scenes/plain.py OUT.blend [--angle 0.0093]
"""

import argparse
import math

import bpy
import numpy as np

CELLS, HALF = 100, 50.0  # of the ground, and half its side, m
CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def height(x, y):
    """Of the ground, m: flat about the middle."""
    return float(1.2 * np.sin(x * 0.13) * np.cos(y * 0.1) * np.clip(np.hypot(x, y) / 20, 0, 1))


def add(name, points, faces, color):
    """An object of one diffuse color."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*color, 1)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def boxes(rng, count, low, high, widths, heights, sunk):
    """Points and faces of boxes on the ground between `low` and `high` (x, y), of half widths and heights in these ranges, m."""
    points, faces = [], []
    for _ in range(count):
        x, y, width = rng.uniform(low[0], high[0]), rng.uniform(low[1], high[1]), rng.uniform(*widths)
        bottom, tall = height(x, y) - sunk, rng.uniform(*heights)
        faces += [tuple(len(points) + corner for corner in side) for side in SIDES]
        points += [(x + a * width, y + b * width, z) for z in (bottom, bottom + tall) for a, b in CORNERS]
    return points, faces


def place(name, data, location, rotation):
    obj = bpy.data.objects.new(name, data)
    obj.location, obj.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(obj)
    return obj


def build(angle):
    rng = np.random.default_rng(1)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 4
    line = np.linspace(-HALF, HALF, CELLS + 1)
    starts = [j * (CELLS + 1) + i for j in range(CELLS) for i in range(CELLS)]
    ground = [(k, k + 1, k + CELLS + 2, k + CELLS + 1) for k in starts]
    add("Ground", [(x, y, height(x, y)) for y in line for x in line], ground, (0.35, 0.4, 0.2))
    add("Sticks", *boxes(rng, 220, (-3, -8.5), (3, -1.5), (0.008, 0.03), (0.1, 0.45), 0.02), (0.6, 0.5, 0.4))
    add("Blocks", *boxes(rng, 150, (-45, 2), (45, 48), (0.2, 0.9), (1, 6), 0.3), (0.5, 0.5, 0.55))
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = 3, angle
    place("Sun", sun, (0, 0, 5), (0.75, 0.35, 0.4))
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 24
    scene.camera = place("Camera", camera, (0, -10, 1.6), (math.radians(78), 0, 0))
    scene.render.resolution_x, scene.render.resolution_y = 320, 180


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out")
    parser.add_argument("--angle", type=float, default=0.0093, help="angular diameter of the sun, rad")
    options = parser.parse_args()
    build(options.angle)
    bpy.ops.wm.save_as_mainfile(filepath=options.out)


if __name__ == "__main__":
    main()
