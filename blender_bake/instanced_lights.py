# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of collections that empties show: each empty gets lights of its own, so that one can be switched without the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Origin:
    """Where an object comes from: the names by which it is reached, outermost first, and the objects of the file that these are."""

    path: tuple[str, ...]
    objects: tuple[bpy.types.Object, ...]


def make_own(scene: bpy.types.Scene, shines: Callable[[bpy.types.Object], bool]) -> dict[bpy.types.Object, Origin]:
    """Copy what `shines` of the collections that the scene's empties show, one copy for each empty; their origins.

    Everything else of the collections stays shared.
    """
    origins: dict[bpy.types.Object, Origin] = {}
    holding: dict[bpy.types.Collection, bool] = {}

    def holds(collection: bpy.types.Collection) -> bool:
        if collection not in holding:
            holding[collection] = False
            holding[collection] = any(shines(obj) or holds_inside(obj) for obj in _rendered(collection))
        return holding[collection]

    def holds_inside(obj: bpy.types.Object) -> bool:
        return shown_by(obj) is not None and holds(obj.instance_collection)

    def own(collection: bpy.types.Collection, above: Origin) -> bpy.types.Collection:
        made = bpy.data.collections.new(collection.name)
        made.instance_offset = collection.instance_offset
        for obj in _rendered(collection):
            origin = Origin((*above.path, obj.name), (*above.objects, obj))
            kept = obj
            if shines(obj):
                kept = obj.copy()
                origins[kept] = origin
            elif holds_inside(obj):
                kept = obj.copy()
                kept.instance_collection = own(obj.instance_collection, origin)
            made.objects.link(kept)
        return made

    for obj in list(scene.objects):
        if not obj.hide_render and holds_inside(obj):
            obj.instance_collection = own(obj.instance_collection, Origin((obj.name,), (obj,)))
    return origins


def shown_by(obj: bpy.types.Object) -> bpy.types.Collection | None:
    """The collection that an empty shows."""
    return obj.instance_collection if obj.type == "EMPTY" and obj.instance_type == "COLLECTION" else None


def _rendered(collection: bpy.types.Collection) -> list[bpy.types.Object]:
    """Objects that render of a collection, children included; made visible to Python, as `show_as_rendered` does the scene's."""
    if collection.hide_render:
        return []
    found = {obj: None for obj in collection.objects if not obj.hide_render}
    for child in collection.children:
        found |= dict.fromkeys(_rendered(child))
    for obj in found:
        obj.hide_viewport = False
    return list(found)
