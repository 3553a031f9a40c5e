# SPDX-License-Identifier: GPL-3.0-or-later
"""UV layers for lightmaps: does one fit (inside [0, 1], not degenerate, no overlap), and making one where none does."""

from __future__ import annotations

import math

import bpy
import numpy as np

from blender_bake.channel import Channel, WorkerError

MAX_UV_LAYERS = 8  # Blender's own limit
MADE_LAYER = "srbf lightmap"
RANGE_TOLERANCE = 1e-4
SMALLEST_AREA = 1e-6  # of the unit square: less is degenerate
OVERLAP_LIMIT = 0.1  # of the layer's area: below, texel rounding at small charts explains it
OVERLAP_GRID = 512
GUTTER_TEXELS = 4
LARGEST_GUTTER = 0.03  # of the layer: small lightmaps would otherwise be all gutter


def choose_layer(obj: bpy.types.Object, name: str | None, texels: int, channel: Channel) -> tuple[str, bool]:
    """(layer, whether it was made): the layer asked for, else the active one if it fits, else another that fits, else a new one."""
    mesh = obj.data
    layers = mesh.uv_layers
    if name == MADE_LAYER and name not in layers:  # an earlier bake made it: the same layer comes out again
        make_layer(obj, texels)
        return name, True
    if name is not None:
        if name not in layers:
            found = ", ".join(repr(layer.name) for layer in layers) or "none"
            raise WorkerError(f"expected a UV layer {name!r} on {obj.name!r}, found {found}")
        problem = misfit(mesh, name)
        if problem and "area" in problem:
            raise WorkerError(f"expected UV layer {name!r} of {obj.name!r} to cover texels, found that it {problem}")
        if problem:
            channel.warn(f"UV layer {name!r} {problem}; it is used because it was asked for")
        return name, False
    active = layers.active.name if layers.active else None
    candidates = ([active] if active else []) + [layer.name for layer in layers if layer.name != active]
    problems = {}
    for candidate in candidates:
        problem = misfit(mesh, candidate)
        if not problem:
            if candidate != active:
                channel.warn(f"the active UV layer {active!r} {problems[active]}; using {candidate!r}")
            return candidate, False
        problems[candidate] = problem
    if len(layers) >= MAX_UV_LAYERS:
        raise WorkerError(
            f"expected a UV layer of {obj.name!r} that fits a lightmap or room for one, found {len(layers)} layers of which none fits "
            f"({active!r} {problems[active]}); remove one, or name one with --uv-layer"
        )
    reason = f"the active one {problems[active]}" if active else "it has none"
    make_layer(obj, texels)
    channel.warn(f"made a lightmap UV layer for {obj.name!r} ({reason}); its coordinates are written to uv.json beside the capture")
    return MADE_LAYER, True


def misfit(mesh: bpy.types.Mesh, layer: str) -> str | None:
    """Why a layer cannot serve as a lightmap, or None."""
    uv = layer_coordinates(mesh, layer)
    if not np.isfinite(uv).all():
        return "holds NaN or infinite coordinates"
    if float(uv.min()) < -RANGE_TOLERANCE or float(uv.max()) > 1 + RANGE_TOLERANCE:
        return f"leaves [0, 1] (from {uv.min():.3g} to {uv.max():.3g})"
    if float(np.abs(triangle_areas(uv[triangle_loops(mesh)])).sum()) < SMALLEST_AREA:
        return "has no area"
    shared = overlap_on_grid(uv[triangle_loops(mesh)])
    if shared > OVERLAP_LIMIT:
        return f"overlaps itself on about {shared:.0%} of its area"
    return None


def make_layer(obj: bpy.types.Object, texels: int) -> None:
    """Add MADE_LAYER by Blender's Smart UV Project, with a gutter between charts, leaving the layer that textures use alone."""
    layers = obj.data.uv_layers
    render_layer = next((layer.name for layer in layers if layer.active_render), None)
    if layers.new(name=MADE_LAYER, do_init=False) is None:
        raise WorkerError(f"Blender refused another UV layer on {obj.name!r}")
    layers.active = layers[MADE_LAYER]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.reveal()
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(
        angle_limit=math.radians(66),
        margin_method="FRACTION",
        island_margin=min(GUTTER_TEXELS / texels, LARGEST_GUTTER),
        correct_aspect=False,
    )
    bpy.ops.object.mode_set(mode="OBJECT")
    if render_layer is not None:
        obj.data.uv_layers[render_layer].active_render = True


