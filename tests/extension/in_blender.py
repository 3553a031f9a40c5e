"""Run as a script in a process of its own: the extension inside Blender's Python module. The last words on stdout are JSON."""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import blender_extension  # noqa: E402
from blender_extension import operators, running, settings, show  # noqa: E402


def plane(name: str = "Plane", layer: str = "lightmap") -> bpy.types.Object:
    """The square [-1, 1]^2 at z = 0 whose layer's u, v are x, y."""
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name=layer).uv.foreach_set("vector", [(v + 1) / 2 for x, y, _ in corners for v in (x, y)])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def material(color: tuple[float, float, float], kind: str = "ShaderNodeBsdfPrincipled") -> bpy.types.Material:
    made = bpy.data.materials.new("Paint")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    shader.inputs[0].default_value = (*color, 1)
    return made


def point_light(kind: str, name: str, energy: float, color: list[float], location: list[float], axis: list[float] | None = None) -> None:
    from mathutils import Vector

    light = bpy.data.lights.new(name, kind)
    light.energy, light.color = energy, color
    obj = bpy.data.objects.new(name, light)
    obj.location = location
    if axis is not None:  # a light shines along its own -z
        obj.rotation_euler = Vector(axis).to_track_quat("Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(obj)


def emitted(obj: bpy.types.Object, width: int, height: int) -> np.ndarray:
    """(H, W, 3), row 0 at the top: what the object emits at its texels' centers, baked by Cycles with one sample."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1
    scene.cycles.use_adaptive_sampling = False
    image = bpy.data.images.new("emitted", width, height, float_buffer=True)
    for slot in obj.material_slots:
        nodes = slot.material.node_tree.nodes
        nodes.active = nodes.new("ShaderNodeTexImage")
        nodes.active.image = image
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.object.bake(type="EMIT", margin=0, use_clear=True)
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)[::-1, :, :3]


def relit(case: dict) -> dict:
    """Show the asset at case.asset under case.lights, and write what is emitted to case.out; again after the lights have moved."""
    obj = plane(layer=case.get("layer", "lightmap"))
    for color in case.get("albedo", []):
        obj.data.materials.append(material(color))
    scene = bpy.context.scene
    scene.srbf.falloff, scene.srbf.a0 = case.get("falloff", "INVERSE_SQUARE"), case.get("a0", 1.0)
    for light in case["lights"]:
        point_light(**light)
    scene.render.engine = case.get("engine", "CYCLES")
    capture = Path(case["capture"]) if "capture" in case else None
    notes = show.show(scene, obj, Path(case["asset"]), capture, case.get("layout", "IMAGES"), bool(case.get("albedo")))
    for light in case.get("later", []):
        point_light(**light)
    bpy.context.view_layer.update()
    np.save(case["out"], emitted(obj, case["width"], case["height"]))
    return {"notes": notes}


def round_trip(case: dict) -> dict:
    """Show and hide again, and what is left."""
    obj, twin = plane(), None
    obj.data.materials.append(material((0.5, 0.5, 0.5)))
    obj.data.materials.append(None)
    twin = bpy.data.objects.new("Twin", obj.data)
    bare = plane("Bare")
    scene = bpy.context.scene
    before = {kind: sorted(x.name for x in getattr(bpy.data, kind)) for kind in ("materials", "node_groups")}
    states = []
    for _ in range(2):
        for target in (obj, bare):
            show.show(scene, target, Path(case["asset"]), None, "ATLAS", True)
        states.append([slot.material.name for slot in obj.material_slots])
        states.append([slot.material.name if slot.material else None for slot in twin.material_slots])
        with show.own_materials():
            states.append([slot.material.name if slot.material else None for slot in obj.material_slots])
        states.append([slot.material.name for slot in obj.material_slots])
        for target in (obj, bare):
            show.hide(target)
        states.append([slot.material.name if slot.material else None for slot in obj.material_slots])
    after = {kind: sorted(x.name for x in getattr(bpy.data, kind)) for kind in ("materials", "node_groups")}
    links = [slot.link for slot in obj.material_slots]
    return {
        "states": states,
        "before": before,
        "after": after,
        "links": links,
        "bare": len(bare.data.materials),
        "images": len(bpy.data.images),
    }


def refusals(case: dict) -> dict:
    """What the operators refuse, in order of a newcomer's steps; the words of `show` on assets that it cannot show."""
    folder = Path(case["folder"])
    scene = bpy.context.scene
    polls = []

    def poll() -> None:
        polls.append([getattr(bpy.ops.srbf, name).poll() for name in ("bake", "stop", "fit", "show", "hide")])

    poll()  # nothing chosen
    scene.srbf.object = obj = plane()
    poll()  # not saved
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
    poll()
    capture = folder / "srbf" / "Plane" / "capture"
    capture.mkdir(parents=True)
    (capture / "capture.json").write_text("{}")
    poll()
    words = []
    for asset in case["assets"]:
        try:
            show.show(scene, obj, Path(asset), None, "IMAGES", False)
            words.append("shown")
        except operators.AssetError as error:
            words.append(str(error))
    return {"polls": polls, "words": words}


def bake(case: dict) -> dict:
    """Press Bake with `case.host` in the library's place, and listen until it ends; the scene's copy and what was asked of the host."""
    from blender_extension import process

    process.HOST = Path(case["host"])
    scene = bpy.context.scene
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(case["folder"]) / "scene.blend"))
    scene.srbf.object = obj = plane()
    obj.data.materials.append(material((0.8, 0.8, 0.8)))
    for name, value in case.get("settings", {}).items():
        setattr(scene.srbf, name, value)
    results = [bpy.ops.srbf.bake()]
    refused = bpy.ops.srbf.bake.poll()
    seen = []
    deadline = time.monotonic() + 40
    stopped = False
    while running.job() is not None and time.monotonic() < deadline:
        running.listen()
        job = running.job()
        if job is not None and job.reader.progress is not None:
            seen.append(job.reader.progress.done)
            if case.get("stop") and not stopped:
                results.append(bpy.ops.srbf.stop())
                stopped = True
        time.sleep(0.02)
    if case.get("fit"):
        results.append(bpy.ops.srbf.fit())
        while running.job() is not None and time.monotonic() < deadline:
            running.listen()
            time.sleep(0.02)
    folder = Path(case["folder"]) / "srbf" / "Plane"
    return {
        "results": [sorted(r) for r in results],
        "refused": not refused,
        "seen": seen,
        "last": running.last(),
        "copy": (folder / "scene.blend").is_file(),
        "state": settings.state_of(folder / "capture"),
    }


