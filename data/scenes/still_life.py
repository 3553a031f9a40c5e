# SPDX-License-Identifier: GPL-3.0-or-later
"""A still life whose shapes come from uneven scales that are not applied: one lightmap for all of it.

Egg-shaped vases are scaled spheres, the table is a scaled cube, one jar is mirrored, a bowl is sheared by its parent, a
ring leans between them; some are shaded smooth, some flat. All seven are receivers with a UV layer `lightmap`, side by side
in one atlas. What they show is whether normals and direct light by rays are right on rounded receivers: every shape shades
itself and its neighbors, and colors bleed between them.

    python data/scenes/still_life.py OUT.blend
"""

import sys
from math import cos, pi, radians, sin

import bpy
from mathutils import Euler, Matrix
from staging import add_camera, add_daylight, start_cycles, write

TABLE = (1.05, 0.8, 0.06)  # m: half extents of the table

# ---- shapes: a part is (points, faces, for every face the places of its corners in the unit square) ---------------------


def shape(name, part, material, matrix, chart, smooth=True):
    """An object placed by a matrix that holds its scale; `chart` (u, v, width, height) is its place in the lightmap."""
    points, faces, places = part
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    mesh.materials.append(material)
    u, v, width, height = chart
    flat = [value for corners in places for x, y in corners for value in (u + width * x, v + height * y)]
    mesh.uv_layers.new(name="lightmap", do_init=False).data.foreach_set("uv", flat)
    return placed(bpy.data.objects.new(name, mesh), matrix)


def placed(thing, matrix):
    thing.matrix_world = matrix
    bpy.context.scene.collection.objects.link(thing)
    return thing


def at(x, y, z, turn=(0, 0, 0), scale=(1, 1, 1)):
    """Scale first, then turn (degrees), then move."""
    return Matrix.LocRotScale((x, y, z), Euler([radians(a) for a in turn]), scale)


def cube():
    """Its top takes most of the chart, the sides strips below it, the bottom what is left beside them."""
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (3, 2, 6, 7), (2, 0, 4, 6), (1, 3, 7, 5)]
    strips = [(0, 0.195, 1, 0.045), (0, 0.13, 1, 0.045), (0, 0.065, 0.76, 0.045), (0, 0, 0.76, 0.045)]
    charts = [(0.78, 0, 0.22, 0.11), (0, 0.26, 1, 0.74), *strips]
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    return corners, faces, [[(u + w * x, v + h * y) for x, y in square] for u, v, w, h in charts]


def woven(rows, closed=False):
    """Quads between rings of points, triangles where a row is one point; longitude runs along u, the rows along v.

    `closed`: the last row is the first.
    """
    around = max(len(row) for row in rows)
    points, starts = [], []
    for row in rows[:-1] if closed else rows:
        starts.append(len(points))
        points += row
    starts += starts[:1] if closed else []
    faces, places = [], []
    for j in range(len(rows) - 1):
        for i in range(around):
            face, corners = [], []
            for column, row in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                pole = len(rows[row]) == 1
                index = starts[row] + (0 if pole else column % around)
                if index not in face:
                    face.append(index)
                    corners.append(((i + 0.5 if pole else column) / around, row / (len(rows) - 1)))
            faces.append(face)
            places.append(corners)
    return points, faces, places


def turned(outline, around):
    """An outline of (radius, height) turned about z."""
    angles = [2 * pi * i / around for i in range(around)]
    return woven([[(r * cos(a), r * sin(a), z) for a in angles] if r > 0 else [(0, 0, z)] for r, z in outline])


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
    """About the z axis."""
    turns, sides = [2 * pi * i / around for i in range(around)], [2 * pi * j / across for j in range(across + 1)]
    rows = [[((major + minor * cos(b)) * cos(a), (major + minor * cos(b)) * sin(a), minor * sin(b)) for a in turns] for b in sides]
    return woven(rows, closed=True)


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
    linen = clay("Linen", (0.74, 0.70, 0.62))
    shape("Table", cube(), linen, at(0, 0, -TABLE[2], scale=TABLE), (0.01, 0.35, 0.62, 0.64), smooth=False)


def add_vases():
    """Spheres, scaled along three axes: one upright, one lying, and one shaded flat."""
    upright, lying = at(-0.38, 0.24, 0.5, scale=(0.22, 0.22, 0.5)), at(0.42, -0.34, 0.148, (0, 78, 35), (0.15, 0.15, 0.23))
    shape("Tall Vase", sphere(), clay("Terracotta", (0.66, 0.27, 0.14)), upright, (0.01, 0.01, 0.32, 0.32))
    shape("Egg", sphere(), clay("Cream", (0.82, 0.74, 0.56)), lying, (0.345, 0.12, 0.285, 0.21))
    slate, behind = clay("Slate", (0.20, 0.30, 0.42)), at(0.5, 0.36, 0.33, (0, 0, 10), (0.28, 0.2, 0.33))
    shape("Faceted Vase", sphere(14, 8), slate, behind, (0.645, 0.26, 0.345, 0.25), smooth=False)


def add_mirrored():
    """A low jar, mirrored by a scale below zero."""
    mirrored = at(-0.72, -0.28, 0.2, (0, 0, 20), (-0.24, 0.17, 0.2))
    shape("Mirrored Jar", sphere(), clay("Ochre", (0.76, 0.50, 0.12)), mirrored, (0.645, 0.01, 0.345, 0.235))


def add_bowl():
    """A bowl turned under a parent that is scaled unevenly: together a shear."""
    parent = placed(bpy.data.objects.new("Shear", None), at(-0.12, -0.42, 0.205, scale=(0.3, 0.2, 0.2)))
    thing = shape("Sheared Bowl", bowl(), clay("Celadon", (0.36, 0.56, 0.44)), Matrix(), (0.645, 0.525, 0.345, 0.29))
    thing.parent = parent
    thing.matrix_parent_inverse = Matrix()
    thing.matrix_basis = at(0, 0, 0, (12, 14, 35))


def add_torus():
    """A ring, flattened, that leans."""
    leaning = at(0.1, 0.16, 0.175, (64, 0, 24), (0.2, 0.17, 0.17))
    shape("Ring", torus(), clay("Madder", (0.58, 0.10, 0.12)), leaning, (0.645, 0.83, 0.345, 0.16))


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
