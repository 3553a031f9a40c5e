# SPDX-License-Identifier: GPL-3.0-or-later
"""A still life whose shapes come from uneven scales that are not applied: one lightmap for all of it.

Egg-shaped vases are scaled spheres, the table is a scaled cube, one jar is a mirrored copy, a bowl is sheared by its
parent, a torus leans beside them; some are shaded smooth, some flat. All seven are receivers, in an atlas that the bake
packs. What they show is whether normals and direct light by rays are right on rounded receivers: every shape
shades itself and its neighbors, and colors bleed between them.

    python data/scenes/still_life.py OUT.blend
"""

import sys
from math import cos, pi, radians, sin

import bpy
from mathutils import Euler, Matrix
from staging import add_camera, add_daylight, start_cycles, write

TABLE = (1.05, 0.8, 0.06)  # m: half extents of the table

# ---- shapes ------------------------------------------------------------------------------------------------------


def shape(name, points, faces, material, matrix, smooth=True):
    """An object of its own mesh, placed by a matrix that holds its scale."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    mesh.materials.append(material)
    return placed(bpy.data.objects.new(name, mesh), matrix)


def placed(thing, matrix):
    thing.matrix_world = matrix
    bpy.context.scene.collection.objects.link(thing)
    return thing


def at(x, y, z, turn=(0, 0, 0), scale=(1, 1, 1)):
    """Scale first, then turn (degrees), then move."""
    return Matrix.LocRotScale((x, y, z), Euler([radians(a) for a in turn]), scale)


def cube():
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    return corners, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def turned(outline, around):
    """An outline of (radius, height) turned about z; where it ends on the axis, in a fan."""
    rings = [r for r in outline if r[0] > 0]
    points = [(r * cos(2 * pi * i / around), r * sin(2 * pi * i / around), z) for r, z in rings for i in range(around)]
    rows = range(len(rings) - 1)
    faces = [
        (j * around + i, j * around + (i + 1) % around, (j + 1) * around + (i + 1) % around, (j + 1) * around + i)
        for j in rows
        for i in range(around)
    ]
    for end, base, flip in ((outline[0], 0, True), (outline[-1], len(points) - around, False)):
        if end[0] == 0:
            points.append((0, 0, end[1]))
            fan = [(base + i, base + (i + 1) % around, len(points) - 1) for i in range(around)]
            faces += [face[::-1] for face in fan] if flip else fan
    return points, faces


def sphere(around=48, across=24):
    """The unit sphere."""
    angles = [pi * j / across for j in range(across + 1)]
    return turned([(sin(a) if 0 < j < across else 0, -cos(a)) for j, a in enumerate(angles)], around)


def bowl(around=48, steps=14):
    """The lower half of the unit sphere with an inner wall."""
    outer = [(sin(a), -cos(a)) for a in (pi / 2 * j / steps for j in range(steps + 1))]
    inner = [(0.9 * r, 0.9 * z) for r, z in reversed(outer)]
    return turned([*outer, (0.97, 0.03), (0.92, 0.03), *inner], around)


def torus(major=1.0, minor=0.36, around=64, across=24):
    steps = [(2 * pi * i / around, 2 * pi * j / across) for i in range(around) for j in range(across)]
    points = [((major + minor * cos(b)) * cos(a), (major + minor * cos(b)) * sin(a), minor * sin(b)) for a, b in steps]
    cells = [(i, j) for i in range(around) for j in range(across)]
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    return points, [[(i + di) % around * across + (j + dj) % across for di, dj in corners] for i, j in cells]


# ---- materials ---------------------------------------------------------------------------------------------------


def clay(name, color):
    """A plain diffuse material."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # always there from Blender 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*color, 1)
    tree.links.new(diffuse.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


# ---- what is built -----------------------------------------------------------------------------------------------


def add_table():
    """The scaled cube that all stands on, its top at z = 0."""
    shape("Table", *cube(), clay("Linen", (0.74, 0.70, 0.62)), at(0, 0, -TABLE[2], scale=TABLE), smooth=False)


def add_vases():
    """Spheres, scaled along three axes: one upright, one leaning against it, and a low flat-shaded one."""
    shape("Tall Vase", *sphere(), clay("Terracotta", (0.66, 0.27, 0.14)), at(-0.38, 0.24, 0.5, scale=(0.22, 0.22, 0.5)))
    shape("Egg", *sphere(), clay("Cream", (0.82, 0.74, 0.56)), at(0.42, -0.34, 0.148, (0, 78, 35), (0.15, 0.15, 0.23)))
    shape(
        "Faceted Vase", *sphere(14, 8), clay("Slate", (0.20, 0.30, 0.42)), at(0.5, 0.36, 0.33, (0, 0, 10), (0.28, 0.2, 0.33)), smooth=False
    )


def add_mirrored():
    """The tall vase's smaller copy, mirrored by a scale below zero."""
    shape("Mirrored Jar", *sphere(), clay("Ochre", (0.76, 0.50, 0.12)), at(-0.72, -0.28, 0.2, (0, 0, 20), (-0.24, 0.17, 0.2)))


def add_bowl():
    """A bowl turned under a parent that is scaled unevenly: together a shear."""
    parent = placed(bpy.data.objects.new("Shear", None), at(-0.12, -0.42, 0.205, scale=(0.3, 0.2, 0.2)))
    thing = shape("Sheared Bowl", *bowl(), clay("Celadon", (0.36, 0.56, 0.44)), Matrix())
    thing.parent = parent
    thing.matrix_parent_inverse = Matrix()
    thing.matrix_basis = at(0, 0, 0, (12, 14, 35))


def add_torus():
    """A ring, flattened, that leans on the faceted vase."""
    shape("Ring", *torus(), clay("Madder", (0.58, 0.10, 0.12)), at(0.1, 0.16, 0.175, (64, 0, 24), (0.2, 0.17, 0.17)))


def build():
    """Fill the current, empty scene."""
    add_table()
    add_vases()
    add_mirrored()
    add_bowl()
    add_torus()
    add_camera((0.55, -2.9, 1.75), (-0.02, 0.0, 0.22), 50)
    add_daylight((-0.55, -0.45, 0.65), 3.0, (0.40, 0.45, 0.52), 0.4)
    cycles = start_cycles(bpy.context.scene)
    cycles.max_bounces, cycles.diffuse_bounces = 4, 4


if __name__ == "__main__":
    sys.exit(write("still_life", build, sys.argv[1:]))
