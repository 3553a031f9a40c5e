# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes with what a bake may lose, on the receiver or over it: `python bake_fidelity.py NAME OUT.blend`.

`python bake_fidelity.py bake OUT.npz OBJECT "X,Y,Z X,Y,Z" IN.blend…` is Blender's own bake of each file, under a sun from each direction.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))

import fidelity_hair  # noqa: E402
import fidelity_nodes  # noqa: E402
import fidelity_occluders  # noqa: E402
import fidelity_settings  # noqa: E402
from closed_form_scenes import camera  # noqa: E402

SIDE = 32
SAMPLES = 64
SCENES = {
    name: made
    for module in (fidelity_hair, fidelity_nodes, fidelity_occluders, fidelity_settings)
    for name, made in vars(module).items()
    if getattr(made, "__module__", None) == module.__name__ and not name.startswith("_")
}


def own_bake(blend, name, directions):
    """(suns, SIDE, SIDE, 3) irradiance of an object under each sun: Blender's own bake of the file as it is."""
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_light_tree = SAMPLES, False, False
    scene.cycles.sample_clamp_indirect = 0
    for point_light in [one for one in scene.objects if one.type == "LIGHT"]:
        bpy.data.objects.remove(point_light)
    if scene.world is not None:
        scene.world = None
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 1.0, 0.0
    scene.collection.objects.link(sun)
    image = bpy.data.images.new("bake", SIDE, SIDE, alpha=True, float_buffer=True)
    obj = scene.objects[name]
    for slot in obj.material_slots:
        target = slot.material.node_tree.nodes.new("ShaderNodeTexImage")
        target.image = image
        slot.material.node_tree.nodes.active = target
    for other in scene.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    images = []
    for direction in directions:
        sun.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
        bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=0, use_clear=True)
        pixels = np.empty(SIDE * SIDE * 4, np.float32)
        image.pixels.foreach_get(pixels)
        images.append(pixels.reshape(SIDE, SIDE, 4)[::-1, :, :3] * math.pi)
    return np.stack(images)


if __name__ == "__main__":
    if sys.argv[1] == "bake":
        out, name, suns, *blends = sys.argv[2:]
        directions = [tuple(map(float, sun.split(","))) for sun in suns.split()]
        np.savez(out, **{Path(blend).stem: own_bake(blend, name, directions) for blend in blends})
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        SCENES[sys.argv[1]]()
        if bpy.context.scene.camera is None:
            camera()
        bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2], check_existing=False)
    os._exit(0)
