# SPDX-License-Identifier: GPL-3.0-or-later
"""A vertex receiver: the vertices of a mesh object, baked by Cycles into a color attribute, as a list of points."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from blender_bake import lobes, materials, precision, soundness, world_normals
from blender_bake.channels import chosen
from blender_bake.ipc import Events, WorkerError
from blender_bake.receiver_objects import prepare, select
from blender_bake.request import RenderRequest
from blender_bake.translucency import Switch
from blender_bake.viewers import Viewers

NOT_DIFFUSE = 1e-3
ATTRIBUTE = "srbf bake"
ROW = 1024  # points per row of the images, at most


def image_size(count: int) -> tuple[int, int]:
    """(width, height) of the image that lists `count` points."""
    width = max(1, min(count, ROW))
    return width, max(1, -(-count // width))


def texel_middles(mesh: bpy.types.Mesh) -> np.ndarray:
    """(loops, 2) where each corner's vertex is in the image that lists them, v up."""
    width, height = image_size(len(mesh.vertices))
    vertices = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    row, column = np.divmod(vertices, width)
    return np.stack([(column + 0.5) / width, 1 - (row + 0.5) / height], axis=1).astype(np.float32)


class VertexReceiver:
    """The vertices of one mesh object, its modifiers applied, in vertex order along the rows; arrays are (H, W, C) float32.

    Cycles bakes every corner of every face, just inside it; a vertex has the mean of its corners weighted by their angles, as its normal
    does, which does not depend on how its faces are divided. Corners with nothing diffuse do not count towards irradiance. Vertices
    without a face, and the padding of the last row, have coverage 0.
    """

    kind = "vertices"
    renders = frozenset({"response", "direct", "indirect"})

    def __init__(self, scene: bpy.types.Scene, job: dict[str, Any], events: Events) -> None:
        self._scene = scene
        self._events = events
        self._irradiance = job["quantity"] == "irradiance"
        scene.render.bake.view_from = "ABOVE_SURFACE"
        objects = prepare(scene, [job["receiver"]["object"]])
        if len(objects) > 1:
            raise WorkerError(f"expected one object's vertices, found {len(objects)} objects in {job['receiver']['object']!r}; name one")
        self._object = objects[0]
        soundness.require_visible(self._object, events)
        soundness.warn_of_occluders(scene, {self._object.name}, events)
        precision.warn_of_objects(objects, len(self._object.data.vertices), "vertex's share", events)
        mesh = self._object.data
        self._count = len(mesh.vertices)
        self._width, self._height = job["width"], job["height"]
        if (self._width, self._height) != image_size(self._count):
            width, height = image_size(self._count)
            raise WorkerError(
                f"expected a size of {width}x{height} for the {self._count} vertices of {self._object.name!r}, found "
                f"{self._width}x{self._height}; let the bake query the scene"
            )
        for attribute in [a for a in mesh.color_attributes if a.name == ATTRIBUTE]:
            mesh.color_attributes.remove(attribute)
        mesh.color_attributes.new(ATTRIBUTE, "FLOAT_COLOR", "CORNER")
        mesh.color_attributes.active_color = mesh.color_attributes[ATTRIBUTE]
        select([self._object])
        self._apart = job.get("transport") == "indirect"
        self._viewers = Viewers(scene, job["viewers"]) if job.get("viewers") else None
        if self._viewers is not None:
            self.renders |= {"toward"}
        self._corners = np.empty(len(mesh.loops), np.int32)  # (C,) vertex of each corner
        mesh.loops.foreach_get("vertex_index", self._corners)
        self._angles = corner_angles(mesh, self._object.matrix_world)
        self._valid = np.ones(len(self._corners), bool)
        albedo = self._bake("DIFFUSE", 1, 0, pass_filter={"COLOR"})
        self._albedo = self._of_vertices(albedo)
        if self._irradiance:
            self._whiten_what_is_not_diffuse(albedo)

    def descriptions(self) -> list[dict[str, Any]]:
        """The manifest's entry of this receiver."""
        return [{"kind": "vertices", "object": self._object.name, "count": self._count}]

    def facts(self) -> dict[str, Any]:
        """For dry run and log."""
        return {"polygons": len(self._object.data.polygons), "vertices": self._count}

    def sampling(self) -> dict[str, Any]:
        """Nothing: points have no footprint for rays to spread over."""
        return {}

    def channels(self, names: list[str]) -> dict[str, np.ndarray]:
        """Those named of `position`, `normal` (as the mesh has them), `albedo`, `coverage` and the masks `hit` and `valid`.

        Where gloss is kept: `glossy`, what it reflects of light along the normal, and `lobe`, its shape.
        """
        faced = (np.bincount(self._corners, minlength=self._count) > 0)[:, None]
        makers = {
            "position": lambda: self._image(self._position() * faced),
            "normal": lambda: self._image(self._normal() * faced),
            "albedo": lambda: self._image(self._albedo),
            "coverage": lambda: self._image(faced),
            "hit": lambda: self._image(faced),
            "valid": lambda: self._image((np.bincount(self._corners, self._valid, self._count) > 0)[:, None]),
            "seams": lambda: None,
            "glossy": lambda: self._image(self._of_vertices(self._bake("GLOSSY", 1, 0, pass_filter={"COLOR"}))),
            "lobe": lambda: self._image(self._lobe()),
        }
        return chosen(names, makers, self.kind)

    def _lobe(self) -> np.ndarray:
        """(roughness, share of the lobe with a Fresnel term, 1 where there is any)."""
        with lobes.emitted(slot.material for slot in self._object.material_slots):
            return lobes.of_sums(self._of_vertices(self._bake("EMIT", 1, 0)))

    def _position(self) -> np.ndarray:
        points = np.empty(self._count * 3, np.float32)
        self._object.data.vertices.foreach_get("co", points)
        matrix = np.array(self._object.matrix_world)
        return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]

    def _normal(self) -> np.ndarray:
        normals = np.empty(self._count * 3, np.float32)
        self._object.data.vertex_normals.foreach_get("vector", normals)
        return world_normals.of_mesh(normals.reshape(-1, 3), np.array(self._object.matrix_world)[:3, :3])

    def render(self, request: RenderRequest, switch: Switch | None) -> dict[str, np.ndarray]:
        """The `response`, its `direct` part, or the `indirect` one; see `RenderRequest`."""
        samples, seed = request.samples, request.seed
        make = {"response": self.response, "direct": self.direct, "indirect": self.indirect, "toward": self.toward}
        return {name: make[name](samples, seed) for name in request.channels}

    def response(self, samples: int, seed: int) -> np.ndarray:
        """Irradiance E = pi x Cycles' DIFFUSE without color, or radiance seen from straight above each face."""
        if self._irradiance:
            corners = self._bake("DIFFUSE", samples, seed, pass_filter={"DIRECT", "INDIRECT"}) * np.float32(math.pi)
        else:
            every = {"DIRECT", "INDIRECT", "DIFFUSE", "GLOSSY", "TRANSMISSION", "EMIT"}
            corners = self._bake("COMBINED", samples, seed, pass_filter=every)
        return self._image(self._of_vertices(corners))

    def direct(self, samples: int, seed: int) -> np.ndarray:
        """The direct diffuse light alone, in the units of `response`."""
        parts, scale = ({"DIRECT"}, math.pi) if self._irradiance else ({"DIRECT", "COLOR"}, 1.0)
        return self._image(self._of_vertices(self._bake("DIFFUSE", samples, seed, pass_filter=parts) * np.float32(scale)))

    def indirect(self, samples: int, seed: int) -> np.ndarray:
        """The response without the direct diffuse light, in its units."""
        if self._irradiance:
            corners = self._bake("DIFFUSE", samples, seed, pass_filter={"INDIRECT"}) * np.float32(math.pi)
        else:
            every = {"DIRECT", "INDIRECT", "DIFFUSE", "GLOSSY", "TRANSMISSION", "EMIT"}
            corners = self._bake("COMBINED", samples, seed, pass_filter=every)
            corners = corners - self._bake("DIFFUSE", samples, seed, pass_filter={"DIRECT", "COLOR"})
        return self._image(self._of_vertices(corners))

    def toward(self, samples: int, seed: int) -> np.ndarray:
        """(H, W, 3 S): the radiance toward each viewer; of an indirect capture without the direct diffuse light, as seen from above."""
        assert self._viewers is not None
        views = self._viewers.images(lambda own: self.response(samples, own), seed)
        if self._apart:  # a point light's direct light has no noise at a point
            views -= np.tile(self.direct(samples, seed), views.shape[2] // 3)
        return views

    def _of_vertices(self, corners: np.ndarray) -> np.ndarray:
        """(V, 3) means over each vertex's valid corners (C, 3), by angle."""
        weight = self._angles * self._valid
        total = np.maximum(np.bincount(self._corners, weight, self._count), 1e-20)
        return np.stack([np.bincount(self._corners, weight * corners[:, c], self._count) / total for c in range(3)], axis=1)

    def _image(self, values: np.ndarray) -> np.ndarray:
        """(V, C) along the rows of (H, W, C), zeros after the last."""
        image = np.zeros((self._height * self._width, values.shape[1]), np.float32)
        image[: self._count] = values
        return image.reshape(self._height, self._width, -1)

    def _bake(self, kind: str, samples: int, seed: int, **options: Any) -> np.ndarray:
        """(C, 3) colors of the corners."""
        self._scene.cycles.samples = samples
        self._scene.cycles.seed = seed
        try:
            result = bpy.ops.object.bake(
                type=kind, target="VERTEX_COLORS", use_clear=True, margin=0, use_selected_to_active=False, use_cage=False, **options
            )
        except RuntimeError as error:
            reason = str(error).replace("Error: ", "").strip().replace("\n", " ")
            raise WorkerError(f"Blender could not bake the vertices of {self._object.name!r}: {reason}") from error
        if result != {"FINISHED"}:
            raise WorkerError(f"Blender's bake of the vertices of {self._object.name!r} ended as {', '.join(result)}, without a reason")
        colors = np.empty(len(self._corners) * 4, np.float32)
        self._object.data.color_attributes[ATTRIBUTE].data.foreach_get("color", colors)
        return colors.reshape(-1, 4)[:, :3]

    def _whiten_what_is_not_diffuse(self, albedo: np.ndarray) -> None:
        """Replace each slot with no diffuse reflection by white Lambert, so that its irradiance can be read; skip single black corners."""
        mesh, slots = self._object.data, self._object.material_slots
        if slots:
            of_faces, corners_of_faces = np.empty(len(mesh.polygons), np.int32), np.empty(len(mesh.polygons), np.int32)
            mesh.polygons.foreach_get("material_index", of_faces)
            mesh.polygons.foreach_get("loop_total", corners_of_faces)
            of_corners = np.repeat(np.clip(of_faces, 0, len(slots) - 1), corners_of_faces)
            names = []
            for i in np.unique(of_corners):
                if albedo[of_corners == i].max() < NOT_DIFFUSE:
                    names.append(repr(slots[i].material.name if slots[i].material else "(none)"))
                    slots[i].material = materials.whitened(slots[i].material.copy() if slots[i].material else None)
            if names:
                self._events.warn(f"nothing is diffuse in {', '.join(names)}: its irradiance is taken on a white Lambert surface instead")
                albedo = self._bake("DIFFUSE", 1, 0, pass_filter={"COLOR"})
        self._valid = albedo.max(axis=1) >= NOT_DIFFUSE
        dark = int((np.bincount(self._corners, self._valid, self._count) == 0).sum())
        if dark:
            self._events.warn(f"{dark} vertices have nothing diffuse around them: they take the irradiance of the nearest in the list")


def corner_angles(mesh: bpy.types.Mesh, matrix: Any) -> np.ndarray:
    """(C,) angle in the world between the two edges that meet at each face corner, rad."""
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    vertices = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    world = (points.reshape(-1, 3) @ np.array(matrix.to_3x3(), np.float64).T)[vertices]
    first, total = np.empty(len(mesh.polygons), np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", first)
    mesh.polygons.foreach_get("loop_total", total)
    corner = np.arange(len(vertices))
    first, total = np.repeat(first, total), np.repeat(total, total)
    after, before = (world[first + (corner - first + step) % total] - world for step in (1, -1))
    cross = np.linalg.norm(np.cross(after, before), axis=1)
    return np.arctan2(cross, (after * before).sum(axis=1))
