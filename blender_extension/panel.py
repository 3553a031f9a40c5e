# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in Render properties."""

from __future__ import annotations

import bpy

from . import running, settings, show
from .progress import duration


class SRBF_PT_panel(bpy.types.Panel):
    """Relighting maps: what to bake, and its progress."""

    bl_idname = "SRBF_PT_panel"
    bl_label = "Relighting Maps"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, asked = self.layout, context.scene.srbf
        layout.use_property_split = True
        layout.use_property_decorate = False
        job = running.job()
        column = layout.column()
        column.enabled = job is None
        column.prop(asked, "receiver", expand=True)
        column.prop(asked, "object" if asked.receiver == "OBJECT" else "camera")
        size = column.column(align=True)
        size.prop(asked, "width", text="Size X")
        size.prop(asked, "height", text="Y")
        column.prop(asked, "lights")
        column.prop(asked, "domain", expand=True)
        column.prop(asked, "soft")
        samples = column.row(align=True, heading="Samples")
        samples.prop(asked, "auto_samples")
        number = samples.row()
        number.enabled = not asked.auto_samples
        number.prop(asked, "samples", text="")
        column.prop(asked, "folder")
        if job is not None:
            _draw_job(layout, job)
        else:
            _draw_bake(layout, asked)
        _draw_asset(layout, asked)
        _draw_shot(layout, context.scene)


def _draw_shot(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    column = layout.box().column()
    column.prop(scene.srbf, "shot_size")
    column.operator("srbf.light_shot", icon="VIEW_CAMERA")
    column.operator("srbf.take_lights", icon="IMPORT")


def _draw_job(layout: bpy.types.UILayout, job: running.Job) -> None:
    progress = job.reader.progress
    if progress is None:
        layout.label(text=f"{job.what}: started", icon="TIME")
    else:
        left = "" if progress.seconds_left is None else f", {duration(progress.seconds_left)} left"
        layout.progress(factor=progress.fraction, text=f"{progress.fraction:.0%}{left}")
        layout.label(text=progress.what)
    layout.operator("srbf.stop", text="Stopping…" if job.stopping else "Stop", icon="CANCEL")


def _draw_bake(layout: bpy.types.UILayout, asked: settings.SrbfSettings) -> None:
    wrong = settings.problem(asked)
    if wrong is not None:
        layout.label(text=wrong, icon="INFO")
    state = "nothing" if wrong else settings.state_of(settings.folder_of(asked) / "capture")
    row = layout.row(align=True)
    if state == "nothing":
        row.operator("srbf.bake", text="Bake", icon="RENDER_STILL")
    else:
        if state == "half done":
            row.operator("srbf.bake", text="Resume", icon="PLAY")
        row.operator("srbf.bake", text="Bake Again", icon="FILE_REFRESH").again = True
    if running.last():
        _wrapped(layout, running.last())


def _draw_asset(layout: bpy.types.UILayout, asked: settings.SrbfSettings) -> None:
    row = layout.row(align=True)
    row.prop(asked, "k")
    row.operator("srbf.fit", text="Fit", icon="MOD_DATA_TRANSFER")
    if asked.receiver != "OBJECT":
        return
    column = layout.column()
    column.prop(asked, "layout", expand=True)
    column.prop(asked, "albedo")
    column.prop(asked, "falloff")
    if asked.falloff == "LINEAR":
        column.prop(asked, "a0")
    row = column.row(align=True)
    row.operator("srbf.show", text="Show", icon="LIGHT_SUN")
    if asked.object is not None and show.SHOWN in asked.object:
        row.operator("srbf.hide", text="Own Materials", icon="MATERIAL")


def _wrapped(layout: bpy.types.UILayout, text: str, width: int = 48) -> None:
    """A label of several lines, since Blender truncates long ones."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    column = layout.column(align=True)
    for line in lines:
        column.label(text=line)
