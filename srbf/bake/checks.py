"""Failures of an overnight bake that can be detected at its start: light that reaches nothing, a full disk."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from srbf.bake.settings import BakeSettings
from srbf.errors import BakeError
from srbf.io.files import WriteError

FIRST_LIGHTS = 24  # in the order of rendering: they cover the domain
HALF_BYTES, FLOAT_BYTES = 2, 4
GEOMETRY_CHANNELS = 10


class FirstLights:
    """Checks the first lights of a bake, so that one whose images are all black, or all constant, ends after a few.

    A single black image may be a sun behind a wall, and a plane's image is constant: the first black one is a warning. FIRST_LIGHTS of
    them, over the whole domain, are an error.
    """

    def __init__(self, lights: int, place: str, say: Callable[[str], None]) -> None:
        self._count = min(FIRST_LIGHTS, lights)
        self._seen = 0
        self._place, self._say = place, say
        self._black = True
        self._constant: float | None = None
        self._varied = lights < FIRST_LIGHTS  # too few to tell

    @property
    def looking(self) -> bool:
        return self._seen < self._count

    @property
    def lit(self) -> bool:
        """Whether one of the images checked has any light."""
        return not self._black

    def black(self, count: int) -> BakeError:
        """The error of `count` black images."""
        return BakeError(
            f"all {count} light images are black: can light reach {self._place} from the directions or positions of the lights? "
            "Fix the scene, then bake with `restart=True`"
        )

    def look(self, image: np.ndarray) -> None:
        """Check the next light's image; BakeError at the last of the first ones, where all were black or all constant."""
        if not self.looking:
            return
        self._seen += 1
        self._black &= float(image.max()) <= 0
        value = float(image.flat[0])
        self._varied |= bool((image != image.flat[0]).any()) or self._constant not in (None, value)
        self._constant = value
        if self._black and self._seen == 1 < self._count:
            self._say(f"the image of the first light of {self._place} is black; the bake ends if the first {self._count} are")
        if self.looking:
            return
        if self._black:
            raise self.black(self._count)
        if not self._varied:
            raise BakeError(
                f"the first {self._count} light images all hold {value:g} and nothing else: {self._place} does not respond to light. "
                "Fix the scene, then bake with `restart=True`"
            )


def bytes_needed(settings: BakeSettings, lights: float, summed: float) -> int:
    """Bytes of an uncompressed capture of `lights` lights, `summed` of which keep their running sums; one with a share counts as such."""
    texels = settings.width * settings.height
    images = (2 if settings.transport == "indirect" else 1) + (0 if settings.harmonics is None else (settings.harmonics + 1) ** 2)
    sums = images + 1  # validation lights have their squares
    return round(texels * (lights * images * 3 * HALF_BYTES + summed * sums * 3 * FLOAT_BYTES + GEOMETRY_CHANNELS * FLOAT_BYTES))


def check_disk(folder: Path, needed: int) -> None:
    """WriteError where the disk of `folder` has fewer than `needed` bytes left."""
    where = next(path for path in (folder.resolve(), *folder.resolve().parents) if path.exists())
    free = shutil.disk_usage(where).free
    if free < needed:
        raise WriteError(
            f"expected {needed / 1e9:.2f} GB free for the whole capture at {folder}, found {free / 1e9:.2f} GB; "
            "free some, choose another folder, or a smaller `size`"
        )
