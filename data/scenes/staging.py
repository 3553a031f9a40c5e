# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scene scripts have in common: a camera, daylight for viewing, Cycles, and the .blend that they write."""

import sys
from math import radians

import bpy
from mathutils import Vector

WARM = (1.0, 0.93, 0.82)


def add_camera(location, target, lens):
    """The scene's camera, of a focal length in mm; returns it."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = lens
    camera.location = location
    camera.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    return camera


def add_daylight(direction, strength, world_color, world_strength, color=WARM):
    """The scene's own sun (`direction` points to it) and a dim world, for viewing: a bake switches both off."""
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle, data.color = strength, radians(0.5), color
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(sun)
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*world_color, 1)
    background.inputs["Strength"].default_value = world_strength


def start_cycles(scene, width=800, height=600):
    """Cycles without caustics, clamps or adaptive sampling; returns its settings, whose bounces are each scene's own."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling = 64, False
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.blur_glossy = 1.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    return cycles


def write(script, build, arguments):
    """Write what `build` fills an empty scene with to the one .blend that `arguments` name; the exit status of `script`."""
    if len(arguments) != 1 or not arguments[0].endswith(".blend"):
        print(f"usage: python data/scenes/{script}.py OUT.blend", file=sys.stderr)
        return 2
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build()
    bpy.ops.wm.save_as_mainfile(filepath=arguments[0], check_existing=False)
    return 0
