# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers whose place in the world is more than a turn: `python uneven.py NAME OUT.blend`. The receiver is called Body."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import bpy
from mathutils import Euler, Matrix

sys.path.insert(0, str(Path(__file__).parent))

from closed_form_scenes import camera, material  # noqa: E402

TURN = Euler((0.4, 0.7, 1.1)).to_matrix().to_4x4()
UNEVEN = Matrix.Diagonal((1, 2, 0.5, 1))


def linked(mesh, name="Body"):
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    mesh.materials.append(material(name, (0.8, 0.8, 0.8)))
    return obj


def pyramid():
    """Four sides over a square, apex (0, 0, 1), each a chart in a quarter of the layer."""
    mesh = bpy.data.meshes.new("Body")
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1)]
    mesh.from_pydata(corners, [], [(i, (i + 1) % 4, 4) for i in range(4)])
    layer = mesh.uv_layers.new(name="UV", do_init=False)
    for side in range(4):
        u, v = 0.5 * (side % 2), 0.5 * (side // 2)
        for corner, (x, y) in enumerate([(0.02, 0.02), (0.48, 0.02), (0.25, 0.48)]):
            layer.uv[3 * side + corner].vector = (u + x, v + y)
    return linked(mesh)


def egg(around=32, across=16):
    """A smooth unit sphere, one chart of longitude and latitude, its poles left open."""
    steps = [(2 * math.pi * i / around, math.pi * (0.06 + 0.88 * j / across)) for i in range(around + 1) for j in range(across + 1)]
    corners = [(math.sin(b) * math.cos(a), math.sin(b) * math.sin(a), math.cos(b)) for a, b in steps]
    mesh = bpy.data.meshes.new("Body")
    row = across + 1
    faces = [(i * row + j, i * row + j + 1, (i + 1) * row + j + 1, (i + 1) * row + j) for i in range(around) for j in range(across)]
    mesh.from_pydata(corners, [], faces)
    layer = mesh.uv_layers.new(name="UV", do_init=False)
    for loop, into in zip(mesh.loops, layer.uv, strict=True):
        i, j = divmod(loop.vertex_index, row)
        into.vector = (0.02 + 0.96 * i / around, 0.98 - 0.96 * j / across)
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    mesh.normals_split_custom_set([corners[loop.vertex_index] for loop in mesh.loops])  # those of the sphere, the seam's too
    return linked(mesh)


def parented(child, parent_matrix, own):
    """The child turned by `own` under a parent that scales unevenly: together a shear."""
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.matrix_world = parent_matrix
    child.parent = parent
    child.matrix_local = own
    return child


def instanced(body, matrix, own):
    """The body in a collection that an empty of that matrix shows: the receiver is the empty, called Shown."""
    held = bpy.data.collections.new("Held")
    bpy.context.scene.collection.objects.unlink(body)
    held.objects.link(body)
    body.matrix_world = own
    empty = bpy.data.objects.new("Shown", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", held
    empty.matrix_world = matrix
    bpy.context.scene.collection.objects.link(empty)


def placed(body, matrix):
    body.matrix_world = matrix
    return body


def haired(body):
    """The same with hair, which stays on an object of its own."""
    body.modifiers.new("Hair", "PARTICLE_SYSTEM")
    body.particle_systems[0].settings.type = "HAIR"
    body.particle_systems[0].settings.count = 3
    body.particle_systems[0].settings.hair_length = 0.01
    return body


def flat():
    """A pyramid without height."""
    return placed(pyramid(), Matrix.Diagonal((1, 2, 0, 1)))


SCENES = {
    "pyramid scaled": lambda: placed(pyramid(), UNEVEN),
    "pyramid turned and scaled": lambda: placed(pyramid(), TURN @ UNEVEN),
    "pyramid mirrored": lambda: placed(pyramid(), TURN @ Matrix.Diagonal((-1, 2, 0.5, 1))),
    "pyramid sheared": lambda: parented(pyramid(), UNEVEN, TURN),
    "pyramid sheared with hair": lambda: haired(parented(pyramid(), UNEVEN, TURN)),
    "pyramid instanced": lambda: instanced(pyramid(), UNEVEN, TURN),
    "pyramid flat": flat,
    "egg turned and scaled": lambda: placed(egg(), TURN @ UNEVEN),
    "egg mirrored": lambda: placed(egg(), TURN @ Matrix.Diagonal((1, 2, -0.5, 1))),
    "egg sheared": lambda: parented(egg(), TURN @ UNEVEN, TURN),
}

if __name__ == "__main__":
    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[sys.argv[1]]()
    camera(location=(0, -8, 6))
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], check_existing=False)
    os._exit(0)
