# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scenes of bake_fidelity.py are made of: the square that light is read from, balls, hair, geometry nodes, materials."""

from __future__ import annotations

import bpy
from closed_form_scenes import material, quad
from mathutils import Matrix


def ground():
    """The white square that light is read from."""
    return quad("Ground")


def ball(name, radius=0.4, location=(0, 0, 0.6), color=(0.1, 0.1, 0.1)):
    """A black ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=radius, location=location)
    obj = bpy.context.object
    obj.name = name
    obj.data.materials.append(material(name, color))
    return obj


def aside(name, radius=0.15):
    """A ball that is shown only where something scatters it."""
    obj = ball(name, radius, (50, 0, 0))
    obj.data.transform(Matrix.Translation((0, 0, 0.3)))
    return obj


def hair_system(obj, count=400, length=0.5, kind="HAIR", **settings):
    """Particle hair, or particles, on an object; their material is its second slot."""
    obj.modifiers.new("Particles", "PARTICLE_SYSTEM")
    found = obj.particle_systems[0].settings
    found.type = kind
    found.count = count
    if kind == "HAIR":
        found.hair_length = length
        found.root_radius, found.tip_radius, found.radius_scale = 1.0, 1.0, 0.02
        obj.data.materials.append(material("hair", (0.05, 0.03, 0.02)))
        found.material = 2
    for name, value in settings.items():
        setattr(found, name, value)
    return found


def geometry_nodes(obj, build):
    """A geometry-nodes modifier; `build(group, geometry in)` returns the socket that goes out."""
    group = bpy.data.node_groups.new("nodes", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    entry, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(build(group, entry.outputs[0]), end.inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = group
    return group


def joined(group, *sockets):
    join = group.nodes.new("GeometryNodeJoinGeometry")
    for socket in sockets:
        group.links.new(socket, join.inputs[0])
    return join.outputs[0]


def node(group, kind, inputs=None, **properties):
    made = group.nodes.new(kind)
    for name, value in properties.items():
        setattr(made, name, value)
    for name, value in (inputs or {}).items():
        if isinstance(value, bpy.types.NodeSocket):
            group.links.new(value, made.inputs[name])
        else:
            made.inputs[name].default_value = value
    return made


def instances(group, source, points=None):
    """Instances of an object on a few points above the square."""
    info = node(group, "GeometryNodeObjectInfo", {"Object": source})
    if points is None:
        points = node(group, "GeometryNodeMeshGrid", {"Size X": 1.2, "Size Y": 1.2, "Vertices X": 3, "Vertices Y": 3}).outputs["Mesh"]
    return node(group, "GeometryNodeInstanceOnPoints", {"Points": points, "Instance": info.outputs["Geometry"]}).outputs["Instances"]


def fog_material(density=2.0):
    made = bpy.data.materials.new("fog")
    made.use_nodes = True
    made.node_tree.nodes.clear()
    scatter = made.node_tree.nodes.new("ShaderNodeVolumePrincipled")
    scatter.inputs["Density"].default_value = density
    made.node_tree.links.new(scatter.outputs[0], made.node_tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    return made


def material_of(shader):
    made = bpy.data.materials.new(shader)
    made.use_nodes = True
    made.node_tree.nodes.clear()
    node = made.node_tree.nodes.new(shader)
    made.node_tree.links.new(node.outputs[0], made.node_tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made
