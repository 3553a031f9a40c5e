# SPDX-License-Identifier: GPL-3.0-or-later
"""An asset on its object inside Blender: materials that emit the relit result; the object's own are kept for restoring."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from . import nodes
from .asset import AssetError, RelightingMaps, read
from .lights import lights_of

SHOWN = "srbf_shown"  # on an object: what is shown on it, a dictionary of these keys
ORIGINAL = "srbf_original"  # on a material of ours: the one that it replaces
OURS = "srbf_emits"  # on every material of ours, also for an empty slot: whether it emits times albedo / pi
EEVEE_TEXTURES = 8  # safe on every graphics card: 16 slots, some used by EEVEE itself
ADDED = "ADDED"  # marks a slot that did not exist before
ALBEDO_SOCKETS = {
    "ShaderNodeBsdfPrincipled": "Base Color",
    "ShaderNodeBsdfDiffuse": "Color",
    "ShaderNodeSubsurfaceScattering": "Color",
}


def show(scene: bpy.types.Scene, obj: bpy.types.Object, asset: Path, capture: Path | None, layout: nodes.Layout, albedo: bool) -> list[str]:
    """Show the asset on `obj`; lines for the user. AssetError where it cannot be shown.

    Irradiance comes out times albedo / pi where `albedo` is asked for and a slot's material has one to find (the color of a Principled,
    Diffuse or Subsurface BSDF), else unchanged; radiance always unchanged.
    """
    maps = read(asset)
    uv_layer = _uv_layer(obj, maps, capture)
    hide(obj)
    notes = []
    _, point_lights, others = lights_of(scene, scene.srbf.a0)
    if others:
        notes.append(f"not shown: light of {', '.join(others)} (only suns and point lights are)")
    if scene.render.engine.startswith("BLENDER_EEVEE") and layout == "IMAGES" and maps.k > EEVEE_TEXTURES:
        notes.append(f"EEVEE may have too few texture slots for {maps.k} maps, and show pink: choose Atlas")
    tree = nodes.build(maps, f"srbf {obj.name}", len(point_lights), uv_layer, layout)
    links = []  # for each slot, whether its material belonged to the object or the mesh
    if not len(obj.data.materials):
        obj.data.materials.append(None)
        links.append(ADDED)
    for slot in obj.material_slots:
        if ADDED not in links:
            links.append(slot.link)
        original = slot.material
        source = albedo and maps.quantity == "irradiance"
        material, found = _material(original, tree, obj.name, source)
        if source and not found:
            notes.append(f"{original.name if original else 'an empty slot'} has no single albedo: irradiance is shown unchanged")
        slot.link = "OBJECT"  # so that the mesh and other objects that share it keep their materials
        slot.material = material
    obj[SHOWN] = {"asset": str(asset), "group": tree, "links": json.dumps(links), "layout": layout}
    update(scene)
    return notes


def hide(obj: bpy.types.Object) -> None:
    """Restore the object's own materials."""
    shown = obj.get(SHOWN)
    if shown is None:
        return
    links = json.loads(shown["links"])
    ours = []
    for slot, link in zip(obj.material_slots, links, strict=False):
        material = slot.material
        if material is None or OURS not in material:
            continue
        ours.append(material)
        if link == "OBJECT":
            slot.material = material.get(ORIGINAL)
        else:
            slot.material = None
            slot.link = "DATA"
    if ADDED in links:
        obj.data.materials.pop(index=0)
    group = shown.get("group")
    del obj[SHOWN]
    for material in ours:
        bpy.data.materials.remove(material)
    if group is not None:
        nodes.remove(group)


def shown_objects() -> list[bpy.types.Object]:
    """Objects with an asset on them, in any scene of this file."""
    return [obj for obj in bpy.data.objects if SHOWN in obj]


