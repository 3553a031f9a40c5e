# SPDX-License-Identifier: GPL-3.0-or-later
"""A .blend that tries all it can: `python hostile.py build OUT.blend CANARIES [ATTEMPT…]`, all where none is named; `none` for the twin.

`python hostile.py trust IN.blend` opens, renders and bakes it as a careless program would; `python hostile.py list` names the attempts.

Where an attempt succeeds it leaves a canary: a file with its name in CANARIES, beside the .blend or in the temporary folder. Spoilers leave
none: they would alter pixels, or what the user reads.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))

from closed_form_scenes import SQUARE, camera, point_light, quad  # noqa: E402

FRAME = 2  # physics write their first cache at the second frame


def touch(canaries, name):
    """Python that leaves a canary, as an expression of value 0."""
    return f"(__import__('pathlib').Path({str(canaries / name)!r}).touch() or 0)"


def script(name, source):
    """A text block that Blender runs on load where scripts may run."""
    text = bpy.data.texts.new(f"{name}.py")
    text.write(source)
    text.use_module = True
    return text


def far(name):
    """A little mesh where no light or eye meets it."""
    return quad(name, corners=[(x / 100, y / 100, 0) for x, y, _ in SQUARE], location=(0, 0, -50))


def text_block(canaries):
    """A registered text."""
    script("text_block", touch(canaries, "text_block"))


def handler(canaries):
    """A handler that outlives the file, made by a registered text."""
    source = f"import bpy\n@bpy.app.handlers.persistent\ndef strike(*_):\n    {touch(canaries, 'handler')}\n"
    script("handler", source + "bpy.app.handlers.depsgraph_update_post.append(strike)\nbpy.app.handlers.render_pre.append(strike)\n")


def object_driver(canaries):
    """A scripted driver; where it does not run, its object must stay at its saved height."""
    wall = bpy.data.objects["Wall"]
    scripted(wall.driver_add("location", 2), f"{touch(canaries, 'object_driver')} + 0.25")


def shader_driver(canaries):
    """A scripted driver inside a material: the wall's color."""
    tree = bpy.data.objects["Wall"].data.materials[0].node_tree
    path = 'nodes["Diffuse BSDF"].inputs[0].default_value'
    scripted(tree.driver_add(path, 0), f"{touch(canaries, 'shader_driver')} + 0.5")


def namespace_driver(canaries):
    """A driver that calls a function which a text put into the driver namespace."""
    script("namespace_driver", f"import bpy\nbpy.app.driver_namespace['strike'] = lambda: {touch(canaries, 'namespace_driver')}\n")
    scripted(bpy.data.objects["Wall"].driver_add("location", 1), "strike() * 1.0")


def linked_driver(canaries):
    """The same in a library that the .blend links."""
    library = Path(bpy.data.filepath).with_name("library.blend")
    obj = far("Linked")
    scripted(obj.driver_add("location", 0), touch(canaries, "linked_driver"))
    bpy.data.libraries.write(str(library), {obj}, fake_user=True)
    bpy.data.objects.remove(obj)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = ["Linked"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])


def open_shading(_canaries):
    """An OSL node whose source is a file: Cycles compiles it when the scene renders, and writes what came out beside it."""
    source = Path(bpy.data.filepath).with_name("open_shading.osl")
    source.write_text("shader strike(output float Strength = 1) { Strength = 1; }")
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.shading_system = True
    tree = bpy.data.objects["Plane"].data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeScript")
    node.mode = "EXTERNAL"
    node.filepath = str(source)
    if "Strength" in node.outputs:
        tree.links.new(node.outputs["Strength"], tree.nodes["Diffuse BSDF"].inputs["Roughness"])
    source.with_suffix(".oso").unlink(missing_ok=True)


def cloth_cache(_canaries):
    """Cloth with a disk cache: Blender writes blendcache_NAME beside the .blend as soon as it evaluates the scene."""
    modifier = far("Cloth").modifiers.new("Cloth", "CLOTH")
    modifier.point_cache.name = "cloth_cache"
    modifier.point_cache.use_disk_cache = True


def rearmed_cache(_canaries):
    """The same, kept on by an animation."""
    obj = far("Rearmed")
    modifier = obj.modifiers.new("Cloth", "CLOTH")
    modifier.point_cache.name = "rearmed_cache"
    modifier.point_cache.use_disk_cache = True
    obj.keyframe_insert('modifiers["Cloth"].point_cache.use_disk_cache', frame=1)


def particle_cache(_canaries):
    """Particles with a disk cache."""
    obj = far("Emitter")
    obj.modifiers.new("Particles", "PARTICLE_SYSTEM")
    system = obj.particle_systems[0]
    system.settings.count = 3
    system.point_cache.name = "particle_cache"
    system.point_cache.use_disk_cache = True


