"""The dry run: time and disk of a bake, estimated from a few renders of one light."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from srbf.bake.checks import bytes_needed
from srbf.bake.cubemap_set import CubemapSet, seconds_of_rays
from srbf.bake.gather_set import GatherSet
from srbf.bake.job import base_job
from srbf.bake.planned_lights import PlannedLight
from srbf.bake.request import RenderRequest
from srbf.bake.run import Bake
from srbf.bake.schedule import next_samples
from srbf.bake.settings import plan_lights
from srbf.bake.worker import Worker
from srbf.compute.threads import cores
from srbf.cubemap import Cubemap
from srbf.io.image import write_image

PROBE_SAMPLES = 4  # more than that of the other probe: enough to separate the fixed cost per light from the cost per sample
SOURCES = {  # of train lights, by light set
    "named": "lights of the scene",
    "cloud": "point lights in free space",
    "patches": "patches of the surfaces",
    "gather": "links of view clusters to a pool of surfels in place of train lights",
    "cubemap": "directions of a cubemap in place of train lights, by rays",
    "surfels": "form factors of surfels in place of train lights",
}
SAMPLED = "gather samples of view clusters in place of train lights"
TRACED = {"gather": "links by rays", "surfels": "form factors by rays"}  # what comes on top of the lights


def estimate(bake: Bake, say: Callable[[str], None] = lambda line: None) -> list[str]:
    """Lines with scene, receiver, lights, disk and time of `bake`; its folder is not written to.

    A light is rendered three times in a scratch folder; errors of scene and receiver are raised as the bake would raise them.
    """
    settings = bake.settings
    bake.check_scene()
    if bake.is_open_ended:
        settings = replace(settings, samples=1)
    lights = plan_lights(settings)
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        scratch = Path(name)
        counts = (1, 1, 1 + PROBE_SAMPLES) if lights else ()  # a light set may have none
        probe = lights[len(lights) // 3] if lights else None
        requests = [RenderRequest(replace(probe, index=i), n, probe.seed, channels=probe.parts) for i, n in enumerate(counts) if probe]
        job = base_job(bake.scene, settings, scratch, requests)
        facts: dict[str, Any] = {}
        seconds, image_bytes = [0.0] * 3, 0
        with Worker(job, scratch, scratch / "bake.log", bake.blender) as worker:
            for event in worker.events(say):
                if event["event"] == "scene":
                    facts = event
                elif event["event"] == "rendered" and probe is not None:
                    seconds[event["light"]] = event["seconds"]
                    image_bytes = 0
                    for part, file in event["files"].items():
                        pixels = np.clip(np.load(scratch / file), -6e4, 6e4)
                        write_image(scratch / "probe.exr", pixels[:, :, :3], "half")
                        image_bytes += (scratch / "probe.exr").stat().st_size * (len(probe.harmonics_files) if part == "toward" else 1)
    # The first render includes passing the scene to Cycles: the second and third give the cost of the others.
    per_sample = max(0.0, seconds[2] - seconds[1]) / PROBE_SAMPLES
    fixed = max(0.0, seconds[1] - per_sample)
    ambient = 2 * settings.holdout_samples  # as the scene emits, and with all of it off
    passes = [_passes(light) for light in lights]
    time = (sum(passes) + 2) * fixed + (sum(light.samples for light in lights) + ambient) * per_sample
    summed = len(lights) if bake.keeps_accumulation else sum(count > 1 for count in passes)
    disk = len(lights) * image_bytes + bytes_needed(settings, 0, summed)
    sampled = settings.light_set.cost(settings.width * settings.height) if isinstance(settings.light_set, GatherSet) else None
    if sampled is not None:
        disk, time = disk + sampled[0], time + sampled[1] / cores()
    where = next(path for path in (bake.folder.resolve(), *bake.folder.resolve().parents) if path.exists())
    free = shutil.disk_usage(where).free
    roles = Counter(light.role for light in lights)
    if settings.light_set is not None:
        train_from = SOURCES[settings.light_set.kind] if sampled is None else SAMPLED
    elif settings.points is not None:
        train_from = f"point lights {settings.points.spacing:g} m apart"
    else:
        train_from = settings.domain if settings.light_list is None else "from the light list"
        train_from += f", a sun of {np.degrees(settings.sun_angle):.3g} degrees"
    train, at = roles["train"], _samples(bake)
    if isinstance(settings.light_set, CubemapSet):
        count = settings.width * settings.height if facts["receivers"][0]["kind"] == "lightmap" else facts["receivers"][0]["count"]
        count = facts.get("covered_texels", count)
        train, at = Cubemap(settings.light_set.side).count, "a ray"
        roles.update({"validation": settings.validation, "holdout": settings.holdout})
        time = seconds_of_rays(settings.light_set, count)
        disk = count * train // 8
    first, *more = facts["receivers"]
    receiver = ", ".join(f"{key} {value}" for key, value in first.items() if key != "kind") + (f" and {len(more)} more" if more else "")
    covered = f", {facts['covered_texels']} texels covered" if "covered_texels" in facts else ""
    return [
        f"scene      {bake.scene} (Blender {facts['blender']})",
        f"receiver   {first['kind']}: {receiver}, {settings.width}x{settings.height}{covered}, {settings.quantity}",
        f"lights     {train} train at {at}, {roles['validation']} validation and "
        f"{roles['holdout']} holdout at {settings.holdout_samples}, {train_from}",
        f"disk       about {disk / 1e6:.0f} MB ({free / 1e9:.1f} GB free)",
        f"time       {_time(bake, time, bool(lights))}",
    ]


def _time(bake: Bake, seconds: float, has_lights: bool) -> str:
    light_set = bake.settings.light_set
    traced = TRACED.get(light_set.kind) if light_set is not None else None
    if isinstance(light_set, GatherSet) and light_set.gather is not None:
        traced = None  # estimated as well
    if traced is not None and not has_lights:
        return f"that of {traced}, which is not estimated"
    rendered = f"about {_duration(seconds)} {'per sample of all lights ' if bake.is_open_ended else ''}on this machine as loaded now"
    return rendered if traced is None else f"{rendered}, and that of {traced}, which is not estimated"


def _samples(bake: Bake) -> str:
    if bake.settings.samples == "auto":
        return "the samples that lower the error"
    return f"{bake.settings.samples} samples" if bake.time_limit is None else f"the samples that {_duration(bake.time_limit)} allow"


def _passes(light: PlannedLight) -> int:
    count = done = 0
    while done < light.samples:
        done += next_samples(light, done, light.samples)
        count += 1
    return count


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
