"""Compare bounces of Godot's own lights with numpy's, by the light that Godot lays on surfels with its shadow maps; exits 1 if they differ.

As scripts/test_godot.py, in the same chroot: an omni light, a spot, two colored lights, and a sun through an open roof, on both
renderers; an environment through a window, objects that emit, and objects that are repainted. Numbers are relative root mean squares: of
the light on the surfels, and of the picture. numpy has the edge of Godot's spots here; by its own, spots differ by 0.06.
    python scripts/test_godot_surfels.py [--keep] [--parts 2] [--only WORD]
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import godot_renderers as godot
import numpy as np
from godot_lights import Lit
from godot_surfels import Shown, assets
from numpy import ndarray

from srbf.asset import Asset
from srbf.export.godot import write
from srbf.methods import in_asset_frame, relight
from srbf.methods.kept_visibility import light_on_patches

MOST = 0.05  # of the picture: numpy sees each cell's middle by a ray, Godot its squares by shadow maps
ALONE = 0.003  # of the picture without Godot's lights, whose passes differ from numpy by half floats: 0.0016 was measured


def relative(found: ndarray, wanted: ndarray) -> float:
    return float(np.sqrt(((found - wanted) ** 2).sum() / (wanted**2).sum()))


def compare(title: str, asset: Asset, lights: dict[str, Shown], parts: int, chroot: Path, keep: bool) -> int:
    """Print a line per renderer and set of lights; returns the number of differences."""
    folder = Path(tempfile.mkdtemp(prefix="srbf-", dir=chroot / "tmp"))
    write(asset, folder)
    for script in ("godot_surfels.gd", "godot_scene.gd"):
        shutil.copy(godot.ROOT / "tests" / "export" / script, folder)
    jobs = [{**lights[name].job(), "parts": parts, "output": f"{name}.raw"} for name in lights]
    (folder / "jobs.json").write_text(json.dumps(jobs))
    godot.run(folder, chroot, "--headless", "--import")
    on_patches = light_on_patches(asset)
    areas = np.bincount(asset.tables["cells"][1, :, 3].round().astype(int), asset.tables["cells"][0, :, 3])[:, None]
    missed, none = 0, np.zeros((len(areas), 3))
    for renderer, arguments in godot.RENDERERS.items():
        godot.run(folder, chroot, *arguments, "--script", "res://godot_surfels.gd", display=True)
        for name, shown in lights.items():
            with edge_of(shown.lights):
                wanted = relight(*shown.meant(asset)) / np.pi
                lit = np.sum(
                    [on_patches(light) for light in in_asset_frame(asset, [lit.light() for lit in shown.lights])] or [none], axis=0
                )
            found = read(folder / f"{name}.raw")[: wanted.size // 3].reshape(wanted.shape)
            received = read(folder / f"received_{name}.raw")[: len(lit)]
            error = relative(found[asset.covered], wanted[asset.covered])
            most = MOST if shown.lights else ALONE
            missed += error > most
            spread = relative(received * np.sqrt(areas), lit * np.sqrt(areas)) if lit.any() else float(np.abs(received).max())
            verdict = "" if error <= most else "  MISSED"
            godot.say(f"{title:22}{renderer:18}{name:12}{spread:9.4f}{error:9.4f}{verdict}")
    if keep:
        godot.say(f"kept {folder}")
    else:
        shutil.rmtree(folder)
    return missed


def edge_of(lights: list[Lit]) -> AbstractContextManager[Any]:
    """numpy with the edge of Godot's spots in place of a smooth step."""
    edge = next((lit.spot[1] for lit in lights if lit.spot is not None), 1.0)

    def cone(cosine: ndarray, inner: float, outer: float) -> ndarray:
        return np.asarray(1 - np.clip((1 - cosine) / (1 - outer), 1e-4, 1) ** (1 / edge))

    return patch("srbf.visibility.received.spot_cone", cone)


def read(path: Path) -> ndarray:
    """(n, 3) pixels row by row."""
    return np.frombuffer(path.read_bytes(), np.float32).reshape(-1, 4)[:, :3].astype(np.float64)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", action="store_true", help="leave the projects in the chroot's /tmp")
    parser.add_argument("--parts", type=int, default=2, help="pixels along each side of a surfel")
    parser.add_argument("--only", default="", metavar="WORD", help="only assets with this word in their title")
    arguments = parser.parse_args()
    chroot = godot.chroot_of_godot()
    godot.say(f"{'asset':22}{'renderer':18}{'lights':12}{'surfels':>9}{'picture':>9}")
    with tempfile.TemporaryDirectory() as scratch:
        missed = sum(
            compare(title, asset, lights, arguments.parts, chroot, arguments.keep)
            for title, asset, lights in assets(Path(scratch))
            if arguments.only in title
        )
    if missed:
        sys.exit(f"{missed} pictures differ from numpy's by more than {MOST}, or {ALONE} without lights")
    godot.say("all within the bound")


if __name__ == "__main__":
    main()
