"""A bake and its fit as a render farm's job: an Open Job Description bundle (specification jobtemplate-2023-09).

Steps: Prepare; Bake, with a task per shard of the lights; Finish, which checks the images and writes the manifest; Fit.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from srbf.bake.cubemap_set import CubemapSet
from srbf.bake.gather_set import GatherSet
from srbf.bake.light_sets import NamedSet
from srbf.bake.run import Bake
from srbf.bake.settings import BakeSettings, LightSet, plan_lights
from srbf.errors import InputError
from srbf.io import files
from srbf.receiver_share import share_word

TEMPLATE = "template.json"
PARAMETERS = "parameters.json"
LIGHT_LIST = "lights.lp"
LIGHTS_PER_TASK = 32
NAME_LENGTH = 64  # of a job, at most
FIT = """import shlex, subprocess, sys

capture, asset, flags = sys.argv[1:]
command = [sys.executable, "-m", "srbf", "fit", capture, "-o", asset, *shlex.split(flags)]
sys.exit(subprocess.run(command).returncode)
"""


def write_bundle(bake: Bake, folder: Path, tasks: int | None, force: bool) -> None:
    """Write the job of `bake` into `folder`: template.json, and parameters.json with the scene's path.

    tasks: of the step Bake, see `template`. force: replace an earlier bundle. InputError where the number of samples is not fixed;
    OutputExistsError where the folder may not be replaced.
    """
    bake.check_scene()
    job = template(bake, tasks)
    with files.atomic_folder(folder, force, TEMPLATE) as temporary:
        files.write_json(temporary / TEMPLATE, job)
        files.write_json(temporary / PARAMETERS, {"Scene": str(bake.scene.resolve())})
        if bake.settings.light_list is not None:
            shutil.copyfile(bake.settings.light_list, temporary / LIGHT_LIST)


def template(bake: Bake, tasks: int | None = None) -> dict[str, Any]:
    """The job template of a bake. `tasks`: of the step Bake, at most one per light; None: one per LIGHTS_PER_TASK lights."""
    if bake.is_open_ended:
        raise InputError("expected a fixed number of `samples` with `farm`, found `samples=auto` or `time_limit`: a farm's tasks are fixed")
    lights = len(plan_lights(bake.settings))
    count = min(lights, tasks or -(-lights // LIGHTS_PER_TASK))
    command = ["-m", "srbf", "bake", "{{Param.Scene}}", "-o", "{{Param.Capture}}", *_flags(bake)]
    listed = [_path("LightList", "FILE", "IN", "Directions to fit.", LIGHT_LIST)] if bake.settings.light_list is not None else []
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": f"srbf {bake.scene.stem}"[:NAME_LENGTH],
        "parameterDefinitions": [
            _path("Scene", "FILE", "IN", "The .blend."),
            _path("Capture", "DIRECTORY", "INOUT", "Where the capture is written, visible to every machine of the farm.", "capture"),
            _path("Asset", "DIRECTORY", "OUT", "Where the asset is written.", "asset"),
            *listed,
            {"name": "FitFlags", "type": "STRING", "default": "", "description": "Flags of srbf fit."},
            {"name": "Python", "type": "STRING", "default": "python3", "description": "A Python with srbf installed."},
        ],
        "steps": [
            _step("Prepare", [*command, "--shard", "prepare"]),
            {
                **_step("Bake", [*command, "--shard", f"{{{{Task.Param.Shard}}}}/{count}"], "Prepare"),
                "parameterSpace": {"taskParameterDefinitions": [{"name": "Shard", "type": "INT", "range": f"1-{count}"}]},
            },
            _step("Finish", command, "Bake"),
            _step("Fit", ["{{Task.File.Fit}}", "{{Param.Capture}}", "{{Param.Asset}}", "{{Param.FitFlags}}"], "Finish", FIT),
        ],
    }


def arguments(settings: BakeSettings) -> list[str]:
    """The flags of `srbf bake` that give exactly these settings; a light list is the job's parameter."""
    receiver, points, inside = settings.receiver, settings.points, settings.light_set
    named = {
        "scene": settings.scene,
        "uv-layer": receiver.uv_layer,
        "unwrap": receiver.unwrap,
        "size": f"{settings.width}x{settings.height}",
        "lights": settings.lights if inside is None else None,
        "domain": settings.domain if inside is None and points is None else None,
        "samples": None if inside is not None and inside.kind in ("surfels", "gather") else settings.samples,
        "validation": settings.validation,
        "holdout": settings.holdout,
        "holdout-samples": settings.holdout_samples,
        "quantity": settings.quantity,
        "transport": settings.transport,
        "gloss": settings.gloss,
        "share": None if settings.step == 1 else share_word(settings.step),
        "seed": settings.seed,
        "sun-angle": repr(float(settings.sun_angle)),
        "light-set": None if points is None else f"point:{points.spacing!r}",
        "light-bounds": None if points is None or points.box is None else ",".join(map(repr, points.box)),
        **_light_set(inside),
        "light-list": None if settings.light_list is None else "{{Param.LightList}}",
    }
    words = [receiver.word, *(f"{receiver.kind}:{name}" for name in receiver.also)]
    flags = [f"--receiver={word}" for word in words] + [f"--{name}={value}" for name, value in named.items() if value is not None]
    flags += [f"--no-cast-shadow={name}" for name in settings.no_shadow]
    flags += [f"--light-group={name}" for name in getattr(settings.light_set, "groups", ())]
    flags += ["--keep-scene-lights"] if settings.keep_scene_lights else []
    return flags + (["--denoise"] if settings.denoise else [])


