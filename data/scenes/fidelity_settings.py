# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers and occluders that a setting changes: modifiers for the render alone, Simplify, holdouts, shadow catchers, ray visibility."""

from __future__ import annotations

import bpy
from closed_form_scenes import SQUARE, camera, material, quad
from fidelity_parts import ball, ground, material_of


def culled():
    """Simplify that culls what the camera does not see: a lid behind it."""
    ground()
    lid = quad("Lid", [(x, y, 1.5) for x, y, _ in SQUARE], color=(0, 0, 0), location=(0, 0.5, 0))
    obj = camera(location=(0, 0, 1.4))
    obj.rotation_euler = (0, 0, 0)
    scene = bpy.context.scene
    scene.render.use_simplify = True
    scene.cycles.use_camera_cull = lid.cycles.use_camera_cull = True
    scene.cycles.camera_cull_margin = 0.0


def render_only_modifiers():
    """Modifiers that only the render, and that only the viewport shows."""
    obj = ground()
    cutter = ball("Cutter", 0.5, (0, 0, 0))
    cutter.hide_render = True
    cut = obj.modifiers.new("Boolean", "BOOLEAN")
    cut.object, cut.show_viewport, cut.show_render = cutter, False, True
    wide = obj.modifiers.new("Array", "ARRAY")
    wide.show_viewport, wide.show_render = True, False


def render_steps():
    """A screw whose render has more steps."""
    ground()
    mesh = bpy.data.meshes.new("Profile")
    mesh.from_pydata([(0.5, 0, 0.3), (0.3, 0, 0.7)], [(0, 1)], [])
    obj = bpy.data.objects.new("Profile", mesh)
    bpy.context.scene.collection.objects.link(obj)
    screw = obj.modifiers.new("Screw", "SCREW")
    screw.steps, screw.render_steps = 3, 32


def screwed_receiver():
    """The receiver itself of a screw whose render has more steps."""
    mesh = bpy.data.meshes.new("Ground")
    mesh.from_pydata([(0.2, 0, 0), (1, 0, 0)], [(0, 1)], [])
    obj = bpy.data.objects.new("Ground", mesh)
    bpy.context.scene.collection.objects.link(obj)
    screw = obj.modifiers.new("Screw", "SCREW")
    screw.steps, screw.render_steps, screw.use_stretch_u, screw.use_stretch_v = 3, 32, True, True
    mesh.materials.append(material("Ground"))


def simplified():
    """Simplify: the viewport divides nothing, the render twice."""
    obj = ground()
    lift = ball("Lift", 0.5, (0, 0, 0.6))
    for one in (obj, lift):
        modifier = one.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = 2
        modifier.boundary_smooth = "PRESERVE_CORNERS"
    render = bpy.context.scene.render
    render.use_simplify = True
    render.simplify_subdivision, render.simplify_subdivision_render = 0, 2


def caught():
    """The receiver itself a shadow catcher, under a ball."""
    ground().is_shadow_catcher = True
    ball("Ball")


def held_out():
    """The receiver itself a holdout."""
    ground().is_holdout = True
    ball("Ball")


def _collected(**settings):
    """The receiver in a collection of its own, with settings of the view layer's."""
    obj = ground()
    ball("Ball")
    held = bpy.data.collections.new("Held")
    bpy.context.scene.collection.children.link(held)
    bpy.context.scene.collection.objects.unlink(obj)
    held.objects.link(obj)
    for name, value in settings.items():
        setattr(bpy.context.view_layer.layer_collection.children["Held"], name, value)


def held_out_by_collection():
    """The receiver in a collection that the view layer holds out."""
    _collected(holdout=True)


def seen_indirectly():
    """The receiver in a collection that is indirect only."""
    _collected(indirect_only=True)


def held_out_by_material():
    """A receiver whose material is a Holdout."""
    obj = ground()
    obj.data.materials[0] = material_of("ShaderNodeHoldout")
    ball("Ball")


def half_held_out():
    """A receiver of two faces, one of them with a Holdout material."""
    obj = ground()
    obj.data.materials.append(material_of("ShaderNodeHoldout"))
    bpy.context.view_layer.objects.active = obj
    modifier = obj.modifiers.new("Divide", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    obj.data.polygons[0].material_index = 1


def unseen_by_rays():
    """A receiver that no kind of ray sees, under a ball."""
    obj = ground()
    ball("Ball")
    for ray in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(obj, f"visible_{ray}", False)
