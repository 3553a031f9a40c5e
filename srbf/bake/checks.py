"""What goes wrong in a night's bake and can be known at its start: light that reaches nothing, a disk too small."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from srbf.bake.settings import BakeSettings
from srbf.errors import BakeError
from srbf.io.files import WriteError

FIRST_LIGHTS = 24  # of the order in which they are rendered: they cover the domain
HALF_BYTES, FLOAT_BYTES = 2, 4
GEOMETRY_CHANNELS = 10


class FirstLights:
    """Looks at the first lights of a bake. A night of black images, or of images that light does not change, ends after a few.

    One black image may be a sun behind a wall, and one constant one is what a plane shows: those are said. FIRST_LIGHTS of them, over
    all the domain, are an error.
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
        """Whether one of those looked at has any light."""
        return not self._black

    def black(self, count: int) -> BakeError:
        """The error of `count` black images."""
        return BakeError(
            f"every one of {count} light images is black: does light reach {self._place} from where the lights stand? "
            "Mend the scene, then bake with `restart=True`"
        )

    def look(self, image: np.ndarray) -> None:
        """Of the next light; BakeError at the last of the first ones, where nothing was lit or nothing changed."""
        if not self.looking:
            return
        self._seen += 1
        self._black &= float(image.max()) <= 0
        value = float(image.flat[0])
        self._varied |= bool((image != image.flat[0]).any()) or self._constant not in (None, value)
        self._constant = value
        if self._black and self._seen == 1 < self._count:
            self._say(f"the first light leaves {self._place} black; should {self._count} of them do so, the bake ends")
        if self.looking:
            return
        if self._black:
            raise self.black(self._count)
        if not self._varied:
            raise BakeError(
                f"the first {self._count} light images all hold {value:g} and nothing else: {self._place} does not answer to light. "
                "Mend the scene, then bake with `restart=True`"
            )


def bytes_needed(settings: BakeSettings, lights: int, summed: int) -> int:
    """Bytes of a capture of so many lights, uncompressed, `summed` of them with their sums."""
    texels = settings.width * settings.height
    images = 2 if settings.transport == "indirect" else 1
    sums = images + 1  # validation lights have their squares
    return texels * (lights * images * 3 * HALF_BYTES + summed * sums * 3 * FLOAT_BYTES + GEOMETRY_CHANNELS * FLOAT_BYTES)


def check_disk(folder: Path, needed: int) -> None:
    """WriteError where the disk under `folder` has not so many bytes left."""
    where = next(path for path in (folder.resolve(), *folder.resolve().parents) if path.exists())
    free = shutil.disk_usage(where).free
    if free < needed:
        raise WriteError(
            f"expected {needed / 1e9:.2f} GB free for the whole capture at {folder}, found {free / 1e9:.2f} GB; "
            "free some, choose another folder, or a smaller `size`"
        )
