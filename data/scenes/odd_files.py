# SPDX-License-Identifier: GPL-3.0-or-later
"""Files as people leave them: other modes, no numbers, far places, several scenes, unusual frames: `python odd_files.py NAME OUT.blend`.

`python odd_files.py mode MODE receiver|occluder OUT.blend` saves the scene in that mode, with unsaved edits where the mode has any.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).parent))

from closed_form_scenes import SQUARE, camera, quad  # noqa: E402

LID = [(x * 0.5, y * 0.5, 0.5) for x, y, _ in SQUARE]  # under a sun at the zenith it shades the middle quarter of the square


def lidded():
    """The white square under a black lid half as wide."""
    return quad("Plane"), quad("Lid", LID, color=(0, 0, 0))


def in_mode(mode, whose):
    """The lidded square saved in a mode of either. In Edit Mode the lid, or its shadow's place, has just been moved."""
    plane, lid = lidded()
    obj = plane if whose == "receiver" else lid
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    if mode == "POSE":
        obj = of_armature(plane, lid)
    elif mode == "SCULPT_CURVES":
        bpy.ops.object.curves_empty_hair_add()
        obj = bpy.context.object
    elif mode == "PAINT_GREASE_PENCIL":
        bpy.ops.object.grease_pencil_add(type="STROKE", location=(0, 0, 3))
        obj = bpy.context.object
    elif mode == "PARTICLE_EDIT":
        obj.modifiers.new("Particles", "PARTICLE_SYSTEM")
        obj.particle_systems[0].settings.type = "HAIR"
        obj.particle_systems[0].settings.count = 2
        obj.particle_systems[0].settings.hair_length = 0.01
    elif mode == "EDIT_CURVE":
        data = bpy.data.curves.new("Wire", "CURVE")
        obj = bpy.data.objects.new("Wire", data)
        data.splines.new("POLY")
        bpy.context.scene.collection.objects.link(obj)
        bpy.context.view_layer.objects.active = obj
        mode = "EDIT"
    elif mode == "EDIT_BOTH":
        plane.select_set(True)
        lid.select_set(True)
        mode = "EDIT"
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT" and obj.type == "MESH":
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.translate(value=(0.5, 0, 0))


def of_armature(plane, lid):
    """An armature in pose, whose bone has moved the lid."""
    bpy.ops.object.armature_add()
    armature = bpy.context.object
    bone = armature.pose.bones[0]
    lid.parent, lid.parent_type, lid.parent_bone = armature, "BONE", bone.name
    at_rest = bone.bone.matrix_local @ Matrix.Translation((0, bone.bone.length, 0))  # children hang on the bone's tail
    lid.matrix_parent_inverse = at_rest.inverted()
    bone.location = (0.5, 0, 0)
    return armature


def spoiled(name, value):
    """The lidded square, with a coordinate of one of them that is no number."""
    lidded()
    mesh = bpy.data.objects[name].data
    points = np.empty(12, np.float32)
    mesh.vertices.foreach_get("co", points)
    points[7] = value  # y of vertex 2; set one by one, Blender would clamp infinity
    mesh.vertices.foreach_set("co", points)


def spoiled_layer():
    """UV coordinates that are no numbers."""
    obj = quad("Plane")
    obj.data.uv_layers["UV"].uv[1].vector.x = float("nan")


def spoiled_by_modifier():
    """Vertices that geometry nodes move by 3e38 x 3e38, which is infinite."""
    obj = quad("Plane")
    group = bpy.data.node_groups.new("nodes", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    entry, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    position, product = group.nodes.new("GeometryNodeSetPosition"), group.nodes.new("ShaderNodeMath")
    product.operation = "MULTIPLY"
    product.inputs[0].default_value = product.inputs[1].default_value = 3e38
    group.links.new(entry.outputs[0], position.inputs["Geometry"])
    group.links.new(product.outputs[0], position.inputs["Offset"])
    group.links.new(position.outputs[0], end.inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = group


def scaled(*scale):
    """The square at such a scale."""
    quad("Plane").scale = scale


def displaced():
    """The square at a place that is no number."""
    quad("Plane").location.x = float("nan")


def far(distance):
    """The lidded square, and a camera over it, so many meters along x."""
    lidded()
    camera()
    for obj in bpy.context.scene.objects:
        obj.location.x += distance


def two_scenes():
    """Two scenes: in the active one a square, in the other another, its lid, a camera and a collection."""
    quad("Here")
    first = bpy.context.scene
    second = bpy.data.scenes.new("Night shot")
    bpy.context.window.scene = second
    lidded()
    camera()
    held = bpy.data.collections.new("Props")
    second.collection.children.link(held)
    second.collection.objects.unlink(bpy.data.objects["Lid"])
    held.objects.link(bpy.data.objects["Lid"])
    bpy.context.window.scene = first


def framed(**settings):
    """The white square before a camera of 1920 x 1080, with other settings of the render."""
    quad("Plane")
    camera()
    bpy.context.scene.camera.data.dof.use_dof = False
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 1920, 1080
    for name, value in settings.items():
        setattr(render, name, value)


def foggy():
    """A world full of fog."""
    framed()
    world = bpy.data.worlds.new("Mist")
    world.use_nodes = True
    tree = world.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], tree.nodes["World Output"].inputs["Volume"])
    bpy.context.scene.world = world


def caught():
    """A shadow catcher before the camera, and a ball that is a holdout."""
    framed()
    bpy.data.objects["Plane"].is_shadow_catcher = True
    quad("Lid", LID).is_holdout = True
    quad("Beside", location=(2.5, 0, 0))


SCENES = {
    "nan receiver": lambda: spoiled("Plane", float("nan")),
    "infinite receiver": lambda: spoiled("Plane", float("inf")),
    "nan occluder": lambda: spoiled("Lid", float("nan")),
    "nan layer": spoiled_layer,
    "nan by modifier": spoiled_by_modifier,
    "scaled away": lambda: scaled(1, 0, 0),
    "nowhere": displaced,
    "near": lambda: far(1000.0),
    "far": lambda: far(5e6),
    "two scenes": two_scenes,
    "wide": framed,
    "tall pixels": lambda: framed(resolution_x=1000, resolution_y=1000, pixel_aspect_x=1.0, pixel_aspect_y=2.0),
    "region": lambda: framed(use_border=True, border_min_x=0.25, border_max_x=0.5),
    "blurred": lambda: framed(use_motion_blur=True),
    "stereo": lambda: framed(use_multiview=True),
    "foggy": foggy,
    "caught": caught,
}

if __name__ == "__main__":
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if sys.argv[1] == "mode":
        in_mode(sys.argv[2], sys.argv[3])
    else:
        SCENES[sys.argv[1]]()
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1], check_existing=False)
    os._exit(0)
