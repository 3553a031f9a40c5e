"""`srbf bake`: a Blender scene under many lights becomes a capture."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Annotated, Literal

import typer

from srbf.bake.estimate import estimate
from srbf.bake.openjd import PARAMETERS, TEMPLATE, write_bundle
from srbf.bake.point_lights import PointGrid
from srbf.bake.run import Bake, Reporter
from srbf.bake.scene_query import objects_of, with_frame, with_free_point_lights, with_size
from srbf.bake.settings import BakeSettings, Receiver, captures_of, folder_names
from srbf.bake.shard import Shard
from srbf.bake.worker_pool import WorkerPoolSettings
from srbf.cli.parameters import Blender, Dask, Force, Output, parse_duration, parse_samples, parse_size, parse_sun_angle
from srbf.cli.terminal import json_progress_lines, note, progress_bar
from srbf.errors import InputError

DEFAULT_SIZE = 256  # texels on the longer side
UNLIMITED = 1 << 16  # samples a texel: more than any bake's time allows


def bake(
    scene: Annotated[Path, typer.Argument(help="The .blend; it is not changed, and nothing in it runs.", show_default=False)],
    output: Output,
    scene_name: Annotated[
        str | None, typer.Option("--scene", help="Which scene of the .blend; default: the one it was saved in.", show_default=False)
    ] = None,
    receiver: Annotated[
        list[str] | None,
        typer.Option(
            help="lightmap:OBJECT, vertices:OBJECT or view[:CAMERA]; again for more: lightmaps share an atlas, others go to OUTPUT/NAME.",
            show_default=False,
        ),
    ] = None,
    collection: Annotated[
        list[str] | None, typer.Option(help="Every renderable mesh of a collection into the atlas.", show_default=False)
    ] = None,
    separate: Annotated[bool, typer.Option("--separate", help="A lightmap each instead of one atlas, in OUTPUT/NAME.")] = False,
    size: Annotated[
        str | None,
        typer.Option(
            help="Texels, WxH, or N for NxN. Default: 256x256; of a view, 256 on the longer side of its camera's frame.", show_default=False
        ),
    ] = None,
    texels_per_meter: Annotated[
        float | None, typer.Option(help="Mean density of a lightmap, which decides its size.", show_default=False)
    ] = None,
    unwrap: Annotated[
        Literal["smart", "lightmap-pack", "keep"], typer.Option(help="How a UV layer is made where none fits; keep: refuse.")
    ] = "smart",
    no_shadow: Annotated[
        list[str] | None, typer.Option(help="An object that light passes, such as a closed room's ceiling.", show_default=False)
    ] = None,
    denoise: Annotated[bool, typer.Option("--denoise", help="Denoise a view's fitted images by OpenImageDenoise.")] = False,
    lights: Annotated[int, typer.Option(help="Hammersley directions to fit.")] = 400,
    domain: Annotated[
        Literal["sphere", "hemisphere"], typer.Option(help="Where lights stand; hemisphere is above the ground.")
    ] = "hemisphere",
    samples: Annotated[
        str | None,
        typer.Option(
            help="Samples a texel of each fitted light; auto: until more no longer help. Default 2, with --time-limit all it allows."
        ),
    ] = None,
    time: Annotated[
        str | None, typer.Option("--time-limit", help="Stop when so much time is up: 90s, 30m, 8h. The same command adds more.")
    ] = None,
    validation: Annotated[int, typer.Option(help="Random lights that decisions may look at.")] = 16,
    holdout: Annotated[int, typer.Option(help="Random lights for the reported error alone.")] = 32,
    holdout_samples: Annotated[int, typer.Option(help="Samples a texel of validation, holdout and ambient.")] = 64,
    quantity: Annotated[
        Literal["radiance", "irradiance"] | None,
        typer.Option(help="Default: irradiance of a lightmap, radiance of a view.", show_default=False),
    ] = None,
    transport: Annotated[
        Literal["combined", "indirect"], typer.Option(help="All light, or all but the sun's direct diffuse light.")
    ] = "combined",
    seed: Annotated[int, typer.Option(help="Of the noise and of the random lights.")] = 0,
    uv_layer: Annotated[str | None, typer.Option(help="UV layer of a lightmap; default: the active one.", show_default=False)] = None,
    light_list: Annotated[
        Path | None, typer.Option(help="A .lp file of directions to fit, instead of --lights.", show_default=False)
    ] = None,
    light_set: Annotated[
        str | None,
        typer.Option(help="point:SPACING: a box filled with lamps so many meters apart, instead of --lights.", show_default=False),
    ] = None,
    light_box: Annotated[
        str | None, typer.Option(help="x0,y0,z0,x1,y1,z1 of --light-set, m; default: all that renders.", show_default=False)
    ] = None,
    sun_angle: Annotated[
        str, typer.Option(help="Angular diameter of the light, rad; auto: as large as the fitted lights stand apart.")
    ] = "0",
    keep_scene_lights: Annotated[bool, typer.Option("--keep-scene-lights", help="The scene's own lamps and world become ambient.")] = False,
    blender: Blender = None,
    workers: Annotated[int, typer.Option(help="Blender processes at a time.", min=1)] = 1,
    lights_per_worker: Annotated[int, typer.Option(help="Lights after which a Blender process is replaced.", min=1)] = 500,
    worker_timeout: Annotated[
        float | None,
        typer.Option(help="Seconds after which a silent Blender is replaced; default: learned from the lights before.", show_default=False),
    ] = None,
    keep_accumulation: Annotated[
        bool, typer.Option("--keep-accumulation", help="Keep what --samples N can later add to; --time-limit and auto do.")
    ] = False,
    dask: Dask = None,
    part: Annotated[
        str | None,
        typer.Option(
            "--shard",
            help="Bake all passes of the I-th of N shards alone, I/N, once `prepare` has been; a bake without it then finishes.",
            show_default=False,
        ),
    ] = None,
    farm: Annotated[
        Literal["openjd"] | None,
        typer.Option(help="Bake nothing: write a render farm's job into -o, an Open Job Description bundle.", show_default=False),
    ] = None,
    farm_tasks: Annotated[
        int | None, typer.Option(help="Tasks of the farm's bake; default: one for 32 lights.", min=1, show_default=False)
    ] = None,
    json_progress: Annotated[
        bool, typer.Option("--json-progress", help="Progress as JSON lines on stderr: done, total, what, seconds_left.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say receiver, lights, disk and time; bake nothing.")] = False,
    force: Force = False,
    restart: Annotated[bool, typer.Option("--restart", help="Drop a half-done capture of other settings and begin anew.")] = False,
) -> None:
    """Bake SCENE under many lights, one at a time, in passes. Stopped at any moment, the same command goes on."""
    width, height = parse_size(size or str(DEFAULT_SIZE))
    angle = parse_sun_angle(sun_angle)
    named = [Receiver.parse(word, uv_layer, unwrap) for word in receiver or []]
    if not (named or collection):
        raise InputError("expected a --receiver or a --collection, found neither; name one, as in --receiver lightmap:OBJECT")

    if light_set is None and light_box is not None:
        raise InputError("expected --light-set point:SPACING with --light-box, found none")
    crew = WorkerPoolSettings(workers, lights_per_worker, worker_timeout)

    def plan(one: Receiver, folder: Path) -> Bake:
        settings = BakeSettings(
            receiver=one,
            width=width,
            height=height,
            lights=lights,
            domain=domain,
            samples=_samples(samples, time),
            validation=validation,
            holdout=holdout,
            holdout_samples=holdout_samples,
            quantity=quantity or ("radiance" if one.kind == "view" else "irradiance"),
            seed=seed,
            sun_angle=0.0 if angle == "auto" else angle,
            keep_scene_lights=keep_scene_lights,
            light_list=light_list,
            transport=transport,
            points=None if light_set is None else PointGrid.parse(light_set, light_box),
            no_shadow=tuple(no_shadow or ()),
            denoise=denoise,
            scene=scene_name,
        )
        settings = settings.with_matched_sun() if angle == "auto" else settings
        return Bake(scene, folder, settings, blender, crew, None if time is None else parse_duration(time), keep_accumulation, dask)

    if collection:
        known = {one.name for one in named if one.kind == "lightmap"}
        inside = objects_of(scene, collection, note, scene_name, blender)
        named += [Receiver("lightmap", name, uv_layer, unwrap=unwrap) for name in inside if name not in known]
    captures = captures_of(named, separate)
    several = len(captures) > 1 or separate
    jobs = [plan(one, output / name if several else output) for one, name in zip(captures, folder_names(captures), strict=True)]
    if angle == "auto":
        sun = jobs[0].settings.sun_angle
        note(f"a sun of {sun:.4g} rad ({degrees(sun):.1f} degrees), as far as the fitted lights stand apart")
    for job in jobs:
        job = with_size(job, texels_per_meter if job.settings.receiver.kind == "lightmap" or not several else None, note)
        if size is None and job.settings.receiver.kind == "view":
            job = with_frame(job, DEFAULT_SIZE, force or restart, note)
        job = with_free_point_lights(job, note)
        _check_spread(job, part, farm, restart or force)
        if farm is not None:
            write_bundle(job, job.folder, farm_tasks, force)
            note(f"wrote {job.folder / TEMPLATE}; try it by: openjd run {job.folder / TEMPLATE} -p file://{job.folder / PARAMETERS}")
            continue
        if dry_run:
            for line in estimate(job, note):
                typer.echo(line)
            continue
        with json_progress_lines() if json_progress else progress_bar("bake") as update:
            baked = job.run(Reporter(update, note), force, restart, None if part is None else Shard.parse(part))
        what = {None: "baked", "prepare": "prepared"}.get(part, f"baked shard {part} of")
        note(f"{what} {job.folder}" if baked else f"{job.folder} is complete already")


def _check_spread(job: Bake, part: str | None, farm: str | None, anew: bool) -> None:
    """InputError where ways to spread the work exclude each other."""
    given = [name for name, value in (("--dask", job.dask), ("--shard", part), ("--farm", farm)) if value is not None]
    if len(given) > 1:
        raise InputError(f"expected one way to spread the work, found {' and '.join(given)}; leave one")
    if job.dask is not None and job.pool.workers > 1:
        raise InputError("--workers counts Blenders of this machine, found it with --dask; start as many dask workers instead")
    if part not in (None, "prepare") and anew:
        raise InputError("--force and --restart would drop what other shards baked; give them with --shard prepare")


def _samples(text: str | None, time: str | None) -> int | Literal["auto"]:
    if text is None:
        return 2 if time is None else UNLIMITED
    return parse_samples(text)
