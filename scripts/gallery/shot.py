"""`python -m scripts.gallery.shot [FOLDER]`: docs/shot.md, a shot lit three ways from one bake, beside renders by Cycles of each.

Builds, bakes and fits the loft with its gloss and its own lights, unless FOLDER (out/shot) has them. For each rig: our picture, as a
light is moved and as a light changes its color; a reference by Cycles; Cycles with few samples and its denoiser, the preview that a
lighting artist has without us. All times are of this run and this machine's CPU.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray
from PIL import Image

from scripts.gallery.drawing import gain_of, label, picture, save
from srbf.asset import Asset
from srbf.bake.given_reference import render_given
from srbf.errors import MissingLibraryError
from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.flip import Flip
from srbf.light_entries import entry_of
from srbf.lights import AreaLight, Light, PointLight, SphereLight
from srbf.relighting.light_rig import LightRig
from srbf.relighting.scene_lights import scene_lights

ROOT = Path(__file__).resolve().parents[2]
SIZE = (320, 240)
REFERENCE, PREVIEW = 256, 16  # samples
GAP = 6
TEXT = """# A shot, lit three ways
`python -m scripts.gallery.shot` writes this page. One bake of `data/scenes/loft.py`, with its gloss, at {width} × {height}: {bake:.0f} s;
one fit: {fit:.0f} s; {bytes:.0f} MB in memory. After that no light needs a render: each row below is the same asset under other lights.

![Each row: relit, Cycles with {reference} samples, Cycles with {preview} samples and its denoiser](images/shot.webp)

- *As designed*: the {lights} lights that the scene has, by `srbf relight --scene-lights`.
- *Night*: four of them stay on, three of these dimmed; a blue area light stands for a window.
- *Carried*: all are off but a warm sphere of 6 cm that somebody carries past the table, and the strip over the counter.

Times of our picture, of Cycles with {reference} samples and of the preview: {preview} samples, denoised. Errors are pairs: ours, the
preview's.

| rig | lights | all of it | one light moves | a color changes | Cycles | preview | relative RMSE | PSNR, dB | FLIP |
|---|---|---|---|---|---|---|---|---|---|
{rows}

