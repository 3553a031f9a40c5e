# SPDX-License-Identifier: GPL-3.0-or-later
"""Where else in the .blend a thing is that the scene at hand lacks."""

from __future__ import annotations

import bpy


def hint(scene: bpy.types.Scene, name: str) -> str:
    """How to reach the object or collection `name` of another scene, as the end of an error; empty where no other scene has it."""
    others = [other.name for other in bpy.data.scenes if other != scene and (name in other.objects or name in _collections(other))]
    if not others:
        return ""
    first, *more = others
    also = f" (and in {', '.join(repr(other) for other in more[:4])})" if more else ""
    return f"; {name!r} is in scene {first!r}{also}: add --scene {_quoted(first)}"


def _collections(scene: bpy.types.Scene) -> set[str]:
    return {collection.name for collection in scene.collection.children_recursive}


def _quoted(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").replace(".", "").isalnum() else f'"{name}"'
