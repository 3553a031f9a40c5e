# SPDX-License-Identifier: GPL-3.0-or-later
"""A receiver of probes: white facets at points of free space that face twelve ways and that no ray of others meets."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from blender_bake import materials
from blender_bake.channels import chosen
from blender_bake.ipc import Events, WorkerError
from blender_bake.receiver_objects import select
from blender_bake.vertices import ATTRIBUTE, VertexReceiver

SIZE = 1e-3  # of a facet, spacings
NAME = "srbf probes"
# Camera rays, which a bake does not trace, may see them: Cycles leaves out what none may.
UNSEEN = ("diffuse", "glossy", "transmission", "volume_scatter", "shadow")


class ProbeReceiver(VertexReceiver):
    """Irradiance at probes, on one small triangle for each of their normals; the columns of the images are facet X + x, the rows z Y + y.

    Nodes without a probe of their own have coverage 0. The job's receiver has `file`: counts (3,), spacing (m), places (N, 3), valid (N,)
    and normals (F, 3), and `described`, the manifest's entry.
    """

    kind = "probes"

    def __init__(self, scene: bpy.types.Scene, job: dict[str, Any], events: Events) -> None:
        self._scene, self._events = scene, events
        self._irradiance = True
        self._described = job["receiver"]["described"]
        with np.load(job["receiver"]["file"]) as stored:
            x, y, z = stored["counts"].tolist()
            places, valid, normals = stored["places"], stored["valid"], stored["normals"]
            size = SIZE * float(stored["spacing"])
        self._width, self._height = len(normals) * x, y * z
        if (job["width"], job["height"]) != (self._width, self._height):
            raise WorkerError(
                f"expected a size of {self._width}x{self._height} for {x}x{y}x{z} probes, found {job['width']}x{job['height']}; "
                "let the bake query the scene"
            )
        node = np.flatnonzero(valid)
        rows, columns = node // x, node % x
        self._texels = (rows[:, None] * self._width + np.arange(len(normals)) * x + columns[:, None]).ravel()  # of each facet
        self._places = np.repeat(places[node], len(normals), axis=0)
        self._normals = np.tile(normals, (len(node), 1)).astype(np.float32)
        self._count = len(self._texels)
        self._object = self._made(size)
        select([self._object])
        scene.render.bake.view_from = "ABOVE_SURFACE"
        self._corners = np.repeat(np.arange(self._count), 3)
        self._angles = np.ones(len(self._corners))
        self._valid = np.ones(len(self._corners), bool)

    def descriptions(self) -> list[dict[str, Any]]:
        """The manifest's entry of this receiver."""
        return [self._described]

    def facts(self) -> dict[str, Any]:
        """For dry run and log."""
        return {"facets": self._count}

    def channels(self, names: list[str]) -> dict[str, np.ndarray]:
        """Those named of `position`, `normal`, `albedo`, which is white, `coverage` and the masks `hit` and `valid`."""
        ones = np.ones((self._count, 1), np.float32)
        makers = {
            "position": lambda: self._image(self._places),
            "normal": lambda: self._image(self._normals),
            "albedo": lambda: self._image(ones.repeat(3, axis=1)),
            "coverage": lambda: self._image(ones),
            "hit": lambda: self._image(ones),
            "valid": lambda: self._image(ones),
            "seams": lambda: None,
        }
        return chosen(names, makers, self.kind)

    def _image(self, values: np.ndarray) -> np.ndarray:
        """(F, C) of the facets as (H, W, C), 0 elsewhere."""
        image = np.zeros((self._height * self._width, values.shape[1]), np.float32)
        image[self._texels] = values
        return image.reshape(self._height, self._width, -1)

    def _made(self, size: float) -> bpy.types.Object:
        """The facets as one object, in order; their fronts face along the normals."""
        across = np.cross(self._normals, np.where(np.abs(self._normals[:, :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0]))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        along = np.cross(self._normals, across)
        turns = 2 * np.pi / 3 * np.arange(3)
        ring = np.cos(turns)[:, None] * across[:, None] + np.sin(turns)[:, None] * along[:, None]  # (F, 3, 3), counterclockwise
        corners = self._places[:, None] + size * ring
        mesh = bpy.data.meshes.new(NAME)
        mesh.vertices.add(3 * self._count)
        mesh.vertices.foreach_set("co", np.ascontiguousarray(corners, np.float32).ravel())
        mesh.loops.add(3 * self._count)
        mesh.loops.foreach_set("vertex_index", np.arange(3 * self._count, dtype=np.int32))
        mesh.polygons.add(self._count)
        mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * self._count, 3, dtype=np.int32))
        mesh.update(calc_edges=True)
        mesh.materials.append(materials.lambert((1, 1, 1)))
        mesh.color_attributes.new(ATTRIBUTE, "FLOAT_COLOR", "CORNER")
        mesh.color_attributes.active_color = mesh.color_attributes[ATTRIBUTE]
        made = bpy.data.objects.new(NAME, mesh)
        for ray in UNSEEN:
            setattr(made, f"visible_{ray}", False)
        self._scene.collection.objects.link(made)
        bpy.context.view_layer.update()
        return made