def soft_body_cache(_canaries):
    """A soft body with a disk cache."""
    obj = far("Soft")
    obj.modifiers.new("Softbody", "SOFT_BODY")
    obj.modifiers["Softbody"].point_cache.name = "soft_body_cache"
    obj.modifiers["Softbody"].point_cache.use_disk_cache = True


def fluid_replay(canaries):
    """Smoke that simulates as one looks, into a folder that the file names, by Python of Mantaflow's; some builds of Blender die of it."""
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, -60))
    domain = bpy.context.object.modifiers.new("Fluid", "FLUID")
    domain.fluid_type = "DOMAIN"
    domain.domain_settings.cache_directory = str(canaries / "fluid_replay")
    domain.domain_settings.cache_type = "REPLAY"


def render_path(canaries):
    """Where a still goes."""
    bpy.context.scene.render.filepath = str(canaries / "render_path")


def file_output(canaries):
    """A compositor that writes files."""
    scene = bpy.context.scene
    if hasattr(scene, "compositing_node_group"):  # Blender 5
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    tree.nodes.clear()
    layers = tree.nodes.new("CompositorNodeRLayers")
    output = tree.nodes.new("CompositorNodeOutputFile")
    if hasattr(output, "base_path"):
        output.base_path = str(canaries / "file_output")
    else:
        output.directory = str(canaries / "file_output")
        output.file_output_items.new("RGBA", "Image")
    tree.links.new(layers.outputs["Image"], output.inputs[0])
    scene.render.use_compositing = True


def render_cache(_canaries):
    """Renders kept as files in the temporary folder."""
    if hasattr(bpy.context.scene.render, "use_render_cache"):
        bpy.context.scene.render.use_render_cache = True


def freestyle_script(canaries):
    """Freestyle's style modules are Python, and run whatever the user says of scripts."""
    text = bpy.data.texts.new("style.py")
    text.write(touch(canaries, "freestyle_script"))
    bpy.context.scene.render.use_freestyle = True
    layer = bpy.context.view_layer
    layer.use_freestyle = True
    layer.freestyle_settings.mode = "SCRIPT"
    layer.freestyle_settings.modules.new().script = text


def script_camera(_canaries):
    """A camera of OSL, which runs with `shading_system` off as well."""
    source = Path(bpy.data.filepath).with_name("script_camera.osl")
    source.write_text(
        "shader lens(output point position = 0, output vector direction = 0, output color throughput = 1) { direction = vector(0, 0, 1); }"
    )
    data = bpy.data.cameras.new("Lens")
    obj = bpy.data.objects.new("Lens", data)
    bpy.context.scene.collection.objects.link(obj)
    if "CUSTOM" in data.bl_rna.properties["type"].enum_items:
        data.type = "CUSTOM"
        data.custom_mode = "EXTERNAL"
        data.custom_filepath = str(source)
        bpy.context.scene.camera = obj
        source.with_suffix(".oso").unlink(missing_ok=True)


def bake_to_file(canaries):
    """A bake that would save by itself, in tangent space with turned axes."""
    bake = bpy.context.scene.render.bake
    bake.save_mode = "EXTERNAL"
    bake.filepath = str(canaries / "bake_to_file.png")
    bake.normal_r, bake.normal_g, bake.normal_b = "NEG_Z", "POS_X", "NEG_Y"
    bake.normal_space = "TANGENT"


def too_much(_canaries):
    """A billion samples, clamps, limits and the like: none of them is the bake's."""
    scene = bpy.context.scene
    cycles, render, layer = scene.cycles, scene.render, bpy.context.view_layer
    for name, value in {
        "samples": 1_000_000_000 if hasattr(cycles, "samples") else 0,
        "use_adaptive_sampling": True,
        "adaptive_threshold": 0.9,
        "time_limit": 0.01,
        "use_denoising": True,
        "sample_clamp_direct": 0.01,
        "sample_clamp_indirect": 0.01,
        "film_exposure": 7.0,
        "use_animated_seed": True,
        "sample_offset": 3,
        "use_sample_subset": True,
        "sample_subset_length": 1,
        "light_sampling_threshold": 1.0,
        "use_fast_gi": True,
        "use_guiding": True,
        "auto_scrambling_distance": True,
        "scrambling_distance": 0.0,
        "tile_size": 8,
        "use_auto_tile": True,
    }.items():
        if hasattr(cycles, name):
            setattr(cycles, name, value)
    for name, value in {
        "resolution_x": 4,
        "resolution_percentage": 1,
        "pixel_aspect_x": 3.0,
        "use_border": True,
        "use_crop_to_border": True,
        "border_max_x": 0.1,
        "border_max_y": 0.1,
        "use_multiview": True,
        "views_format": "MULTIVIEW",
        "use_motion_blur": True,
        "use_persistent_data": True,
        "film_transparent": True,
        "use_stamp": True,
        "threads_mode": "FIXED",
        "threads": 1,
        "use_placeholder": True,
        "dither_intensity": 2.0,
        "use_file_extension": False,
    }.items():
        if hasattr(render, name):
            setattr(render, name, value)
    layer.samples = 4096
    scene.view_settings.exposure, scene.view_settings.gamma = 3.0, 2.0
    render.image_settings.file_format = "JPEG"
    render.bake.margin = 16
    render.bake.view_from = "ACTIVE_CAMERA"
    render.bake.use_selected_to_active = True
    render.bake.use_clear = False