def layer_coordinates(mesh: bpy.types.Mesh, layer: str) -> np.ndarray:
    """(loops, 2) UV coordinates, v up, in the mesh's loop order."""
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers[layer].uv.foreach_get("vector", uv)
    return uv.reshape(-1, 2)


def triangle_loops(mesh: bpy.types.Mesh) -> np.ndarray:
    """(triangles, 3) loop indices."""
    mesh.calc_loop_triangles()
    loops = np.empty(len(mesh.loop_triangles) * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    return loops.reshape(-1, 3)


def triangle_areas(uv: np.ndarray) -> np.ndarray:
    """Signed UV areas of (triangles, 3, 2) corners."""
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def overlap_on_grid(corners: np.ndarray) -> float:
    """The share of a layer's area that is covered more than once: 1 - cells covered / area in cells of an OVERLAP_GRID square grid."""
    area = np.abs(triangle_areas(corners))
    covered = np.zeros((OVERLAP_GRID, OVERLAP_GRID), bool)
    for triangle in corners[area > 0]:
        rows, columns = _cells(triangle, OVERLAP_GRID, OVERLAP_GRID)
        covered[rows, columns] = True
    total = float(area.sum()) * OVERLAP_GRID**2
    return max(0.0, 1 - float(covered.sum()) / total) if total else 0.0


def overlap(mesh: bpy.types.Mesh, layer: str, coverage: np.ndarray) -> float:
    """The share of a layer's area that lies on texels already taken: 1 - covered texels / area in texels."""
    area = float(np.abs(triangle_areas(layer_coordinates(mesh, layer)[triangle_loops(mesh)])).sum()) * coverage.size
    return max(0.0, 1 - float((coverage > 0).sum()) / area) if area else 0.0


def slot_maximum(obj: bpy.types.Object, layer: str, image: np.ndarray) -> dict[int, float]:
    """The largest value that each used material slot shows in `image` (H, W, 4), over the texels that its triangles cover."""
    mesh = obj.data
    loops = triangle_loops(mesh)
    slots = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("material_index", slots)
    slots = np.clip(slots, 0, len(obj.material_slots) - 1)
    corners = layer_coordinates(mesh, layer)[loops]
    height, width = image.shape[:2]
    largest: dict[int, float] = {}
    for slot, triangle in zip(slots, corners, strict=True):
        rows, columns = _cells(triangle, width, height)
        if len(rows) == 0:  # smaller than a texel: the one that holds its centroid
            u, v = np.clip(triangle.mean(axis=0), 0, 1 - 1e-6)
            rows, columns = np.array([int(v * height)]), np.array([int(u * width)])
        seen = image[height - 1 - rows, columns]
        real = seen[:, 3] > 0
        if real.any():
            largest[int(slot)] = max(largest.get(int(slot), 0.0), float(seen[real, :3].max()))
    return largest


def _cells(triangle: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """(rows from the bottom, columns) of the grid cells whose centres lie in a (3, 2) UV triangle."""
    scaled = triangle * np.array([width, height]) - 0.5
    low = np.maximum(np.ceil(scaled.min(axis=0)), 0).astype(int)
    high = np.minimum(np.floor(scaled.max(axis=0)), [width - 1, height - 1]).astype(int)
    if (high < low).any():
        return np.empty(0, int), np.empty(0, int)
    columns, rows = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
    inside = np.ones(columns.shape, bool)
    orientation = np.sign(triangle_areas(scaled[None])[0])
    for i in range(3):
        p, q = scaled[i], scaled[(i + 1) % 3]
        inside &= orientation * ((q[0] - p[0]) * (rows - p[1]) - (q[1] - p[1]) * (columns - p[0])) >= 0
    return rows[inside], columns[inside]
