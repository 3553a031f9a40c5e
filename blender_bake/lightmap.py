# SPDX-License-Identifier: GPL-3.0-or-later
"""A lightmap receiver: the texels of UV layers, of one object or of several in one atlas, baked by Cycles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from blender_bake import lobes, materials, precision, sample_spread, soundness, unwrap, world_normals
from blender_bake.channels import chosen
from blender_bake.ipc import Events, WorkerError
from blender_bake.receiver_objects import prepare, select
from blender_bake.request import RenderRequest
from blender_bake.seam_edges import seam_edges
from blender_bake.share import UV_LAYER, Share
from blender_bake.translucency import Switch, switched
from blender_bake.viewers import Viewers

NOT_DIFFUSE = 1e-3  # albedo below which a slot is not diffuse: Cycles divides irradiance by it
NORMAL_OFFSET = 1e-5  # Blender stores normals as n / 2 + 1/2 + this


class LightmapReceiver:
    """Mesh objects, their modifiers applied, whose texels share one atlas; arrays are (H, W, C) float32, row 0 at the top."""

    kind = "lightmap"
    renders = frozenset({"response", "direct", "indirect"})

    def __init__(self, scene: bpy.types.Scene, job: dict[str, Any], events: Events) -> None:
        self._scene = scene
        self._events = events
        self._irradiance = job["quantity"] == "irradiance"
        scene.render.bake.view_from = "ABOVE_SURFACE"
        self._height, self._width = job["height"], job["width"]
        self._apart = job.get("transport") == "indirect"
        self._viewers = Viewers(scene, job["viewers"]) if job.get("viewers") else None
        if self._viewers is not None:
            self.renders |= {"toward"}
        wanted = job["receiver"]
        self._objects = prepare(scene, wanted.get("objects") or [wanted["object"]])
        for obj in self._objects:
            soundness.require_visible(obj, events)
        soundness.warn_of_occluders(scene, {obj.name for obj in self._objects}, events)
        self._image = bpy.data.images.new("srbf bake", self._width, self._height, alpha=True, float_buffer=True)
        self._material_names = [[s.material.name if s.material else "(none)" for s in obj.material_slots] for obj in self._objects]
        for obj in self._objects:
            materials.bakeable_slots(obj, self._image)
        texels, method = min(self._width, self._height), wanted.get("unwrap", "smart")
        layers, self._made = unwrap.choose_layers(self._objects, wanted.get("uv_layer"), texels, method, events)
        self._layers = dict(zip([obj.name for obj in self._objects], layers, strict=True))
        for obj, layer in zip(self._objects, layers, strict=True):
            obj.data.uv_layers.active = obj.data.uv_layers[layer]  # the one that a bake goes by
        self._spread = True  # samples are jittered over the texel's footprint; False: the first is at its center
        self._small: dict[tuple[int, int], bpy.types.Image] = {}  # images of shares, by size
        self._whole_uvs: dict[str, np.ndarray] = {}  # (N, 2) by object, once a share is rendered
        self._owner = np.zeros(
            (self._height, self._width), np.int32
        )  # which object a covered texel belongs to: the last one that covers it
        self._albedo = np.zeros((self._height, self._width, 4), np.float32)
        for i, obj in enumerate(self._objects):
            self._take_texels(i, obj)
        self._coverage = self._albedo[:, :, 3:]
        self._check_overlap(self._made or wanted.get("uv_layer") is not None)
        precision.warn_of_objects(self._objects, int((self._coverage > 0).sum()), "texel", events)
        self._valid, self._albedo_read = self._coverage, self._albedo
        if self._irradiance:
            self._whiten_what_is_not_diffuse()

    def descriptions(self) -> list[dict[str, Any]]:
        """The manifest's entry of each object."""
        return [{"kind": "lightmap", "object": name, "uv_layer": layer} for name, layer in self._layers.items()]

    def facts(self) -> dict[str, Any]:
        """For dry run and log; where layers were made, their names and coordinates per loop, so that users can copy them into the scene."""
        facts: dict[str, Any] = {
            "polygons": sum(len(obj.data.polygons) for obj in self._objects),
            "covered_texels": int((self._coverage > 0).sum()),
        }
        if self._made:
            made = [
                {"object": obj.name, "uv_layer": self._layers[obj.name], "per_loop": unwrap.layer_coordinates(obj.data, layer).tolist()}
                for obj in self._objects
                for layer in (self._layers[obj.name],)
            ]
            facts["uv"] = {key: made[0][key] for key in ("uv_layer", "per_loop")} if len(made) == 1 else {"objects": made}
        return facts

    def sampling(self) -> dict[str, Any]:
        """`footprint`: side of the square within a texel that its samples are spread over, texels."""
        return {"footprint": 0.5 if bpy.app.version < (5, 0) else 1.0}

    def channels(self, names: list[str]) -> dict[str, np.ndarray]:
        """Those named of `position` (at texel centers), `normal`, `albedo`, `coverage`, masks `hit` and `valid`, `seams` (1, E, 8).

        Where gloss is kept: `glossy`, what it reflects of light along the normal, and `lobe`, its shape.
        """
        makers = {
            "position": self._position,
            "normal": self._normal,
            "albedo": lambda: self._albedo[:, :, :3],
            "coverage": lambda: self._coverage,
            "hit": lambda: self._coverage,
            "valid": lambda: self._valid,
            "seams": self._seams,
            "glossy": lambda: self._bake("GLOSSY", self._objects, 1, 0, pass_filter={"COLOR"})[:, :, :3] * self._coverage,
            "lobe": self._lobe,
        }
        return chosen(names, makers, self.kind)

    def _lobe(self) -> np.ndarray:
        """(roughness, share of the lobe with a Fresnel term, 1 where there is any)."""
        with lobes.emitted(slot.material for obj in self._objects for slot in obj.material_slots):
            return lobes.of_sums(self._bake("EMIT", self._objects, 1, 0)[:, :, :3] * self._coverage)

    def _position(self) -> np.ndarray:
        return self._bake("POSITION", self._objects, 1, 0)[:, :, :3] * self._coverage  # one sample lies at the texel's center

    def _normal(self) -> np.ndarray:
        encoded = self._bake("NORMAL", self._objects, 1, 0, normal_space="OBJECT")[:, :, :3]
        of_object = 2 * (encoded - NORMAL_OFFSET) - 1
        normal = np.empty_like(of_object)
        for i, obj in enumerate(self._objects):
            mine = self._owner == i
            normal[mine] = world_normals.of_bake(of_object[mine], obj)
        return normal * self._coverage

    def _seams(self) -> np.ndarray | None:
        edges = [seam_edges(obj.data, self._layers[obj.name], within_material=not self._irradiance) for obj in self._objects]
        seams = np.concatenate(edges)
        return seams[None] if len(seams) else None

    @contextmanager
    def part(self, share: Share) -> Iterator[None]:
        """Inside, bakes go to an image of every n-th texel, by UVs moved so that its texel centers are theirs; see `Share`.

        Samples are spread over a footprint that is as many texels wide as of a whole image, so n times as wide on the surface.
        """
        whole = self._image, self._width, self._height
        size = share.size(self._width, self._height)
        if size not in self._small:
            self._small[size] = bpy.data.images.new("srbf share", *size, alpha=True, float_buffer=True)
        for obj in self._objects:
            self._move_uvs(obj, share)
        self._image.user_remap(self._small[size])
        self._image, (self._width, self._height) = self._small[size], size
        self._spread = not share.at_centers
        try:
            yield
        finally:
            self._image.user_remap(whole[0])
            self._image, self._width, self._height = whole
            self._spread = True
            for obj in self._objects:
                obj.data.uv_layers.active = obj.data.uv_layers[self._layers[obj.name]]

    def _move_uvs(self, obj: bpy.types.Object, share: Share) -> None:
        """Make a layer of the object's moved UVs the active one, which a bake goes by; textures keep to theirs."""
        layers = obj.data.uv_layers
        uv = self._whole_uvs.get(obj.name)
        if uv is None:
            flat = np.empty(2 * len(obj.data.loops), np.float32)
            layers[self._layers[obj.name]].uv.foreach_get("vector", flat)
            uv = self._whole_uvs[obj.name] = flat.reshape(-1, 2).astype(np.float64)
            if layers.new(name=UV_LAYER, do_init=False) is None:
                raise WorkerError(
                    f"expected at most 7 UV layers of {obj.name!r} for a share of its texels, found {len(layers)}; "
                    "remove one that nothing uses, or bake without `share`"
                )
        moved = layers[UV_LAYER]
        moved.uv.foreach_set("vector", share.coordinates(uv, self._width, self._height).ravel())
        layers.active = moved

    def render(self, request: RenderRequest, switch: Switch | None) -> dict[str, np.ndarray]:
        """`response`, `direct` and `indirect` of the same seed: one is exactly part of the other. See `RenderRequest`."""
        images = {}
        if "response" in request.channels:
            images["response"] = self.response(request.samples, request.seed)
        if "direct" in request.channels:
            with switched(switch):
                images["direct"] = self.direct(request.samples, request.seed)
        if "indirect" in request.channels:
            images["indirect"] = self.indirect(request.samples, request.seed, switch)
        if "toward" in request.channels:
            images["toward"] = self.toward(request.samples, request.seed, switch)
        return images

    def response(self, samples: int, seed: int) -> np.ndarray:
        """Irradiance E = pi x Cycles' DIFFUSE without color, or radiance seen from straight above each texel."""
        if self._irradiance:
            return self._light("DIFFUSE", samples, seed, {"DIRECT", "INDIRECT"}) * np.float32(math.pi)
        every = {"DIRECT", "INDIRECT", "DIFFUSE", "GLOSSY", "TRANSMISSION", "EMIT"}
        return self._light("COMBINED", samples, seed, every)

    def direct(self, samples: int, seed: int) -> np.ndarray:
        """The direct diffuse light alone, in the units of `response`."""
        parts = {"DIRECT"} if self._irradiance else {"DIRECT", "COLOR"}
        scale = math.pi if self._irradiance else 1.0
        return self._light("DIFFUSE", samples, seed, parts) * np.float32(scale)

    def indirect(self, samples: int, seed: int, switch: Switch | None) -> np.ndarray:
        """What `direct` lacks of the response. Without translucent materials, irradiance takes one bake, not two."""
        if self._irradiance and not switch:
            return self._light("DIFFUSE", samples, seed, {"INDIRECT"}) * np.float32(math.pi)
        whole = self.response(samples, seed)
        with switched(switch):
            return whole - self.direct(samples, seed)

    def toward(self, samples: int, seed: int, switch: Switch | None) -> np.ndarray:
        """(H, W, 3 S): the radiance toward each viewer; of an indirect capture without the direct diffuse light, as seen from above."""
        assert self._viewers is not None
        views = self._viewers.images(lambda own: self.response(samples, own), seed)
        if self._apart:
            with switched(switch):
                views -= np.tile(self.direct(samples, seed), views.shape[2] // 3)
        return views

    def _light(self, kind: str, samples: int, seed: int, parts: set[str]) -> np.ndarray:
        return self._bake(kind, self._objects, samples, seed, spread=self._spread, pass_filter=parts)[:, :, :3]

    def _bake(
        self, kind: str, objects: list[bpy.types.Object], samples: int, seed: int, *, spread: bool = False, **options: Any
    ) -> np.ndarray:
        """(H, W, 4), its samples `spread` over the footprint, or the first of them at the texel's center."""
        select(objects)
        sample_spread.take(self._scene, samples, seed, spread=spread)
        try:
            result = bpy.ops.object.bake(
                type=kind,
                margin=0,
                use_clear=True,  # of several objects Blender clears none: uncovered texels keep the values of its last bake alone
                target="IMAGE_TEXTURES",
                save_mode="INTERNAL",
                use_selected_to_active=False,
                use_cage=False,
                use_split_materials=False,
                **options,
            )
        except RuntimeError as error:
            reason = str(error).replace("Error: ", "").strip().replace("\n", " ")
            raise WorkerError(f"Blender could not bake {self._names()}: {reason}") from error
        if result != {"FINISHED"}:
            raise WorkerError(f"Blender's bake of {self._names()} ended as {', '.join(result)}, without a reason")
        pixels = np.empty(self._height * self._width * 4, np.float32)
        self._image.pixels.foreach_get(pixels)
        # Blender's row 0 is the bottom: this is the one flip.
        return pixels.reshape(self._height, self._width, 4)[::-1]

    def _names(self) -> str:
        shown = ", ".join(repr(name) for name in list(self._layers)[:4])
        return shown + (f" and {len(self._layers) - 4} more" if len(self._layers) > 4 else "")

    def _take_texels(self, index: int, obj: bpy.types.Object) -> None:
        image = self._bake("DIFFUSE", [obj], 1, 0, pass_filter={"COLOR"})
        mine = image[:, :, 3] > 0
        if not mine.any():
            raise WorkerError(
                f"expected texels on UV layer {self._layers[obj.name]!r} of {obj.name!r}, found none at "
                f"{self._width}x{self._height}; check its UVs, or bake larger"
            )
        self._owner[mine] = index
        self._albedo[mine] = image[mine]

    def _check_overlap(self, made_or_named: bool) -> None:
        overlap = unwrap.overlap([(obj.data, self._layers[obj.name]) for obj in self._objects], self._coverage[:, :, 0])
        if overlap > unwrap.OVERLAP_LIMIT and made_or_named:
            layers = ", ".join(repr(layer) for layer in sorted(set(self._layers.values())))
            self._events.warn(f"UV layer {layers}: about {overlap:.0%} of its area overlaps, and overlapping faces share light")

    def _whiten_what_is_not_diffuse(self) -> None:
        """Replace each slot with no diffuse reflection (metal, glass, black) by white Lambert, so that its irradiance can be read."""
        names = []
        for obj, slots in zip(self._objects, self._material_names, strict=True):
            for i, albedo in unwrap.slot_maximum(obj, self._layers[obj.name], self._albedo).items():
                if albedo < NOT_DIFFUSE:
                    names.append(repr(slots[i]))
                    obj.material_slots[i].material = materials.whitened(obj.material_slots[i].material)
                    materials.add_target(obj.material_slots[i].material, self._image)
        if names:
            self._events.warn(
                f"nothing is diffuse in {', '.join(dict.fromkeys(names))}: its irradiance is taken on a white Lambert surface instead"
            )
            self._albedo_read = self._bake("DIFFUSE", self._objects, 1, 0, pass_filter={"COLOR"})
        black = (self._albedo_read[:, :, :3].max(axis=2) < NOT_DIFFUSE) & (self._coverage[:, :, 0] > 0)
        if black.any():
            self._valid = self._coverage * ~black[:, :, None]
            self._events.warn(
                f"{int(black.sum())} texels are black between diffuse ones: they take the irradiance of the nearest that is not"
            )
