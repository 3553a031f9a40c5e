# SPDX-License-Identifier: GPL-3.0-or-later
"""UV layers for lightmaps: whether they fit (inside [0, 1], not degenerate, no overlap, side by side), and making those that do not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from blender_bake.ipc import Events, WorkerError
from blender_bake.receiver_objects import select, world_area

MAX_UV_LAYERS = 8  # Blender's own limit
MADE_LAYER = "srbf lightmap"
RANGE_TOLERANCE = 1e-4
SMALLEST_AREA = 1e-6  # of the unit square: less is degenerate
OVERLAP_LIMIT = 0.1  # of the layer's area: below, texel rounding at small charts explains it
OVERLAP_GRID = 512
NO_AREA = "has no area"
NOT_NUMBERS = "holds NaN or infinite coordinates"
GUTTER_TEXELS = 4
LARGEST_GUTTER = 0.03  # of the layer: small lightmaps would otherwise be mostly gutter


def choose_layers(objects: list[bpy.types.Object], name: str | None, texels: int, method: str, events: Events) -> tuple[list[str], bool]:
    """(a layer for each object, whether they were made). Several objects share one atlas, so theirs must lie side by side.

    name: the layer asked for, else the active one if it fits, else another that fits; where none does, or where those of several objects
    overlap, a layer of our own on every object, by `method`: `smart` (Smart UV Project) or `lightmap-pack` for objects without a layer
    that fits, then all charts together by Blender's packer at one density; `keep` makes none. WorkerError where none fits or can be made.
    """
    if len(objects) == 1:
        layer, made = choose_layer(objects[0], name, texels, method, events)
        return [layer], made
    if name not in (None, MADE_LAYER):
        for obj in objects:
            _require_layer(obj, name)
        own: list[str | None] = [name] * len(objects)
    else:
        own = [fitting_layer(obj.data) for obj in objects]
    fitting = [layer for layer in own if layer is not None]
    if len(fitting) < len(objects):
        lacking = [repr(obj.name) for obj, layer in zip(objects, own, strict=True) if layer is None]
        reason = (
            f"{len(lacking)} of {len(objects)} objects have none that fits: {', '.join(lacking[:8])}{', …' if len(lacking) > 8 else ''}"
        )
    else:
        both = zip(objects, fitting, strict=True)
        corners = np.concatenate([layer_coordinates(obj.data, layer)[triangle_loops(obj.data)] for obj, layer in both])
        problem = misfit_of(corners)
        if problem is None and name != MADE_LAYER:
            return fitting, False
        reason = f"the layers of {len(objects)} objects together: that of all {problem}" if problem else "it was asked for"
    if method == "keep":
        raise WorkerError(
            f"expected UV layers of {len(objects)} objects that share one atlas, found {reason}; lay them out side by side, "
            "or let `unwrap=smart` pack them"
        )
    pack(objects, own, texels, method)
    events.warn(
        f"packed a lightmap UV layer for {len(objects)} objects ({reason}); its coordinates are written to uv.json beside the capture"
    )
    return [MADE_LAYER] * len(objects), True


def choose_layer(obj: bpy.types.Object, name: str | None, texels: int, method: str, events: Events) -> tuple[str, bool]:
    """(layer, whether it was made) of a single object, see `choose_layers`."""
    mesh = obj.data
    layers = mesh.uv_layers
    if name == MADE_LAYER and name not in layers:  # an earlier bake made it: the same layer is made again
        make_layer(obj, texels, method)
        return name, True
    if name is not None:
        _require_layer(obj, name)
        problem = misfit(mesh, name)
        if problem:
            events.warn(f"UV layer {name!r} {problem}; it is used as requested")
        return name, False
    active = layers.active.name if layers.active else None
    layer = fitting_layer(mesh)
    if layer is not None:
        if layer != active:
            events.warn(f"the active UV layer {active!r} {misfit(mesh, active)}; using {layer!r}")
        return layer, False
    problem = misfit(mesh, active) if active else None
    reason = f"the active one {problem}" if active else "it has none"
    if method == "keep":
        raise WorkerError(
            f"expected a UV layer of {obj.name!r} that fits a lightmap, found that {reason}; fix it, or let `unwrap=smart` make one"
        )
    make_layer(obj, texels, method)
    events.warn(f"made a lightmap UV layer for {obj.name!r} ({reason}); its coordinates are written to uv.json beside the capture")
    return MADE_LAYER, True


def fitting_layer(mesh: bpy.types.Mesh) -> str | None:
    """The active UV layer if it fits a lightmap, else the first that does."""
    active = mesh.uv_layers.active.name if mesh.uv_layers.active else None
    names = ([active] if active else []) + [layer.name for layer in mesh.uv_layers if layer.name != active]
    return next((name for name in names if misfit(mesh, name) is None), None)


def _require_layer(obj: bpy.types.Object, name: str) -> None:
    layers = obj.data.uv_layers
    if name not in layers:
        found = ", ".join(repr(layer.name) for layer in layers) or "none"
        raise WorkerError(f"expected a UV layer {name!r} on {obj.name!r}, found {found}")
    problem = misfit(obj.data, name)
    if problem == NOT_NUMBERS:
        bad = int(np.nonzero(~np.isfinite(layer_coordinates(obj.data, name)).all(axis=1))[0][0])
        vertex = obj.data.loops[bad].vertex_index
        raise WorkerError(
            f"expected numbers in UV layer {name!r} of {obj.name!r}, found NaN or infinity at vertex {vertex} (face corner {bad}); "
            "fix it, or name another layer"
        )
    if problem == NO_AREA:
        raise WorkerError(f"expected UV layer {name!r} of {obj.name!r} to cover texels, found that it {problem}")


def misfit(mesh: bpy.types.Mesh, layer: str) -> str | None:
    """Why a layer cannot serve as a lightmap, or None."""
    return misfit_of(layer_coordinates(mesh, layer)[triangle_loops(mesh)])


def misfit_of(corners: np.ndarray) -> str | None:
    """Why UV triangles (n, 3, 2), of one mesh or of several together, cannot serve as a lightmap, or None."""
    if not np.isfinite(corners).all():
        return NOT_NUMBERS
    if float(corners.min()) < -RANGE_TOLERANCE or float(corners.max()) > 1 + RANGE_TOLERANCE:
        return f"leaves [0, 1] (from {corners.min():.3g} to {corners.max():.3g})"
    if float(np.abs(triangle_areas(corners)).sum()) < SMALLEST_AREA:
        return NO_AREA
    shared = overlap_on_grid(corners)
    if shared > OVERLAP_LIMIT:
        return f"overlaps itself on about {shared:.0%} of its area"
    return None


def make_layer(obj: bpy.types.Object, texels: int, method: str = "smart") -> None:
    """Add MADE_LAYER by Blender's Smart UV Project or Lightmap Pack, a gutter between charts, leaving the layer that textures use alone."""
    with _layer_for_us(obj):
        select([obj])
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.reveal()
        bpy.ops.mesh.select_all(action="SELECT")
        if method == "lightmap-pack":
            bpy.ops.uv.lightmap_pack(
                PREF_CONTEXT="ALL_FACES", PREF_PACK_IN_ONE=True, PREF_NEW_UVLAYER=False, PREF_MARGIN_DIV=_gutter(texels)
            )
        else:
            bpy.ops.uv.smart_project(
                angle_limit=math.radians(66), margin_method="FRACTION", island_margin=_gutter(texels), correct_aspect=False
            )
        bpy.ops.object.mode_set(mode="OBJECT")


