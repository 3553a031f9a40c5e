# SPDX-License-Identifier: GPL-3.0-or-later
"""A switch for the emission of materials: off, they emit nothing, and reflect and cast shadows as before."""

from __future__ import annotations

import bpy
import numpy as np

from blender_bake.node_values import Place, source

EMISSION = "ShaderNodeEmission"
VALUE = "srbf on"
EMITS = {  # nodes that emit, and the pairs of (strength, color) by which they do
    EMISSION: (("Strength", "Color"),),
    "ShaderNodeBsdfPrincipled": (("Emission Strength", "Emission Color"),),
    "ShaderNodeVolumePrincipled": (("Emission Strength", "Emission Color"), ("Blackbody Intensity", "Blackbody Tint")),  # words: ok
}


class EmissionSwitch:
    """A node group that gives 1 or 0 to all materials that it is installed in, and to their copies."""

    def __init__(self, like: EmissionSwitch | None = None) -> None:
        """A new switch, that is on; quicker as a copy of another, since Blender goes through all node groups at every change of one."""
        self._on = True
        self._tree: bpy.types.NodeTree = _group_of_one() if like is None else like._tree.copy()

    def set(self, on: bool) -> None:
        """Emission as designed, or none: constants that Cycles folds, so that it does not sample what is off."""
        if on != self._on:
            self._on = on
            self._tree.nodes[VALUE].outputs[0].default_value = 1.0 if on else 0.0

    def install(self, material: bpy.types.Material) -> None:
        """Let the switch govern every node of `material` that emits. Its animation stops at the current frame.

        The material must not be used by what another switch governs. Node groups that emit become its own.
        """
        _install(material.node_tree, self._tree, {})


def _group_of_one() -> bpy.types.NodeTree:
    tree = bpy.data.node_groups.new("srbf switch", "ShaderNodeTree")
    tree.interface.new_socket("On", in_out="OUTPUT", socket_type="NodeSocketFloat")
    value = tree.nodes.new("ShaderNodeValue")
    value.name = VALUE
    value.outputs[0].default_value = 1.0
    tree.links.new(value.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


def emits(material: bpy.types.Material) -> bool:
    """Whether a material's surface or volume emits in Cycles: by a strength and a color that are not 0, or that a node calculates."""
    if not material.use_nodes or material.node_tree is None:
        return False
    output = material.node_tree.get_output_node("CYCLES")
    if output is None:
        return False
    waiting = [Place(output.inputs["Surface"]), Place(output.inputs["Volume"])]
    seen: set[tuple[int, ...]] = set()
    while waiting:
        _, shader = source(waiting.pop())
        if shader is None:
            continue
        node = shader.node
        key = (node.as_pointer(), *(group.as_pointer() for group in shader.groups))
        if key in seen:
            continue
        seen.add(key)
        if any(_may_differ_from_zero(shader, names) for names in EMITS.get(node.bl_idname, ())):
            return True
        waiting += [Place(socket, shader.groups) for socket in _mixed(node)]
    return False


def _mixed(node: bpy.types.Node) -> list[bpy.types.NodeSocket]:
    """The shaders that a node lets through."""
    if node.bl_idname == "ShaderNodeMixShader" and not node.inputs[0].is_linked:
        if node.inputs[0].default_value <= 0:
            return [node.inputs[1]]
        if node.inputs[0].default_value >= 1:
            return [node.inputs[2]]
    return [socket for socket in node.inputs if socket.type == "SHADER"]


def _may_differ_from_zero(shader: Place, names: tuple[str, str]) -> bool:
    for name in names:
        place = shader.input(name)
        if place is None:
            return False
        deciding, output = source(place)
        if output is not None and output.node.type not in {"RGB", "VALUE"}:
            continue
        value = (deciding.socket if output is None else output.node.outputs[0]).default_value
        if not np.any(np.atleast_1d(value)[:3]):
            return False
    return True


def _install(tree: bpy.types.NodeTree, switch: bpy.types.NodeTree, copies: dict[bpy.types.NodeTree, bpy.types.NodeTree]) -> None:
    tree.animation_data_clear()  # a driver may read a light that is off
    gate: bpy.types.NodeSocket | None = None
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None and _has_emission(node.node_tree):
            inner = node.node_tree
            if inner not in copies:
                copies[inner] = inner.copy()
                _install(copies[inner], switch, copies)
            node.node_tree = copies[inner]
        if node.bl_idname not in EMITS or node.mute:
            continue
        if gate is None:
            group = tree.nodes.new("ShaderNodeGroup")
            group.node_tree = switch
            gate = group.outputs[0]
        if node.bl_idname == EMISSION:
            _after(tree, node.outputs[0], gate)
        else:
            for strength, _ in EMITS[node.bl_idname]:
                _before(tree, node.inputs[strength], gate)


def _has_emission(tree: bpy.types.NodeTree) -> bool:
    return any(
        node.bl_idname in EMITS or (node.type == "GROUP" and node.node_tree is not None and _has_emission(node.node_tree))
        for node in tree.nodes
    )


def _after(tree: bpy.types.NodeTree, emission: bpy.types.NodeSocket, gate: bpy.types.NodeSocket) -> None:
    """Mix an emission shader with nothing: its strength stays as it is, driven or textured."""
    targets = [link.to_socket for link in emission.links]
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(gate, mix.inputs[0])
    tree.links.new(emission, mix.inputs[2])
    for target in targets:
        tree.links.new(mix.outputs[0], target)


def _before(tree: bpy.types.NodeTree, strength: bpy.types.NodeSocket, gate: bpy.types.NodeSocket) -> None:
    """Multiply a strength, linked or not."""
    product = tree.nodes.new("ShaderNodeMath")
    product.operation = "MULTIPLY"
    if strength.links:
        tree.links.new(strength.links[0].from_socket, product.inputs[0])
    else:
        product.inputs[0].default_value = strength.default_value
    tree.links.new(gate, product.inputs[1])
    tree.links.new(product.outputs[0], strength)
