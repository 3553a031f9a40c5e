# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of a baked receiver: copies with the bake's image node, and the white Lambert that replaces what is not diffuse."""

from __future__ import annotations

import bpy

from blender_bake.emission_switch import emits

SURFACE = "ShaderNodeBsdf"
REFLECTING = {"Color", "Base Color", "Metallic", "Specular IOR Level", "Transmission Weight"}  # inputs of such nodes, 0 of black


def bakeable_slots(obj: bpy.types.Object, image: bpy.types.Image) -> None:
    """Give every slot of `obj` a material of its own with `image` as the active node, which a bake writes to.

    Being copies, they leave other objects that share a material unchanged. An empty slot becomes what Cycles shows for it: 80 % gray.
    """
    if not obj.material_slots:
        obj.data.materials.append(None)
    for slot in obj.material_slots:
        source = slot.material
        if source is None or source.node_tree is None or not source.use_nodes:
            material = lambert(tuple(source.diffuse_color[:3]) if source else (0.8, 0.8, 0.8))
        else:
            material = source.copy()
        add_target(material, image)
        slot.material = material


def lambert(color: tuple[float, float, float]) -> bpy.types.Material:
    """A plain diffuse material."""
    material = bpy.data.materials.new("srbf lambert")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*color, 1)
    links.new(diffuse.outputs["BSDF"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def whitened(material: bpy.types.Material | None) -> bpy.types.Material:
    """White Lambert in place of a material that has no diffuse reflection; where it emits, its light goes on to shine.

    The material is the receiver's own, and changed. Emission that is switched off later is so here, too.
    """
    if material is None or not emits(material):
        return lambert((1, 1, 1))
    _blacken(material.node_tree)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = material.node_tree.get_output_node("CYCLES").inputs["Surface"]
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    both = nodes.new("ShaderNodeAddShader")
    links.new(diffuse.outputs["BSDF"], both.inputs[0])
    if surface.links:
        links.new(surface.links[0].from_socket, both.inputs[1])
    links.new(both.outputs["Shader"], surface)
    return material


def _blacken(tree: bpy.types.NodeTree) -> None:
    """Let nothing in a tree reflect or transmit light, so that white on top of it gives back no more than falls in."""
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree is not None and _has_surface(node.node_tree):
            node.node_tree = node.node_tree.copy()  # others may use it
            _blacken(node.node_tree)
        if node.bl_idname.startswith(SURFACE):
            for socket in [socket for socket in node.inputs if socket.name in REFLECTING]:
                for link in list(socket.links):
                    tree.links.remove(link)
                socket.default_value = (0, 0, 0, 1) if socket.type == "RGBA" else 0.0


def _has_surface(tree: bpy.types.NodeTree) -> bool:
    return any(
        node.bl_idname.startswith(SURFACE) or (node.type == "GROUP" and node.node_tree is not None and _has_surface(node.node_tree))
        for node in tree.nodes
    )


def add_target(material: bpy.types.Material, image: bpy.types.Image) -> None:
    """Add the image node that a bake writes to and make it the active one."""
    nodes = material.node_tree.nodes
    for node in nodes:
        node.select = False
    target = nodes.new("ShaderNodeTexImage")
    target.image = image
    target.select = True
    nodes.active = target
