"""Point lights of a bake: a box filled with lamps, those inside geometry left out; Blender is asked which, before the bake."""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.bake.worker import Worker
from srbf.errors import BakeError, InputError

if TYPE_CHECKING:
    from srbf.bake.settings import BakeSettings

Box = tuple[float, float, float, float, float, float]  # x0, y0, z0, x1, y1, z1, metres
Places = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class PointGrid:
    """Lamps `spacing` metres apart in a box (None: the bounds of what the scene renders), and random ones in the same free space.

    `grid` and `random` are positions in metres, not known before `survey` has asked the scene.
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
    def parse(light_set: str, light_box: str | None) -> PointGrid:
        """From the command line: `point:SPACING` and `x0,y0,z0,x1,y1,z1`; InputError on other words."""
        kind, _, spacing = light_set.partition(":")
        box: Box | None = None
        try:
            metres = float(spacing)
        except ValueError:
            kind, metres = "", 0.0
        if kind != "point":
            raise InputError(f"expected --light-set point:SPACING, the spacing in metres, found {light_set!r}")
        if light_box is not None:
            try:
                x0, y0, z0, x1, y1, z1 = (float(word) for word in light_box.split(","))
                box = (x0, y0, z0, x1, y1, z1)
            except ValueError as error:
                raise InputError(f"expected --light-box x0,y0,z0,x1,y1,z1 in metres, found {light_box!r}") from error
        return PointGrid(metres, box)

    def places(self, validation: int, holdout: int) -> tuple[Float64[ndarray, "L 3"], Float64[ndarray, "V 3"], Float64[ndarray, "H 3"]]:
        """(train, validation, holdout) positions; InputError before a survey, or where it was for fewer."""
        if self.grid is None or len(self.random) < validation + holdout:
            raise InputError("expected point lights whose free places are known, found none; survey the scene first")
        random = np.array(self.random, np.float64).reshape(-1, 3)
        return np.array(self.grid, np.float64).reshape(-1, 3), random[:validation], random[validation : validation + holdout]

    def record(self) -> dict[str, Any]:
        """For the manifest: spacing and box, and the positions by a checksum, since the lights hold them."""
        places = json.dumps([self.grid, self.random])
        return {"spacing": self.spacing, "box": self.box, "positions": hashlib.sha256(places.encode()).hexdigest()}


def survey(
    settings: BakeSettings, job: dict[str, Any], blender: Path | None = None, say: Callable[[str], None] = lambda line: None
) -> BakeSettings:
    """The same settings with the lamps that are free in the scene of `job` (srbf.bake.run.base_job), as Blender finds them.

    BakeError where there are none, or so few free places that random ones cannot be found.
    """
    points = settings.points
    if points is None or points.grid is not None:
        return settings
    asked = {"spacing": points.spacing, "box": points.box, "random": settings.validation + settings.holdout, "seed": settings.seed}
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        found: dict[str, Any] | None = None
        with Worker(
            {**job, "scratch": str(scratch), "lights": [], "survey": {"points": asked}}, scratch, scratch / "survey.log", blender
        ) as worker:
            for event in worker.events():
                if event["event"] == "warning":
                    say(event["message"])
                elif event["event"] == "survey":
                    found = event["points"]
    if found is None:
        raise BakeError("expected Blender to survey the scene for point lights, found no answer; run the same command again")
    x0, y0, z0, x1, y1, z1 = found["box"]
    grid, random = (tuple((x, y, z) for x, y, z in found[key]) for key in ("grid", "random"))
    bounds = f"{x0:.4g},{y0:.4g},{z0:.4g} to {x1:.4g},{y1:.4g},{z1:.4g} m"
    say(f"{len(grid)} point lights in the box {bounds}; {found['skipped']} places in or at geometry are left out")
    return replace(settings, points=replace(points, box=(x0, y0, z0, x1, y1, z1), grid=grid, random=random))
