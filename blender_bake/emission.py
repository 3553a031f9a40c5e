# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive materials, switched off while a sun shines: what they emit is ambient, and their noise need not be subtracted."""

from __future__ import annotations

import bpy

STRENGTHS = {
    "ShaderNodeEmission": "Strength",
    "ShaderNodeBsdfPrincipled": "Emission Strength",
    "ShaderNodeVolumePrincipled": "Emission Strength",
}


def switch_off() -> None:
    """Set every emission strength of every material and node group to 0, drivers and animation included.

    What emits by other means (a blackbody in a volume, say) is left, and the host subtracts its image.
    """
    trees = [material.node_tree for material in bpy.data.materials if material.node_tree]
    trees += [group for group in bpy.data.node_groups if group.bl_idname == "ShaderNodeTree"]
    for tree in trees:
        for node in tree.nodes:
            socket = node.inputs.get(STRENGTHS.get(node.bl_idname, ""))
            if socket is None:
                continue
            for link in list(socket.links):
                tree.links.remove(link)
            tree.animation_data_clear()  # a driver would bring the strength back
            socket.default_value = 0.0
