"""A capture's images as a bake writes them: its receiver's channels once, then every light's mean, dilated, without residual emission."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.bake.accumulation import ACCUMULATION, load_array, save_array
from srbf.bake.planned_lights import PlannedLight
from srbf.bake.viewers import project, viewer_directions
from srbf.channels import CHANNELS, GEOMETRY, file_name
from srbf.encode.dilation import dilate, nearest_covered
from srbf.errors import BakeError, ImageError, ManifestError
from srbf.io import files
from srbf.io.image import HALF_MAX, read_image, write_image
from srbf.receiver_share import Share

MASKS = ("hit", "valid")  # of the receiver, see `srbf.channels.Channel`; coverage, the third, is a channel itself
SEAMS = "seams"  # (1, E, 8), an image that is no channel: it has no texels
ASKED_FOR = (*GEOMETRY, *MASKS, SEAMS)  # what the first worker of a bake sends of its receiver
SCENE_FILE = "scene.glb"
PREPARED = "prepared.json"  # in the accumulation folder: the receiver is known and its channels are written
VALID_MASK = "valid_mask.npz"  # where light can be read off the receiver
RESIDUAL = "residual_emission.npz"  # what the receiver shows with every light and emission off


class CaptureImages:
    """Writes the images of a capture.

    `prepared`, once the receiver is known, is what is kept of it between runs:
    facts (what the worker says of scene and receiver), sampling (footprint or camera, see the manifest's `direct`), transmittances (of
    translucent materials by name, or None), channels (names of those written), seams (whether there is such an image), uv (checksum of a
    UV layer that the bake made, or None), files ({name: checksum} of all that was written).
    """

    def __init__(self, folder: Path, say: Callable[[str], None] = lambda line: None) -> None:
        self._folder = folder
        self._say = say
        self._received: dict[str, ndarray] = {}
        self._residual: Float32[ndarray, "H W 3"] | None = None
        self._valid: ndarray = np.zeros((0, 0), np.float32)  # (H, W), above 0 where light can be read off the receiver
        self._nearest_of: dict[Share | None, Int[ndarray, "H W"] | None] = {}  # of a share's texels, or of all
        self._normals: Float32[ndarray, "H W 3"] | None = None
        self.prepared: dict[str, Any] | None = None
        path = folder / ACCUMULATION / PREPARED
        if path.is_file():
            try:
                self._load(files.read_json(path))
            except (ImageError, ManifestError):
                path.unlink()  # of a damaged preparation: made again

    def take(self, name: str, array: ndarray) -> None:
        """Receive an image of the preparation (H, W, C): a channel, a mask, `seams`, or `residual`. `prepare` writes them."""
        self._received[name] = array

    def prepare(self, facts: dict[str, Any], sampling: dict[str, Any], transmittances: dict[str, Any] | None) -> None:
        """Write the channels received and a UV layer that was made; last, the record that the preparation is complete.

        facts, sampling, transmittances: as in `prepared`; `facts["uv"]` has the coordinates of a layer that was made.
        """
        received, self._received = self._received, {}
        masks = {"coverage": received["coverage"], **{name: received.pop(name) for name in MASKS}}
        nearest = {name: nearest_covered(mask[:, :, 0]) for name, mask in masks.items()}
        save_array(self._folder / ACCUMULATION / VALID_MASK, masks["valid"])
        self._valid, self._nearest_of = masks["valid"][:, :, 0], {None: nearest["valid"]}
        residual, seams = received.pop("residual", None), received.pop(SEAMS, None)
        self._residual = None
        (self._folder / ACCUMULATION / RESIDUAL).unlink(missing_ok=True)
        if residual is not None and residual.any():
            self._residual = dilate(residual, nearest["valid"])
            save_array(self._folder / ACCUMULATION / RESIDUAL, self._residual)
        if "ambient" in received and not received["ambient"].any():
            del received["ambient"]
        if seams is not None:
            write_image(self._folder / file_name(SEAMS), seams, "float")
        for name, image in received.items():
            mask = CHANNELS[name].real_where
            write_image(self._folder / file_name(name), image if mask is None else dilate(image, nearest[mask]), "float")
        if "uv" in facts:
            files.write_json(self._folder / "uv.json", facts["uv"])
        names = [
            *(file_name(name) for name in (*received, SEAMS)),
            "uv.json",
            SCENE_FILE,
            f"{ACCUMULATION}/{VALID_MASK}",
            f"{ACCUMULATION}/{RESIDUAL}",
        ]
        prepared = {
            "facts": without_uv(facts),
            "sampling": sampling,
            "transmittances": transmittances,
            "channels": [name for name in CHANNELS if name in received],
            "seams": seams is not None,
            "uv": uv_checksum(facts),
            "files": {name: files.sha256_of(self._folder / name) for name in names if (self._folder / name).is_file()},
        }
        write_preparation(self._folder, prepared)
        self.prepared = prepared

    def require_receiver(self, facts: dict[str, Any]) -> None:
        """BakeError where a worker has another receiver than the one prepared."""
        assert self.prepared is not None
        if without_uv(facts) != self.prepared["facts"] or uv_checksum(facts) != self.prepared["uv"]:
            raise BakeError(
                f"expected the receiver of {self._folder} as it was when its bake began, found another; bake with `restart=True`"
            )

    def require_size(self, light: PlannedLight, image: ndarray) -> None:
        """BakeError where an image of `light` has not the size of the receiver, or of the light's share of it."""
        size = self._own(self._valid, light).shape
        if image.shape != (*size, 3):
            raise BakeError(f"expected {(*size, 3)} values of light {light.index} from Blender, found {image.shape}; see the bake's log")

    def own_light(self, light: PlannedLight, mean: Float32[ndarray, "H W 3"]) -> Float32[ndarray, "H W 3"]:
        """`mean` as the capture holds it, before rounding: dilated, the residual emission subtracted. BakeError for NaN."""
        if not np.isfinite(mean).all():
            raise BakeError(f"Blender rendered NaN or Inf for light {light.index}; look for a broken material or normal in the scene")
        mean = dilate(mean, self._nearest(light))
        return mean if self._residual is None else mean - self._own(self._residual, light)

    def harmonics(self, light: PlannedLight, toward: Float32[ndarray, "H W N"]) -> Float32[ndarray, "H W M"]:
        """Harmonics of the radiance toward the viewers of a light's pass; BakeError for another size."""
        assert light.gloss is not None
        viewers = len(viewer_directions(light.gloss))
        if toward.shape != (*self._valid.shape, 3 * viewers):
            raise BakeError(f"expected {viewers} viewers of light {light.index} from Blender, found {toward.shape}; see the bake's log")
        if self._normals is None:
            self._normals = read_image(self._folder / file_name("normal"), 3)
        return project(toward, self._normals, light.gloss)

    def publish(
        self,
        light: PlannedLight,
        own: Float32[ndarray, "H W 3"],
        direct: Float32[ndarray, "H W 3"] | None = None,
        harmonics: Float32[ndarray, "H W M"] | None = None,
    ) -> None:
        """Write one light's response as half floats, values beyond their range clipped with a warning.

        `direct`, where given, is subtracted from it and written first, to a file of its own: a light whose image exists has both. So are
        the `harmonics`, which have no direct light.
        """
        if harmonics is not None:
            self._publish_harmonics(light, harmonics)
        if direct is not None:
            if not np.isfinite(direct).all():
                raise BakeError(f"Blender rendered NaN or Inf for light {light.index}; look for a broken material or normal in the scene")
            direct = np.clip(dilate(direct, self._nearest(light)), 0, HALF_MAX).astype(np.float16).astype(np.float32)
            own = own - direct  # as stored, so that the two add up again
            write_image(self._folder / light.direct_file, direct, "half")
        write_image(self._folder / light.file, self._clipped(light, own), "half")

    def _publish_harmonics(self, light: PlannedLight, harmonics: Float32[ndarray, "H W M"]) -> None:
        every = self._clipped(light, dilate(harmonics, self._nearest(light)))
        for k, file in enumerate(light.harmonics_files):
            own = every[:, :, 3 * k : 3 * k + 3]
            if k == 0 and self._residual is not None:  # what still shines, the same toward all viewers
                own = own - self._residual * np.float32(np.sqrt(4 * np.pi))
            write_image(self._folder / file, own, "half")

    @staticmethod
    def _own(whole: ndarray, light: PlannedLight) -> ndarray:
        """The texels of `whole` (H, W, ...) that the light's images have."""
        return whole if light.share is None else whole[light.share.indices]

    def _nearest(self, light: PlannedLight) -> Int[ndarray, "H W"] | None:
        if light.share not in self._nearest_of:
            self._nearest_of[light.share] = nearest_covered(np.ascontiguousarray(self._own(self._valid, light)))
        return self._nearest_of[light.share]

    def _clipped(self, light: PlannedLight, own: Float32[ndarray, "H W C"]) -> Float32[ndarray, "H W C"]:
        if not np.isfinite(own).all():
            raise BakeError(f"Blender rendered NaN or Inf for light {light.index}; look for a broken material or normal in the scene")
        beyond = int((np.abs(own) > HALF_MAX).sum())
        if not beyond:
            return own
        self._say(f"light {light.index}: {beyond} values past half float's {HALF_MAX:.0f} are clipped to it")
        return np.clip(own, -HALF_MAX, HALF_MAX)

    def checksum(self, light: PlannedLight) -> str:
        """Checksum of the light's images on disk, empty where one is missing."""
        names = (light.file, *([light.direct_file] if light.has_direct else []), *light.harmonics_files)
        paths = [self._folder / name for name in names]
        if not all(path.is_file() for path in paths):
            return ""
        return hashlib.sha256("".join(files.sha256_of(path) for path in paths).encode()).hexdigest()

    def published(self, light: PlannedLight) -> Float32[ndarray, "H W 3"]:
        """The published response to a light; the sum of its two images where its direct light is kept apart."""
        image = read_image(self._folder / light.file, 3)
        return image + read_image(self._folder / light.direct_file, 3) if light.has_direct else image

    def _load(self, stored: dict[str, Any]) -> None:
        prepared = stored.get("prepared")
        if stored.get("sha256") != checksum_of(prepared) or not isinstance(prepared, dict):
            raise ManifestError(f"expected {PREPARED} as it was written, found another")
        for name, checksum in prepared["files"].items():
            if not (self._folder / name).is_file() or files.sha256_of(self._folder / name) != checksum:
                raise ImageError(f"expected {name} as it was written, found another")
        self._valid = load_array(self._folder / ACCUMULATION / VALID_MASK)[:, :, 0]
        self._nearest_of = {}
        residual = self._folder / ACCUMULATION / RESIDUAL
        self._residual = load_array(residual) if residual.is_file() else None
        self.prepared = prepared


def without_uv(facts: dict[str, Any]) -> dict[str, Any]:
    """Facts of a scene without the long list of UV coordinates of a layer that was made."""
    return {key: value for key, value in facts.items() if key not in ("uv", "event")}


def uv_checksum(facts: dict[str, Any]) -> str | None:
    """Checksum of the UV layer that was made, None without one: every worker must make the same."""
    return hashlib.sha256(json.dumps(facts["uv"]).encode()).hexdigest() if "uv" in facts else None


def write_preparation(folder: Path, prepared: dict[str, Any]) -> None:
    """Write the record of `CaptureImages.prepared`, with its checksum."""
    files.write_json(folder / ACCUMULATION / PREPARED, {"sha256": checksum_of(prepared), "prepared": prepared})


def checksum_of(value: Any) -> str:
    """Hex SHA-256 of a JSON value."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
