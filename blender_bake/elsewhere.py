# SPDX-License-Identifier: GPL-3.0-or-later
"""Other scenes of the .blend that have what the current one lacks."""

from __future__ import annotations

import bpy


def hint(scene: bpy.types.Scene, name: str) -> str:
    """The end of an error about the missing object or collection `name`: which other scene has it; empty where none does."""
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
