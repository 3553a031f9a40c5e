# SPDX-License-Identifier: GPL-3.0-or-later
"""Facts of the scene that a bake needs before it is planned: objects, sizes, free places for lights."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_bake import free_places, point_grid, probe_places, scene_lights, surfaces, unwrap, vertices
from blender_bake.frame import Frame
from blender_bake.ipc import Events, hand_over
from blender_bake.named_lights import NamedLights
from blender_bake.receiver_objects import meshes_of, prepare, require_object, world_area
from blender_bake.view import find_camera

ROUNDS = 4  # of laying out a layer for the size that the one before needs: its gutter shrinks as the size grows


def facts(scene: bpy.types.Scene, question: dict[str, Any], events: Events, frame: Frame, scratch: str) -> dict[str, Any]:
    """The facts for `question`, which may have several of these keys.

    required: receiver            -> nothing; WorkerError where its object or camera is not there
    collections: names            -> `objects`: the receivers in them, in order of name
    vertices: receiver            -> `width`, `height`: of the image that lists the receiver's vertices
    texels_per_meter: density D, receiver -> `side`: texels per side, D sqrt(area in the world / area of the UV layer), not rounded;
        `world_area` (m2), `uv_area` (of the unit square)
    frame: true                   -> `frame`: the aspect of the camera's picture in the scene's own render settings, see `Frame.record`
    points: {spacing, box, random, seed} -> `points`: free places for point lights, see `point_grid.free_points`
    named: {groups}               -> `named`: [{name, objects}], see `NamedLights.entries`
    probes: {spacing, seed}       -> `probes`: {origin, spacing, counts, moved}, see `probe_places.places`; `files` in `scratch`:
        `probe_places` (N, 3), `probe_valid` (N,), and `occluders`
    scene_lights: true            -> `scene_lights`: {lights, left_out, sun_angle}, see `scene_lights.values`
    places                        -> `places`: see `free_places.places`
    surfaces: {cells, spacing, gloss} -> `files` in `scratch`: `corners` (T, 3, 3), `albedo` (T, 3), with gloss as if it were diffuse where
        `gloss` is true, or `caustics` and the scene has reflective ones, else of `caustics` apart in `gloss` (T, 3),
        `transmission` (T, 3), what is let through diffusely,
        `object` (T,), `transparent` (T,), `emission` (T, 3) and `one_sided` (T,) of all surfaces in fragments no longer than a cell, if
        they were `cells`, or than `spacing` m if that is more; `occluders` (U, 3, 3), the triangles that block light;
        `surface_objects`: their names by number; `bounces`: diffuse ones that the scene's settings allow
    """
    found: dict[str, Any] = {}
    if question.get("required"):
        _require(scene, question["required"])
    if question.get("collections"):
        found["objects"] = list(dict.fromkeys(name for c in question["collections"] for name in meshes_of(scene, c, events)))
    if question.get("vertices"):
        counts = [len(obj.data.vertices) for obj in prepare(scene, [question["vertices"]["object"]])]
        found["width"], found["height"] = vertices.image_size(sum(counts))
    if question.get("texels_per_meter"):
        found |= _size_by_density(scene, question["receiver"], question["texels_per_meter"], events)
    if question.get("frame"):
        found["frame"] = frame.record()
    if question.get("named"):
        found["named"] = NamedLights(scene, question["named"]["groups"]).entries()
    if question.get("scene_lights"):
        found["scene_lights"] = scene_lights.values(scene)
    if question.get("places"):
        found["places"] = free_places.places(scene, question["places"])
        for line in found["places"].pop("warnings"):
            events.warn(line)
    if question.get("points"):
        found["points"] = point_grid.free_points(scene, question["points"])
    if question.get("probes"):
        found |= _probes(scene, question["probes"], Path(scratch))
    if question.get("surfaces"):  # the last: it hides all objects
        found |= _surfaces(scene, question["surfaces"], Path(scratch), events)
    return found


def _require(scene: bpy.types.Scene, receiver: dict[str, Any]) -> None:
    if receiver["kind"] == "view":
        find_camera(scene, receiver["camera"])
    for name in receiver.get("objects", ()):
        require_object(scene, name)


def _probes(scene: bpy.types.Scene, question: dict[str, Any], scratch: Path) -> dict[str, Any]:
    found = probe_places.places(scene, question)
    arrays = {
        "probe_places": found.pop("places"),
        "probe_valid": found.pop("valid").astype(np.uint8),
        "occluders": surfaces.occluders(scene),
    }
    return {"probes": found, "files": {name: hand_over(scratch, name, array) for name, array in arrays.items()}}


def _surfaces(scene: bpy.types.Scene, question: dict[str, Any], scratch: Path, events: Events) -> dict[str, Any]:
    longest = max(math.sqrt(surfaces.area(scene) / question["cells"]), question.get("spacing") or 0.0)
    gloss: surfaces.Gloss = "diffuse" if question.get("gloss") else "none"
    if question.get("gloss") == "caustics" and not scene.cycles.caustics_reflective:
        gloss = "apart"
    found = surfaces.fragments(scene, longest, events, gloss)
    names = ("corners", "albedo", "transmission", "object", "transparent", "emission", "one_sided", "occluders", "gloss")
    return {
        "files": {name: hand_over(scratch, name, found[name]) for name in names if name in found},
        "surface_objects": found["names"],
        "bounces": min(scene.cycles.diffuse_bounces, scene.cycles.max_bounces),
    }


class Silent:
    """Drops warnings that were given before."""

    def warn(self, message: str) -> None:
        """Do nothing."""


def _size_by_density(scene: bpy.types.Scene, wanted: dict[str, Any], density: float, events: Events) -> dict[str, Any]:
    objects = prepare(scene, wanted.get("objects") or [wanted["object"]])
    world = sum(world_area(obj) for obj in objects)
    side = density * math.sqrt(world)  # as if the layer were full
    before = [{layer.name for layer in obj.data.uv_layers} for obj in objects]
    for i in range(ROUNDS):
        for obj, names in zip(objects, before, strict=True):
            for name in [layer.name for layer in obj.data.uv_layers if layer.name not in names]:
                obj.data.uv_layers.remove(obj.data.uv_layers[name])
        texels = max(1, math.ceil(side))
        layers, made = unwrap.choose_layers(
            objects, wanted.get("uv_layer"), texels, wanted.get("unwrap", "smart"), events if i == 0 else Silent()
        )
        area = sum(unwrap.uv_area(obj.data, layer) for obj, layer in zip(objects, layers, strict=True))
        side = density * math.sqrt(world / area)
        if not made:
            break
    return {"side": side, "world_area": world, "uv_area": area}