def light_shot(case: dict) -> dict:
    """Press Light This Shot with `case.host` in the library's place, and listen until the page's server runs."""
    from blender_extension import process

    if "host" in case:
        process.HOST = Path(case["host"])
    if "scene" in case:
        bpy.ops.wm.open_mainfile(filepath=case["scene"])
    scene = bpy.context.scene
    scene.srbf.folder, scene.srbf.shot_size = case["folder"], 24
    if "scene" not in case:
        refused = not bpy.ops.srbf.light_shot.poll()
        scene.camera = bpy.data.objects.new("Shot: 1", bpy.data.cameras.new("Lens"))
        scene.collection.objects.link(scene.camera)
    else:
        refused = True
    results = [sorted(bpy.ops.srbf.light_shot())]
    deadline, page, told = time.monotonic() + 50, None, ""
    while time.monotonic() < deadline and (page is None or not told) and not (running.job() is None and running.last() and page is None):
        running.listen()
        page = running.page()
        log = folder_of_page(case) / "page.progress"
        told = log.read_text() if page is not None and log.is_file() else ""
        time.sleep(0.05)
    found = {"results": results, "refused": refused, "last": running.last(), "page": page is not None, "told": told}
    running.close_page()
    return found


def folder_of_page(case: dict) -> Path:
    from blender_extension import shot

    return shot.folder_of(bpy.context.scene)