def _light_set(light_set: LightSet | None) -> dict[str, Any]:
    if light_set is None:
        return {}
    if isinstance(light_set, NamedSet):
        return {"light-set": light_set.kind}
    box = None if light_set.box is None else ",".join(map(repr, light_set.box))
    if isinstance(light_set, GatherSet):
        pool = light_set.count if light_set.gather is None else None
        own = {"pool": pool, "view-clusters": light_set.clusters, "gather": light_set.gather}
        return {"light-set": light_set.kind, **own, "light-bounds": box}
    if isinstance(light_set, CubemapSet):
        raise InputError("expected a bake of rendered lights for a farm, found `light_set` cubemap, which one process traces; bake it here")
    if light_set.kind == "surfels":
        density = None if light_set.spacing is None else round(light_set.spacing**-2, 6)
        return {"light-set": light_set.kind, "surfels-per-m2": density, "light-bounds": box}
    count = {"lights" if light_set.kind == "cloud" else "patches": light_set.count}
    return {"light-set": light_set.kind, **count, "grid": light_set.spacing, "light-bounds": box}


def _flags(bake: Bake) -> list[str]:
    pool = {
        "workers": bake.pool.workers,
        "lights-per-worker": bake.pool.lights_per_worker,
        "worker-timeout": bake.pool.worker_timeout,
        "blender": bake.blender,
    }
    flags = [f"--{name}={value}" for name, value in pool.items() if value is not None]
    flags += ["--keep-accumulation"] if bake.keep_accumulation else []
    for flag in (*flags, *arguments(bake.settings), bake.scene.stem):
        if "{{" in flag and flag != "--light-list={{Param.LightList}}":
            raise InputError(f"expected names without {{{{, which begins an expression of job templates, found {flag!r}; rename it")
    return [*arguments(bake.settings), *flags]


def _path(name: str, kind: str, flow: str, description: str, default: str | None = None) -> dict[str, Any]:
    given = {} if default is None else {"default": default}
    return {"name": name, "type": "PATH", "objectType": kind, "dataFlow": flow, "description": description, **given}


def _step(name: str, args: list[str], after: str | None = None, file: str | None = None) -> dict[str, Any]:
    script: dict[str, Any] = {"actions": {"onRun": {"command": "{{Param.Python}}", "args": args}}}
    if file is not None:
        script["embeddedFiles"] = [{"name": name, "type": "TEXT", "filename": f"{name.lower()}.py", "data": file}]
    depends = {} if after is None else {"dependencies": [{"dependsOn": after}]}
    return {"name": name, **depends, "script": script}
