"""The demo: one of our scenes baked, fitted and shown, from nothing to a folder one wants to look at."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import srbf
from srbf import files
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.budget import within_budget
from srbf.capture import Capture, Quantity
from srbf.errors import BakeError, InputError, OutputExistsError
from srbf.evaluation import TrainWatch, evaluate
from srbf.report import write_report


@dataclass(frozen=True)
class DemoScene:
    """What the article showed of a scene: its receiver, and in what quantity."""

    receiver: Receiver
    size: tuple[int, int]
    quantity: Quantity


HOLDOUT_SAMPLES = 24  # fewer than a bake's default: both scenes are clean by then, and the demo is to take minutes
SCENES = {
    "caustics": DemoScene(Receiver("lightmap", "Table"), (256, 256), "irradiance"),
    "house": DemoScene(Receiver("view"), (256, 192), "radiance"),
}


def scene_script(name: str) -> Path:
    """The bpy script of a demo scene: in the checkout's data/scenes, or beside the installed package."""
    package = Path(srbf.__file__).parent
    for folder in (package.parent / "data" / "scenes", package / "data" / "scenes"):
        if (folder / f"{name}.py").is_file():
            return folder / f"{name}.py"
    raise InputError(f"expected a demo scene of {', '.join(SCENES)} with its script installed, found none named {name!r}")


def build_scene(name: str, path: Path) -> None:
    """Run the scene's script in a process of its own to write the .blend at `path`; BakeError with its last words on failure."""
    temporary = path.with_name(f".{path.stem}.partial.blend")
    finished = subprocess.run(
        [sys.executable, str(scene_script(name)), str(temporary)], capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False
    )
    if finished.returncode != 0 or not temporary.is_file():
        temporary.unlink(missing_ok=True)
        lines = (finished.stderr or finished.stdout).strip().splitlines()
        raise BakeError(f"expected the scene {name} to build, found status {finished.returncode}: {lines[-1] if lines else 'no message'}")
    temporary.replace(path)


def run_demo(name: str, folder: Path, lights: int, reporter: Reporter, progress: Callable[[int, int, str], None]) -> Path:
    """Build, bake, fit, evaluate and report the scene `name` in `folder`; returns the page. Run again, it goes on where it stopped."""
    scene = SCENES[name]
    files.make_folder(folder)
    blend, capture_folder, asset_folder = folder / f"{name}.blend", folder / "capture", folder / "asset"
    timings: dict[str, float] = {}
    clock = time.perf_counter
    started = clock()
    if not blend.is_file():
        reporter.say(f"building {blend}")
        build_scene(name, blend)
    settings = BakeSettings(scene.receiver, *scene.size, lights=lights, holdout_samples=HOLDOUT_SAMPLES, quantity=scene.quantity)
    reporter.say(f"baking {lights} directions at {scene.size[0]}x{scene.size[1]} with Cycles")
    try:
        baked = Bake(blend, capture_folder, settings).run(reporter)
    except OutputExistsError as error:
        raise OutputExistsError(
            f"expected this demo's own capture at {capture_folder}, found another; choose another -o, or delete it"
        ) from error
    if baked:
        timings["bake"] = clock() - started
    capture = Capture.open(capture_folder)
    started = clock()
    method = within_budget(capture, say=reporter.say)
    watch = TrainWatch(capture)
    asset = method.encode(capture, lambda done, total: progress(done, total, "fit"), watch.look)
    timings["fit"] = clock() - started
    started = clock()
    errors = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"), watch=watch)
    asset.manifest["error"] = {role: error for role, error in errors.items() if role != "lights"}
    timings["evaluate"] = clock() - started
    asset.save(asset_folder, force=True)
    reporter.say("drawing the report")
    files.make_folder(folder / "report")
    page = write_report(asset, capture, folder / "report", evaluation=errors, timings=timings, asset_folder=asset_folder)
    holdout, size = asset.manifest["error"]["holdout"], asset.bytes_per_texel()["directional"]
    reporter.say(f"held-out PSNR {holdout['psnr']:.2f} dB, relative RMSE {holdout['relative_rmse']:.3f}, at {size} bytes a texel")
    return page
