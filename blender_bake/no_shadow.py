# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that cast no shadow but are otherwise visible to the scene, such as a closed room's ceiling."""

from __future__ import annotations

import bpy

from blender_bake import elsewhere
from blender_bake.ipc import WorkerError


def let_light_through(scene: bpy.types.Scene, names: list[str]) -> None:
    """Hide the objects `names` from shadow rays alone; WorkerError, naming those there are, for an unknown one.

    Shadow rays start at every bounce, so direct and indirect light both enter. The object still reflects: camera, diffuse and glossy
    rays meet it, so a white ceiling reflects the light of the floor, and it is lit as before. The name of an empty that shows a
    collection means all of its objects; instances share what is set on their source.
    The sun must then be sampled by shadow rays alone, see `light.SoleLight`: a bounced ray that could have met the sun's disc meets the
    ceiling, and Cycles would weight the shadow ray as if it had not.
    """
    for name in names:
        obj = scene.objects.get(name)
        if obj is None:
            shown = sorted(o.name for o in scene.objects if o.type in {"MESH", "EMPTY", "CURVE", "SURFACE", "FONT", "META"})
            listed = ", ".join(repr(n) for n in shown[:12]) + (", …" if len(shown) > 12 else "")
            raise WorkerError(
                f"expected an object {name!r} for `no_shadow`, found none in scene {scene.name!r}; there are {listed}"
                f"{elsewhere.hint(scene, name)}"
            )
        shows = obj.type == "EMPTY" and obj.instance_collection is not None
        for hidden in list(obj.instance_collection.all_objects) if shows else [obj]:
            hidden.visible_shadow = False
