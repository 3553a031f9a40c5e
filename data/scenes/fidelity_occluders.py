# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of every kind over the receiver, by themselves or as instances."""

from __future__ import annotations

import bpy
import numpy as np
from closed_form_scenes import SQUARE, material, quad
from fidelity_parts import aside, ball, fog_material, ground


def fog_box():
    """A box of fog over the receiver: a mesh with a volume material."""
    ground()
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0.7))
    bpy.context.object.data.materials.append(fog_material())


def volume_object():
    """A Volume object, made by a modifier of a mesh."""
    ground()
    source = ball("Source", 0.5, (0, 0, 0.7))
    source.hide_render = True
    data = bpy.data.volumes.new("Cloud")
    obj = bpy.data.objects.new("Cloud", data)
    bpy.context.scene.collection.objects.link(obj)
    data.materials.append(fog_material(20.0))
    modifier = obj.modifiers.new("Volume", "MESH_TO_VOLUME")
    modifier.object = source
    modifier.resolution_mode = "VOXEL_AMOUNT"
    modifier.voxel_amount = 24


def curves_object():
    """A Curves object, as the hair tools make it, over the receiver."""
    ground()
    data = bpy.data.hair_curves.new("Curves")
    obj = bpy.data.objects.new("Curves", data)
    bpy.context.scene.collection.objects.link(obj)
    data.add_curves([2] * 60)
    rng = np.random.default_rng(1)
    roots = rng.uniform(-0.8, 0.8, (60, 2))
    points = np.array([(x, y, z) for x, y in roots for z in (0.1, 0.7)], np.float32)
    data.position_data.foreach_set("vector", points.ravel())
    radius = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(120, 0.02, np.float32))
    data.materials.append(material("curves", (0.1, 0.1, 0.1)))


def metaballs():
    """Metaballs over the receiver."""
    ground()
    data = bpy.data.metaballs.new("Meta")
    obj = bpy.data.objects.new("Meta", data)
    bpy.context.scene.collection.objects.link(obj)
    data.elements.new().co = (0.2, 0, 0.7)
    data.elements.new().co = (-0.3, 0.2, 0.7)
    for element in data.elements:
        element.radius = 0.5
    data.resolution, data.render_resolution = 0.4, 0.1
    data.materials.append(material("meta", (0.1, 0.1, 0.1)))


def text_and_curve():
    """A text and a beveled curve over the receiver."""
    ground()
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.size = "SRBF", 0.05, 0.7
    obj = bpy.data.objects.new("Text", text)
    obj.location = (-0.8, 0, 0.4)
    bpy.context.scene.collection.objects.link(obj)
    data = bpy.data.curves.new("Curve", "CURVE")
    data.dimensions, data.bevel_depth = "3D", 0.05
    spline = data.splines.new("POLY")
    spline.points.add(1)
    spline.points[0].co, spline.points[1].co = (-0.8, -0.5, 0.3, 1), (0.8, -0.5, 0.6, 1)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Curve", data))


def face_instances():
    """A parent whose children stand on its faces."""
    ground()
    parent = quad("Parent", [(x * 0.5, y * 0.5, 0.5) for x, y, _ in SQUARE])
    child = ball("Child", 0.3, (0, 0, 0))
    child.parent = parent
    parent.instance_type = "FACES"
    parent.show_instancer_for_render = False


def receiver_instances_on_faces():
    """The same, the parent being the receiver."""
    obj = ground()
    child = ball("Child", 0.3, (0, 0, 0.6))
    child.parent = obj
    obj.instance_type = "FACES"


def vertex_instances():
    """Children on the receiver's vertices."""
    obj = ground()
    child = ball("Child", 0.3, (0.5, 0, 0.6))
    child.parent = obj
    obj.instance_type = "VERTS"


def collection_instance():
    """An instanced collection over the receiver."""
    ground()
    held = bpy.data.collections.new("Held")
    source = aside("Ball", 0.4)
    bpy.context.scene.collection.objects.unlink(source)
    held.objects.link(source)
    source.location = (0, 0, 0.3)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", held
    bpy.context.scene.collection.objects.link(empty)


def grease_pencil():
    """Strokes, which Cycles does not see."""
    ground()
    bpy.ops.object.grease_pencil_add(type="STROKE", location=(0, 0, 0.5))


def lattice():
    """The receiver bent by a lattice, an empty and a lattice beside it."""
    obj = ground()
    data = bpy.data.lattices.new("Lattice")
    cage = bpy.data.objects.new("Lattice", data)
    cage.scale = (3, 3, 1)
    bpy.context.scene.collection.objects.link(cage)
    for point in list(data.points)[:2]:
        point.co_deform.z += 0.6
    obj.modifiers.new("Lattice", "LATTICE").object = cage
    ball("Ball", 0.3)


def holdout_occluder():
    """A ball that is a holdout, over the receiver."""
    ground()
    ball("Ball").is_holdout = True


def shadow_catcher_occluder():
    """A ball that is a shadow catcher, over the receiver."""
    ground()
    ball("Ball").is_shadow_catcher = True


def linked_lights():
    """Light and shadow linking of the scene's own sun, which a bake replaces, and of the objects."""
    ground()
    block = ball("Ball")
    data = bpy.data.lights.new("Sun", "SUN")
    sun = bpy.data.objects.new("Sun", data)
    bpy.context.scene.collection.objects.link(sun)
    for purpose in ("receiver_collection", "blocker_collection"):
        held = bpy.data.collections.new(purpose)
        held.objects.link(block)
        setattr(sun.light_linking, purpose, held)


def indirect_only():
    """A collection that is indirect only, with a red wall."""
    ground()
    wall = quad("Wall", [(-0.5, -0.5, 0.1), (-0.5, 0.5, 0.1), (-0.5, 0.5, 0.8), (-0.5, -0.5, 0.8)], color=(0.9, 0.1, 0.1))
    held = bpy.data.collections.new("Held")
    bpy.context.scene.collection.children.link(held)
    bpy.context.scene.collection.objects.unlink(wall)
    held.objects.link(wall)
    bpy.context.view_layer.layer_collection.children["Held"].indirect_only = True
