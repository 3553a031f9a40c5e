# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials without the light that they let through diffusely, which Cycles counts as diffuse color: of cloth, leaves, shades.

What they let through is the diffuse color of the whole material less that of its reflection alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

BLACK = (0.0, 0.0, 0.0, 1.0)
TRANSLUCENT = "ShaderNodeBsdfTranslucent"


@contextmanager
def reflection_alone() -> Iterator[None]:
    """Translucent BSDFs of all materials black inside: their color counts as diffuse in Cycles, and none of it goes back."""
    before = []
    for tree in _trees():
        for node in tree.nodes:
            if node.bl_idname == TRANSLUCENT:
                color = node.inputs["Color"]
                before.append((tree, color, tuple(color.default_value), [link.from_socket for link in color.links]))
    for tree, color, _, _ in before:
        for link in list(color.links):
            tree.links.remove(link)
        color.default_value = BLACK
    try:
        yield
    finally:
        for tree, color, value, sources in before:
            color.default_value = value
            for source in sources:
                tree.links.new(source, color)


def lets_light_through(material: bpy.types.Material | None) -> bool:
    """Whether a material has Translucent BSDFs, in groups too."""
    return material is not None and bool(material.use_nodes) and _is_translucent(material.node_tree)


def _is_translucent(tree: bpy.types.NodeTree | None) -> bool:
    nodes = () if tree is None else tree.nodes
    return any(node.bl_idname == TRANSLUCENT or (node.type == "GROUP" and _is_translucent(node.node_tree)) for node in nodes)


def _trees() -> Iterator[bpy.types.NodeTree]:
    yield from (material.node_tree for material in bpy.data.materials if material.use_nodes and material.node_tree)
    yield from (tree for tree in bpy.data.node_groups if tree.bl_idname == "ShaderNodeTree")
