"""What only the scene knows, asked before a bake is planned: a collection's objects, a receiver's texels, where lamps may stand."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbf.bake.folder import STATE
from srbf.bake.job import base_job
from srbf.bake.run import Bake
from srbf.bake.settings import LARGEST_SIDE, BakeSettings
from srbf.bake.worker import Worker
from srbf.capture import MANIFEST
from srbf.errors import BakeError, InputError, ManifestError
from srbf.io import files

MULTIPLE = 4  # of texels, that a side found by density is rounded up to: what block compression needs


def survey(bake: Bake, asked: dict[str, Any], say: Callable[[str], None] = lambda line: None) -> dict[str, Any]:
    """The facts `asked` for of the scene of `bake`, see `blender_bake.survey`; it is opened by a worker of its own, nothing is written."""
    bake.check_scene()
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        job = {**base_job(bake.scene, bake.settings, scratch), "survey": asked}
        facts: dict[str, Any] | None = None
        with Worker(job, scratch, scratch / "bake.log", bake.blender) as worker:
            for event in worker.events(say):
                if event["event"] == "survey":
                    facts = event
    if facts is None:
        raise BakeError("expected a survey of the scene from Blender, found none; run again, and look at the scene if it happens twice")
    return facts


def objects_of(bake: Bake, collections: list[str], say: Callable[[str], None] = lambda line: None) -> list[str]:
    """Names of the receivers that the scene's collections hold, children included, in order of name."""
    return list(survey(bake, {"collections": collections}, say)["objects"])


def with_size(bake: Bake, texels_per_meter: float | None = None, say: Callable[[str], None] = lambda line: None) -> Bake:
    """The same bake with the size that its receiver takes: of a list of vertices, or of a lightmap of a mean density.

    The square's side is D sqrt(area in the world / area of the UV layer), rounded up to a multiple of 4; InputError where that is past
    16384, with the density to take. A bake that needs neither is returned as it is.
    """
    if bake.settings.receiver.kind == "vertices":
        if texels_per_meter is not None:
            raise InputError("`texels_per_meter` belongs to a lightmap, found it with vertices")
        facts = survey(bake, {"vertices": True}, say)
        return _sized(bake, facts["width"], facts["height"])
    if texels_per_meter is None:
        return bake
    if bake.settings.receiver.kind != "lightmap":
        raise InputError("`texels_per_meter` belongs to a lightmap, found it with a view; give its `size`")
    if not (texels_per_meter > 0 and math.isfinite(texels_per_meter)):
        raise InputError(f"expected `texels_per_meter` above 0, found {texels_per_meter:g}")
    facts = survey(bake, {"texels_per_meter": texels_per_meter}, say)
    side = MULTIPLE * math.ceil(facts["side"] / MULTIPLE)
    if side > LARGEST_SIDE:
        most = math.floor(LARGEST_SIDE * math.sqrt(facts["uv_area"] / facts["world_area"]) * 100) / 100
        raise InputError(
            f"expected a lightmap of at most {LARGEST_SIDE} texels a side, found {side} at {texels_per_meter:g} texels a meter on "
            f"{facts['world_area']:.4g} square meters; take `texels_per_meter={most:g}` or less, or `separate=True` lightmaps"
        )
    say(f"{side}x{side} texels: {texels_per_meter:g} a meter on {facts['world_area']:.4g} square meters, UVs fill {facts['uv_area']:.0%}")
    return _sized(bake, side, side)


def with_frame(bake: Bake, longer: int, anew: bool, say: Callable[[str], None] = lambda line: None) -> Bake:
    """The same bake of a view in the shape of its camera's frame, in square pixels, `longer` on the longer side.

    A capture that its folder holds already keeps its size, unless it is to be made `anew`.
    """
    before = None if anew else size_of_begun(bake.folder)
    if before is not None:
        return _sized(bake, *before)
    found = survey(bake, {"frame": True}, say)["frame"]
    aspect = float(found["aspect"])
    width, height = (longer, max(1, round(longer / aspect))) if aspect >= 1 else (max(1, round(longer * aspect)), longer)
    say(f"{width}x{height} texels: the shape of the camera's frame, {found['text']}; `size=WxH` gives another")
    return _sized(bake, width, height)


def size_of_begun(folder: Path) -> tuple[int, int] | None:
    """(width, height) of the capture in `folder`, finished or not; None where there is none to read."""
    for name in (STATE, MANIFEST):
        if (folder / name).is_file():
            with suppress(ManifestError, KeyError, TypeError, ValueError):
                recorded = files.read_json(folder / name)
                settings = (recorded["source"] if name == MANIFEST else recorded)["settings"]
                return int(settings["width"]), int(settings["height"])
    return None


def with_free_point_lights(bake: Bake, say: Callable[[str], None] = lambda line: None) -> Bake:
    """The same bake with the lamps that are free in its scene, where it is one under point lights whose places are not known yet."""
    settings, points = bake.settings, bake.settings.points
    if points is None or points.grid is not None:
        return bake
    random = settings.validation + settings.holdout
    found = survey(bake, {"points": {"spacing": points.spacing, "box": points.box, "random": random, "seed": settings.seed}}, say)["points"]
    x0, y0, z0, x1, y1, z1 = found["box"]
    grid, free = (tuple((x, y, z) for x, y, z in found[key]) for key in ("grid", "random"))
    say(
        f"{len(grid)} point lights in the box {x0:.4g},{y0:.4g},{z0:.4g} to {x1:.4g},{y1:.4g},{z1:.4g} m; "
        f"{found['skipped']} places in or at geometry are left out"
    )
    known = replace(points, box=(x0, y0, z0, x1, y1, z1), grid=grid, random=free)
    return replace(bake, settings=replace(settings, points=known))


def _sized(bake: Bake, width: int, height: int) -> Bake:
    settings: BakeSettings = replace(bake.settings, width=width, height=height)
    return replace(bake, settings=settings)
