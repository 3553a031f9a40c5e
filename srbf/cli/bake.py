"""`srbf bake`: a Blender scene under many lights becomes a capture."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Literal

import typer

from srbf.bake.cubemap_set import WORD, CubemapSet
from srbf.bake.cubemap_trace import totals
from srbf.bake.estimate import estimate
from srbf.bake.gather_set import GatherSet
from srbf.bake.light_choice import Goal, with_chosen_lights
from srbf.bake.light_sets import parse_light_set
from srbf.bake.openjd import PARAMETERS, TEMPLATE, write_bundle
from srbf.bake.point_lights import PointGrid
from srbf.bake.run import Bake, Reporter
from srbf.bake.scene_query import objects_of, with_frame, with_free_point_lights, with_light_set, with_size
from srbf.bake.settings import BakeSettings, LightSet, Receiver, captures_of, folder_names
from srbf.bake.shard import Shard
from srbf.bake.worker_pool import WorkerPoolSettings
from srbf.cli import bake_parameters as flag
from srbf.cli.flags import flags_alone
from srbf.cli.parameters import Blender, Output
from srbf.cli.terminal import json_line, json_progress_lines, note, progress_bar
from srbf.cli.values import Size

DEFAULT_SIZE = 256  # texels on the longer side
DEFAULT_LIGHTS = 400
UNLIMITED = 1 << 16  # samples per texel: more than any bake's time allows


def bake(
    scene: flag.Scene,
    output: Output,
    blender: Blender = None,
    json_progress: flag.JsonProgress = False,
    scene_name: flag.SceneName = None,
    receiver: flag.Receivers = None,
    collection: flag.Collections = None,
    separate: flag.Separate = False,
    uv_layer: flag.UvLayer = None,
    unwrap: flag.UnwrapBy = "smart",
    no_cast_shadow: flag.NoCastShadow = None,
    keep_scene_lights: flag.KeepSceneLights = False,
    lights: flag.Lights = None,
    domain: flag.DomainOfLights = None,
    light_list: flag.LightList = None,
    light_set: flag.LightSet = None,
    light_group: flag.LightGroups = None,
    patches: flag.PatchCount = None,
    surfels_per_m2: flag.SurfelDensity = None,
    pool: flag.PoolSize = None,
    view_clusters: flag.ViewClusterCount = None,
    gather: flag.GatherCount = None,
    operator: flag.OperatorOf = "rays",
    sparse: flag.Sparse = False,
    full: flag.Full = False,
    sparse_by: flag.SparseBy = None,
    grid: flag.GridSpacing = None,
    light_bounds: flag.LightBounds = None,
    sun_angle: flag.SunAngle = "0",
    transport: flag.TransportOf = None,
    gloss: flag.Gloss = None,
    validation: flag.ValidationLights = None,
    holdout: flag.HoldoutLights = 32,
    size: flag.SizeOf = None,
    texels_per_meter: flag.TexelsPerMeter = None,
    samples: flag.Samples = None,
    share: flag.ShareOf = None,
    time_limit: flag.TimeLimit = None,
    error: flag.ErrorGoal = None,
    holdout_samples: flag.HoldoutSamples = 64,
    denoise: flag.Denoise = False,
    quantity: flag.QuantityOf = None,
    seed: flag.Seed = 0,
    workers: flag.Workers = 1,
    lights_per_worker: flag.LightsPerWorker = 500,
    worker_timeout: flag.WorkerTimeout = None,
    dask: flag.DaskScheduler = None,
    shard: flag.ShardOf = None,
    farm: flag.FarmOf = None,
    farm_tasks: flag.FarmTasks = None,
    keep_accumulation: flag.KeepAccumulation = False,
    dry_run: flag.DryRun = False,
    force: flag.Overwrite = False,
    restart: flag.Restart = False,
) -> None:
    """Bake SCENE under many lights, one at a time, in passes. If it is stopped, the same command resumes it."""
    count = DEFAULT_LIGHTS if lights in (None, "auto") else lights
    goal = _goal(lights, time_limit, error, share, sun_angle, light_set, light_list)
    width, height = size or Size(DEFAULT_SIZE, DEFAULT_SIZE)
    with flags_alone():
        named = [Receiver.parse(word, uv_layer, unwrap) for word in receiver or []]
        by_grid = light_set is not None and light_set.startswith("point:")
        points = PointGrid.parse(str(light_set), light_bounds) if by_grid else None
        inside: LightSet | None = None
        if light_set == GatherSet.kind:
            inside = GatherSet.parse(pool, view_clusters, light_bounds, gather)
        elif light_set is not None and light_set.startswith(WORD):
            inside = CubemapSet.parse(light_set, sparse, full, sparse_by, light_bounds)
        elif light_set is not None and not by_grid:
            inside = parse_light_set(light_set, light_group or (), count, patches, grid, light_bounds, surfels_per_m2, operator)
    if not (named or collection):
        raise typer.BadParameter("expected a --receiver or a --collection, found neither; name one, as in --receiver lightmap:OBJECT")
    for name, value in (
        ("--light-bounds", light_bounds),
        ("--light-group", light_group),
        ("--patches", patches),
        ("--grid", grid),
        ("--surfels-per-m2", surfels_per_m2),
        ("--operator cycles", operator == "cycles"),
    ):
        if value and (light_set is None or (by_grid and name != "--light-bounds")):
            raise typer.BadParameter(f"expected --light-set named, cloud, patches or surfels with {name}, found {light_set or 'none'}")
    for name, value in (("--sparse", sparse), ("--full", full), ("--sparse-by", sparse_by)):
        if value and not isinstance(inside, CubemapSet):
            raise typer.BadParameter(f"expected --light-set cubemap:SIDE with {name}, found {light_set or 'none'}")
    gathers = light_set == GatherSet.kind
    for name, value in (("--pool", pool), ("--view-clusters", view_clusters), ("--gather", gather)):
        if value is not None and not gathers:
            raise typer.BadParameter(f"expected --light-set gather with {name}, found {light_set or 'none'}")
    for name, value in (("--light-group", light_group), ("--patches", patches), ("--grid", grid), ("--surfels-per-m2", surfels_per_m2)):
        if value and (gathers or isinstance(inside, CubemapSet)):
            raise typer.BadParameter(f"expected --light-set {light_set} without {name}, found both; leave it out")
    if operator == "cycles" and (gathers or isinstance(inside, CubemapSet)):
        raise typer.BadParameter(f"expected --light-set surfels with --operator cycles, found {light_set}")
    if domain is not None and light_set is not None:
        raise typer.BadParameter(f"expected --light-set {light_set} without --domain, found both: it is of directions; leave it out")
    traced = inside is not None and inside.kind in ("surfels", "gather", "cubemap")
    for name, value, is_unused in (
        ("--lights", lights, traced or operator == "cycles"),
        ("--samples", samples, traced),
        ("--time-limit", time_limit, isinstance(inside, CubemapSet)),
    ):
        if value is not None and is_unused:
            raise typer.BadParameter(
                f"expected --light-set {light_set} without {name}, found both: it has no train lights to render; leave it out"
            )
    if size is not None and not collection and all(one.kind in ("vertices", "probes") for one in named):
        note(f"--size is not used: it sets the texels of lightmaps and views, and the receivers are {named[0].kind}")
    workers_of = WorkerPoolSettings(workers, lights_per_worker, worker_timeout)

    def plan(one: Receiver, folder: Path) -> Bake:
        with flags_alone():
            settings = BakeSettings(
                receiver=one,
                width=width,
                height=height,
                lights=count,
                domain=domain or "hemisphere",
                samples=samples or (UNLIMITED if time_limit is not None else 2 if share in (None, 1) and goal is None else 1),
                validation=(0 if gathers else 16) if validation is None else validation,
                holdout=holdout,
                holdout_samples=holdout_samples,
                quantity=quantity or ("radiance" if one.kind == "view" or gloss is not None else "irradiance"),
                seed=seed,
                sun_angle=0.0 if sun_angle == "auto" else sun_angle,
                keep_scene_lights=keep_scene_lights,
                light_list=light_list,
                transport=transport or ("indirect" if gathers else "combined"),
                points=points,
                light_set=inside,
                no_shadow=tuple(no_cast_shadow or ()),
                denoise=denoise,
                scene=scene_name,
                gloss=gloss,
                step=1 if share is None else share,
            )
            if sun_angle == "auto" and light_set is not None:
                raise typer.BadParameter("expected directional lights with --sun-angle auto, found --light-set; leave one of them out")
        settings = settings.with_matched_sun() if sun_angle == "auto" else settings
        with flags_alone():
            return Bake(scene, folder, settings, blender, workers_of, time_limit, keep_accumulation, dask)

    if collection:
        known = {one.name for one in named if one.kind == "lightmap"}
        members = objects_of(scene, collection, note, scene_name, blender)
        named += [Receiver("lightmap", name, uv_layer, unwrap=unwrap) for name in members if name not in known]
    with flags_alone():
        captures = captures_of(named, separate)
    several = len(captures) > 1 or separate
    jobs = [plan(one, output / name if several else output) for one, name in zip(captures, folder_names(captures), strict=True)]
    for job in jobs:
        _check_spread(job, shard, farm, restart or force)
    if sun_angle == "auto":
        sun = jobs[0].settings.sun_angle
        note(f"a sun of {sun:.4g} rad ({degrees(sun):.1f} degrees), the mean light spacing")
    for job in jobs:
        job = with_size(job, texels_per_meter if job.settings.receiver.kind == "lightmap" or not several else None, note)
        if size is None and job.settings.receiver.kind == "view":
            job = with_frame(job, DEFAULT_SIZE, force or restart, note)
        if goal is not None:
            job = with_chosen_lights(job, goal, force or restart, note)
        job = with_light_set(with_free_point_lights(job, note), note)
        if farm is not None:
            write_bundle(job, job.folder, farm_tasks, force)
            note(f"wrote {job.folder / TEMPLATE}; try it by: openjd run {job.folder / TEMPLATE} -p file://{job.folder / PARAMETERS}")
            continue
        if dry_run:
            for line in estimate(job, note):
                typer.echo(line)
            continue
        with json_progress_lines() if json_progress else progress_bar("bake") as update:
            baked = job.run(Reporter(update, note), force, restart, shard)
        note(f"{_done(shard)} {job.folder}" if baked else f"{job.folder} is complete already")
    if json_progress and not dry_run and farm is None and (told := totals([job.folder for job in jobs])) is not None:
        json_line(told)


def _goal(
    lights: int | str | None,
    time_limit: float | None,
    error: float | None,
    share: int | None,
    sun_angle: float | str,
    light_set: str | None,
    light_list: Path | None,
) -> Goal | None:
    """What `--lights auto` is to reach; wrong usage where other flags decide what it would, or `--error` is without it."""
    if lights != "auto":
        if error is not None:
            raise typer.BadParameter(f"expected --lights auto with --error, found {lights or 'none'}; give it, or leave --error out")
        return None
    for name, value in (("--share", share), ("--light-set", light_set), ("--light-list", light_list)):
        if value is not None:
            raise typer.BadParameter(f"expected --lights auto without {name}, found both: a probe decides; leave one of them out")
    if sun_angle == "auto":
        raise typer.BadParameter("expected an angle with --lights auto, found --sun-angle auto, which follows from their number")
    with flags_alone():
        return Goal(time_limit, error)


def _done(shard: Shard | None) -> str:
    if shard is None:
        return "baked"
    return "prepared" if shard.is_preparation else f"baked shard {shard.name} of"


def _check_spread(job: Bake, shard: Shard | None, farm: Literal["openjd"] | None, again: bool) -> None:
    """Wrong usage where ways to spread the work exclude each other, or need to know how much there is to do."""
    given = [name for name, value in (("--dask", job.dask), ("--shard", shard), ("--farm", farm)) if value is not None]
    if len(given) > 1:
        raise typer.BadParameter(f"expected one way to spread the work, found {' and '.join(given)}; leave one")
    if given and isinstance(job.settings.light_set, CubemapSet):
        raise typer.BadParameter(
            f"expected --light-set cubemap:SIDE without {given[0]}, found both: one process traces its rays; leave it out"
        )
    if job.dask is not None and job.pool.workers > 1:
        raise typer.BadParameter("expected --workers without --dask, found both; start as many dask workers instead")
    if job.is_open_ended and (shard is not None or farm is not None):
        raise typer.BadParameter(
            f"{given[0]} needs to know how much there is to do: expected --samples COUNT, found --samples auto or --time-limit"
        )
    if shard is not None and not shard.is_preparation and again:
        raise typer.BadParameter("--force and --restart would drop what other shards baked; give them with --shard prepare")
