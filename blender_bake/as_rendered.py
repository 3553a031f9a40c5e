# SPDX-License-Identifier: GPL-3.0-or-later
"""Python evaluates the viewport's scene: settings that make it the scene of a render."""

from __future__ import annotations

import bpy

ALONE = {  # modifiers that read only their own object
    "ARRAY", "BEVEL", "BUILD", "CAST", "DECIMATE", "DISPLACE", "EDGE_SPLIT", "MASK", "MIRROR", "MULTIRES", "PARTICLE_SYSTEM", "REMESH",
    "SCREW", "SIMPLE_DEFORM", "SKIN", "SMOOTH", "SOLIDIFY", "SUBSURF", "TRIANGULATE", "WAVE", "WEIGHTED_NORMAL", "WELD", "WIREFRAME",
}  # fmt: skip


def settle(scene: bpy.types.Scene) -> None:
    """Set Simplify and geometry nodes of the whole file as in a render."""
    render = scene.render
    render.simplify_subdivision = render.simplify_subdivision_render
    render.simplify_child_particles = render.simplify_child_particles_render
    for tree in [group for group in bpy.data.node_groups if group.bl_idname == "GeometryNodeTree"]:
        _never_the_viewport(tree)


def for_evaluation(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Set the modifiers of `obj` as in a render, and those of every object where `obj` may read others."""
    settle_object(obj)
    if any(modifier.show_render and modifier.type not in ALONE for modifier in obj.modifiers):
        for other in scene.objects:
            settle_object(other)


def settle_object(obj: bpy.types.Object) -> None:
    """Set which modifiers of `obj` are on, their subdivision, and whether an instancer is itself visible, as in a render."""
    if obj.library:
        return
    obj.show_instancer_for_viewport = obj.show_instancer_for_render
    for modifier in obj.modifiers:
        modifier.show_viewport = modifier.show_render
        if modifier.type in {"SUBSURF", "MULTIRES"}:
            modifier.levels = modifier.render_levels
        elif modifier.type == "SCREW":
            modifier.steps = modifier.render_steps
        elif modifier.type == "OCEAN":
            modifier.viewport_resolution = modifier.resolution
        elif modifier.type == "PARTICLE_SYSTEM":
            settings = modifier.particle_system.settings
            if not settings.library:
                settings.display_percentage, settings.child_percent = 100, settings.rendered_child_count


def _never_the_viewport(tree: bpy.types.NodeTree) -> None:
    """Replace every Is Viewport node by false."""
    if tree.library:
        return
    for node in [node for node in tree.nodes if node.bl_idname == "GeometryNodeIsViewport"]:
        no = tree.nodes.new("FunctionNodeInputBool")
        no.boolean = False
        for link in list(node.outputs[0].links):
            tree.links.new(no.outputs[0], link.to_socket)
        tree.nodes.remove(node)
