# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object shows beside its mesh (hair, particles, instances, curves, points, volumes): kept when its modifiers are applied."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
from mathutils import Matrix

BESIDE_A_MESH = ("Curve", "Point Cloud", "Volume", "Grease Pencil")  # of geometry nodes
INSTANCES = "Instances"
SHORT = 12  # characters of a name, which leave room for more in Blender's 63 bytes
AUTHORED = "srbf name"  # property that holds the name that an object had in the file


def authored_name(obj: bpy.types.Object) -> str:
    """The name of `obj` in the file."""
    return str(obj.get(AUTHORED, obj.name))


@dataclass(frozen=True)
class Beside:
    """What the modifiers of an object show beside its mesh: hair and particles, and what geometry nodes make."""

    particles: bool
    nodes: bool

    def __bool__(self) -> bool:
        return self.particles or self.nodes


def shown_by(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Beside:
    """What `obj` shows; other kinds of geometry than its mesh are instances of their own to the depsgraph."""
    kinds = {modifier.type for modifier in obj.modifiers if modifier.show_render}
    nodes = "NODES" in kinds and any(
        instance.is_instance and instance.parent and instance.parent.original == obj for instance in depsgraph.object_instances
    )
    return Beside("PARTICLE_SYSTEM" in kinds, nodes)


def real_mesh(obj: bpy.types.Object) -> bpy.types.Mesh | None:
    """The instances that geometry nodes of `obj` scatter as one mesh of their own; None where they make no faces."""
    with _at_the_end(obj, _realizing()):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph)
    return mesh if mesh.polygons else None


def set_apart(obj: bpy.types.Object, mesh: bpy.types.Mesh, more: Beside, instances_too: bool = True) -> bpy.types.Object:
    """An object with `mesh` and the transform and name of `obj`, which is renamed "NAME instance" and shows all except its mesh.

    Hair, particles and whatever other objects read thus come from the original object. Without `instances_too` the instances that
    geometry nodes scatter are left out: `mesh` holds them.
    """
    name, place = obj.name, obj.matrix_world.copy()
    receiver = obj.copy()
    receiver.animation_data_clear()
    receiver.modifiers.clear()
    receiver.constraints.clear()
    receiver.data = mesh
    receiver.instance_type = "NONE"
    for collection in obj.users_collection:
        collection.objects.link(receiver)
    obj.name, obj[AUTHORED] = f"{name[:SHORT]} instance", name  # another name than before, whatever Blender cuts off
    receiver.name = name
    place_at(receiver, place)
    if more.nodes and (more.particles or not instances_too):
        # Where there are particles, what nodes make would be hidden along with the mesh.
        _append(obj, _keeping([*BESIDE_A_MESH, *([INSTANCES] if instances_too else [])]))
    else:
        obj.show_instancer_for_render = obj.show_instancer_for_viewport = False
    return receiver


def place_at(obj: bpy.types.Object, matrix: Matrix) -> None:
    """Give `obj` the world transform `matrix`, shear included, through a parent's inverse: location, rotation and scale cannot hold it."""
    anchor = bpy.data.objects.new(f"{obj.name} place", None)
    bpy.context.scene.collection.objects.link(anchor)
    obj.parent, obj.parent_type = anchor, "OBJECT"
    obj.matrix_parent_inverse = matrix
    obj.delta_location, obj.delta_scale = (0, 0, 0), (1, 1, 1)
    obj.delta_rotation_euler, obj.delta_rotation_quaternion = (0, 0, 0), (1, 0, 0, 0)
    obj.matrix_basis = Matrix.Identity(4)
    bpy.context.view_layer.update()


@contextmanager
def _at_the_end(obj: bpy.types.Object, group: bpy.types.NodeTree) -> Iterator[None]:
    modifier = _append(obj, group)
    yield
    obj.modifiers.remove(modifier)


def _append(obj: bpy.types.Object, group: bpy.types.NodeTree) -> bpy.types.Modifier:
    modifier = obj.modifiers.new("srbf", "NODES")
    modifier.node_group = group
    return modifier


def _realizing() -> bpy.types.NodeTree:
    group, entry, end = _group()
    real = group.nodes.new("GeometryNodeRealizeInstances")
    group.links.new(entry.outputs[0], real.inputs[0])
    group.links.new(real.outputs[0], end.inputs[0])
    return group


def _keeping(kept: list[str]) -> bpy.types.NodeTree:
    group, entry, end = _group()
    parts, join = group.nodes.new("GeometryNodeSeparateComponents"), group.nodes.new("GeometryNodeJoinGeometry")
    group.links.new(entry.outputs[0], parts.inputs[0])
    for output in [output for output in parts.outputs if output.name in kept]:
        group.links.new(output, join.inputs[0])
    group.links.new(join.outputs[0], end.inputs[0])
    return group


def _group() -> tuple[bpy.types.NodeTree, bpy.types.Node, bpy.types.Node]:
    group = bpy.data.node_groups.new("srbf", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    return group, group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
