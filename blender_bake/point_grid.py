# SPDX-License-Identifier: GPL-3.0-or-later
"""Which points of a grid in a box are free: neither inside closed geometry nor close to a surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from blender_bake.ipc import WorkerError
from blender_bake.scene_file import SOLID, show_as_rendered
from blender_bake.seam_edges import mesh_corners, paired

CLEARANCE = 0.1  # of the spacing: a light nearer to a surface lights little else
MOST_LIGHTS = 20000
TRIES = 200  # random points per one wanted, before giving up
STEP = 1e-5  # of a solid's size: how far behind a hit the next ray begins
MOST_HITS = 200
DIRECTIONS = [  # unlike any axis or diagonal, since meshes like those: an edge hit along one is not hit along the others
    Vector((0.3151, 0.9127, 0.2604)).normalized(),
    Vector((-0.7843, 0.2239, 0.5785)).normalized(),
    Vector((0.5417, -0.4381, -0.7173)).normalized(),
    Vector((-0.1879, -0.8211, 0.5389)).normalized(),
    Vector((0.8713, 0.1937, -0.4508)).normalized(),
]


@dataclass(frozen=True)
class Solid:
    """Triangles of one object in the world, its bounds, and whether it is closed, so that it has an inside."""

    tree: BVHTree
    low: np.ndarray
    high: np.ndarray
    closed: bool


def free_points(scene: bpy.types.Scene, asked: dict[str, Any]) -> dict[str, Any]:
    """{box, grid, random, skipped}: free points `asked["spacing"]` meters apart in `asked["box"]`, and `asked["random"]` free random ones.

    The box is by default that of all that renders. The grid is centered in it, half a spacing or more from its sides. WorkerError where
    no point is free.
    """
    show_as_rendered(scene)
    solids = list(_solids())
    if not solids:
        raise WorkerError("expected something that renders, to place lights about, found no mesh")
    if asked["box"] is None:
        low, high = np.min([s.low for s in solids], axis=0), np.max([s.high for s in solids], axis=0)
    else:
        low, high = np.array(asked["box"][:3], np.float64), np.array(asked["box"][3:], np.float64)
    points = grid(low, high, asked["spacing"])
    clearance = CLEARANCE * asked["spacing"]
    free = [point for point in points if is_free(point, solids, clearance)]
    if not free:
        raise WorkerError(
            f"expected room for point lights in the box {_shown(low)} to {_shown(high)} m, found all {len(points)} in or near geometry; "
            "choose another `light_bounds` or a smaller spacing, or turn the normals of a closed room inwards"
        )
    rng = np.random.default_rng(asked["seed"])
    random: list[np.ndarray] = []
    for _ in range(TRIES * asked["random"]):
        if len(random) == asked["random"]:
            break
        point = rng.uniform(low, high)
        if is_free(point, solids, clearance):
            random.append(point)
    if len(random) < asked["random"]:
        raise WorkerError(f"expected {asked['random']} random free places in the box, found {len(random)}; choose another `light_bounds`")
    return {
        "box": [*low.tolist(), *high.tolist()],
        "grid": [point.tolist() for point in free],
        "random": [point.tolist() for point in random],
        "skipped": len(points) - len(free),
    }


def grid(low: np.ndarray, high: np.ndarray, spacing: float) -> np.ndarray:
    """(N, 3) points `spacing` apart, in the middle of the box, x running fastest; one where the box is thinner than that."""
    counts = np.maximum(np.floor((high - low) / spacing + 1e-6), 1)
    if counts.prod() > MOST_LIGHTS:
        raise WorkerError(f"expected at most {MOST_LIGHTS} point lights, found {counts.prod():.0f} in the box; choose a larger spacing")
    axes = [(low[i] + high[i]) / 2 + (np.arange(counts[i]) - (counts[i] - 1) / 2) * spacing for i in range(3)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)


def is_free(point: np.ndarray, solids: list[Solid], clearance: float) -> bool:
    """Whether a point is in no closed solid and farther than `clearance` from all surfaces."""
    place = Vector(point)
    for solid in solids:
        if (point < solid.low - clearance).any() or (point > solid.high + clearance).any():
            continue
        if solid.tree.find_nearest(place, clearance)[0] is not None:
            return False
        if solid.closed and is_inside(place, solid):
            return False
    return True


def is_inside(place: Vector, solid: Solid) -> bool:
    """Whether most of several rays leave the solid more often than they enter it.

    Parity would do for one simple shell. Signed counts also handle overlapping shells of one mesh, and rooms, whose faces point inwards
    and whose air is free.
    """
    size = float((solid.high - solid.low).max())
    votes = 0
    for direction in DIRECTIONS:
        leaving, start = 0, place
        for _ in range(MOST_HITS):
            hit, normal, _, _ = solid.tree.ray_cast(start, direction)
            if hit is None:
                break
            leaving += 1 if normal.dot(direction) > 0 else -1
            start = hit + direction * (STEP * size)
        votes += leaving > 0
    return 2 * votes > len(DIRECTIONS)


def _solids() -> Iterator[Solid]:
    """All that renders, in the world, instances and modifiers applied."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type not in SOLID or obj.hide_render or not (instance.is_instance or instance.show_self):
            continue
        mesh = obj.to_mesh()
        if mesh is None:
            continue
        if mesh.polygons:
            yield _solid(mesh, np.array(instance.matrix_world))
        obj.to_mesh_clear()


def _solid(mesh: bpy.types.Mesh, matrix: np.ndarray) -> Solid:
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    mesh.calc_loop_triangles()
    triangles = np.empty(len(mesh.loop_triangles) * 3, np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    triangles = triangles.reshape(-1, 3)
    if np.linalg.det(matrix[:3, :3]) < 0:  # mirrored: outward normals point inward
        triangles = triangles[:, ::-1]
    used = points[np.unique(triangles)]
    vertices, following, _ = mesh_corners(mesh)
    closed = 2 * len(paired(vertices, following)[0]) == len(vertices)  # every edge between two faces
    tree = BVHTree.FromPolygons(points.tolist(), triangles.tolist(), all_triangles=True)
    return Solid(tree, used.min(axis=0), used.max(axis=0), closed)


def _shown(point: np.ndarray) -> str:
    return ",".join(f"{value:.4g}" for value in point)
