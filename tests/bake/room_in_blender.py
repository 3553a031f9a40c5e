"""Facts of a scene as one JSON line: `python room_in_blender.py SCENE.blend X,Y,Z X,Y,Z`, the corners of a box.

Rays from random places of the box that lie in free space count by what they meet: `front`, `back` of a face, or nothing (`escaped`). A
place from which more than a tenth of the rays meet backs is inside something. `overlap`: the largest share of an object's lightmap, in
256 x 256 points, that two faces cover, among objects of at most LARGE triangles; `receivers`: names of the meshes.
"""

from __future__ import annotations

import json
import os
import random
import sys
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

SIDE, PLACES, RAYS, LARGE = 256, 150, 40, 12_000


def triangles(mesh: bpy.types.Mesh) -> int:
    mesh.calc_loop_triangles()
    return len(mesh.loop_triangles)


def overlap(mesh: bpy.types.Mesh) -> float:
    """Share of the points of the unit square, offset from texel centers, that lie in two triangles or more."""
    layer = mesh.uv_layers["lightmap"].uv
    hits = np.zeros((SIDE, SIDE), np.int64)
    for triangle in mesh.loop_triangles:
        corners = np.array([layer[loop].vector for loop in triangle.loops]) * SIDE
        assert corners.min() >= 0 and corners.max() <= SIDE
        (x0, y0), (x1, y1) = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
        y, x = np.mgrid[y0:y1, x0:x1] + 0.4871
        a, b = corners, np.roll(corners, -1, axis=0)
        sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in zip(a, b, strict=True)]
        hits[y0:y1, x0:x1] += np.all([side > 0 for side in sides], axis=0) | np.all([side < 0 for side in sides], axis=0)
    return float((hits > 1).mean())


def facts(low: list[float], high: list[float]) -> dict[str, object]:
    meshes = [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]
    points: list[Any] = []
    faces: list[list[int]] = []
    for thing in meshes:
        faces += [[len(points) + i for i in face.vertices] for face in thing.data.polygons]
        points += [thing.matrix_world @ vertex.co for vertex in thing.data.vertices]
    tree, rng = BVHTree.FromPolygons(points, faces), random.Random(0)
    count = {"front": 0, "back": 0, "escaped": 0}
    for _ in range(PLACES):
        place = Vector([rng.uniform(a, b) for a, b in zip(low, high, strict=True)])
        met = []
        for _ in range(RAYS):
            direction = Vector([rng.gauss(0, 1) for _ in range(3)]).normalized()
            normal = tree.ray_cast(place, direction)[1]
            met.append("escaped" if normal is None else "front" if normal.dot(direction) < 0 else "back")
        if met.count("back") <= RAYS / 10:
            count = {kind: number + met.count(kind) for kind, number in count.items()}
    return {
        **count,
        "overlap": max(overlap(thing.data) for thing in meshes if triangles(thing.data) <= LARGE),
        "triangles": sum(triangles(thing.data) for thing in meshes),
        "receivers": sorted(thing.name for thing in meshes),
        "lights": sorted(thing.name for thing in bpy.context.scene.objects if thing.type == "LIGHT"),
    }


if __name__ == "__main__":
    bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
    low, high = ([float(x) for x in word.split(",")] for word in sys.argv[2:4])
    sys.stdout.write("\n" + json.dumps(facts(low, high)) + "\n")
    sys.stdout.flush()
    os._exit(0)
