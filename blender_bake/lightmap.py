# SPDX-License-Identifier: GPL-3.0-or-later
"""A lightmap receiver: the texels of an object's UV layer, baked by Cycles."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from blender_bake import materials, unwrap
from blender_bake.channel import Channel, WorkerError
from blender_bake.seam_edges import seam_edges
from blender_bake.translucency import Switch

NOT_DIFFUSE = 1e-3  # an albedo below this everywhere on a slot leaves Cycles nothing to divide irradiance by
NORMAL_OFFSET = 1e-5  # Blender stores normals as n / 2 + 1/2 + this


class LightmapReceiver:
    """One mesh object, its modifiers applied, its texels answering lights; arrays are (H, W, C) float32, row 0 at the top."""

    def __init__(self, scene: bpy.types.Scene, job: dict[str, Any], channel: Channel) -> None:
        self._scene = scene
        self._channel = channel
        self._irradiance = job["quantity"] == "irradiance"
        scene.render.bake.view_from = "ABOVE_SURFACE"
        self._height, self._width = job["height"], job["width"]
        self._object = find_mesh_object(scene, job["receiver"]["object"])
        apply_modifiers(self._object)
        _only_selected(self._object)
        self._image = bpy.data.images.new("srbf bake", self._width, self._height, alpha=True, float_buffer=True)
        self._material_names = [slot.material.name if slot.material else "(none)" for slot in self._object.material_slots]
        materials.bakeable_slots(self._object, self._image)
        self._uv_layer, made = unwrap.choose_layer(self._object, job["receiver"].get("uv_layer"), min(self._width, self._height), channel)
        self._albedo = self._bake("DIFFUSE", 1, 0, pass_filter={"COLOR"})
        self._coverage = self._albedo[:, :, 3:]
        self._check_coverage(made or job["receiver"].get("uv_layer") is not None)
        self._readable, self._albedo_read = self._coverage, self._albedo
        if self._irradiance:
            self._whiten_what_is_not_diffuse()
        self._made_layer = made

    def description(self) -> dict[str, Any]:
        """What the manifest says of this receiver."""
        return {"kind": "lightmap", "object": self._object.name, "uv_layer": self._uv_layer}

    def facts(self) -> dict[str, Any]:
        """For the dry run and the log; where a layer was made, its name and its coordinates per loop, to carry into one's own scene."""
        facts: dict[str, Any] = {
            "polygons": len(self._object.data.polygons),
            "covered_texels": int((self._coverage > 0).sum()),
        }
        if self._made_layer:
            facts["made_uv_layer"] = self._uv_layer
            facts["uv"] = unwrap.layer_coordinates(self._object.data, self._uv_layer).tolist()
        return facts

    def sampling(self) -> dict[str, Any]:
        """The side of the square within a texel that its samples spread over."""
        return {"footprint": 0.5 if bpy.app.version < (5, 0) else 1.0}

    def geometry(self) -> dict[str, np.ndarray]:
        """World position at texel centres, world normal, albedo and coverage; (1, E, 8) `seams` where the layer has any."""
        position = self._bake("POSITION", 1, 0)[:, :, :3]  # one sample stands on the texel centre; more would be summed
        encoded = self._bake("NORMAL", 1, 0, normal_space="OBJECT")[:, :, :3]
        normal = (2 * (encoded - NORMAL_OFFSET) - 1) @ np.array(self._object.matrix_world.to_3x3().inverted_safe(), np.float32)
        normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-20)
        covered = self._coverage
        seams = seam_edges(self._object.data, self._uv_layer, within_material=not self._irradiance)
        return {
            "position": position * covered,
            "normal": normal * covered,
            "albedo": self._albedo[:, :, :3],
            "coverage": covered,
            "readable": self._readable,
            "hit": covered,
            **({"seams": seams[None]} if len(seams) else {}),
        }

    def answer(self, samples: int, seed: int) -> np.ndarray:
        """Irradiance E = pi x Cycles' DIFFUSE without colour, or radiance seen from straight above each texel."""
        if self._irradiance:
            return self._bake("DIFFUSE", samples, seed, pass_filter={"DIRECT", "INDIRECT"})[:, :, :3] * np.float32(math.pi)
        every = {"DIRECT", "INDIRECT", "DIFFUSE", "GLOSSY", "TRANSMISSION", "EMIT"}
        return self._bake("COMBINED", samples, seed, pass_filter=every)[:, :, :3]

    def answers(self, samples: int, seed: int, translucent: Switch) -> tuple[np.ndarray, np.ndarray]:
        """(`answer`, the direct diffuse light in it with `translucent` on): same seed, so that one is exactly part of the other."""
        whole = self.answer(samples, seed)
        translucent.on()
        part = self.direct(samples, seed)
        translucent.off()
        return whole, part

    def direct(self, samples: int, seed: int) -> np.ndarray:
        """The direct diffuse light alone, in the units of `answer`."""
        parts = {"DIRECT"} if self._irradiance else {"DIRECT", "COLOR"}
        scale = math.pi if self._irradiance else 1.0
        return self._bake("DIFFUSE", samples, seed, pass_filter=parts)[:, :, :3] * np.float32(scale)

    def _bake(self, kind: str, samples: int, seed: int, **options: Any) -> np.ndarray:
        self._scene.cycles.samples = samples
        self._scene.cycles.seed = seed
        try:
            result = bpy.ops.object.bake(
                type=kind,
                margin=0,
                use_clear=True,
                target="IMAGE_TEXTURES",
                save_mode="INTERNAL",
                use_selected_to_active=False,
                use_cage=False,
                use_split_materials=False,
                uv_layer=self._uv_layer,
                **options,
            )
        except RuntimeError as error:
            reason = str(error).replace("Error: ", "").strip().replace("\n", " ")
            raise WorkerError(f"Blender could not bake {self._object.name!r}: {reason}") from error
        if result != {"FINISHED"}:
            raise WorkerError(f"Blender's bake of {self._object.name!r} ended as {', '.join(result)}, without a reason")
        pixels = np.empty(self._height * self._width * 4, np.float32)
        self._image.pixels.foreach_get(pixels)
        # Blender's row 0 is the bottom: this is the one flip.
        return pixels.reshape(self._height, self._width, 4)[::-1]

    def _check_coverage(self, made_or_named: bool) -> None:
        if not self._coverage.any():
            raise WorkerError(
                f"expected texels on UV layer {self._uv_layer!r} of {self._object.name!r}, found none at "
                f"{self._width}x{self._height}; check its UVs, or bake larger"
            )
        overlap = unwrap.overlap(self._object.data, self._uv_layer, self._coverage[:, :, 0])
        if overlap > unwrap.OVERLAP_LIMIT and made_or_named:
            self._channel.warn(f"UV layer {self._uv_layer!r}: about {overlap:.0%} of its area overlaps, and overlapping faces share light")

    def _whiten_what_is_not_diffuse(self) -> None:
        """Replace each slot with no diffuse reflection (metal, glass, black) by white Lambert, so that its irradiance can be read."""
        largest = unwrap.slot_maximum(self._object, self._uv_layer, self._albedo)
        names = []
        for i, albedo in largest.items():
            if albedo < NOT_DIFFUSE:
                slot = self._object.material_slots[i]
                names.append(repr(self._material_names[i]))
                slot.material = materials.lambert((1, 1, 1))
                materials.add_target(slot.material, self._image)
        if names:
            self._channel.warn(f"nothing is diffuse in {', '.join(names)}: its irradiance is taken on a white Lambert surface instead")
            self._albedo_read = self._bake("DIFFUSE", 1, 0, pass_filter={"COLOR"})
        black = (self._albedo_read[:, :, :3].max(axis=2) < NOT_DIFFUSE) & (self._coverage[:, :, 0] > 0)
        if black.any():
            self._readable = self._coverage * ~black[:, :, None]
            self._channel.warn(
                f"{int(black.sum())} texels are black between diffuse ones: they take the irradiance of the nearest that is not"
            )


