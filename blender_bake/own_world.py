# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's own world, switched between as designed and black."""

from __future__ import annotations

import bpy
import numpy as np

from blender_bake.scene import black_world


class OwnWorld:
    """The world of the scene, or the one that its view layer has in its place; its animation stops at the current frame."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene
        self._layer = bpy.context.view_layer
        own = getattr(self._layer, "world_override", None) or scene.world
        self.name = own.name if own is not None else "World"
        self.is_lit = _is_lit(own)
        self._own = _without_volume(own)
        self._black = black_world()

    def set(self, on: bool) -> None:
        """The world as designed, but without a volume, as in every image; or no light from it."""
        if hasattr(self._layer, "world_override"):
            self._layer.world_override = None
        self._scene.world = self._own if on and self.is_lit else self._black


def _is_lit(world: bpy.types.World | None) -> bool:
    """Whether a world may give light."""
    if world is None:
        return False
    if not world.use_nodes or world.node_tree is None:
        return any(world.color)
    world.node_tree.animation_data_clear()  # a driver may read a light that is off
    output = world.node_tree.get_output_node("CYCLES")
    if output is None or not output.inputs["Surface"].links:
        return False
    nodes = world.node_tree.nodes
    if any(node.type == "GROUP" or node.bl_idname == "ShaderNodeEmission" for node in nodes):
        return True
    return any(
        _may_shine(node.inputs["Color"]) and _may_shine(node.inputs["Strength"])
        for node in nodes
        if node.bl_idname == "ShaderNodeBackground"
    )


def _may_shine(socket: bpy.types.NodeSocket) -> bool:
    return socket.is_linked or bool(np.any(np.atleast_1d(socket.default_value)[:3]))


def _without_volume(world: bpy.types.World | None) -> bpy.types.World | None:
    output = world.node_tree.get_output_node("CYCLES") if world is not None and world.use_nodes and world.node_tree else None
    if world is None or output is None or not output.inputs["Volume"].links:
        return world
    copy = world.copy()
    output = copy.node_tree.get_output_node("CYCLES")
    copy.node_tree.links.remove(output.inputs["Volume"].links[0])
    return copy
