# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening a .blend without running anything in it, and making the capture's light the only one."""

from __future__ import annotations

from pathlib import Path

import bpy

from blender_bake import as_rendered
from blender_bake.ipc import Events, WorkerError, leave
from blender_bake.sanitize import sanitize

WORKING_SPACE = "Linear Rec.709"


def version() -> str:
    """Blender's version, as "4.5.15"."""
    return ".".join(str(n) for n in bpy.app.version)


def open_scene(path: str, events: Events, name: str | None = None) -> bpy.types.Scene:
    """The .blend's scene `name`, else its active one, sanitized (see `sanitize`), all objects in Object Mode.

    Warnings name what is left out or missing. WorkerError where it cannot be opened.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.use_scripts_auto_execute = False
    said: list[str] = []
    read = False

    @bpy.app.handlers.persistent
    def clean(*_: object) -> None:
        nonlocal read
        read = True
        try:
            said.extend(sanitize())
        except Exception as error:  # noqa: BLE001 - Blender would print it and evaluate the rest
            events.emit("error", message=str(error) if isinstance(error, WorkerError) else f"Blender's worker failed: {error!r}")
            leave(1)

    bpy.app.handlers.load_post.insert(0, clean)
    try:
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False, use_scripts=False)
    except RuntimeError as error:
        reason = str(error).replace("Error: ", "").strip().replace("\n", " ")
        raise WorkerError(f"expected a .blend that Blender {version()} can open, found {path}: {reason}") from error
    finally:
        bpy.app.handlers.load_post.remove(clean)
    if not read:
        raise WorkerError(f"expected Blender {version()} to say that it has read {path}, found it silent; use another Blender")
    for line in said:
        events.warn(line)
    for missing in missing_files():
        events.warn(missing)
    space = getattr(getattr(bpy.data, "colorspace", None), "working_space", WORKING_SPACE)
    if space != WORKING_SPACE:
        raise WorkerError(f"expected the working color space {WORKING_SPACE}, found {space}; set it in the .blend's render properties")
    leave_modes()
    return _chosen(name)


def leave_modes() -> None:
    """Set Object Mode for every object saved in another: in Edit Mode its data is the editor's, and operators refuse."""
    for obj in [obj for obj in bpy.context.view_layer.objects if obj.mode != "OBJECT"]:
        if obj.mode != "OBJECT":  # it may have left together with another
            bpy.context.view_layer.objects.active = obj
            try:
                bpy.ops.object.mode_set(mode="OBJECT")
            except RuntimeError as error:
                raise WorkerError(
                    f"expected {obj.name!r} in Object Mode, found it in {obj.mode}; leave that, and save the .blend"
                ) from error


def _chosen(name: str | None) -> bpy.types.Scene:
    """The scene `name` made the active one; WorkerError names those there are."""
    if name is not None:
        if name not in bpy.data.scenes:
            shown = ", ".join(repr(scene.name) for scene in bpy.data.scenes)
            raise WorkerError(f"expected a scene {name!r}, found none; the .blend holds {shown}")
        bpy.context.window.scene = bpy.data.scenes[name]
        leave_modes()
    return bpy.context.scene


def left_out(scene: bpy.types.Scene) -> list[str]:
    """A line where the world has a volume, which is left out while a light of ours is on."""
    world = scene.world
    output = world.node_tree.get_output_node("CYCLES") if world is not None and world.use_nodes and world.node_tree else None
    if output is not None and output.inputs["Volume"].links:
        return [f"the volume of world {world.name!r} is left out of every image; fog in a mesh is rendered"]
    return []


def missing_files() -> list[str]:
    """A line for each texture and library file that the .blend names and that is not there."""
    lines = []
    for library in bpy.data.libraries:
        path = bpy.path.abspath(library.filepath)
        if not Path(path).is_file():
            lines.append(f"missing library {path}: its content is not rendered")
    for image in bpy.data.images:
        if image.source not in {"FILE", "SEQUENCE", "MOVIE", "TILED"} or image.packed_file or image.users == 0:
            continue
        path = bpy.path.abspath(image.filepath, library=image.library)
        tiles = [path.replace("<UDIM>", str(tile.number)) for tile in image.tiles] if image.source == "TILED" else [path]
        if not all(Path(tile).is_file() for tile in tiles):
            lines.append(f"missing texture {path or image.name} (image {image.name!r}): Blender renders it magenta")
    return lines


def configure(scene: bpy.types.Scene) -> None:
    """Cycles on the CPU, unbiased and repeatable: no clamps, no adaptive sampling, no denoiser, no compositor, no view transform.

    Bounces, caustics, Filter Glossy and subdivision stay as the scene has them.
    """
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    for name, value in {
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "use_light_tree": False,
        "use_guiding": False,
        "use_animated_seed": False,
        "use_fast_gi": False,
        "use_camera_cull": False,  # Simplify's: what is culled casts no shadows
        "use_distance_cull": False,
        "sample_clamp_direct": 0.0,
        "sample_clamp_indirect": 0.0,
        "light_sampling_threshold": 0.0,
        "film_exposure": 1.0,
        "time_limit": 0.0,
        "sample_offset": 0,
        "use_sample_subset": False,
        "auto_scrambling_distance": False,
        "scrambling_distance": 1.0,
        "use_auto_tile": True,
        "tile_size": 2048,
    }.items():
        if hasattr(cycles, name):  # Blender versions differ in what they have
            setattr(cycles, name, value)
    render = scene.render
    bake = render.bake
    bake.normal_r, bake.normal_g, bake.normal_b = "POS_X", "POS_Y", "POS_Z"  # the operator reads these in any case
    bake.use_cage, bake.cage_object, bake.cage_extrusion, bake.max_ray_distance = False, None, 0.0, 0.0
    render.use_compositing = False
    render.use_sequencer = False
    render.use_motion_blur = False
    render.use_border = render.use_crop_to_border = False
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.use_multiview = False
    render.use_freestyle = False
    render.use_persistent_data = False  # it would keep the samples, seed and filter of the render before
    if hasattr(render, "use_bake_multires"):
        render.use_bake_multires = False
    elif hasattr(bake, "use_multires"):  # Blender 5
        bake.use_multires = False
    render.use_stamp = False
    render.use_overwrite = True
    render.use_file_extension = True
    render.threads_mode = "AUTO"
    as_rendered.settle(scene)
    for layer in scene.view_layers:
        layer.samples = 0  # a layer's own count would override ours


class OwnLight:
    """The scene's own lights and world: switched off when this is made, and on again for `keep_scene_lights`."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene
        self._world = scene.world
        self._black = black_world()
        self._overrides = [(layer, layer.world_override) for layer in scene.view_layers if hasattr(layer, "world_override")]
        self._point_lights = [(data, data.energy) for data in bpy.data.lights]
        for data, _ in self._point_lights:
            data.animation_data_clear()
        self.off()

    def off(self) -> None:
        """No light, a black world."""
        self._scene.world = self._black
        for layer, _ in self._overrides:
            layer.world_override = None
        for data, _ in self._point_lights:
            data.energy = 0.0

    def restore(self) -> None:
        """The scene's own lighting."""
        self._scene.world = self._world
        for layer, world in self._overrides:
            layer.world_override = world
        for data, energy in self._point_lights:
            data.energy = energy


def black_world() -> bpy.types.World:
    """A world of no light at all."""
    world = bpy.data.worlds.new("srbf black")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes.clear()
    output = world.node_tree.nodes.new("ShaderNodeOutputWorld")
    background = world.node_tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    background.inputs["Strength"].default_value = 0
    world.node_tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return world
