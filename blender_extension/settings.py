# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's settings, stored in the scene, and as arguments of `srbf`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import bpy

SCENE_COPY = "scene.blend"  # the baked copy: a bake can be resumed after the original file has changed
State = Literal["nothing", "half done", "done"]


class SrbfSettings(bpy.types.PropertyGroup):
    """Settings of the panel; see their descriptions."""

    receiver: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Receiver",
        items=[("OBJECT", "Object", "The texels of an object's UV layer"), ("CAMERA", "Camera", "The pixels of a camera's view")],
    )
    object: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Object", type=bpy.types.Object, poll=lambda _, obj: obj.type == "MESH", description="The mesh whose lightmap is baked"
    )
    camera: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Camera", type=bpy.types.Object, poll=lambda _, obj: obj.type == "CAMERA", description="The camera whose view is baked"
    )
    width: bpy.props.IntProperty(name="Width", default=256, min=1, max=16384, description="Texels")  # type: ignore[valid-type]
    height: bpy.props.IntProperty(name="Height", default=256, min=1, max=16384, description="Texels")  # type: ignore[valid-type]
    lights: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Lights", default=400, min=1, description="Light directions to bake and fit; random held-out ones are added"
    )
    domain: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="From",
        items=[("hemisphere", "Above", "Light comes from above the ground"), ("sphere", "All Around", "Light comes from everywhere")],
    )
    soft: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Soft Shadows", description="A sun as large as the mean light spacing: penumbrae that this many lights can resolve"
    )
    auto_samples: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Automatic", description="Add samples until the error on held-out lights stops improving"
    )
    samples: bpy.props.IntProperty(name="Samples", default=2, min=1, description="Samples per texel of each light")  # type: ignore[valid-type]
    folder: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Folder",
        default="//srbf",
        subtype="DIR_PATH",
        description="Captures and assets go here, in one folder per receiver",
    )
    shot_size: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Shot Size", default=640, min=8, max=16384, subtype="PIXEL", description="Longer side of the shot that is lit, pixels"
    )
    k: bpy.props.IntProperty(name="Maps", default=25, min=1, max=2048, description="Relighting maps to fit")  # type: ignore[valid-type]
    albedo: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Albedo", default=True, description="Show irradiance times albedo / pi of the object's own materials, instead of unchanged"
    )
    layout: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Textures",
        items=[
            ("IMAGES", "One per Map", "One image texture per map: for Cycles, which has no limit"),
            ("ATLAS", "Atlas", "All maps in one image: for EEVEE, which has few texture slots"),
        ],
    )
    falloff: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Fall-off",
        items=[
            ("INVERSE_SQUARE", "Inverse Square", "Like Blender's lights"),
            ("LINEAR", "Linear", "The article's: equal to Blender's at the distance a0"),
        ],
    )
    a0: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="a0", default=1.0, min=1e-3, unit="LENGTH", description="The distance at which a linear falloff equals Blender's"
    )


def receiver_of(settings: Any) -> bpy.types.Object | None:
    """The chosen object or camera."""
    return settings.object if settings.receiver == "OBJECT" else settings.camera


def folder_of(settings: Any) -> Path:
    """The receiver's folder: capture/, asset/, the copy of the scene and the logs."""
    receiver = receiver_of(settings)
    name = bpy.path.clean_name(receiver.name) if receiver else "nothing"
    return Path(bpy.path.abspath(settings.folder)).resolve() / name


def problem(settings: Any) -> str | None:
    """What the user must do before a bake; None if nothing."""
    if receiver_of(settings) is None:
        return "Choose an object" if settings.receiver == "OBJECT" else "Choose a camera"
    if settings.folder.startswith("//") and not bpy.data.filepath:
        return "Save the file first: the folder is beside it"
    return None


def state_of(capture: Path) -> State:
    """State of a bake, from the files in its folder."""
    if (capture / "bake.json").is_file():
        return "half done"
    return "done" if (capture / "capture.json").is_file() else "nothing"


def bake_arguments(settings: Any, folder: Path, state: State, again: bool, blender: str) -> list[str]:
    """Arguments of `srbf bake` for the scene's copy in `folder`, with the Blender at the path `blender` (empty: the bpy module)."""
    receiver = receiver_of(settings)
    kind = "lightmap" if settings.receiver == "OBJECT" else "view"
    arguments = ["bake", str(folder / SCENE_COPY), "--output", str(folder / "capture"), "--receiver", f"{kind}:{receiver.name}"]
    arguments += ["--size", f"{settings.width}x{settings.height}", "--lights", str(settings.lights), "--domain", settings.domain]
    arguments += ["--samples", "auto" if settings.auto_samples else str(settings.samples), "--json-progress"]
    if settings.soft:
        arguments += ["--sun-angle", "auto"]
    if again and state != "nothing":
        arguments.append("--force" if state == "done" else "--restart")
    return arguments + (["--blender", blender] if blender else [])


def fit_arguments(settings: Any, folder: Path) -> list[str]:
    """Arguments of `srbf fit` for the capture in `folder`; it replaces an existing asset."""
    return ["fit", str(folder / "capture"), "--output", str(folder / "asset"), "-k", str(settings.k), "--force"]
