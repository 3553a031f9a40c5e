"""Point lights of a bake: a box filled with them, except inside geometry; a scene query before the bake finds the free places."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.errors import InputError

Box = tuple[float, float, float, float, float, float]  # x0, y0, z0, x1, y1, z1, meters
Places = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class PointGrid:
    """Point lights `spacing` meters apart in a box (None: the bounds of all that renders), and random ones in the same free space.

    grid, random: positions (m), unknown before `srbf.bake.scene_query.with_free_point_lights`.
    """

    spacing: float
    box: Box | None = None
    grid: Places | None = None
    random: Places = ()

    def __post_init__(self) -> None:
        if not (np.isfinite(self.spacing) and self.spacing > 0):
            raise InputError(f"expected a spacing of point lights above 0 m, found {self.spacing:g}")
        if self.box is not None:
            low, high = np.array(self.box[:3]), np.array(self.box[3:])
            if not (np.isfinite(self.box).all() and (low <= high).all()):
                raise InputError(f"expected a box x0,y0,z0,x1,y1,z1 with each first value the smaller, found {self.box}")

    @staticmethod
    def parse(light_set: str, light_bounds: str | None) -> PointGrid:
        """From the command line: `point:SPACING` and `x0,y0,z0,x1,y1,z1`; InputError on other words."""
        kind, _, spacing = light_set.partition(":")
        try:
            meters = float(spacing)
        except ValueError:
            kind, meters = "", 0.0
        if kind != "point":
            raise InputError(f"expected `light_set` point:SPACING, the spacing in meters, found {light_set!r}")
        return PointGrid(meters, parse_box(light_bounds))

    def places(self, validation: int, holdout: int) -> tuple[Float64[ndarray, "L 3"], Float64[ndarray, "V 3"], Float64[ndarray, "H 3"]]:
        """(train, validation, holdout) positions, m; InputError where they are not known yet, or too few."""
        if self.grid is None or len(self.random) < validation + holdout:
            raise InputError("expected point lights with known positions, found none; call with_free_point_lights first")
        random = np.array(self.random, np.float64).reshape(-1, 3)
        return np.array(self.grid, np.float64).reshape(-1, 3), random[:validation], random[validation : validation + holdout]

    def record(self) -> dict[str, Any]:
        """JSON for the manifest: spacing, box, and a checksum of the positions, which the lights hold."""
        places = json.dumps([self.grid, self.random])
        return {"spacing": self.spacing, "box": self.box, "positions": hashlib.sha256(places.encode()).hexdigest()}


def parse_box(text: str | None) -> Box | None:
    """`x0,y0,z0,x1,y1,z1` in meters; InputError on anything else."""
    if text is None:
        return None
    try:
        x0, y0, z0, x1, y1, z1 = (float(word) for word in text.split(","))
    except ValueError as error:
        raise InputError(f"expected `light_bounds` x0,y0,z0,x1,y1,z1 in meters, found {text!r}") from error
    box = (x0, y0, z0, x1, y1, z1)
    if not (np.isfinite(box).all() and x0 <= x1 and y0 <= y1 and z0 <= z1):
        raise InputError(f"expected a box x0,y0,z0,x1,y1,z1 with each first value the smaller, found {text!r}")
    return box
