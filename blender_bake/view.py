# SPDX-License-Identifier: GPL-3.0-or-later
"""A view receiver: the pixels of a fixed camera (perspective, orthographic or panoramic), rendered by Cycles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_bake import elsewhere, lobes, materials, precision, sample_spread, soundness
from blender_bake.channels import chosen
from blender_bake.denoise import Denoiser
from blender_bake.exr import read_passes
from blender_bake.ipc import Events, WorkerError
from blender_bake.reflected import lets_light_through, reflection_alone
from blender_bake.request import RenderRequest
from blender_bake.share import Share
from blender_bake.translucency import Switch, switched

GEOMETRY_FILTER = 0.01  # pixels: one sample so close to the center that its position reprojects onto it
NOT_DIFFUSE = 1e-3
LEAST_TRANSMISSION = 1e-3  # of a pixel: less is rounding of two renders
LIGHT_PASSES = ("Combined", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color")
DIRECT_PASSES = ("Diffuse Direct", "Diffuse Color")
GLOSS_PASSES = ("Glossy Direct", "Glossy Color")


class ViewReceiver:
    """The pixels of one camera; arrays are (H, W, C) float32, row 0 at the top, unpremultiplied."""

    kind = "view"
    renders = frozenset({"response", "direct", "indirect", "denoised"})

    def __init__(self, scene: bpy.types.Scene, job: dict[str, Any], events: Events) -> None:
        self._scene = scene
        self._events = events
        self._irradiance = job["quantity"] == "irradiance"
        self._file = Path(job["scratch"]) / "view.exr"
        self._camera = find_camera(scene, job["receiver"].get("camera"))
        self._layer = bpy.context.view_layer
        self._coverage_samples = job["coverage_samples"]
        self._measured_passes: dict[str, np.ndarray] | None = None
        self._gloss = GLOSS_PASSES if job.get("direct_gloss") else ()  # passes: of light that gloss reflects directly
        self._last: dict[str, np.ndarray] = {}
        self._centers: dict[str, np.ndarray] | None = None  # position, normal and hit
        self._denoiser: Denoiser | None = None
        self._share: Share | None = None
        self._scratch = Path(job["scratch"])
        soundness.warn_of_occluders(scene, set(), events)
        soundness.warn_of_hidden(scene, events)
        self._prepare(job["width"], job["height"])
        if self._irradiance:
            self._whiten_if_nothing_is_diffuse(events)

    def descriptions(self) -> list[dict[str, Any]]:
        """The manifest's entry of this receiver."""
        return [{"kind": "view", "camera": self._camera.name}]

    def facts(self) -> dict[str, Any]:
        """For dry run, log and depth-based shaders: the camera's kind and pose."""
        data = self._camera.data
        return {
            "camera": {
                "type": data.type,
                "matrix_world": [list(row) for row in self._camera.matrix_world],
                "frame": [list(corner) for corner in data.view_frame(scene=self._scene)],
                "angle_x": data.angle_x,
                "ortho_scale": data.ortho_scale,
                "shift": [data.shift_x, data.shift_y],
            }
        }

    def sampling(self) -> dict[str, Any]:
        """`camera`: what rays need to sample the pixels as Cycles does; empty for depth of field and panoramas."""
        data = self._camera.data
        if data.type not in {"PERSP", "ORTHO"} or data.dof.use_dof:
            return {}
        return {
            "camera": {
                "type": data.type,
                "matrix_world": [list(row) for row in self._camera.matrix_world],
                "frame": [list(corner) for corner in data.view_frame(scene=self._scene)],
                "filter": self._scene.cycles.pixel_filter_type,
                "filter_width": self._scene.cycles.filter_width,
            }
        }

    def channels(self, names: list[str]) -> dict[str, np.ndarray]:
        """Those named of `position` and `normal` (at pixel centers, with the mask `hit`), `albedo`, `coverage` and the mask `valid`.

        Where gloss is kept: `glossy`, what the specular lobe reflects toward the camera, and its shape, `lobe`; `transmission`, what
        surfaces in view let through diffusely, of scenes with such materials.
        """
        makers = {
            "position": self._position,
            "normal": lambda: self._at_centers()["normal"],
            "albedo": self._albedo,
            "coverage": self._measured_coverage,
            "hit": lambda: self._at_centers()["hit"],
            "valid": self._measured_coverage,
            "seams": lambda: None,
            "glossy": lambda: self._measured("Glossy Color"),
            "lobe": self._lobe,
            "transmission": self._transmission,
        }
        return chosen(names, makers, self.kind)

    def _position(self) -> np.ndarray:
        center = self._at_centers()
        precision.warn_of_pixels(center["position"], center["hit"], self._events)
        return center["position"]

    def _albedo(self) -> np.ndarray:
        return self._measured("Diffuse Color")

    def _measured(self, name: str) -> np.ndarray:
        """A color by many samples of what is covered."""
        coverage = self._measured_coverage()
        return self._materials()[name][:, :, :3] / np.where(coverage > 0, coverage, 1)

    def _lobe(self) -> np.ndarray:
        """(roughness, share of the lobe with a Fresnel term, 1 where there is any)."""
        return lobes.of_sums(self._materials()[lobes.AOV][:, :, :3])

    def _transmission(self) -> np.ndarray | None:
        """The diffuse color of whole materials less that of their reflection; None where no material lets light through."""
        if not any(lets_light_through(material) for material in bpy.data.materials):
            return None
        coverage = self._measured_coverage()
        whole = self._render(self._coverage_samples, 0, ("Diffuse Color",))["Diffuse Color"][:, :, :3]
        reflected = self._materials()["Diffuse Color"][:, :, :3]
        found = np.maximum(whole - reflected, 0) / np.where(coverage > 0, coverage, 1)
        return np.where(found.max(axis=2, keepdims=True) > LEAST_TRANSMISSION, found, 0) if found.max() > LEAST_TRANSMISSION else None

    def _at_centers(self) -> dict[str, np.ndarray]:
        """`position` (m), unit `normal` and `hit` (1 or 0) at pixel centers, all 0 where there is no hit; rendered once."""
        if self._centers is None:
            cycles, lens = self._scene.cycles, self._camera.data.dof
            before = cycles.pixel_filter_type, cycles.filter_width, lens.use_dof
            cycles.pixel_filter_type, cycles.filter_width, lens.use_dof = "BLACKMAN_HARRIS", GEOMETRY_FILTER, False
            center = self._render(1, 0, ("Combined", "Position", "Normal"), spread=False)
            cycles.pixel_filter_type, cycles.filter_width, lens.use_dof = before
            hit = (center["Combined"][:, :, 3:] > 0).astype(np.float32)
            normal = center["Normal"] / np.maximum(np.linalg.norm(center["Normal"], axis=2, keepdims=True), 1e-20)
            self._centers = {"position": center["Position"] * hit, "normal": normal * hit, "hit": hit}
        return self._centers

    @contextmanager
    def part(self, share: Share) -> Iterator[None]:
        """Inside, renders have every n-th pixel each way, through a camera moved so that its pixel centers are theirs.

        The filter is as wide on the film as of a whole image. WorkerError of panoramas, which no shift of the film moves, and of a size
        that is no multiple of n, whose frame has another shape.
        """
        data, render, cycles = self._camera.data, self._scene.render, self._scene.cycles
        width, height = render.resolution_x, render.resolution_y
        if data.type not in {"PERSP", "ORTHO"}:
            raise WorkerError(f"expected a perspective or orthographic camera for a share of a view, found {data.type}; leave `share` out")
        if width % share.step or height % share.step:
            raise WorkerError(f"expected a size that is a multiple of {share.step} for a share of a view, found {width}x{height}")
        self._materials()  # measured of the whole image
        before = data.shift_x, data.shift_y, cycles.filter_width
        side = width if _fits_width(data, width, height) else height  # pixels in a shift of 1
        middle = (share.step - 1) / 2
        data.shift_x += (share.x - middle) / side
        data.shift_y -= (share.y - middle) / side
        cycles.filter_width = before[2] / share.step
        render.resolution_x, render.resolution_y = width // share.step, height // share.step
        self._share = share
        try:
            yield
        finally:
            data.shift_x, data.shift_y, cycles.filter_width = before
            render.resolution_x, render.resolution_y = width, height
            self._share = None

    def render(self, request: RenderRequest, switch: Switch | None) -> dict[str, np.ndarray]:
        """`response`, `direct`, `indirect` and `denoised`, see `RenderRequest`: of one render where nothing is translucent, else of two."""
        samples, seed = request.samples, request.seed
        images = {}
        if {"response", "denoised", "indirect"} & set(request.channels):
            response = self.response(samples, seed)
            images = {"response": response, "denoised": response}
            if "denoised" in request.channels:
                images["denoised"] = self.denoised(response)
        if {"direct", "indirect"} & set(request.channels):
            if images and not switch:
                images["direct"] = self._direct_of(self._last)
            else:
                with switched(switch):
                    images["direct"] = self.direct(samples, seed)
        if "indirect" in request.channels:
            images["indirect"] = images["response"] - images["direct"]
        return {name: images[name] for name in request.channels}

    def response(self, samples: int, seed: int) -> np.ndarray:
        """Radiance (COMBINED over coverage), or irradiance E = pi x (diffuse direct + indirect, without color).

        Divided by coverage and color of many samples: by its own few, a pixel that they all miss would be dark, and so would the mean.
        """
        passes = self._last = self._render(samples, seed, (*LIGHT_PASSES, *self._gloss))
        if self._irradiance:
            return self._irradiance_of(passes["Diffuse Direct"] + passes["Diffuse Indirect"], passes)
        return self._over_coverage(passes["Combined"][:, :, :3])

    def denoised(self, image: np.ndarray) -> np.ndarray:
        """An image in the units of `response` without its noise, by OpenImageDenoise: biased, so never to be summed.

        Guided by the albedo and normal channels; pixels without coverage stay 0.
        """
        if self._denoiser is None:
            self._denoiser = Denoiser(self._scratch, self._albedo(), self._at_centers()["normal"])
        return self._denoiser.denoise(image) * (self._measured_coverage() > 0)

    def direct(self, samples: int, seed: int) -> np.ndarray:
        """The direct diffuse light alone, and that of gloss where it is kept, in the units of `response`."""
        return self._direct_of(self._render(samples, seed, (*DIRECT_PASSES, *self._gloss)))

    def _direct_of(self, passes: dict[str, np.ndarray]) -> np.ndarray:
        if self._irradiance:
            return self._irradiance_of(passes["Diffuse Direct"], passes)
        found = (passes["Diffuse Direct"] * passes["Diffuse Color"])[:, :, :3]
        if self._gloss:
            found = found + (passes["Glossy Direct"] * passes["Glossy Color"])[:, :, :3]
        return self._over_coverage(found)

    def _irradiance_of(self, light: np.ndarray, passes: dict[str, np.ndarray]) -> np.ndarray:
        """E = pi x `light`, which Cycles has divided by the diffuse color of the same samples: 0 where all of them miss.

        Where a pixel is covered in part, that color is multiplied back and the color of many samples divided by, so that the mean over
        passes is right; elsewhere the ratio is kept, which has less noise on textures.
        """
        coverage, diffuse = self._own(self._measured_coverage()), self._own(self._materials()["Diffuse Color"][:, :, :3])
        ratio = light[:, :, :3]
        partial = (coverage < 1) & (diffuse > 0)
        expected = ratio * passes["Diffuse Color"][:, :, :3] / np.where(partial, diffuse, 1)
        return np.where(partial, expected, ratio) * np.float32(math.pi)

    def _measured_coverage(self) -> np.ndarray:
        """(H, W, 1) by many samples."""
        return np.clip(self._materials()["Combined"][:, :, 3:], 0, 1)

    def _materials(self) -> dict[str, np.ndarray]:
        """Passes of materials by many samples, each times coverage; rendered once."""
        if self._measured_passes is None:
            names: tuple[str, ...] = ("Combined", "Diffuse Color")
            if self._gloss:
                lobes.add(self._layer)
                names = (*names, "Glossy Color", lobes.AOV)
            with reflection_alone() if self._gloss else nullcontext():
                self._measured_passes = self._render(self._coverage_samples, 0, names)
            lobes.remove(self._layer)
        return self._measured_passes

    def _own(self, whole: np.ndarray) -> np.ndarray:
        """The pixels of `whole` that are rendered now."""
        return whole if self._share is None else self._share.of_image(whole)

    def _over_coverage(self, image: np.ndarray) -> np.ndarray:
        coverage = self._own(self._measured_coverage())
        seen = coverage > 0
        return np.where(seen, image / np.where(seen, coverage, 1), 0)

    def _prepare(self, width: int, height: int) -> None:
        render = self._scene.render
        self._scene.camera = self._camera
        render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
        render.film_transparent = True
        render.filepath = str(self._file)
        settings = render.image_settings
        if hasattr(settings, "media_type"):  # Blender 5
            settings.media_type = "MULTI_LAYER_IMAGE"
        settings.file_format = "OPEN_EXR_MULTILAYER"
        settings.color_depth = "32"
        settings.exr_codec = "NONE"
        for layer in self._scene.view_layers:
            layer.use = layer == self._layer
        layer = self._layer
        layer.use_pass_combined = layer.use_pass_position = layer.use_pass_normal = True
        layer.use_pass_diffuse_color = layer.use_pass_diffuse_direct = layer.use_pass_diffuse_indirect = True
        layer.use_pass_glossy_color = layer.use_pass_glossy_direct = bool(self._gloss)

    def _render(self, samples: int, seed: int, passes: tuple[str, ...], *, spread: bool = True) -> dict[str, np.ndarray]:
        sample_spread.take(self._scene, samples, seed, spread=spread)
        self._file.unlink(missing_ok=True)
        try:
            result = bpy.ops.render.render(write_still=True)
        except RuntimeError as error:
            reason = str(error).replace("Error: ", "").strip().replace("\n", " ")
            raise WorkerError(f"Blender could not render camera {self._camera.name!r}: {reason}") from error
        if result != {"FINISHED"} or not self._file.is_file():
            raise WorkerError(f"Blender's render of camera {self._camera.name!r} ended as {', '.join(result)} without an image")
        return read_passes(self._file, passes)

    def _whiten_if_nothing_is_diffuse(self, events: Events) -> None:
        passes = self._render(1, 0, ("Combined", "Diffuse Color"))
        seen = passes["Combined"][:, :, 3] > 0
        dark = (passes["Diffuse Color"][:, :, :3].max(axis=2) < NOT_DIFFUSE) & seen
        if seen.any() and dark[seen].all():
            self._layer.material_override = materials.lambert((1, 1, 1))
            events.warn("nothing in view is diffuse: irradiance is taken with every surface white Lambert instead")
        elif dark.any():
            events.warn(f"{int(dark.sum())} pixels show nothing diffuse (metal, glass, black): they have no irradiance and hold 0")


def _fits_width(data: bpy.types.Camera, width: int, height: int) -> bool:
    """Whether the camera's frame is as wide as its sensor, not as high."""
    return data.sensor_fit == "HORIZONTAL" or (data.sensor_fit == "AUTO" and width >= height)


def find_camera(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object:
    """The camera `name`, or the scene's own; WorkerError, naming those there are, where there is none."""
    cameras = sorted(o.name for o in scene.objects if o.type == "CAMERA")
    shown = ", ".join(repr(n) for n in cameras) or "none"
    if name is None:
        if scene.camera is None or scene.camera.type != "CAMERA":
            raise WorkerError(
                f"expected an active camera in scene {scene.name!r}, found none; its cameras are {shown}: name one as view:NAME"
            )
        return scene.camera
    camera = scene.objects.get(name)
    if camera is None or camera.type != "CAMERA":
        raise WorkerError(
            f"expected a camera {name!r} in scene {scene.name!r}, found none; its cameras are {shown}{elsewhere.hint(scene, name)}"
        )
    return camera
