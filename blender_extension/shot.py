# SPDX-License-Identifier: GPL-3.0-or-later
"""Light a shot: bake the scene's camera as a deep framebuffer, fit it and open its page; take lights back from the page."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy

from . import process, rig, running, settings, show
from .asset import AssetError

NAME = "shot"


def folder_of(scene: bpy.types.Scene) -> Path:
    """The shot's folder; of a file that was never saved a temporary one, which goes with Blender."""
    asked = scene.srbf
    name = f"{bpy.path.clean_name(scene.camera.name)} {NAME}"
    if asked.folder.startswith("//") and not bpy.data.filepath:
        return Path(bpy.app.tempdir or tempfile.gettempdir()) / "srbf" / name
    return Path(bpy.path.abspath(asked.folder)).resolve() / name


def commands(scene: bpy.types.Scene, folder: Path, blender: str) -> list[tuple[str, list[str]]]:
    """(what, arguments of `srbf`) one after the other; the last, the page's server, runs on."""
    copy, capture, asset = (str(folder / name) for name in (settings.SCENE_COPY, "capture", "asset"))
    state = settings.state_of(folder / "capture")
    bake = ["bake", copy, "--output", capture, "--receiver", f"view:{scene.camera.name}", "--size", _size(scene)]
    bake += ["--light-set", "gather", "--holdout", "0", "--scene", scene.name, "--json-progress"]
    if state != "nothing":
        bake.append("--force" if state == "done" else "--restart")
    own = ["--blender", blender] if blender else []
    return [
        ("Bake", bake + own),
        ("Fit", ["fit", capture, "--output", asset, "--force"]),
        ("Page", ["view", asset, "--scene", copy, *own]),
    ]


class SRBF_OT_light_shot(bpy.types.Operator):
    """Bake what the camera sees in a separate process, and light it in the browser, its own lights to begin with"""

    bl_idname = "srbf.light_shot"
    bl_label = "Light This Shot"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        wrong = "Give the scene a camera" if context.scene.camera is None else None
        if wrong is None and running.job() is not None:
            wrong = "Wait for the running job, or stop it"
        if wrong is not None:
            cls.poll_message_set(wrong)
        return wrong is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        folder = folder_of(context.scene)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with show.own_materials():
                bpy.ops.wm.save_as_mainfile(filepath=str(folder / settings.SCENE_COPY), copy=True, relative_remap=True, compress=False)
            running.close_page()  # it serves what is replaced now
            _start(commands(context.scene, folder, bpy.app.binary_path), folder)
        except (OSError, RuntimeError, AssetError, process.MissingHostError) as error:
            self.report({"ERROR"}, " ".join(str(error).split()))
            return {"CANCELLED"}
        return {"FINISHED"}


class SRBF_OT_take_lights(bpy.types.Operator):
    """Set the scene's lights as a FRAMES.json that the page saved (Lights) has them, by their names"""

    bl_idname = "srbf.take_lights"
    bl_label = "Take Lights from the Rig"
    bl_options = {"REGISTER", "UNDO"}
    filepath: bpy.props.StringProperty(subtype="FILE_PATH")  # type: ignore[valid-type]
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})  # type: ignore[valid-type]

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            count, notes = rig.take(context.scene, rig.read(Path(self.filepath)))
        except rig.RigError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for note in notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, f"{count} lights set")
        return {"FINISHED"} if count else {"CANCELLED"}


def _size(scene: bpy.types.Scene) -> str:
    """WxH in the shape of the camera's frame."""
    render, longer = scene.render, scene.srbf.shot_size
    width, height = render.resolution_x * render.pixel_aspect_x, render.resolution_y * render.pixel_aspect_y
    scale = longer / max(width, height)
    return f"{max(1, round(width * scale))}x{max(1, round(height * scale))}"


CLASSES = (SRBF_OT_light_shot, SRBF_OT_take_lights)


def _start(steps: list[tuple[str, list[str]]], folder: Path) -> None:
    """Run the steps one after the other, each if the one before succeeds."""
    (what, arguments), *rest = steps
    job = process.Job(what, process.host_command(arguments), folder / f"{what.lower()}.progress")
    if rest:
        running.start(job, lambda: _start(rest, folder))
    else:
        running.open_page(job)
