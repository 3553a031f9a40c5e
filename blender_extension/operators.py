# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators bake, stop, fit, show and hide. They start work and return at once."""

from __future__ import annotations

from typing import Any

import bpy

from . import process, running, settings, show
from .asset import AssetError


class SRBF_OT_bake(bpy.types.Operator):
    """Bake the receiver under many lights in a separate process; resume a stopped bake"""

    bl_idname = "srbf.bake"
    bl_label = "Bake Relighting"
    again: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Again", options={"SKIP_SAVE"}, description="Delete the previous bake, and bake the current scene"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_start(cls, settings.problem(context.scene.srbf))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.again and settings.state_of(settings.folder_of(context.scene.srbf) / "capture") != "nothing":
            message = "The previous bake is deleted, and the current scene is baked"
            return context.window_manager.invoke_confirm(self, event, title="Bake again?", message=message, confirm_text="Bake Again")
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        asked = context.scene.srbf
        folder = settings.folder_of(asked)
        state = settings.state_of(folder / "capture")
        copy = folder / settings.SCENE_COPY
        try:
            if state == "nothing" or self.again or not copy.is_file():
                folder.mkdir(parents=True, exist_ok=True)
                with show.own_materials():
                    bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True, relative_remap=True, compress=False)
            arguments = settings.bake_arguments(asked, folder, state, self.again, bpy.app.binary_path)
            running.start(process.Job("Bake", process.host_command(arguments), folder / "bake.progress"))
        except (OSError, RuntimeError, AssetError, process.MissingHostError) as error:
            return _failed(self, error)
        return {"FINISHED"}


class SRBF_OT_stop(bpy.types.Operator):
    """Stop the running job; finished images are kept, and Resume continues"""

    bl_idname = "srbf.stop"
    bl_label = "Stop"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return running.job() is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        job = running.job()
        if job is not None:
            job.stop()
        return {"FINISHED"}


class SRBF_OT_fit(bpy.types.Operator):
    """Compress the capture to relighting maps"""

    bl_idname = "srbf.fit"
    bl_label = "Fit Maps"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        asked = context.scene.srbf
        wrong = settings.problem(asked)
        if wrong is None and not (settings.folder_of(asked) / "capture" / "capture.json").is_file():
            wrong = "Bake first"
        return _can_start(cls, wrong)

    def execute(self, context: bpy.types.Context) -> set[str]:
        asked = context.scene.srbf
        folder = settings.folder_of(asked)
        try:
            running.start(process.Job("Fit", process.host_command(settings.fit_arguments(asked, folder)), folder / "fit.progress"))
        except (OSError, process.MissingHostError) as error:
            return _failed(self, error)
        return {"FINISHED"}


class SRBF_OT_show(bpy.types.Operator):
    """Show the fitted asset on its object, lit by the scene's suns and point lights"""

    bl_idname = "srbf.show"
    bl_label = "Show Relit"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        asked = context.scene.srbf
        wrong = settings.problem(asked)
        if wrong is None and asked.receiver != "OBJECT":
            wrong = "A view cannot be shown on an object"
        if wrong is None and asked.object.mode != "OBJECT":
            wrong = "Leave edit mode"
        if wrong is None and not (settings.folder_of(asked) / "asset" / "asset.json").is_file():
            wrong = "Fit first"
        return _can_start(cls, wrong)

    def execute(self, context: bpy.types.Context) -> set[str]:
        asked = context.scene.srbf
        folder = settings.folder_of(asked)
        try:
            notes = show.show(context.scene, asked.object, folder / "asset", folder / "capture", asked.layout, asked.albedo)
        except (AssetError, OSError, KeyError, ValueError) as error:
            return _failed(self, error)
        for note in notes:
            self.report({"WARNING"}, note)
        return {"FINISHED"}


class SRBF_OT_hide(bpy.types.Operator):
    """Restore the object's own materials"""

    bl_idname = "srbf.hide"
    bl_label = "Show Own Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.scene.srbf.object
        return obj is not None and show.SHOWN in obj

    def execute(self, context: bpy.types.Context) -> set[str]:
        show.hide(context.scene.srbf.object)
        return {"FINISHED"}


CLASSES = (SRBF_OT_bake, SRBF_OT_stop, SRBF_OT_fit, SRBF_OT_show, SRBF_OT_hide)


def _can_start(operator: Any, wrong: str | None) -> bool:
    if wrong is None and running.job() is not None:
        wrong = "Wait for the running job, or stop it"
    if wrong is not None:
        operator.poll_message_set(wrong)
    return wrong is None


def _failed(operator: bpy.types.Operator, error: Exception) -> set[str]:
    operator.report({"ERROR"}, " ".join(str(error).split()))
    return {"CANCELLED"}
