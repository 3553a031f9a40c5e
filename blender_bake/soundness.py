# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that would silently corrupt a bake: vertices or transforms with NaN, settings that hide a receiver."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from blender_bake.ipc import Events, WorkerError

SHOWN = 6  # names in a warning
LARGEST = 1e18  # of a coordinate, m
RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")


def require_finite(obj: bpy.types.Object, mesh: bpy.types.Mesh, after: str = "") -> None:
    """WorkerError where a receiver's vertex or transform has NaN or infinity; `after` names the step that made the mesh."""
    if not np.isfinite(np.array(obj.matrix_world)).all():
        raise WorkerError(f"expected a place in the world for {obj.name!r}, found NaN or infinity in its transform; clear it (Alt+G, R, S)")
    bad = spoiled_vertices(mesh)
    if len(bad):
        x, y, z = mesh.vertices[int(bad[0])].co
        more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise WorkerError(
            f"expected numbers for the vertices of {obj.name!r}{after}, found ({x:g}, {y:g}, {z:g}) at vertex {int(bad[0])}{more}; "
            "delete or move them, and save the .blend"
        )


def require_visible(obj: bpy.types.Object, events: Events) -> None:
    """WorkerError, naming the setting, where Cycles leaves a receiver black or empty; a warning for parts of it that stay empty."""
    setting = hidden_by(obj)
    if setting is not None:
        raise WorkerError(f"expected a receiver that light can be read from, found that {obj.name!r} {setting}, and save the .blend")
    if held := _held_out(obj):
        events.warn(f"faces of {obj.name!r} with material {held[0]!r}, a Holdout, stay empty")


def hidden_by(obj: bpy.types.Object) -> str | None:
    """What hides `obj` from a bake, and how to switch it off; None where nothing does."""
    if obj.is_shadow_catcher:
        return "is a shadow catcher, which shows no light of its own; switch Object > Visibility > Shadow Catcher off"
    if obj.is_holdout:
        return "is a holdout, which shows nothing; switch Object > Visibility > Holdout off"
    for collection in _holdout_collections(bpy.context.view_layer.layer_collection):
        if obj.name in collection.all_objects:
            return f"is in collection {collection.name!r}, which the view layer holds out; switch its Holdout off in the outliner"
    if not any(getattr(obj, f"visible_{ray}") for ray in RAYS):
        return "is seen by no ray at all; switch something of Object > Visibility > Ray Visibility on"
    held = _held_out(obj)
    if held and len(held) == len(obj.material_slots):
        return f"has material {held[0]!r}, a Holdout, which shows nothing; give it another"
    return None


def _held_out(obj: bpy.types.Object) -> list[str]:
    return [slot.material.name for slot in obj.material_slots if slot.material and _is_holdout(slot.material)]


def _is_holdout(material: bpy.types.Material) -> bool:
    output = material.node_tree.get_output_node("CYCLES") if material.use_nodes and material.node_tree else None
    links = output.inputs["Surface"].links if output is not None else ()
    return bool(links) and links[0].from_node.bl_idname == "ShaderNodeHoldout"


def warn_of_occluders(scene: bpy.types.Scene, receivers: set[str], events: Events) -> None:
    """Warn of meshes other than `receivers` with NaN or infinity in vertices or transform."""
    found = []
    for obj in scene.objects:
        if obj.type != "MESH" or obj.hide_render or obj.name in receivers:
            continue
        bad = spoiled_vertices(obj.data)
        if len(bad):
            found.append(f"{obj.name!r} at vertex {int(bad[0])}")
        elif not np.isfinite(np.array(obj.matrix_world)).all():
            found.append(f"{obj.name!r} in its transform")
    if found:
        more = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
        events.warn(f"NaN, infinite or immense coordinates, whose shadows and reflections are unreliable: {', '.join(found[:SHOWN])}{more}")


def warn_of_hidden(scene: bpy.types.Scene, events: Events) -> None:
    """Warn of what a view does not show: shadow catchers and holdouts."""
    layer = bpy.context.view_layer
    shown = [obj for obj in scene.objects if obj.type == "MESH" and not obj.hide_render and obj.name in layer.objects]
    found = [f"{obj.name!r} {setting.partition(',')[0]}" for obj in shown if (setting := _leaves_no_picture(obj)) is not None]
    if found:
        more = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
        events.warn(f"pixels without a picture: {', '.join(found[:SHOWN])}{more}")


def spoiled_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """Indices of the vertices with a coordinate that is NaN, infinite, or so large that single precision cannot square it."""
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    return np.nonzero(~(np.abs(points.reshape(-1, 3)) < LARGEST).all(axis=1))[0]


def _leaves_no_picture(obj: bpy.types.Object) -> str | None:
    return hidden_by(obj) if any(getattr(obj, f"visible_{ray}") for ray in RAYS) else None


def _holdout_collections(layer: bpy.types.LayerCollection) -> Iterator[bpy.types.Collection]:
    if layer.holdout:
        yield layer.collection
    for child in layer.children:
        yield from _holdout_collections(child)