*All of it* computes every light for the first time, by numpy, and is slower than the reference where many lights have a size: changes
after that are what pays. Nearly all of that time is direct light by rays, without visible noise, of lights with a size; bounces take
0.4 to 0.9 CPU seconds a light ([measurements.md](measurements.md)). The viewer does the same on a GPU, by shadow maps. Cycles' times
are without opening the scene (two cores, no GPU). Errors are against the reference, whose own noise counts in both. For colors alone,
Cycles' light groups are an alternative: they keep an image per group, and mixing adds no noise, but no light can move or change its
cone; [measurements.md](measurements.md) compares them with `--light-set named`.
"""


@dataclass(frozen=True, eq=False)
class Row:
    """One rig: pictures (H, W, 3), and seconds."""

    name: str
    lights: int
    relit: ndarray
    reference: ndarray
    preview: ndarray
    seconds: Mapping[str, float]


def rigs(own: Mapping[str, Light]) -> dict[str, tuple[list[Light], Light]]:
    """By name: the lights of a rig, and the one that moves, as it is after that; it is the last of the rig."""
    dimmed: list[Any] = [own["Reading light"], own["Desk light"], own["Counter strip"]]
    window = AreaLight((7.6, 0.25, 1.6), color=(0.35, 0.5, 1.0), u=(1.2, 0.0, 0.0), v=(0.0, 0.0, 1.0), a0=4.0)
    carried = SphereLight((3.0, 1.2, 1.3), (1.6, 1.15, 0.7), falloff="inverse-square", size=0.06)
    night = [replace(light, color=tuple(0.6 * np.array(light.color))) for light in dimmed]
    designed = [light for name, light in own.items() if name != "Reading light"] + [own["Reading light"]]
    return {
        "As designed": (designed, _beside(designed[-1])),
        "Night": ([own["Pendant 2"], *night, window], _beside(window)),
        "Carried": ([own["Counter strip"], carried], _beside(carried)),
    }


def _beside(light: Any) -> Light:
    x, y, z = light.position
    return replace(light, position=(x + 0.05, y + 0.05, z))


def made(folder: Path) -> tuple[Path, Asset, dict[str, float]]:
    """(scene, asset, seconds of bake and fit), made if they are not there."""
    scene, capture, asset, times = folder / "loft.blend", folder / "capture", folder / "asset", folder / "seconds.txt"
    folder.mkdir(parents=True, exist_ok=True)
    if not times.is_file():
        subprocess.run([sys.executable, ROOT / "data" / "scenes" / "loft.py", scene, "--unlit"], check=True, capture_output=True)
        size = f"{SIZE[0]}x{SIZE[1]}"
        flags = ["--receiver", "view", "--size", size, "--light-set", "gather", "--holdout", "0", "--seed", "77", "--force"]
        bake = _seconds(lambda: subprocess.run(["srbf", "bake", scene, "-o", capture, *flags], check=True))
        fit = _seconds(lambda: subprocess.run(["srbf", "fit", capture, "-o", asset, "--force"], check=True))
        times.write_text(f"{bake} {fit}")
    bake, fit = map(float, times.read_text().split())
    return scene, Asset.open(asset), {"bake": bake, "fit": fit}


def row(scene: Path, asset: Asset, name: str, lights: list[Light], moved: Light) -> Row:
    """One rig, relit and rendered."""
    with LightRig(asset, "ray") as rig:
        rig.picture([PointLight((4.0, 2.5, 2.0))])  # makes ready what all lights share
        seconds = {"all": _seconds(lambda: rig.picture(lights))}
        relit = rig.picture(lights)
        seconds["move"] = _seconds(lambda: rig.picture([*lights[:-1], moved]))
        colored = replace(moved, color=(1.0, 0.2, 0.2))
        seconds["color"] = _seconds(lambda: rig.picture([*lights[:-1], colored]))
    entries = [entry_of(light) for light in lights]
    reference = render_given(asset, scene, entries, REFERENCE, _told(name))
    preview = render_given(asset, scene, entries, PREVIEW, seed=2, denoised=True)
    seconds |= {"reference": reference.render_seconds, "preview": preview.render_seconds}
    return Row(name, len(lights), relit, reference.image, preview.image, seconds)


def line(row: Row, covered: ndarray) -> str:
    """Of the page's table."""
    shown = [image[covered].astype(np.float64) for image in (row.relit, row.preview)]
    reference = row.reference[covered].astype(np.float64)
    errors = [np.sqrt(((image - reference) ** 2).mean()) for image in shown]
    relative = [f"{error / np.sqrt((reference**2).mean()):.1%}" for error in errors]
    ratios = [f"{psnr(float(np.quantile(reference, 0.999)), float(error)):.1f}" for error in errors]
    try:
        flip = Flip(0.0)
        flips = [f"{flip.error_map(row.reference, image, covered)[covered].mean():.3f}" for image in (row.relit, row.preview)]
    except MissingLibraryError:
        flips = ["–", "–"]
    s = row.seconds
    times = [
        f"{s['all']:.1f} s",
        f"{s['move']:.1f} s",
        f"{s['color']:.2f} s",
        f"{s['reference']:.0f} s",
        f"{s['preview']:.1f} s",
    ]
    return "| " + " | ".join([row.name, str(row.lights), *times, *(", ".join(pair) for pair in (relative, ratios, flips))]) + " |"


def sheet(rows: list[Row]) -> Image.Image:
    """A row of three pictures for each rig."""
    width, height = SIZE
    drawn = Image.new("RGB", (3 * width + 2 * GAP, len(rows) * (height + GAP) - GAP), "white")
    for number, one in enumerate(rows):
        gain = gain_of(one.reference, 0.98)
        named = (
            (f"{one.name}: relit", one.relit),
            (f"Cycles, {REFERENCE} samples", one.reference),
            (f"Cycles, {PREVIEW} samples, denoised", one.preview),
        )
        for column, (text, image) in enumerate(named):
            x, y = column * (width + GAP), number * (height + GAP)
            drawn.paste(picture(image, gain, SIZE), (x, y))
            label(drawn, x, y + height, text)
    return drawn


def _seconds(work: Callable[[], Any]) -> float:
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def _told(name: str) -> Callable[[int, int], None]:
    return lambda done, total: print(f"{name}: {done} of {total} samples", flush=True)


def main() -> None:
    """Write the page and its picture."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "out" / "shot"
    scene, asset, seconds = made(folder)
    own = scene_lights(asset)
    rows = [row(scene, asset, name, lights, moved) for name, (lights, moved) in rigs(own).items()]
    save(sheet(rows), ROOT / "docs" / "images" / "shot.webp")
    told = {"width": SIZE[0], "height": SIZE[1], "reference": REFERENCE, "preview": PREVIEW, "lights": len(own)}
    size = (sum(table.nbytes for table in asset.tables.values()) + asset.stored.nbytes) / 1e6
    text = TEXT.format(**told, **seconds, bytes=size, rows="\n".join(line(one, asset.covered) for one in rows))
    (ROOT / "docs" / "shot.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
