"""Facts that only the scene knows, queried before a bake is planned: a collection's objects, a receiver's size, free places for lights."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbf.bake.folder import STATE
from srbf.bake.run import Bake, require_scene
from srbf.bake.settings import LARGEST_SIDE, BakeSettings
from srbf.bake.worker import Worker
from srbf.errors import BakeError, InputError, ManifestError
from srbf.io import files
from srbf.receiver_images import MANIFEST

MULTIPLE = 4  # texels that a side computed from a density is rounded up to: block compression needs it


def ask_scene(
    scene: Path,
    question: dict[str, Any],
    say: Callable[[str], None] = lambda line: None,
    scene_name: str | None = None,
    blender: Path | None = None,
) -> dict[str, Any]:
    """The facts that a `question` asks of a .blend, see `blender_bake.scene_query`; needs no bake, and writes nothing.

    scene_name: which scene of the .blend; None: the active one. blender: an installed Blender's executable; None: this Python's bpy.
    `say` gets a line for each warning. Raises InputError where there is no .blend, BakeError where Blender fails.
    """
    require_scene(scene)
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        job = {"scene": str(scene.resolve()), "scene_name": scene_name, "scratch": str(scratch.resolve()), "query": question}
        facts: dict[str, Any] | None = None
        with Worker(job, scratch, scratch / "bake.log", blender) as worker:
            for event in worker.events(say):
                if event["event"] == "facts":
                    facts = event
    if facts is None:
        raise BakeError("expected facts of the scene from Blender, found none; run again, and look at the scene if it happens twice")
    return facts


def objects_of(
    scene: Path,
    collections: list[str],
    say: Callable[[str], None] = lambda line: None,
    scene_name: str | None = None,
    blender: Path | None = None,
) -> list[str]:
    """Names of the receivers in a scene's collections, children included, in order of name. Arguments and errors as of `ask_scene`."""
    return list(ask_scene(scene, {"collections": collections}, say, scene_name, blender)["objects"])


def _ask(bake: Bake, question: dict[str, Any], say: Callable[[str], None]) -> dict[str, Any]:
    return ask_scene(bake.scene, question, say, bake.settings.scene, bake.blender)


def with_size(bake: Bake, texels_per_meter: float | None = None, say: Callable[[str], None] = lambda line: None) -> Bake:
    """The bake with the size of its receiver: of a list of vertices, or of a lightmap of `texels_per_meter`; others are unchanged.

    A lightmap is square, its side D sqrt(area in the world / area of the UV layer) rounded up to a multiple of 4; InputError where that
    is above 16384, with a density to use instead.
    """
    if bake.settings.receiver.kind == "vertices":
        if texels_per_meter is not None:
            raise InputError("expected `texels_per_meter` with a lightmap, found it with vertices")
        facts = _ask(bake, {"vertices": bake.settings.receiver.job()}, say)
        return _sized(bake, facts["width"], facts["height"])
    if texels_per_meter is None:
        return bake
    if bake.settings.receiver.kind != "lightmap":
        raise InputError("expected `texels_per_meter` with a lightmap, found it with a view; give its `size`")
    if not (texels_per_meter > 0 and math.isfinite(texels_per_meter)):
        raise InputError(f"expected `texels_per_meter` above 0, found {texels_per_meter:g}")
    facts = _ask(bake, {"texels_per_meter": texels_per_meter, "receiver": bake.settings.receiver.job()}, say)
    side = MULTIPLE * math.ceil(facts["side"] / MULTIPLE)
    if side > LARGEST_SIDE:
        most = math.floor(LARGEST_SIDE * math.sqrt(facts["uv_area"] / facts["world_area"]) * 100) / 100
        raise InputError(
            f"expected a lightmap of at most {LARGEST_SIDE} texels per side, found {side} at {texels_per_meter:g} texels per meter on "
            f"{facts['world_area']:.4g} square meters; use `texels_per_meter={most:g}` or less, or `separate` lightmaps"
        )
    say(f"{side}x{side} texels: {texels_per_meter:g} per meter on {facts['world_area']:.4g} square meters, UVs fill {facts['uv_area']:.0%}")
    return _sized(bake, side, side)


def with_frame(bake: Bake, longer: int, replacing: bool, say: Callable[[str], None] = lambda line: None) -> Bake:
    """The bake of a view in the shape of its camera's frame, in square pixels, `longer` on the longer side.

    A capture that its folder holds keeps its size, unless it is to be replaced (`replacing`).
    """
    before = None if replacing else size_of_begun(bake.folder)
    if before is not None:
        return _sized(bake, *before)
    found = _ask(bake, {"frame": True}, say)["frame"]
    aspect = float(found["aspect"])
    width, height = (longer, max(1, round(longer / aspect))) if aspect >= 1 else (max(1, round(longer * aspect)), longer)
    say(f"{width}x{height} texels: the shape of the camera's frame, {found['text']}; `size` gives another")
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
    """The bake with the positions of its point lights, free places of its scene; unchanged where they are known, or it has none."""
    settings, points = bake.settings, bake.settings.points
    if points is None or points.grid is not None:
        return bake
    random = settings.validation + settings.holdout
    question = {"points": {"spacing": points.spacing, "box": points.box, "random": random, "seed": settings.seed}}
    found = _ask(bake, question, say)["points"]
    x0, y0, z0, x1, y1, z1 = found["box"]
    grid, free = (tuple((x, y, z) for x, y, z in found[key]) for key in ("grid", "random"))
    say(
        f"{len(grid)} point lights in the box {x0:.4g},{y0:.4g},{z0:.4g} to {x1:.4g},{y1:.4g},{z1:.4g} m; "
        f"{found['skipped']} places in or near geometry are left out"
    )
    known = replace(points, box=(x0, y0, z0, x1, y1, z1), grid=grid, random=free)
    return replace(bake, settings=replace(settings, points=known))


def _sized(bake: Bake, width: int, height: int) -> Bake:
    settings: BakeSettings = replace(bake.settings, width=width, height=height)
    return replace(bake, settings=settings)
