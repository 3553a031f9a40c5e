# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers with hair and particles, which a bake must keep."""

from __future__ import annotations

import bpy
from closed_form_scenes import SQUARE, quad
from fidelity_nodes import node_instances, node_points
from fidelity_parts import aside, ground, hair_system


def hair():
    """Particle hair on the receiver."""
    hair_system(ground())


def hair_and_children():
    """Few parents, many children that only a render shows."""
    obj = ground()
    hair_system(obj, 40, child_type="SIMPLE", child_percent=0, rendered_child_count=20, child_radius=0.2)


def hair_elsewhere():
    """Hair of another object over the receiver."""
    ground()
    other = quad("Other", [(x * 0.6, y * 0.6, 0.8) for x, y, _ in SQUARE], location=(0, 0, 0))
    hair_system(other, 100, 0.3)


def hair_hidden_emitter():
    """Hair whose emitter does not render, on its own, over the receiver."""
    hair_elsewhere()
    bpy.data.objects["Other"].show_instancer_for_render = False


def particle_objects():
    """Balls as particles of the receiver."""
    source = aside("Ball")
    hair_system(
        ground(), 40, kind="HAIR", render_type="OBJECT", instance_object=source, particle_size=1.0, use_advanced_hair=True, hair_length=1
    )


def particle_halves():
    """Particles of which the viewport shows a tenth."""
    particle_objects()
    bpy.data.particles[0].display_percentage = 10


def particle_collection():
    """A collection as particles of the receiver."""
    source = aside("Ball")
    held = bpy.data.collections.new("Held")
    held.objects.link(source)
    hair_system(ground(), 40, render_type="COLLECTION", instance_collection=held, particle_size=1.0, use_advanced_hair=True, hair_length=1)


def emitted():
    """Emitted particles, those of the first frame, shown as balls."""
    source = aside("Ball", 0.3)
    hair_system(
        ground(),
        120,
        kind="EMITTER",
        render_type="OBJECT",
        instance_object=source,
        particle_size=1.0,
        frame_start=1,
        frame_end=5,
        lifetime=50,
    )
    bpy.context.scene.frame_set(1)


def hair_and_node_instances():
    """Hair beside instances."""
    node_instances()
    hair_system(bpy.data.objects["Ground"], 200, 0.4)


def hair_and_node_points():
    """Hair beside a point cloud."""
    node_points()
    hair_system(bpy.data.objects["Ground"], 200, 0.4)
