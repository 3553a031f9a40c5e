"""Import of photographs, or of renders, with a light list as a capture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import srbf
from srbf.captured_light import LightKind, Role
from srbf.errors import ImageError, InputError
from srbf.importing.image_pairing import paired
from srbf.importing.light_list import LightListEntry, below_the_horizon
from srbf.importing.pictures import Picture, Transfer, read_picture, said_once
from srbf.io import files
from srbf.io.image import HALF_MAX, write_image
from srbf.receiver_images import MANIFEST, Quantity


@dataclass(frozen=True)
class LightListImport:
    r"""A light list (.lp) and its images, paired by the name in the list, to be written as a capture.

    Parameters
    ----------
    lights
        The list of the train lights.
    transfer
        `srgb` decodes the sRGB curve, `linear` keeps stored values; profiles and tags in the files come first (`srbf.importing.pictures`).
    holdout
        A list of held-out lights.
    mask
        An image that becomes the coverage.
    quantity
        `radiance` of photographs and renders, or `irradiance`.
    kind
        `directional`: the lists hold directions. `point`: positions in meters of lights that have unit irradiance at 1 m.
    layer
        Of a multilayer EXR.
    images
        A further folder for images, besides the list's own.

    Examples
    --------
    >>> lines = [f"{i}.exr {x} {y} {z}" for i, (x, y, z) in enumerate(capture.directions()[:3])]
    >>> (folder / "photographs").mkdir()
    >>> for i in range(3):
    ...     write_image(folder / "photographs" / f"{i}.exr", capture.image(i), "float")
    >>> (folder / "photographs" / "dirs.lp").write_text("\n".join(["3", *lines])) > 0
    True
    >>> manifest = LightListImport(folder / "photographs" / "dirs.lp", "linear").write(folder / "imported")
    >>> len(Capture.open(folder / "imported").lights)
    3
    """

    lights: Path
    transfer: Transfer
    holdout: Path | None = None
    mask: Path | None = None
    quantity: Quantity = "radiance"
    kind: LightKind = "directional"
    layer: str | None = None
    images: Path | None = None

    def write(
        self,
        folder: Path,
        force: bool = False,
        progress: Callable[[int, int], None] = lambda done, total: None,
        say: Callable[[str], None] = lambda text: None,
    ) -> dict[str, Any]:
        """Write the capture, whole or not at all.

        Parameters
        ----------
        folder
            Made with its parents.
        force
            Replace a capture that is there.
        progress
            Called with (images done, images in all).
        say
            Gets one line per kind of conversion.

        Returns
        -------
        dict
            The content of capture.json.

        Raises
        ------
        ManifestError
            Where a list is missing or damaged, or names an image that is not there.
        ImageError
            Where an image is damaged, of another size, or not finite.
        InputError
            On another transfer than `srgb` and `linear`.
        OutputExistsError
            Where the folder exists and `force` is not set, or it holds something else than a capture.
        MissingLibraryError
            Without OpenImageIO.
        """
        if self.transfer not in ("srgb", "linear"):
            raise InputError(f"expected a transfer of srgb, linear, found {self.transfer!r}")
        pairs: list[tuple[Path, LightListEntry, Role]] = self._pairs(self.lights, "train", say)
        if self.holdout is not None:
            pairs += self._pairs(self.holdout, "holdout", say)
        with files.atomic_folder(folder, force, MANIFEST) as temporary:
            (temporary / "lights").mkdir()
            size: tuple[int, int] = (0, 0)
            lights = []
            bits = 0
            notes: list[tuple[str, tuple[str, ...]]] = []
            for index, (path, entry, role) in enumerate(pairs):
                picture = self._read(path)
                pixels = picture.pixels
                bits = max(bits, picture.bits)
                notes.append((path.name, picture.notes))
                height, width = pixels.shape[:2]
                size = (height, width) if index == 0 else size
                if (height, width) != size:
                    raise ImageError(f"expected {size[1]}x{size[0]} pixels in {path}, as in {pairs[0][0].name}, found {width}x{height}")
                file = f"lights/{index:04d}.exr"
                wide = picture.bits > 8 and float(np.abs(pixels - pixels.astype(np.float16)).max()) > 0
                write_image(temporary / file, pixels, "float" if wide or np.abs(pixels).max() > HALF_MAX else "half")
                place = "direction" if self.kind == "directional" else "position"
                lights.append({"kind": self.kind, place: list(entry.place), "role": role, "file": file})
                progress(index + 1, len(pairs))
            manifest: dict[str, Any] = {
                "format": "srbf-capture",
                "version": 1,
                "quantity": self.quantity,
                "transport": "combined",
                "width": size[1],
                "height": size[0],
                "lights": lights,
            }
            if self.mask is not None:
                mask_read = read_picture(self.mask, "linear", self.layer if self.mask.suffix.lower() == ".exr" else None)
                mask = mask_read.pixels[:, :, :1]
                notes.append((self.mask.name, mask_read.notes))
                if mask.shape[:2] != size:
                    raise ImageError(f"expected a mask of {size[1]}x{size[0]} pixels, found {self.mask} of {mask.shape[1]}x{mask.shape[0]}")
                write_image(temporary / "coverage.exr", np.clip(mask, 0, 1), "float")
                manifest["coverage"] = "coverage.exr"
            manifest["source"] = {
                "srbf": srbf.__version__,
                "lights": self.lights.name,
                "transfer": self.transfer,
                "bits": bits,
            }
            said = said_once(notes)
            if said:
                manifest["source"]["pictures"] = said
            files.write_json(temporary / MANIFEST, manifest)
        for line in said:
            say(line)
        return manifest

    def _pairs(self, light_list: Path, role: Role, say: Callable[[str], None]) -> list[tuple[Path, LightListEntry, Role]]:
        pairs = paired(light_list, self.kind, self.images, say)
        if role == "train" and self.kind == "directional":  # the domain is that of the lights to be fitted
            below = below_the_horizon([entry for _, entry in pairs], light_list.name)
            if below is not None:
                say(below)
        return [(path, entry, role) for path, entry in pairs]

    def _read(self, path: Path) -> Picture:
        return read_picture(path, self.transfer, self.layer)