def animated_settings(_canaries):
    """Simple drivers, which Blender evaluates by itself, and keys on what a bake sets: seed, samples, exposure."""
    scene = bpy.context.scene
    for path, expression in (("cycles.seed", "frame"), ("cycles.samples", "7"), ("render.film_transparent", "0")):
        scripted(scene.driver_add(path), expression)
    scene.cycles.film_exposure = 5.0
    scene.keyframe_insert("cycles.film_exposure", frame=1)


def marker_camera(_canaries):
    """A marker that switches to another camera at the saved frame."""
    data = bpy.data.cameras.new("Elsewhere")
    obj = bpy.data.objects.new("Elsewhere", data)
    obj.location = (30, 0, 3)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.scene.timeline_markers.new("cut", frame=FRAME).camera = obj


def sequencer(_canaries):
    """A strip in place of the picture."""
    scene = bpy.context.scene
    scene.sequence_editor_create()
    editor = scene.sequence_editor
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    options = {"frame_end": 100} if bpy.app.version < (5, 0) else {"length": 100}
    strips.new_effect("red", "COLOR", channel=1, frame_start=1, **options).color = (1, 0, 0)
    scene.render.use_sequencer = True


def names(_canaries):
    """Names that a terminal, a markup or a format string would interpret."""
    for name in ("\x1b[2J\x1b[31mred", "[/bold]{0}%s", "two\nlines", "'; import os"):
        scripted(far(name).driver_add("location", 0), "bpy.context.scene.frame_current * 0.0")


ATTEMPTS = {
    attempt.__name__: attempt
    for attempt in (
        text_block,
        handler,
        object_driver,
        shader_driver,
        namespace_driver,
        linked_driver,
        open_shading,
        cloth_cache,
        rearmed_cache,
        particle_cache,
        soft_body_cache,
        render_path,
        file_output,
        render_cache,
        freestyle_script,
        script_camera,
        fluid_replay,  # the last: nothing may evaluate the scene once it is armed
    )
}
SPOILERS = {spoiler.__name__: spoiler for spoiler in (bake_to_file, too_much, animated_settings, marker_camera, sequencer, names)}


def scripted(curve, expression):
    curve.driver.type = "SCRIPTED"
    curve.driver.expression = expression


def build(path, canaries, chosen):
    """The square, a gray wall on it that drivers move, a camera; saved at FRAME, armed after its values were set."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    quad("Plane")
    wall = quad("Wall", corners=[(0, 0, 0), (0, 1, 0), (0, 1, 0.5), (0, 0, 0.5)], color=(0.5, 0.2, 0.1))
    wall.location.z = 0.25
    point_light()
    camera()
    bpy.context.scene.camera.data.dof.use_dof = False
    bpy.context.scene.frame_set(FRAME)
    bpy.context.scene.render.filepath = ""
    for name in chosen:
        {**ATTEMPTS, **SPOILERS}[name](canaries)
    wall.location.z = 0.25  # what evaluating a driver without leave may have undone
    wall.location.y = 0.0
    wall.data.materials[0].node_tree.nodes["Diffuse BSDF"].inputs[0].default_value = (0.5, 0.2, 0.1, 1)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)


def trust(path):
    """Open with scripts, play two frames, render and bake as the file says."""
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = bpy.context.view_layer.samples = 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage = 100
    for frame in (1, 2, 3):
        scene.frame_set(frame)
    bpy.ops.render.render(write_still=bool(scene.render.filepath))
    plane = scene.objects["Plane"]
    tree = plane.data.materials[0].node_tree
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = bpy.data.images.new("target", 8, 8)
    tree.nodes.active = target
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == plane)
    bpy.context.view_layer.objects.active = plane
    scene.render.bake.use_selected_to_active = False
    scene.render.bake.view_from = "ABOVE_SURFACE"
    bpy.ops.object.bake(type="DIFFUSE", save_mode=scene.render.bake.save_mode, filepath=scene.render.bake.filepath)


if __name__ == "__main__":
    if sys.argv[1] == "list":
        print(*ATTEMPTS, flush=True)
    elif sys.argv[1] == "trust":
        trust(Path(sys.argv[2]).resolve())
    else:
        chosen = sys.argv[4:] or [*SPOILERS, *ATTEMPTS]
        build(Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve(), [] if chosen == ["none"] else chosen)
    os._exit(0)
