"""Facts that only the scene knows, queried before a bake is planned: a collection's objects, a receiver's size, free places for lights."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from srbf.bake.cubemap_set import CubemapSet
from srbf.bake.folder import STATE
from srbf.bake.gather_set import GatherSet
from srbf.bake.light_sets import LIGHT_SET_FILE, MOST_NAMES, MOST_SURFELS, SURFEL_SIZE, CloudSet, FoundPlaces, NamedSet
from srbf.bake.probes import facts_line, grid_of
from srbf.bake.run import Bake, require_scene
from srbf.bake.settings import LARGEST_SIDE, BakeSettings, LightSet
from srbf.bake.surface_checks import require_surfels, warn_of_fewer, warn_of_surfaces
from srbf.bake.worker import Worker
from srbf.compute.allocator import freed_memory_kept
from srbf.errors import BakeError, InputError, ManifestError
from srbf.io import files
from srbf.receiver_images import MANIFEST
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.patches import patches_of, unemitting
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.surfel_parts import parts_of
from srbf.visibility.surfels import surfels_of

SHOWN = 8  # names in a line
OPEN = 0.2  # share of rays that leave the scene, from which it is called open
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
    `say` gets a line for each warning. `arrays` of the facts are those that the worker handed over in files.
    Raises InputError where there is no .blend, BakeError where Blender fails.
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
                    facts["arrays"] = {key: np.load(scratch / file) for key, file in event.get("files", {}).items()}
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
    """The bake with the size of its receiver: of vertices, of probes, or of a lightmap of `texels_per_meter`; others are unchanged.

    A lightmap is square, its side D sqrt(area in the world / area of the UV layer) rounded up to a multiple of 4; InputError where that
    is above 16384, with a density to use instead.
    """
    kind = bake.settings.receiver.kind
    if kind in ("vertices", "probes") and texels_per_meter is not None:
        raise InputError(f"expected `texels_per_meter` with a lightmap, found it with {kind}")
    if kind == "probes":
        return _with_probes(bake, say)
    if kind == "vertices":
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


def _with_probes(bake: Bake, say: Callable[[str], None]) -> Bake:
    settings = bake.settings
    facts = _ask(bake, {"probes": {"spacing": settings.receiver.spacing, "seed": settings.seed}}, say)
    grid = grid_of(facts, settings.seed)
    say(facts_line(grid, facts["probes"]["moved"]))
    return _sized(replace(bake, settings=replace(settings, receiver=replace(settings.receiver, probes=grid))), *grid.image_size)


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


def with_light_set(bake: Bake, say: Callable[[str], None] = lambda line: None) -> Bake:
    """The bake with what its light set has of the scene: names, or free places and patches; unchanged where they are known.

    Those of a bake begun in its folder are kept, so that it resumes with the same lights. InputError where the scene has no light.
    """
    settings, light_set = bake.settings, bake.settings.light_set
    if light_set is None or light_set.is_known:
        return bake
    tested = settings.validation + settings.holdout
    if isinstance(light_set, (CloudSet, GatherSet, CubemapSet)):
        require_scene(bake.scene)
        key = light_set.key(files.sha256_of(bake.scene), tested, settings.seed, settings.scene)
        kept = light_set.read(bake.folder / LIGHT_SET_FILE, key)
        if kept.is_known:
            return replace(bake, settings=replace(settings, light_set=kept))
    question = {"required": settings.receiver.job(), **light_set.question(tested, settings.seed)}
    found = _ask(bake, question, say)
    known: LightSet
    if isinstance(light_set, NamedSet):
        entries = tuple((entry["name"], tuple(entry["objects"])) for entry in found["named"])
        if not entries:
            raise InputError(f"expected lights in {bake.scene}, found none: no light object, no emission and a black world; add one")
        if len(entries) > MOST_NAMES:
            raise InputError(f"expected at most {MOST_NAMES} named lights, found {len(entries)}; gather them by `light_group`")
        shown = ", ".join(repr(name) for name, _ in entries[:SHOWN])
        say(f"{len(entries)} named lights: {shown}{', …' if len(entries) > SHOWN else ''}")
        known = replace(light_set, entries=entries)
    elif isinstance(light_set, GatherSet):
        known = light_set.with_facts(found, say)
    elif isinstance(light_set, CubemapSet):
        known = light_set.with_surfels(_with_places(light_set.surfels, found, settings.seed, say, distant=True))
    else:
        known = _with_places(light_set, found, settings.seed, say)
    return replace(bake, settings=replace(settings, light_set=known))


@freed_memory_kept()
def _with_places(light_set: CloudSet, found: dict[str, Any], seed: int, say: Callable[[str], None], distant: bool = False) -> CloudSet:
    """The set with free places and patches, from the facts of its scene; `distant`: no light of it is inside the scene."""
    arrays, places = found["arrays"], found["places"]
    x0, y0, z0, x1, y1, z1 = places["box"]
    free = np.array(places["places"], np.float64).reshape(-1, 3)
    occluders = EmbreeTriangles(arrays["occluders"])
    surfels, names = None, tuple(found.get("surface_objects", ()))
    if light_set.kind == "surfels":
        opaque = arrays["transparent"] < 0.5
        surfaces = Fragments(arrays["corners"][opaque], arrays["albedo"][opaque])
        warn_of_surfaces(surfaces, say)
        front = arrays["emission"][opaque]
        emission = np.stack([front, np.where(arrays["one_sided"][opaque, None] > 0.5, 0, front)])
        objects = arrays["object"][opaque].astype(np.int64)
        most = light_set.count
        if light_set.spacing is None:
            most = int(np.clip(surfaces.areas.sum() / SURFEL_SIZE**2, most, MOST_SURFELS))
        surfels = surfels_of(surfaces, objects, occluders, free, light_set.spacing, most, emission)
        require_surfels(surfels)
        if light_set.spacing is not None:
            warn_of_fewer(surfels, light_set.spacing, most, say)
        patches = unemitting(parts_of(surfels))
    else:
        patches = patches_of(Fragments(arrays["corners"], arrays["albedo"]), occluders, free, light_set.patch_count, seed)
    if patches.count == 0:
        raise InputError(
            "expected surfaces that reflect light around the free places, found none; choose another `light_bounds`, or make them diffuse"
        )
    train, random = (np.array(places[key], np.float64).reshape(-1, 3) for key in ("train", "random"))
    lights = {"patches": f"{patches.count} patches", "cloud": f"{len(train)} point lights"}.get(light_set.kind, f"{patches.count} surfels")
    skipped = f"; {places['skipped']} places are in or near geometry" if light_set.kind == "cloud" else ""  # others have no train lights
    say(f"{lights} in the box {x0:.4g},{y0:.4g},{z0:.4g} to {x1:.4g},{y1:.4g},{z1:.4g} m{skipped}")
    if places.get("open_share", 0) > OPEN and not distant:
        say(
            f"the scene is open: {places['open_share']:.0%} of rays from the free places leave it; lights are captured in that box "
            f"alone, and {'environments by what surfels see' if surfels is not None else 'distant light is not'}: `light_bounds` gives "
            "another box"
        )
    box = (x0, y0, z0, x1, y1, z1)
    return replace(
        light_set, found=FoundPlaces(train, random, free, box, patches, surfels, names if surfels is not None else (), found.get("bounces"))
    )


def _sized(bake: Bake, width: int, height: int) -> Bake:
    settings: BakeSettings = replace(bake.settings, width=width, height=height)
    return replace(bake, settings=settings)
