"""The demo of photographs: a scene under a light dome, as 8-bit JPEGs with a light list that are imported and fitted as a user's own."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.demo import PAGE_FIT, Demo, Progress, Quality, Shown, Steps, bake_once, reported, scene_file, under_sun
from srbf.demo.photographs import DIRS, POINT_LIGHTS, TEST, Dome, photograph, write_point_lights
from srbf.evaluation.errors_by_role import evaluate
from srbf.importing.photographs import LightListImport
from srbf.io import files
from srbf.lights import DirectionalLight
from srbf.methods import FitRun

RAKING = DirectionalLight((-0.62, 0.55, 0.56))  # of a picture


@dataclass(frozen=True)
class Photographs:
    """A dome, pixels per side of its square photographs, and their samples."""

    dome: Dome
    side: int
    samples: int

    def settings(self, light_list: Path) -> BakeSettings:
        """Of the renders that become photographs."""
        return BakeSettings(
            Receiver("view"),
            self.side,
            self.side,
            samples=self.samples,
            validation=0,
            holdout=0,
            quantity="radiance",
            light_list=light_list,
        )


DOMES: dict[str, dict[Quality, Photographs]] = {
    "coin": {"draft": Photographs(Dome(48, 8, 12), 320, 4), "publish": Photographs(Dome(80, 20, 12), 512, 16)},
}


def dome_steps(name: str, folder: Path, reporter: Reporter, progress: Progress, quality: Quality = "draft") -> Steps:
    """Build, photograph, import and fit the scene `name` in `folder`, then evaluate and report it. Another run resumes it."""
    taken = DOMES[name][quality]
    dome = taken.dome
    files.make_folder(folder)
    blend, rendered, shots, asset_folder = folder / f"{name}.blend", folder / "dome", folder / "photographs", folder / "asset"
    timings: dict[str, float] = {}
    clock = time.perf_counter
    started = clock()
    scene_file(name, blend, reporter)
    write_point_lights(folder / POINT_LIGHTS, dome)
    reporter.say(f"taking {dome.point_lights + dome.tests} photographs of {taken.side}x{taken.side} with Cycles")
    if bake_once(Bake(blend, rendered, taken.settings(folder / POINT_LIGHTS)), reporter):
        timings["photographs"] = clock() - started
    started = clock()
    photograph(rendered, dome, shots)
    LightListImport(shots / DIRS, "srgb", shots / TEST).write(folder / "capture", force=True)
    timings["import"] = clock() - started
    started = clock()
    capture = Capture.open(folder / "capture")
    asset = PAGE_FIT.encode(capture, FitRun(lambda done, total: progress(done, total, "fit")))
    timings["fit"] = clock() - started
    asset.save(asset_folder, force=True)
    yield Shown(asset_folder, None, lambda: under_sun(asset, "none", RAKING))
    started = clock()
    errors = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"))
    timings["evaluate"] = clock() - started
    page = reported(asset, capture, folder, errors, timings, reporter, quality != "draft")
    holdout = errors["holdout"]
    found = f"{dome.tests} held-out photographs: relative RMSE {100 * holdout['relative_rmse']:.1f} %, {holdout['psnr']:.1f} dB"
    reporter.say(found)
    return Demo(page, (asset_folder,), folder / "capture", None, error=found)
