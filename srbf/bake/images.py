"""A capture's images as a bake writes them: geometry and ambient once, then every light's mean, dilated, without what shines anyway."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Int
from srbf.bake.settings import PlannedLight
from srbf.bake.sums import SUMS, load_array, save_array
from srbf.encode.dilation import dilate, nearest_covered
from srbf.errors import BakeError, ImageError, ManifestError
from srbf.io import files
from srbf.io.image import HALF_MAX, read_image, write_image

GEOMETRY = ("position", "normal", "albedo", "coverage")
SCENE_FILE = "scene.glb"
PREPARED = "prepared.json"  # in the folder of sums: the receiver is known and its geometry written
READABLE = "readable.npz"  # where light can be read off the receiver
LEFT = "left.npz"  # what shines with every lamp and emission off


class CaptureImages:
    """Writes the images of a capture. `prepared` holds what the worker told of scene and receiver, once that is known.

    prepared: facts, sampling, tints, ambient and seams (whether there are such images), uv (checksum of a layer that was made), files
    (checksums of all that was written).
    """

    def __init__(self, folder: Path, say: Callable[[str], None] = lambda line: None) -> None:
        self._folder = folder
        self._say = say
        self._raw: dict[str, ndarray] = {}
        self._left: Float32[ndarray, "H W 3"] | None = None
        self._nearest: Int[ndarray, "H W"] | None = None
        self._size: tuple[int, ...] = (0, 0)
        self.prepared: dict[str, Any] | None = None
        path = folder / SUMS / PREPARED
        if path.is_file():
            try:
                self._load(files.read_json(path))
            except (ImageError, ManifestError):
                path.unlink()  # of a damaged preparation: made again

    def take(self, name: str, array: ndarray) -> None:
        """An array of the preparation; `prepare` writes what follows from all of them."""
        self._raw[name] = array

    def prepare(self, facts: dict[str, Any], sampling: dict[str, Any], tints: dict[str, Any] | None) -> None:
        """Write geometry, ambient and a made UV layer; last, that the preparation is whole. Positions are real where `hit`."""
        raw, self._raw = self._raw, {}
        readable, hit = raw.pop("readable"), raw.pop("hit")
        save_array(self._folder / SUMS / READABLE, readable)
        self._nearest, self._size = nearest_covered(readable[:, :, 0]), readable.shape[:2]
        left, ambient, seams = (raw.pop(name, None) for name in ("left", "ambient", "seams"))
        self._left = None
        (self._folder / SUMS / LEFT).unlink(missing_ok=True)
        if left is not None and left.any():
            self._left = dilate(left, self._nearest)
            save_array(self._folder / SUMS / LEFT, self._left)
        shines = ambient is not None and bool(ambient.any())
        if ambient is not None and shines:
            write_image(self._folder / "ambient.exr", dilate(ambient, self._nearest), "float")
        if seams is not None:
            write_image(self._folder / "seams.exr", seams, "float")
        nearest, of_hits = nearest_covered(raw["coverage"][:, :, 0]), nearest_covered(hit[:, :, 0])
        for name, image in raw.items():
            if name != "coverage":
                image = dilate(image, nearest if name == "albedo" else of_hits)
            write_image(self._folder / f"{name}.exr", image, "float")
        if "uv" in facts:
            files.write_json(self._folder / "uv.json", facts["uv"])
        names = [
            *(f"{name}.exr" for name in (*GEOMETRY, "ambient", "seams")),
            "uv.json",
            SCENE_FILE,
            f"{SUMS}/{READABLE}",
            f"{SUMS}/{LEFT}",
        ]
        prepared = {
            "facts": without_uv(facts),
            "sampling": sampling,
            "tints": tints,
            "ambient": shines,
            "seams": seams is not None,
            "uv": uv_checksum(facts),
            "files": {name: files.sha256_of(self._folder / name) for name in names if (self._folder / name).is_file()},
        }
        files.write_json(self._folder / SUMS / PREPARED, {"sha256": _checksum(prepared), "prepared": prepared})
        self.prepared = prepared

    def require_receiver(self, facts: dict[str, Any]) -> None:
        """BakeError where a worker tells of another receiver than what is prepared."""
        assert self.prepared is not None
        if without_uv(facts) != self.prepared["facts"] or uv_checksum(facts) != self.prepared["uv"]:
            raise BakeError(f"expected the receiver of {self._folder} as it was when its bake began, found another; add `restart=True`")

    def require_size(self, light: PlannedLight, image: ndarray) -> None:
        """BakeError where an answer has not the size of the receiver."""
        if image.shape != (*self._size, 3):
            raise BakeError(
                f"expected {(*self._size, 3)} values of light {light.index} from Blender, found {image.shape}; see the bake's log"
            )

    def own_light(self, light: PlannedLight, mean: Float32[ndarray, "H W 3"]) -> Float32[ndarray, "H W 3"]:
        """`mean` as the capture has it, but for the rounding: dilated, what shines without any light taken away. BakeError on NaN."""
        if not np.isfinite(mean).all():
            raise BakeError(f"Blender rendered NaN or Inf for light {light.index}; look for a broken material or normal in the scene")
        mean = dilate(mean, self._nearest)
        return mean if self._left is None else mean - self._left

    def publish(self, light: PlannedLight, own: Float32[ndarray, "H W 3"], direct: Float32[ndarray, "H W 3"] | None = None) -> None:
        """Write one light's answer as half floats, fireflies beyond them clipped, and said.

        With `direct` given that is taken from it and written beside it, first: a light whose image is there has both.
        """
        if direct is not None:
            if not np.isfinite(direct).all():
                raise BakeError(f"Blender rendered NaN or Inf for light {light.index}; look for a broken material or normal in the scene")
            direct = np.clip(dilate(direct, self._nearest), 0, HALF_MAX).astype(np.float16).astype(np.float32)
            own = own - direct  # as the file has it, so that the two add up again
            write_image(self._folder / light.direct_file, direct, "half")
        beyond = int((np.abs(own) > HALF_MAX).sum())
        if beyond:
            self._say(f"light {light.index}: {beyond} values past half float's {HALF_MAX:.0f} are clipped to it")
            own = np.clip(own, -HALF_MAX, HALF_MAX)
        write_image(self._folder / light.file, own, "half")

    def checksum(self, light: PlannedLight, apart: bool) -> str:
        """Of the light's images as they are on disk, empty where one is missing; `apart` where there are two."""
        paths = [self._folder / name for name in (light.file, *([light.direct_file] if apart else []))]
        if not all(path.is_file() for path in paths):
            return ""
        return hashlib.sha256("".join(files.sha256_of(path) for path in paths).encode()).hexdigest()

    def published(self, light: PlannedLight, apart: bool) -> Float32[ndarray, "H W 3"]:
        """All light of one that is published; of an indirect capture (`apart`), both its images together."""
        image = read_image(self._folder / light.file, 3)
        return image + read_image(self._folder / light.direct_file, 3) if apart else image

    def _load(self, stored: dict[str, Any]) -> None:
        prepared = stored.get("prepared")
        if stored.get("sha256") != _checksum(prepared) or not isinstance(prepared, dict):
            raise ManifestError(f"expected {PREPARED} as it was written, found another")
        for name, checksum in prepared["files"].items():
            if not (self._folder / name).is_file() or files.sha256_of(self._folder / name) != checksum:
                raise ImageError(f"expected {name} as it was written, found another")
        readable = load_array(self._folder / SUMS / READABLE)
        self._nearest, self._size = nearest_covered(readable[:, :, 0]), readable.shape[:2]
        left = self._folder / SUMS / LEFT
        self._left = load_array(left) if left.is_file() else None
        self.prepared = prepared


def without_uv(facts: dict[str, Any]) -> dict[str, Any]:
    """Facts of a scene without the long list of a made layer's coordinates."""
    return {key: value for key, value in facts.items() if key not in ("uv", "event")}


def uv_checksum(facts: dict[str, Any]) -> str | None:
    """Of the layer that was made, where one was: every worker must make the same."""
    return hashlib.sha256(json.dumps(facts["uv"]).encode()).hexdigest() if "uv" in facts else None


def _checksum(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
