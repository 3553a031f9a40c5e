# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges where a UV layer is cut but the surface is not: both sides should look the same."""

from __future__ import annotations

import math

import bpy
import numpy as np

SAME_UV = 1e-6  # of the unit square: closer corners are one
SMOOTH = math.cos(math.radians(2))  # of the angle between corner normals, above which the shading is discontinuous


def seam_edges(mesh: bpy.types.Mesh, layer: str, within_material: bool) -> np.ndarray:
    """(E, 8) float32: u0 v0 u1 v1 of an edge on one side, v up, then the same two vertices on the other side.

    Edges of two faces whose coordinates differ there, whose corner normals do not, and, if `within_material`, of one material. Vertices at
    one place are one vertex, as meshes from files that split them at seams need. Edges of more than two faces, or outside [0, 1],
    are left out.
    """
    corners = len(mesh.loops)
    uv = np.empty(corners * 2, np.float32)
    mesh.uv_layers[layer].uv.foreach_get("vector", uv)
    uv = uv.reshape(-1, 2)
    normals = np.empty(corners * 3, np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    normals = normals.reshape(-1, 3)
    vertices, following, face = mesh_corners(mesh)
    material = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", material)
    one, other = paired(vertices, following)
    turned = vertices[one] != vertices[other]  # faces that agree on their front run along an edge in opposite directions
    left = np.stack([one, following[one]], axis=1)  # (E, 2) corners at the edge's two vertices
    right = np.stack([other, following[other]], axis=1)
    right[turned] = right[turned, ::-1]
    sides = uv[np.concatenate([left, right], axis=1)]  # (E, 4, 2)
    cut = np.abs(sides[:, :2] - sides[:, 2:]).max(axis=(1, 2)) > SAME_UV
    smooth = np.einsum("eix,eix->ei", normals[left], normals[right]).min(axis=1) >= SMOOTH
    inside = (np.isfinite(sides) & (sides >= -SAME_UV) & (sides <= 1 + SAME_UV)).all(axis=(1, 2))
    kept = cut & smooth & inside
    if within_material:
        kept &= material[face[one]] == material[face[other]]
    return sides[kept].reshape(-1, 8)


def mesh_corners(mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(vertex of every corner, the corner after it in its face, its face); vertices at one place are one vertex."""
    vertices = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    first = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", first)
    count = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", count)
    following = np.arange(1, len(vertices) + 1)
    following[first + count - 1] = first  # the corner after a face's last is its first
    return _places(mesh)[vertices], following, np.repeat(np.arange(len(first)), count)


def paired(vertices: np.ndarray, following: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two corners that begin each edge of exactly two faces, a corner beginning the edge to the one after it."""
    ends = vertices, vertices[following]
    edge = np.minimum(*ends) * (int(vertices.max(initial=0)) + 1) + np.maximum(*ends)
    order = np.argsort(edge, kind="stable")
    edge = edge[order]
    starts = np.flatnonzero(np.concatenate([[True], edge[1:] != edge[:-1]])) if len(edge) else np.zeros(0, np.int64)
    twice = starts[np.diff(np.append(starts, len(edge))) == 2]
    return order[twice], order[twice + 1]


def _places(mesh: bpy.types.Mesh) -> np.ndarray:
    """For every vertex the first one at its place."""
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3) + np.float32(0)  # -0 is 0
    order = np.lexsort(points.T)
    new = np.ones(len(points), bool)
    new[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    places = np.empty(len(points), np.int64)
    places[order] = order[np.flatnonzero(new)[np.cumsum(new) - 1]] if len(points) else order
    return places
