"""The demo: one of the project's scenes built, baked, fitted and reported in one folder."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.errors import BakeError, InputError, MissingLibraryError, OutputExistsError
from srbf.evaluation.errors_by_role import TrainErrorAccumulator, evaluate
from srbf.export.scene_mesh import write_scene_mesh
from srbf.fitting.auto_method import within_budget
from srbf.io import files
from srbf.methods import FitRun
from srbf.methods.relighting_map import RelightingMap
from srbf.receiver_images import Quantity
from srbf.report import write_report


@dataclass(frozen=True)
class DemoScene:
    """A scene of the article: its receiver and quantity."""

    receiver: Receiver
    size: tuple[int, int]
    quantity: Quantity
    published: tuple[int, int]

    def settings(self, lights: int, quality: Quality) -> BakeSettings:
        """A `draft` takes a minute or two. `publish` has more texels, twice the samples, and on a lightmap a sun as wide as the mean light
        spacing, the sharpest shadows that so many lights resolve."""
        draft = BakeSettings(self.receiver, *self.size, lights=lights, holdout_samples=HOLDOUT_SAMPLES, quantity=self.quantity)
        if quality == "draft":
            return draft
        finer = replace(draft, width=self.published[0], height=self.published[1], samples=SAMPLES)
        return finer.with_matched_sun() if self.receiver.kind == "lightmap" else finer


Quality = Literal["draft", "publish"]
SAMPLES = 4  # of `publish`
MAPS = 25  # of the article's asset, beside the smallest good one
FINE_MAPS = 100  # as bytes, of `publish`: no cluster borders and little blur, at 400 bytes per texel
HOLDOUT_SAMPLES = 24  # fewer than a bake's default, enough for both scenes, to finish in minutes
SCENES = {
    "caustics": DemoScene(Receiver("lightmap", "Table"), (256, 256), "irradiance", (512, 512)),
    "house": DemoScene(Receiver("view"), (256, 192), "radiance", (512, 384)),
}


def scene_script(name: str) -> Path:
    """The bpy script of a scene: in the installed package blender_bake, or in the data/scenes of its checkout.

    MissingLibraryError without that package, which the distribution srbf-blender holds; InputError where it has no such scene.
    """
    package = importlib.util.find_spec("blender_bake")
    if package is None or package.origin is None:
        raise MissingLibraryError("expected the demo's scenes, which are in srbf-blender, found it missing; pip install srbf[blender]")
    root = Path(package.origin).parent
    for folder in (root / "scenes", root.parent / "data" / "scenes"):
        if (folder / f"{name}.py").is_file():
            return folder / f"{name}.py"
    raise InputError(f"expected a demo scene of {', '.join(SCENES)} with its script installed, found none named {name!r}")


def build_scene(name: str, path: Path, options: Sequence[str] = ()) -> None:
    """Run the scene's script in a separate process to write the .blend at `path`; BakeError with its last output on failure."""
    temporary = path.with_name(f".{path.stem}.partial.blend")
    finished = subprocess.run(
        [sys.executable, str(scene_script(name)), str(temporary), *options],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
    )
    if finished.returncode != 0 or not temporary.is_file():
        temporary.unlink(missing_ok=True)
        lines = (finished.stderr or finished.stdout).strip().splitlines()
        raise BakeError(f"expected the scene {name} to build, found status {finished.returncode}: {lines[-1] if lines else 'no message'}")
    temporary.replace(path)


def bake_once(bake: Bake, reporter: Reporter) -> bool:
    """Whether lights were rendered; OutputExistsError where another capture is in the bake's folder."""
    try:
        return bake.run(reporter)
    except OutputExistsError as error:
        raise OutputExistsError(
            f"expected the capture of this demo at {bake.folder}, found another; choose another folder, or delete it"
        ) from error


@dataclass(frozen=True)
class Demo:
    """The results of a demo: the report's page, the assets (the first is shown first), their capture, a lightmap's scene, and a picture
    in the scene's camera beside Cycles."""

    page: Path
    assets: tuple[Path, ...]
    capture: Path
    mesh: Path | None
    picture: Path | None = None


def run_demo(
    name: str, folder: Path, lights: int, reporter: Reporter, progress: Callable[[int, int, str], None], quality: Quality = "draft"
) -> Demo:
    """Build, bake, fit, evaluate and report the scene `name` in `folder`. Another run resumes it."""
    scene = SCENES[name]
    files.make_folder(folder)
    blend, capture_folder, asset_folder = folder / f"{name}.blend", folder / "capture", folder / "asset"
    timings: dict[str, float] = {}
    clock = time.perf_counter
    started = clock()
    if not blend.is_file():
        reporter.say(f"building {blend}")
        build_scene(name, blend)
    settings = scene.settings(lights, quality)
    reporter.say(f"baking {lights} directions at {settings.width}x{settings.height} with Cycles")
    if bake_once(Bake(blend, capture_folder, settings), reporter):
        timings["bake"] = clock() - started
    capture = Capture.open(capture_folder)
    started = clock()
    method = within_budget(capture, say=reporter.say)
    watch = TrainErrorAccumulator(capture)
    asset = method.encode(capture, FitRun(lambda done, total: progress(done, total, "fit"), watch.look))
    timings["fit"] = clock() - started
    started = clock()
    errors = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"), watch=watch)
    asset.manifest["error"] = {role: error for role, error in errors.items() if role != "lights"}
    timings["evaluate"] = clock() - started
    asset.save(asset_folder, force=True)
    fits = {"maps": RelightingMap(k=MAPS)}
    if quality == "publish":
        fits = {"fine": RelightingMap(k=FINE_MAPS, encoding="uint8"), **fits}
    for fit, maps in fits.items():
        maps.encode(capture).save(folder / fit, force=True)
    mesh = None
    if scene.receiver.kind == "lightmap":
        mesh = folder / "scene.glb"
        write_scene_mesh(blend, mesh, capture_folder, force=True, say=reporter.say)
    reporter.say("drawing the report")
    files.make_folder(folder / "report")
    page = write_report(asset, capture, folder / "report", evaluation=errors, timings=timings, asset_folder=asset_folder)
    holdout, size = asset.manifest["error"]["holdout"], asset.bytes_per_texel()["directional"]
    reporter.say(f"held-out PSNR {holdout['psnr']:.2f} dB, relative RMSE {holdout['relative_rmse']:.3f}, at {size} bytes per texel")
    assets = [folder / fit for fit in fits]
    assets.insert(1 if quality == "publish" else 0, asset_folder)
    return Demo(page, tuple(assets), capture_folder, mesh)
