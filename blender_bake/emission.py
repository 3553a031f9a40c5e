# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive materials, switched off while a light of ours is on: their light is ambient, and its noise need not be subtracted."""

from __future__ import annotations

import bpy

STRENGTHS = {
    "ShaderNodeEmission": "Strength",
    "ShaderNodeBsdfPrincipled": "Emission Strength",
    "ShaderNodeVolumePrincipled": "Emission Strength",
}


SHINING = {"ShaderNodeBackground", "ShaderNodeEeveeSpecular", "ShaderNodeScript"}  # emit, or may, without such a strength
BLACKBODY = "Blackbody Intensity"


def may_shine() -> bool:
    """Whether any material has a node that emits, with a strength that is not 0 or is driven; otherwise ambient is exactly 0."""
    for tree in _trees():
        for node in tree.nodes:
            sockets = [_strength(node), node.inputs.get(BLACKBODY)]
            driven = tree.animation_data is not None
            if node.bl_idname in SHINING or any(s is not None and (driven or s.is_linked or s.default_value != 0) for s in sockets):
                return True
    return False


def switch_off() -> None:
    """Set every emission strength of every material and node group to 0, drivers and animation included.

    What emits by other means, such as a blackbody in a volume, remains, and the host subtracts its image (the residual).
    """
    for tree in _trees():
        for node in tree.nodes:
            socket = _strength(node)
            if socket is None:
                continue
            for link in list(socket.links):
                tree.links.remove(link)
            tree.animation_data_clear()  # a driver would bring the strength back
            socket.default_value = 0.0


def _strength(node: bpy.types.Node) -> bpy.types.NodeSocket | None:
    name = STRENGTHS.get(node.bl_idname)
    return node.inputs.get(name) if name else None  # a group's output has a socket without a name


def _trees() -> list[bpy.types.NodeTree]:
    trees = [material.node_tree for material in bpy.data.materials if material.node_tree]
    return trees + [group for group in bpy.data.node_groups if group.bl_idname == "ShaderNodeTree"]
