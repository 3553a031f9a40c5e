"""docs/gallery.md, written from what the steps measured: no figure in it is typed."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import srbf
from scripts.gallery.places import Places
from scripts.gallery.scenes import Fit
from scripts.gallery.steps import Steps
from scripts.gallery.words import INTRODUCTION, TITLES, WORDS
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.evaluation.rate_distortion import family_of, name_of, texel_bytes
from srbf.io import files

FIGURE = "error-by-bytes.webp"
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight")


def text(made: Sequence[Places], steps: Steps, folder: str) -> str:
    """The page, its pictures in `folder` beside it."""
    parts = [INTRODUCTION.format(folder=folder, figure=FIGURE)]
    parts += [_scene(places, steps, folder) for places in made]
    parts.append(_time(made, steps))
    return "\n\n".join(parts) + "\n"


def _scene(places: Places, steps: Steps, folder: str) -> str:
    scene = places.scene
    parts = [f"## {TITLES[scene.name]}", WORDS[scene.name].strip()]
    parts.append(f"![{scene.name}: rendered and relit under held-out lights]({folder}/{places.strip.name})")
    parts.append(f"![{scene.name} under lights that move]({folder}/{places.clip.name})")
    parts.append(_point_lights(places, folder))
    parts.append(_bake_table(places, steps))
    parts.append(_asset_table(places, steps))
    return "\n\n".join(part for part in parts if part)


def _point_lights(places: Places, folder: str) -> str:
    fit = places.scene.moved[0]
    if not places.point_light_strip.is_file() or not places.point_light_errors(fit).is_file():
        return ""
    errors = files.read_json(places.point_light_errors(fit))
    relit, alone, count = errors["relit"], errors["alone"], _number(len(errors["lights"]))
    words = (
        f"The lantern against {count} true Cycles lamps on its path (a bake of point lights), and in brackets its\n"
        "direct light alone, without what the asset holds: "
        f"relative RMSE **{relit['relative_rmse']:.2f}** ({alone['relative_rmse']:.2f}),\n"
        f"without the worst pixel in a hundred, highlights and Cycles' own sparks, **{relit['rest']:.2f}** ({alone['rest']:.2f});\n"
        f"mean brightness {100 * relit['brightness']:.0f} % ({100 * alone['brightness']:.0f} %) of the true one."
    )
    return f"{words}\n\n![Three true lamps, relit, and their direct light alone]({folder}/{places.point_light_strip.name})"


def _bake_table(places: Places, steps: Steps) -> str:
    capture = Capture.open(places.capture)
    trained, held = len(capture.indices("train")), len(capture.indices("holdout"))
    settings = places.scene.bake_settings()
    sun = f"{np.degrees(settings.sun_angle):.1f}°" if settings.sun_angle else "a point"
    samples = f"{settings.samples}" if places.scene.dome else f"{settings.samples}, held out {settings.holdout_samples}"
    cells = {
        "receiver": ", ".join(f"`{word}`" for word in places.scene.receivers),
        "texels": f"{capture.width} × {capture.height}",
        "lights": f"{trained} and {held} held out",
        "samples": samples,
        "sun": sun,
        "transport": capture.transport,
        "bake": duration(steps.made(f"{places.scene.name}/bake").seconds),
        "capture": f"{size_of(places.capture) / 2**20:.0f} MiB",
    }
    return _table([list(cells), list(cells.values())])


def _asset_table(places: Places, steps: Steps) -> str:
    rows = [["asset", "bytes a texel", "fit", "held-out PSNR", "relative RMSE"]]
    for fit in places.scene.fits:
        asset, error = Asset.open(places.asset(fit)), files.read_json(places.errors(fit))["holdout"]
        seconds = steps.made(f"{places.scene.name}/fit {fit.folder}").seconds
        rows.append(
            [_named(fit, asset), f"{texel_bytes(asset):g}", duration(seconds), f"{error['psnr']:.2f} dB", f"{error['relative_rmse']:.3f}"]
        )
    return _table(rows)


def _named(fit: Fit, asset: Asset) -> str:
    name = f"{family_of(asset)}, {name_of(asset)}" if fit.method == "auto" else fit.label
    return f"{fit.label}: {name}" if fit.method == "auto" else name


def _time(made: Sequence[Places], steps: Steps) -> str:
    rows = [["", *(places.scene.name for places in made), "all"]]
    kinds: dict[str, tuple[str, ...]] = {
        "build and bake": ("build", "bake", "photograph", "import", "bake true lamps"),
        "fit": ("fit",),
        "measure": ("evaluate", "compare methods"),
        "draw": ("strip", "clip", "lamp strip"),
    }
    totals = np.zeros(len(made) + 1)
    for kind, starts in kinds.items():
        seconds = [steps.spent(places.scene.name, starts) for places in made]
        totals += [*seconds, sum(seconds)]
        rows.append([kind, *map(duration, seconds), duration(sum(seconds))])
    rows.append(["**together**", *map(duration, totals[:-1]), f"**{duration(totals[-1])}**"])
    whole = steps.total([places.scene.name for places in made])
    times = {1: "once", 2: "twice"}.get(whole.interrupted, f"{_number(whole.interrupted)} times")
    stopped = "" if not whole.interrupted else f" It was stopped, and gone on with, {times}."
    source = Capture.open(made[0].rendered).manifest["source"]
    cores = f"{_number(os.cpu_count() or 1)} {platform.machine()} cores that other work shared"
    versions = f"srbf {srbf.__version__}, Blender {blender_version(source)}, Python {platform.python_version()}, numpy {np.__version__}"
    return (
        f"## How long it took\n{_table(rows)}\n\n"
        f"Wall time of every step, summed, on {cores}; CPU time of all processes {duration(whole.cpu)}.{stopped} {versions}; no GPU."
    )


def blender_version(source: dict[str, Any]) -> str:
    """As a capture names the one that rendered it."""
    return str(source.get("blender", "unknown"))


def _table(rows: Sequence[Sequence[str]]) -> str:
    head, *body = rows
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(row) + " |" for row in body)])


def _number(count: int) -> str:
    return NUMBERS[count] if count < len(NUMBERS) else str(count)


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def size_of(folder: Path) -> int:
    """Bytes of all files below a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
