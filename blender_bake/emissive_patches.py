# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of the surfaces that emit, one at a time: what a patch reflects diffusely when irradiance 1 falls on it."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np

from blender_bake.ipc import WorkerError

LIFT = 1e-4  # m, off the surface that it is a copy of; what is nearer than this to it cannot see it
LIFT_OF_EXTENT = 1e-5  # of the largest coordinate, at least: single precision
ATTRIBUTE = "srbf radiance"


class EmissivePatches:
    """An object of our own, thin and `lift` meters off the surfaces (by default 0.1 mm), with the mesh of the patch that emits.

    path: an .npz of T fragments: `corners` (T, 3, 3) in the world (m), wound so that the normal is on the side that emits, `albedo` (T, 3),
    `patch` (T,) from 0 on. The radiance is albedo / pi. Light passes through the object, from both sides and to what lies behind, so that
    the surface beneath reflects as before; cameras and shadow rays do not see it. WorkerError where the file cannot be read.
    """

    def __init__(self, scene: bpy.types.Scene, path: str | Path, lift: float | None = None) -> None:
        try:
            with np.load(path) as stored:
                corners, albedo, patch = (stored[key] for key in ("corners", "albedo", "patch"))
        except (OSError, ValueError, KeyError) as error:
            raise WorkerError(f"expected patches of the surfaces in {path}, found none to read: {error}; run the bake again") from error
        order = np.argsort(patch, kind="stable")
        self._corners, self._albedo = corners[order], albedo[order]
        self._lift = max(LIFT, LIFT_OF_EXTENT * float(np.abs(corners).max(initial=0))) if lift is None else lift
        self._starts = np.searchsorted(patch[order], np.arange(int(patch.max(initial=-1)) + 2))
        self._aimed: int | None = None
        self._material = _front_emission()
        self._object = bpy.data.objects.new("srbf patch", self._mesh(0, 0))
        self._object.visible_camera = self._object.visible_shadow = False
        self._object.hide_render = True
        self._object.hide_select = True
        scene.collection.objects.link(self._object)

    @property
    def count(self) -> int:
        """How many patches there are."""
        return len(self._starts) - 1

    def aim(self, patch: int | None) -> None:
        """Let one patch emit; None: none. WorkerError for one that there is not."""
        if patch == self._aimed:
            return
        if patch is not None and not 0 <= patch < self.count:
            raise WorkerError(f"expected a patch from 0 to {self.count - 1}, found {patch}; run the bake again")
        before = self._object.data
        self._object.data = self._mesh(0, 0) if patch is None else self._mesh(self._starts[patch], self._starts[patch + 1])
        self._object.hide_render = patch is None
        bpy.data.meshes.remove(before)
        self._aimed = patch

    def _mesh(self, start: int, end: int) -> bpy.types.Mesh:
        corners, albedo = self._corners[start:end].astype(np.float64), self._albedo[start:end]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        count = 3 * len(corners)
        mesh = bpy.data.meshes.new("srbf patch")
        mesh.vertices.add(count)
        mesh.loops.add(count)
        mesh.polygons.add(len(corners))
        mesh.vertices.foreach_set("co", (corners + self._lift * normals[:, None]).astype(np.float32).ravel())
        mesh.loops.foreach_set("vertex_index", np.arange(count, dtype=np.int32))
        mesh.polygons.foreach_set("loop_start", np.arange(0, count, 3, dtype=np.int32))
        radiance = np.ones((count, 4), np.float32)
        radiance[:, :3] = np.repeat(albedo / math.pi, 3, axis=0)
        mesh.attributes.new(ATTRIBUTE, "FLOAT_COLOR", "POINT").data.foreach_set("color", radiance.ravel())
        mesh.update(calc_edges=True)
        mesh.materials.append(self._material)
        return mesh


def _front_emission() -> bpy.types.Material:
    """Transparent, and on the front emission of the attribute's radiance."""
    material = bpy.data.materials.new("srbf patch")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    radiance = nodes.new("ShaderNodeAttribute")
    radiance.attribute_name = ATTRIBUTE
    front = nodes.new("ShaderNodeMath")
    front.operation = "SUBTRACT"
    front.inputs[0].default_value = 1.0
    links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[1])
    emission = nodes.new("ShaderNodeEmission")
    links.new(radiance.outputs["Color"], emission.inputs["Color"])
    links.new(front.outputs[0], emission.inputs["Strength"])
    both = nodes.new("ShaderNodeAddShader")
    links.new(emission.outputs[0], both.inputs[0])
    links.new(nodes.new("ShaderNodeBsdfTransparent").outputs[0], both.inputs[1])
    links.new(both.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    material.cycles.emission_sampling = "FRONT"
    return material
