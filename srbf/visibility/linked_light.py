"""Direct light on the surfels of a pool, of lights that shine on some objects alone, or that some do not shadow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64, Int
from srbf.errors import ImageError, InputError
from srbf.light_linking import choices_of
from srbf.lights import Light
from srbf.visibility.received import ReceivedLight, occluders_of
from srbf.visibility.surface_cells import Cells


class LinkedLight:
    """Irradiance on N surfels by rays, where lights choose their objects.

    Parameters
    ----------
    cells
        The surfels.
    scene
        scene.glb: what casts shadows.
    names, objects
        Names of the scene's objects, and the number of each surfel's; None where the bake did not keep them.
    """

    def __init__(self, cells: Cells, scene: bytes, names: Sequence[str], objects: Int[ndarray, " N"] | None) -> None:
        self._cells, self._scene, self._names, self._objects = cells, scene, tuple(names), objects

    def irradiance(self, light: Light) -> Float64[ndarray, "N 3"]:
        """As of `ReceivedLight`; 0 on objects that the light does not shine on. InputError where it chooses, and objects are not known."""
        choices = choices_of(light)
        found = ReceivedLight(self._cells, occluders_of(self._scene, choices.get("blockers"))).irradiance(light)
        if "receivers" not in choices:
            return found
        if self._objects is None:
            raise InputError("expected surfels of known objects for a light with `receivers`, found none; bake again")
        return found * choices["receivers"].among(self._names)[self._objects, None]


def surfel_objects(pool: ndarray, names: Sequence[str]) -> Int[ndarray, " S"] | None:
    """The number of each surfel's object, of a pool (n, S, 4) as pool.exr holds it; None where there are no `names`.

    ImageError where a number has no name.
    """
    if not names:
        return None
    objects = np.round(pool[2, :, 3]).astype(np.int64)
    if objects.min(initial=0) < 0 or objects.max(initial=0) >= len(names):
        raise ImageError(f"expected objects 0 to {len(names) - 1} in the pool, found {objects.min()} to {objects.max()}; fit again")
    return objects
