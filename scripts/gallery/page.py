"""Writes docs/gallery.md from the measurements of the steps; no figure is typed by hand."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import srbf
from scripts.gallery.captions import CAPTIONS, INTRODUCTION, TITLES
from scripts.gallery.paths import ScenePaths
from scripts.gallery.scenes import Fit
from scripts.gallery.steps import Steps
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.evaluation.rate_distortion import family_of, name_of, texel_bytes
from srbf.io import files

FIGURE = "error-by-bytes.webp"
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight")


def text(made: Sequence[ScenePaths], steps: Steps, folder: str) -> str:
    """The page's Markdown; its pictures are in `folder` beside it."""
    parts = [INTRODUCTION.format(folder=folder, figure=FIGURE)]
    parts += [_scene(paths, steps, folder) for paths in made]
    parts.append(_time(made, steps))
    return "\n\n".join(parts) + "\n"


def _scene(paths: ScenePaths, steps: Steps, folder: str) -> str:
    scene = paths.scene
    parts = [f"## {TITLES[scene.name]}", CAPTIONS[scene.name].strip()]
    parts.append(f"![{scene.name}: rendered and relit under held-out lights]({folder}/{paths.strip.name})")
    parts.append(f"![{scene.name} under lights that move]({folder}/{paths.clip.name})")
    parts.append(_point_lights(paths, folder))
    parts.append(_bake_table(paths, steps))
    parts.append(_asset_table(paths, steps))
    return "\n\n".join(part for part in parts if part)


def _point_lights(paths: ScenePaths, folder: str) -> str:
    fit = paths.scene.moved[0]
    if not paths.point_light_strip.is_file() or not paths.point_light_errors(fit).is_file():
        return ""
    errors = files.read_json(paths.point_light_errors(fit))
    relit, alone, count = errors["relit"], errors["alone"], _number(len(errors["lights"]))
    words = (
        f"The lantern against {count} true Cycles point lights on its path (a bake of point lights), and in brackets its\n"
        "direct light alone, without the asset's maps: "
        f"relative RMSE **{relit['relative_rmse']:.2f}** ({alone['relative_rmse']:.2f}),\n"
        f"without the worst 1 % of pixels (highlights and Cycles' fireflies) **{relit['rest']:.2f}** ({alone['rest']:.2f});\n"
        f"mean brightness {100 * relit['brightness']:.0f} % ({100 * alone['brightness']:.0f} %) of the true one."
    )
    return f"{words}\n\n![Three true point lights, relit, and their direct light alone]({folder}/{paths.point_light_strip.name})"


def _bake_table(paths: ScenePaths, steps: Steps) -> str:
    capture = Capture.open(paths.capture)
    trained, held = len(capture.indices("train")), len(capture.indices("holdout"))
    settings = paths.scene.bake_settings()
    sun = f"{np.degrees(settings.sun_angle):.1f}°" if settings.sun_angle else "a point"
    samples = f"{settings.samples}" if paths.scene.dome else f"{settings.samples}, held out {settings.holdout_samples}"
    cells = {
        "receiver": ", ".join(f"`{word}`" for word in paths.scene.receivers),
        "texels": f"{capture.width} × {capture.height}",
        "lights": f"{trained} and {held} held out",
        "samples": samples,
        "sun": sun,
        "transport": capture.transport,
        "bake": duration(steps.made(f"{paths.scene.name}/bake").seconds),
        "capture": f"{size_of(paths.capture) / 2**20:.0f} MiB",
    }
    return _table([list(cells), list(cells.values())])


def _asset_table(paths: ScenePaths, steps: Steps) -> str:
    rows = [["asset", "bytes per texel", "fit", "held-out PSNR", "relative RMSE"]]
    for fit in paths.scene.fits:
        asset, error = Asset.open(paths.asset(fit)), files.read_json(paths.errors(fit))["holdout"]
        seconds = steps.made(f"{paths.scene.name}/fit {fit.folder}").seconds
        rows.append(
            [_named(fit, asset), f"{texel_bytes(asset):g}", duration(seconds), f"{error['psnr']:.2f} dB", f"{error['relative_rmse']:.3f}"]
        )
    return _table(rows)


def _named(fit: Fit, asset: Asset) -> str:
    name = f"{family_of(asset)}, {name_of(asset)}" if fit.method == "auto" else fit.label
    return f"{fit.label}: {name}" if fit.method == "auto" else name


def _time(made: Sequence[ScenePaths], steps: Steps) -> str:
    rows = [["", *(paths.scene.name for paths in made), "all"]]
    kinds: dict[str, tuple[str, ...]] = {
        "build and bake": ("build", "bake", "photograph", "import", "bake true point lights"),
        "fit": ("fit",),
        "measure": ("evaluate", "compare methods"),
        "draw": ("strip", "clip", "point light strip"),
    }
    totals = np.zeros(len(made) + 1)
    for kind, starts in kinds.items():
        seconds = [steps.spent(paths.scene.name, starts) for paths in made]
        totals += [*seconds, sum(seconds)]
        rows.append([kind, *map(duration, seconds), duration(sum(seconds))])
    rows.append(["**together**", *map(duration, totals[:-1]), f"**{duration(totals[-1])}**"])
    whole = steps.total([paths.scene.name for paths in made])
    times = {1: "once", 2: "twice"}.get(whole.interrupted, f"{_number(whole.interrupted)} times")
    stopped = "" if not whole.interrupted else f" It was resumed {times}."
    source = Capture.open(made[0].rendered).manifest["source"]
    cores = f"{_number(os.cpu_count() or 1)} shared {platform.machine()} cores"
    versions = f"srbf {srbf.__version__}, Blender {blender_version(source)}, Python {platform.python_version()}, numpy {np.__version__}"
    return (
        f"## Time\n{_table(rows)}\n\n"
        f"Wall time of every step, summed, on {cores}; CPU time of all processes {duration(whole.cpu)}.{stopped} {versions}; no GPU."
    )


def blender_version(source: dict[str, Any]) -> str:
    """The version of Blender that rendered a capture, from its `source`."""
    return str(source.get("blender", "unknown"))


def _table(rows: Sequence[Sequence[str]]) -> str:
    head, *body = rows
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(row) + " |" for row in body)])


def _number(count: int) -> str:
    return NUMBERS[count] if count < len(NUMBERS) else str(count)


def duration(seconds: float) -> str:
    """Seconds as text: `9.1 s`, `12 s` or `1 min 7 s`."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def size_of(folder: Path) -> int:
    """Total size of all files below a folder, in bytes."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
