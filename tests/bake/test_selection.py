"""Selecting objects in Blender while its view layer is rebuilt."""

from __future__ import annotations

from typing import Any

import pytest
from bpy_process import in_blender

pytestmark = pytest.mark.blender
TIMES = 12


def selected() -> dict[str, Any]:
    """Which of the objects are selected after each of some that come and go."""
    import bpy

    from blender_bake.receiver_objects import select

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.collection.objects.link(bpy.data.objects.new("Room", bpy.data.meshes.new("Room")))
    found = []
    for _ in range(TIMES):
        for other in bpy.context.scene.objects:
            other.hide_render = True
        made = bpy.data.objects.new("Made", bpy.data.meshes.new("Made"))
        bpy.context.scene.collection.objects.link(made)
        select([made])
        found.append([obj.name for obj in bpy.context.view_layer.objects if obj.select_get()])
        bpy.data.objects.remove(made)
    return {"names": found}


def test_objects_that_come_and_go_are_selected_alone() -> None:
    """Blender keeps no list of a layer's objects from one selection to the next: iterated meanwhile, it has None in it, or crashes."""
    assert in_blender(selected)["names"].tolist() == [["Made"]] * TIMES
