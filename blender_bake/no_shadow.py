# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that light passes as if they were not there, while all else of the scene still sees them: a closed room's ceiling."""

from __future__ import annotations

import bpy

from blender_bake import elsewhere
from blender_bake.channel import WorkerError


def let_light_through(scene: bpy.types.Scene, names: list[str]) -> None:
    """Hide the objects `names` from shadow rays, and from nothing else; WorkerError names what there is.

    Shadow rays go to the light from where it falls first and from every bounce after: direct light and bounced light enter alike. The
    object still reflects: camera, diffuse and glossy rays meet it, so a white ceiling sends back what the floor sends up. It is lit
    itself as ever. An empty that shows a collection stands for all of its objects; instances share what is set on their source.
    The sun must then be sampled by shadow rays alone, see `Illuminant`: a bounced ray that could have met the sun's disc meets the ceiling,
    and Cycles would weigh the shadow ray as if it had not.
    """
    for name in names:
        obj = scene.objects.get(name)
        if obj is None:
            shown = sorted(o.name for o in scene.objects if o.type in {"MESH", "EMPTY", "CURVE", "SURFACE", "FONT", "META"})
            listed = ", ".join(repr(n) for n in shown[:12]) + (", …" if len(shown) > 12 else "")
            raise WorkerError(
                f"expected an object {name!r} for --no-cast-shadow, found none in scene {scene.name!r}; there are {listed}"
                f"{elsewhere.hint(scene, name)}"
            )
        shows = obj.type == "EMPTY" and obj.instance_collection is not None
        for hidden in list(obj.instance_collection.all_objects) if shows else [obj]:
            hidden.visible_shadow = False
