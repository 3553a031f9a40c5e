# SPDX-License-Identifier: GPL-3.0-or-later
"""Relighting maps inside Blender: a panel in Render properties, a command, and materials that show an asset on its object."""

from __future__ import annotations

from typing import Any

import bpy

from . import command, operators, panel, running, settings, shot, show

CLASSES = (settings.SrbfSettings, *operators.CLASSES, *shot.CLASSES, panel.SRBF_PT_panel)
_commands: list[Any] = []


@bpy.app.handlers.persistent
def _follow_lights(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    show.update(scene, depsgraph)


HANDLERS = (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post)


def register() -> None:
    """Called by Blender when the extension is enabled."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.srbf = bpy.props.PointerProperty(type=settings.SrbfSettings)
    for handlers in HANDLERS:
        handlers.append(_follow_lights)
    _commands.append(bpy.utils.register_cli_command("srbf", command.run))


def unregister() -> None:
    """Called by Blender when the extension is disabled, or Blender ends: removes everything, and stops a running bake."""
    running.end()
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    for handlers in HANDLERS:
        handlers.remove(_follow_lights)
    del bpy.types.Scene.srbf
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