def find_mesh_object(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """The object `name` of the scene, made local and visible; WorkerError says what else there is."""
    obj = scene.objects.get(name)
    if obj is None:
        meshes = sorted(o.name for o in scene.objects if o.type == "MESH")
        shown = ", ".join(repr(n) for n in meshes[:12]) + (", …" if len(meshes) > 12 else "")
        raise WorkerError(f"expected an object {name!r} in scene {scene.name!r}, found none; its meshes are {shown or 'none'}")
    if obj.type != "MESH":
        raise WorkerError(
            f"expected a mesh object, found {name!r} of type {obj.type}; a curve or text: Object > Convert > Mesh, and save the .blend"
        )
    if obj.hide_render:
        raise WorkerError(f"expected {name!r} to be renderable, found it disabled in renders; enable its camera icon and save the .blend")
    if obj.library or obj.override_library:
        obj.make_local()
    obj.hide_viewport = False
    obj.hide_select = False
    obj.hide_set(False)
    if not obj.visible_get():
        raise WorkerError(f"expected {name!r} to be visible, found its collection excluded or hidden; show it and save the .blend")
    return obj


def apply_modifiers(obj: bpy.types.Object) -> None:
    """Put the evaluated mesh, at render settings, in place of the object's data: every bake would evaluate it again."""
    for modifier in obj.modifiers:
        modifier.show_viewport = modifier.show_render
        if modifier.type in {"SUBSURF", "MULTIRES"}:
            modifier.levels = modifier.render_levels
    depsgraph = bpy.context.evaluated_depsgraph_get()
    _realise_instances(obj, depsgraph)
    mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph)
    obj.modifiers.clear()
    obj.data = mesh
    if not mesh.polygons:
        raise WorkerError(f"expected faces to bake on {obj.name!r}, found a mesh without any")


def _realise_instances(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
    """Objects that the modifiers or particles of `obj` scatter stay as objects of their own when those are gone."""
    meshes: dict[str, bpy.types.Mesh] = {}
    for instance in depsgraph.object_instances:
        source = instance.object
        if not (instance.is_instance and instance.parent and instance.parent.original == obj and source.type == "MESH"):
            continue
        key = source.data.name_full
        if key not in meshes:
            meshes[key] = bpy.data.meshes.new_from_object(source, preserve_all_data_layers=True, depsgraph=depsgraph)
        copy = bpy.data.objects.new(f"{obj.name} instance", meshes[key])
        copy.matrix_world = instance.matrix_world.copy()
        bpy.context.scene.collection.objects.link(copy)


def _only_selected(obj: bpy.types.Object) -> None:
    for other in bpy.context.view_layer.objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
