# SPDX-License-Identifier: GPL-3.0-or-later
"""Sanitizing an untrusted .blend: its scripts, OSL shaders and whatever writes files are disabled before it is first evaluated.

Blender calls `load_post` handlers after a file is read and before its dependency graph is evaluated, which is when drivers run and physics
write their disk caches. Driven values stay as saved.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from blender_bake.ipc import WorkerError

SANDBOXED = "SRBF_CONFINED"  # set by `sandbox`: nothing outside the scratch folder can be written
SHOWN = 6  # names in a warning
REVERTING = ("use_disk_cache", "use_external", "cache_type")  # properties that no animation may turn back


def sanitize() -> list[str]:
    """Remove from the file just read all that runs code or writes files; returns a line for each kind of thing that the user may miss.

    WorkerError where opening the scene further would change files on disk.
    """
    said = [
        _line(list(_drivers_with_python()), "do not run, their values are kept as saved", "drivers that need Python"),
        _line(list(_osl()), "do not run: their nodes have no output, cameras are perspective ones", "OSL scripts"),
        _line(list(_simulations()), "are left out, since Blender would write their caches", "fluids that are replayed rather than baked"),
    ]
    for block in _blocks():
        for curves, curve in list(_curves(block)):
            if curve.data_path.endswith(REVERTING) or (isinstance(block, bpy.types.Camera) and curve.data_path == "type"):
                curves.remove(curve)
    _disk_caches()
    for scene in bpy.data.scenes:
        _sanitize_scene(scene)
    for text in bpy.data.texts:
        text.use_module = False
    for tree in [scene.node_tree for scene in bpy.data.scenes if getattr(scene, "node_tree", None)] + list(bpy.data.node_groups):
        for node in [node for node in tree.nodes if node.bl_idname == "CompositorNodeOutputFile"]:
            tree.nodes.remove(node)
    return [line for line in said if line]


def _sanitize_scene(scene: bpy.types.Scene) -> None:
    """No OSL, no compositor, sequencer or Freestyle, no cache of renders; nothing animated that `scene.configure` sets."""
    scene.animation_data_clear()
    for marker in scene.timeline_markers:
        marker.camera = None  # it would override the receiver's
    scene.cycles.shading_system = False
    render = scene.render
    for name in ("use_compositing", "use_sequencer", "use_freestyle", "use_render_cache"):
        if hasattr(render, name):
            setattr(render, name, False)
    render.filepath = ""
    render.bake.save_mode = "INTERNAL"
    render.bake.filepath = ""
    for layer in scene.view_layers:
        layer.use_freestyle = False
        for module in list(layer.freestyle_settings.modules):
            layer.freestyle_settings.modules.remove(module)


def _drivers_with_python() -> Iterator[str]:
    """Remove every scripted driver that needs Python; yields their names."""
    for block in _blocks():
        for curve in list(block.animation_data.drivers) if getattr(block, "animation_data", None) else ():
            if curve.driver.type == "SCRIPTED" and not curve.driver.is_simple_expression:
                yield f"{block.name!r} {curve.data_path}"
                block.animation_data.drivers.remove(curve)


def _osl() -> Iterator[str]:
    """Yields the names of OSL nodes and cameras, whose scripts Cycles would compile and run; cameras become perspective ones."""
    for tree in _trees():
        for node in tree.nodes:
            if node.bl_idname == "ShaderNodeScript":
                yield f"node {node.name!r}"
    for camera in bpy.data.cameras:
        if camera.type == "CUSTOM":
            yield f"camera {camera.name!r}"
            camera.type = "PERSP"


def _simulations() -> Iterator[str]:
    """Remove fluid domains that simulate when evaluated: Mantaflow writes their folder and builds Python from their settings."""
    for obj in bpy.data.objects:
        for modifier in list(obj.modifiers):
            if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN" and modifier.domain_settings.cache_type == "REPLAY":
                yield repr(obj.name)
                obj.modifiers.remove(modifier)


def _disk_caches() -> None:
    """Set physics that are not baked to cache in memory.

    Turning a disk cache off deletes its files, so it is done only where there are none, or where they cannot be deleted; else WorkerError.
    """
    found = [(owner, cache) for owner, cache in _point_caches() if cache.use_disk_cache and not (cache.is_baked or cache.use_external)]
    sandboxed = os.environ.get(SANDBOXED) == "1"
    kept = [repr(owner.name) for owner, _ in found if not sandboxed and _cache_folder(owner).exists()]
    if kept:
        raise WorkerError(
            f"expected physics baked or cached in memory, found an unfinished disk cache of {', '.join(kept[:SHOWN])}, which Blender would "
            "write or delete as it opens the scene; bake it, or switch its Disk Cache off, and save the .blend"
        )
    for _, cache in found:
        cache.use_disk_cache = False


def _point_caches() -> Iterator[tuple[bpy.types.ID, Any]]:
    for obj in bpy.data.objects:
        for modifier in obj.modifiers:
            if modifier.type in {"CLOTH", "SOFT_BODY"}:
                yield obj, modifier.point_cache
            elif modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings:
                for surface in modifier.canvas_settings.canvas_surfaces:
                    yield obj, surface.point_cache
        for system in obj.particle_systems:
            yield obj, system.point_cache
    for scene in bpy.data.scenes:
        if scene.rigidbody_world and scene.rigidbody_world.point_cache:
            yield scene, scene.rigidbody_world.point_cache


def _cache_folder(owner: bpy.types.ID) -> Path:
    blend = Path(bpy.path.abspath(owner.library.filepath) if owner.library else bpy.data.filepath)
    return blend.with_name(f"blendcache_{blend.stem}")


def _blocks() -> Iterator[Any]:
    """Every data-block of the file and of its libraries, and the node trees and key shapes inside them."""
    for collection in bpy.data.bl_rna.properties:
        if collection.type != "COLLECTION":
            continue
        for block in getattr(bpy.data, collection.identifier):
            yield block
            if getattr(block, "node_tree", None) is not None:
                yield block.node_tree


def _trees() -> Iterator[bpy.types.NodeTree]:
    return (block for block in _blocks() if isinstance(block, bpy.types.NodeTree))


def _curves(block: Any) -> Iterator[tuple[Any, Any]]:
    """(the collection that holds it, F-curve or driver) of a block; of an action, whatever its layers, strips and slots hold."""
    if isinstance(block, bpy.types.Action):
        if not hasattr(block, "layers"):  # before Blender 4.4
            yield from ((block.fcurves, curve) for curve in block.fcurves)
            return
        for layer in block.layers:
            for strip in layer.strips:
                for bag in getattr(strip, "channelbags", ()):
                    yield from ((bag.fcurves, curve) for curve in bag.fcurves)
    elif getattr(block, "animation_data", None):
        yield from ((block.animation_data.drivers, curve) for curve in block.animation_data.drivers)


def _line(names: list[str], fate: str, what: str) -> str:
    names = list(dict.fromkeys(names))
    if not names:
        return ""
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return f"{what} {fate}: {', '.join(names[:SHOWN])}{more}"