def take_lights(case: dict) -> dict:
    """Lights of every kind, set by the file `case.rig`; their values before, after, and after undo."""
    for name, kind in (
        ("Key", "POINT"),
        ("Globe", "POINT"),
        ("Spot", "SPOT"),
        ("Panel", "AREA"),
        ("Disk", "AREA"),
        ("Sun", "SUN"),
        ("Fill", "POINT"),
    ):
        point_light(kind, name, 7, [1, 1, 1], [0, 0, 3])
    bpy.data.objects["Globe"].data = bpy.data.objects["Key"].data  # shared
    bpy.data.objects["Disk"].data.shape = "DISK"
    bpy.data.objects["Spot"].data.exposure = 2
    bpy.data.objects["Panel"].scale = (2, 3, 1)
    for name in ("Box", "Wall"):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, bpy.data.meshes.new(name)))
    own = bpy.data.collections.new("by the artist")
    own.objects.link(bpy.data.objects["Wall"])
    bpy.data.objects["Sun"].light_linking.receiver_collection = bpy.data.objects["Key"].light_linking.blocker_collection = own
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="before")

    def told() -> dict:
        bpy.context.view_layer.update()
        names = ("energy", "color", "shadow_soft_size", "spot_size", "spot_blend", "shape", "size", "size_y", "exposure")
        values = {}
        for obj in bpy.data.objects:
            own = {name: getattr(obj.data, name) for name in names if hasattr(obj.data, name)}
            own = {name: list(value) if name == "color" else value for name, value in own.items()}
            values[obj.name] = {**own, "matrix": [list(row) for row in obj.matrix_world], "hidden": obj.hide_render}
        return values

    def links(name: str) -> dict:
        linking, found = bpy.data.objects[name].light_linking, {}
        for link, place in (("receivers", linking.receiver_collection), ("blockers", linking.blocker_collection)):
            if place is not None:
                members = zip(place.collection_objects, place.objects, strict=True)
                found[link] = {one.name: member.light_linking.link_state for member, one in members}
        return found

    before = told()
    result = bpy.ops.srbf.take_lights("EXEC_DEFAULT", True, filepath=case["rig"])
    after, linked = told(), {name: links(name) for name in ("Key", "Globe", "Sun")}
    bpy.ops.ed.undo()
    undone, linked_before = told(), {name: links(name) for name in ("Key", "Globe", "Sun")}
    again = [bpy.ops.srbf.take_lights("EXEC_DEFAULT", True, filepath=case[name]) for name in ("rig", "plain")]
    left = {name: links(name) for name in ("Key", "Globe", "Sun")}
    return {
        **{"before": before, "after": after, "undone": undone, "result": sorted(result), "again": [sorted(one) for one in again]},
        **{"linked": linked, "linked_before": linked_before, "left": left},
    }


def command(case: dict) -> dict:
    """`srbf` as Blender's command, with the file at case.scene open."""
    from blender_extension import command

    if "scene" in case:
        bpy.ops.wm.open_mainfile(filepath=case["scene"])
    return {"status": command.run(case["arguments"])}


def completions(case: dict) -> dict:
    """Arguments with what only Blender knows, of an open file open.blend in a Blender at /blender."""
    from typer.main import get_command

    from blender_extension.command import completed
    from srbf.cli import app

    return {"completed": [completed(arguments, get_command(app), "open.blend", "/blender") for arguments in case["cases"]]}


def twice(case: dict) -> dict:
    """Registered and unregistered again and again, nothing of it stays."""
    handlers = [len(h) for h in blender_extension.HANDLERS]
    before = (hasattr(bpy.types.Scene, "srbf"), hasattr(bpy.types, "SRBF_PT_panel"), handlers)
    blender_extension.unregister()
    gone = (hasattr(bpy.types.Scene, "srbf"), hasattr(bpy.types, "SRBF_PT_panel"), [len(h) for h in blender_extension.HANDLERS])
    blender_extension.register()
    return {"before": before, "gone": gone, "again": hasattr(bpy.types, "SRBF_PT_panel")}


if __name__ == "__main__":
    status = 0
    bpy.ops.wm.read_factory_settings(use_empty=True)
    blender_extension.register()
    try:
        result = globals()[sys.argv[1]](json.loads(sys.argv[2]))
        sys.stdout.flush()
        sys.stdout.write("\n" + json.dumps(result) + "\n")
    except Exception:  # noqa: BLE001 - told, and then this process ends past Blender's own shutdown
        traceback.print_exc()
        status = 1
    blender_extension.unregister()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