def pack(objects: list[bpy.types.Object], own: list[str | None], texels: int, method: str) -> None:
    """Add MADE_LAYER to every object: charts of its `own` layer, or new ones where that is None, at one density, packed without overlap."""
    whole = sum(world_area(obj) for obj in objects)
    for obj, layer in zip(objects, own, strict=True):
        if layer is None:
            make_layer(obj, texels, method)
        elif layer != MADE_LAYER:
            charts = layer_coordinates(obj.data, layer)
            with _layer_for_us(obj):
                _set_coordinates(obj.data, charts)
        loops = layer_coordinates(obj.data, MADE_LAYER)
        area = float(np.abs(triangle_areas(loops[triangle_loops(obj.data)])).sum())
        _set_coordinates(obj.data, loops * math.sqrt(world_area(obj) / area / whole))  # together they fill the unit square
        obj.data.uv_layers.active = obj.data.uv_layers[MADE_LAYER]
    select(objects)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.reveal()
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    result = bpy.ops.uv.pack_islands(  # by boxes: packing by outlines takes seconds, in every worker
        rotate=True, rotate_method="CARDINAL", scale=True, margin_method="FRACTION", margin=_gutter(texels), shape_method="AABB"
    )
    bpy.ops.object.mode_set(mode="OBJECT")
    if result != {"FINISHED"}:
        raise WorkerError(f"Blender's packer ended as {', '.join(result)} on {len(objects)} objects; name UV layers that lie side by side")


@contextmanager
def _layer_for_us(obj: bpy.types.Object) -> Iterator[None]:
    """A new MADE_LAYER, active inside; the layer that textures use stays the one for rendering."""
    layers = obj.data.uv_layers
    render_layer = next((layer.name for layer in layers if layer.active_render), None)
    if MADE_LAYER in layers:
        layers.remove(layers[MADE_LAYER])
    if len(layers) >= MAX_UV_LAYERS:
        raise WorkerError(
            f"expected a UV layer of {obj.name!r} that fits a lightmap or room for one, found {len(layers)} layers of which none fits "
            f"({layers.active.name!r} {misfit(obj.data, layers.active.name)}); remove one, or name one with `uv_layer`"
        )
    if layers.new(name=MADE_LAYER, do_init=False) is None:
        raise WorkerError(f"Blender refused another UV layer on {obj.name!r}")
    layers.active = layers[MADE_LAYER]
    yield
    if render_layer is not None and render_layer in obj.data.uv_layers:
        obj.data.uv_layers[render_layer].active_render = True


def _gutter(texels: int) -> float:
    return min(GUTTER_TEXELS / texels, LARGEST_GUTTER)


def _set_coordinates(mesh: bpy.types.Mesh, uv: np.ndarray) -> None:
    mesh.uv_layers[MADE_LAYER].uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())


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


def uv_area(mesh: bpy.types.Mesh, layer: str) -> float:
    """Area of a layer's triangles, of the unit square."""
    return float(np.abs(triangle_areas(layer_coordinates(mesh, layer)[triangle_loops(mesh)])).sum())


def overlap(layers: list[tuple[bpy.types.Mesh, str]], coverage: np.ndarray) -> float:
    """The share of the layers' area that lies on texels already taken: 1 - covered texels / area in texels."""
    area = sum(uv_area(mesh, layer) for mesh, layer in layers) * coverage.size
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
    """(rows from the bottom, columns) of the grid cells whose centers lie in a (3, 2) UV triangle."""
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
