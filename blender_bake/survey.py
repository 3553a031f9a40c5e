# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake must know of the scene before it is planned: which objects are asked for, and how many texels they take."""

from __future__ import annotations

import math
from typing import Any

import bpy

from blender_bake import point_grid, unwrap, vertices
from blender_bake.channel import Channel
from blender_bake.frame import Frame
from blender_bake.receiver_objects import meshes_of, prepare, world_area

ROUNDS = 4  # a layer's gutter shrinks as its size grows: so often is one laid out for the size that the one before it asked for


def response(scene: bpy.types.Scene, job: dict[str, Any], channel: Channel, frame: Frame) -> dict[str, Any]:
    """The facts that `job["survey"]` asks for.

    collections: names            -> `objects`: the receivers in them, in order of name
    vertices: true                -> `width`, `height`: of the image that lists the receiver's vertices
    texels_per_meter: density D   -> `side`: texels a side, D sqrt(area in the world / area of the UV layer), not rounded; and both areas
    frame: true                   -> `frame`: the aspect of the camera's picture in the scene's own render settings, see `Frame.record`
    points: {spacing, box, random, seed} -> `points`: where lamps may stand, see `point_grid.survey`
    """
    asked = job["survey"]
    facts: dict[str, Any] = {}
    if asked.get("collections"):
        facts["objects"] = list(dict.fromkeys(name for c in asked["collections"] for name in meshes_of(scene, c, channel)))
    if asked.get("vertices"):
        counts = [len(obj.data.vertices) for obj in prepare(scene, [job["receiver"]["object"]])]
        facts["width"], facts["height"] = vertices.image_size(sum(counts))
    if asked.get("texels_per_meter"):
        facts |= _size_by_density(scene, job, asked["texels_per_meter"], channel)
    if asked.get("frame"):
        facts["frame"] = frame.record()
    if asked.get("points"):
        facts["points"] = point_grid.survey(scene, asked["points"])
    return facts


class Silent:
    """A channel for what was said before."""

    def warn(self, message: str) -> None:
        """Say nothing."""


def _size_by_density(scene: bpy.types.Scene, job: dict[str, Any], density: float, channel: Channel) -> dict[str, Any]:
    wanted = job["receiver"]
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
            objects, wanted.get("uv_layer"), texels, wanted.get("unwrap", "smart"), channel if i == 0 else Silent()
        )
        area = sum(unwrap.uv_area(obj.data, layer) for obj, layer in zip(objects, layers, strict=True))
        side = density * math.sqrt(world / area)
        if not made:
            break
    return {"side": side, "world_area": world, "uv_area": area}