def update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Update what is shown in `scene` to its current lights."""
    shown = [obj for obj in scene.objects if SHOWN in obj]
    if not shown:
        return
    settings = scene.srbf
    suns, point_lights, _ = lights_of(scene, settings.a0, depsgraph)
    for obj in shown:
        tree = obj[SHOWN].get("group")
        try:
            maps = _cached(obj[SHOWN]["asset"])
        except AssetError:  # moved or removed by now: the nodes stay unchanged
            continue
        if tree is None or len(tree.nodes) == 0:
            continue
        if nodes.point_lights_in(tree) != len(point_lights):
            tree = _rebuilt(obj, tree, maps, len(point_lights))
        nodes.set_lights(tree, maps, suns, point_lights, settings.a0, settings.falloff)


@contextmanager
def own_materials() -> Iterator[None]:
    """A context in which every object has its own materials, so that a bake sees the scene, not the shown asset."""
    before = [(obj, dict(obj[SHOWN]), _albedo_used(obj)) for obj in shown_objects()]
    scenes = {obj: next((s for s in bpy.data.scenes if obj.name in s.objects), None) for obj, _, _ in before}
    for obj, _, _ in before:
        hide(obj)
    try:
        yield
    finally:
        for obj, shown, albedo in before:
            scene = scenes[obj]
            if scene is not None:
                asset = Path(shown["asset"])
                show(scene, obj, asset, asset.parent / "capture", shown["layout"], albedo)


_maps_read: dict[str, tuple[float, RelightingMaps]] = {}


def _cached(asset: str) -> RelightingMaps:
    """The asset, reloaded when its manifest has changed."""
    path = Path(asset)
    try:
        changed = (path / "asset.json").stat().st_mtime
    except OSError as error:
        raise AssetError(f"cannot read {path}: {error}") from error
    if asset not in _maps_read or _maps_read[asset][0] != changed:
        _maps_read[asset] = (changed, read(path))
    return _maps_read[asset][1]


def _rebuilt(obj: bpy.types.Object, tree: bpy.types.NodeTree, maps: RelightingMaps, point_lights: int) -> bpy.types.NodeTree:
    """Replace the group by one for another number of point lights."""
    name, layout = tree.name, obj[SHOWN]["layout"]
    uv_layer = next(node.uv_map for node in tree.nodes if node.bl_idname == "ShaderNodeUVMap")
    users = [
        (material, node.name)
        for material in bpy.data.materials
        if OURS in material
        for node in material.node_tree.nodes
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree == tree
    ]
    links = [(material, node, [link.to_socket for link in material.node_tree.nodes[node].outputs[0].links]) for material, node in users]
    rebuilt = nodes.build(maps, name, point_lights, uv_layer, layout)
    for material, node, targets in links:
        material.node_tree.nodes[node].node_tree = rebuilt
        for target in targets:
            material.node_tree.links.new(material.node_tree.nodes[node].outputs[0], target)
    shown = dict(obj[SHOWN])
    obj[SHOWN] = {**shown, "group": rebuilt}
    return rebuilt


def _material(original: bpy.types.Material | None, tree: bpy.types.NodeTree, name: str, albedo: bool) -> tuple[bpy.types.Material, bool]:
    """(a copy of a material that emits the group's color, whether an albedo multiplies it)."""
    if original is None:
        material = bpy.data.materials.new(f"srbf {name}")
        material.use_nodes = True
        material.node_tree.nodes.clear()
    else:
        material = original.copy()
        material.name = f"srbf {original.name}"
        material[ORIGINAL] = original
        material.use_nodes = True
    material[OURS] = albedo
    sheet = nodes.Sheet(material.node_tree)
    source = _albedo(material) if albedo and original is not None else None
    column = 2
    group = sheet.node("ShaderNodeGroup", column, -2, "srbf", node_tree=tree)
    color: Any = group.outputs[0]
    if source is not None:
        per_pi = sheet.vector("SCALE", column, -1, source, 1 / math.pi)
        color = sheet.vector("MULTIPLY", column + 1, -2, color, per_pi)
    emission = sheet.node("ShaderNodeEmission", column + 2, -2)
    sheet.put(color, emission.inputs["Color"])
    output = material.node_tree.get_output_node("ALL") or sheet.node("ShaderNodeOutputMaterial", column + 3, -2)
    for other in material.node_tree.nodes:
        if other.bl_idname == "ShaderNodeOutputMaterial":
            other.is_active_output = other == output
    sheet.put(emission.outputs[0], output.inputs["Surface"])
    for unused in ("Volume", "Displacement"):
        for link in list(output.inputs[unused].links):
            material.node_tree.links.remove(link)
    return material, source is not None


def _albedo(material: bpy.types.Material) -> Any:
    """The surface's diffuse color: a socket or an RGB triple; None where the surface is not a single BSDF with one."""
    output = material.node_tree.get_output_node("ALL")
    if output is None or not output.inputs["Surface"].links:
        return None
    surface = output.inputs["Surface"].links[0].from_node
    name = ALBEDO_SOCKETS.get(surface.bl_idname)
    if name is None:
        return None
    socket = surface.inputs[name]
    return socket.links[0].from_socket if socket.links else tuple(socket.default_value)[:3]


def _albedo_used(obj: bpy.types.Object) -> bool:
    return any(slot.material[OURS] for slot in obj.material_slots if slot.material and OURS in slot.material)


def _uv_layer(obj: bpy.types.Object, maps: RelightingMaps, capture: Path | None) -> str:
    """The layer that the asset was baked on; a layer that the bake unwrapped is restored from the capture's uv.json."""
    layers = obj.data.uv_layers
    if maps.uv_layer is None:
        if layers.active is None:
            raise AssetError(f"expected a UV layer on {obj.name!r}, found none; unwrap it as it was when the asset was made")
        return layers.active.name
    if maps.uv_layer in layers:
        return maps.uv_layer
    path = None if capture is None else capture / "uv.json"
    if path is None or not path.is_file():
        raise AssetError(f"expected the UV layer {maps.uv_layer!r} on {obj.name!r}, found no such layer and no uv.json of the bake")
    uv = np.array(json.loads(path.read_text(encoding="utf-8"))["per_loop"], np.float32)
    if uv.shape != (len(obj.data.loops), 2):
        raise AssetError(
            f"expected {len(uv)} corners on {obj.name!r}, as in the bake's UV layer, found {len(obj.data.loops)}; "
            "apply its modifiers, as the bake did, or give it a lightmap UV layer and bake again"
        )
    layer = layers.new(name=maps.uv_layer, do_init=False)
    if layer is None:
        raise AssetError(f"Blender refused another UV layer on {obj.name!r}, which has {len(layers)}; remove one")
    layer.uv.foreach_set("vector", uv.ravel())
    return layer.name
