# SPDX-License-Identifier: GPL-3.0-or-later
"""Lightmap coordinates: a UV layer whose charts fill the unit square and do not overlap."""

from math import radians

import bpy
import numpy as np
from mathutils import Vector

LAYER, GAP = "lightmap", 2.5 / 256  # UV layer of every object; distance between its charts
LEAST = 1.5 / 256  # side of the thinnest chart of an atlas


def unwrap_curved(thing, gap=GAP):
    """Smart projection of all faces into the layer, without overlap."""
    thing.data.uv_layers.new(name=LAYER)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.select_all(action="DESELECT")
    thing.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(angle_limit=radians(66), island_margin=gap)
    bpy.ops.object.mode_set(mode="OBJECT")


def unwrap_planes(mesh):
    """One chart for each connected piece of a plane, all at one scale, packed in rows of falling height."""
    _lay_out([mesh], LAYER, 0.0)


def share_atlas(things, layer, least=LEAST):
    """A UV `layer` of several objects made of flat faces, one chart for each piece of a plane, side by side.

    All at one scale, but no chart is thinner than `least`: thin ones are stretched, so that they have texels of their own.
    """
    _lay_out([thing.data for thing in things], layer, least)


def _lay_out(meshes, layer, least):
    charts = [(mesh, loops, places) for mesh in meshes for loops, places in _charts(mesh)]
    sizes = np.array([places.max(axis=0) for _, _, places in charts])
    low, high = 0.0, 1 / sizes.max()
    for _ in range(40):
        scale = (low + high) / 2
        low, high = (scale, high) if _rows(np.maximum(sizes * scale, least)) is not None else (low, scale)
    shown = np.maximum(sizes * low, least)
    corners = {mesh: np.empty((len(mesh.loops), 2)) for mesh in meshes}
    for (mesh, loops, places), size, stretched, corner in zip(charts, sizes, shown, _rows(shown), strict=True):
        corners[mesh][loops] = places * (stretched / size) + corner
    for mesh, uv in corners.items():
        mesh.uv_layers.new(name=layer, do_init=False).uv.foreach_set("vector", uv.astype(np.float32).ravel())


def _charts(mesh):
    """(loops, places in the plane from 0, m) of each piece; wider than high."""
    parent, on_edge = list(range(len(mesh.polygons))), {}

    def root(i):
        while parent[i] != i:
            parent[i] = i = parent[parent[i]]
        return i

    planes = [(*(round(c, 3) for c in face.normal), round(face.normal.dot(face.center), 4)) for face in mesh.polygons]
    for face in mesh.polygons:
        for edge in face.edge_keys:
            other = on_edge.setdefault((edge, planes[face.index]), face.index)
            parent[root(face.index)] = root(other)
    pieces = {}
    for face in mesh.polygons:
        pieces.setdefault(root(face.index), []).append(face)
    for faces in pieces.values():
        normal = faces[0].normal
        first = normal.orthogonal() if abs(normal.z) > 0.999 else Vector((0, 0, 1)).cross(normal)
        first = Vector((1, 0, 0)) if abs(normal.z) > 0.999 else first.normalized()
        loops = [i for face in faces for i in face.loop_indices]
        points = np.array([mesh.vertices[mesh.loops[i].vertex_index].co for i in loops])
        places = points @ np.array([first, normal.cross(first)]).T
        places -= places.min(axis=0)
        yield loops, places if places[:, 0].max() >= places[:, 1].max() else places[:, ::-1] * (1, -1) + (0, places[:, 0].max())


def _rows(sizes):
    """Lower left corners of rectangles in rows of the unit square, GAP apart; None where they do not fit."""
    corners, x, y, height = np.empty_like(sizes), GAP, GAP, 0.0
    for i in np.lexsort((-sizes[:, 0], -sizes[:, 1])):
        if x + sizes[i, 0] + GAP > 1:
            x, y, height = GAP, y + height + GAP, 0.0
        if x + sizes[i, 0] + GAP > 1 or y + sizes[i, 1] + GAP > 1:
            return None
        corners[i] = x, y
        x, height = x + sizes[i, 0] + GAP, max(height, sizes[i, 1])
    return corners
