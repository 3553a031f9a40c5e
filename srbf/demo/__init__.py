"""The demo: one of the project's scenes built, baked, fitted and reported in one folder."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from numpy import ndarray

from srbf.asset import Asset
from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.demo.pictures import direct_light, shown_bytes
from srbf.errors import BakeError, InputError, MissingLibraryError, OutputExistsError
from srbf.evaluation.errors_by_role import TrainErrorAccumulator, evaluate
from srbf.export.scene_mesh import write_scene_mesh
from srbf.fitting.auto_method import within_budget
from srbf.fitting.options import encode
from srbf.io import files
from srbf.lights import DirectionalLight
from srbf.methods import FitRun
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.receiver_images import Quantity, Transport
from srbf.relighting.direct_light import Direct
from srbf.relighting.relight import relight
from srbf.report import write_report


@dataclass(frozen=True)
class DemoScene:
    """A scene of the article: its receiver and quantity."""

    receiver: Receiver
    size: tuple[int, int]
    quantity: Quantity
    published: tuple[int, int]

    def settings(self, lights: int, quality: Quality, transport: Transport = "combined") -> BakeSettings:
        """A `draft` takes a minute or two. `publish` has more texels, twice the samples, and on a lightmap of combined transport a sun as
        wide as the mean light spacing, the sharpest shadows that so many lights resolve."""
        draft = BakeSettings(self.receiver, *self.size, lights=lights, holdout_samples=HOLDOUT_SAMPLES, quantity=self.quantity)
        if transport == "indirect":
            draft = replace(draft, transport=transport, validation=0, holdout=SPLIT_HOLDOUT)  # nothing is chosen by validation lights
        if quality == "draft":
            return draft
        finer = replace(draft, width=self.published[0], height=self.published[1], samples=SAMPLES)
        return finer.with_matched_sun() if self.receiver.kind == "lightmap" and transport == "combined" else finer


Quality = Literal["draft", "publish"]
SAMPLES = 4  # of `publish`
MAPS = 25  # of the article's asset, beside the smallest good one
FINE_MAPS = 100  # as bytes, of `publish`: no cluster borders and little blur, at 400 bytes per texel
HOLDOUT_SAMPLES = 24  # fewer than a bake's default, enough for both scenes, to finish in minutes
DIRECTIONS = 400
SPLIT_DIRECTIONS = 144  # with direct light apart: what is left has no sharp edges
SPLIT_HOLDOUT = 8
PAGE_FIT = ClusteredEigenMap(components=12, clusters=32, encoding="uint8")  # its tables of lights fit a page of 10 MiB
SUN = DirectionalLight((-0.45, -0.5, 0.74))  # of a picture
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


def scene_file(name: str, path: Path, reporter: Reporter, options: Sequence[str] = ()) -> None:
    """Build the scene at `path` unless it is there."""
    if not path.is_file():
        reporter.say(f"building {path}")
        build_scene(name, path, options)


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
    """The results of a demo: the report's page, the assets (the first is shown first), their capture, a lightmap's scene, a picture in the
    scene's camera beside Cycles, and its error in words."""

    page: Path
    assets: tuple[Path, ...]
    capture: Path
    mesh: Path | None
    picture: Path | None = None
    error: str = ""


@dataclass(frozen=True)
class Shown:
    """What a page can show before errors are known: an asset, a lightmap's scene, and what draws a picture, sRGB bytes (H, W, 3)."""

    asset: Path
    mesh: Path | None
    picture: Callable[[], ndarray]


Progress = Callable[[int, int, str], None]
Steps = Generator[Shown, None, Demo]  # of a demo: it waits once, as soon as the asset can be looked at; then its errors are measured


def finished(steps: Steps) -> Demo:
    """What all steps of a demo make."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            made: Demo = done.value
            return made


def demo_steps(
    name: str,
    folder: Path,
    lights: int | None,
    reporter: Reporter,
    progress: Progress,
    quality: Quality = "draft",
    transport: Transport = "combined",
) -> Steps:
    """Build, bake and fit the scene `name` in `folder`, then evaluate and report it. Another run resumes it.

    `lights`: directions, None for as many as the transport needs. Lights that no fit reads are rendered after the wait.
    """
    scene, is_split = SCENES[name], transport == "indirect"
    lights = lights or (SPLIT_DIRECTIONS if is_split else DIRECTIONS)
    files.make_folder(folder)
    blend, capture_folder, asset_folder = folder / f"{name}.blend", folder / "capture", folder / "asset"
    timings: dict[str, float] = {}
    clock = time.perf_counter
    started = clock()
    scene_file(name, blend, reporter)
    settings = scene.settings(lights, quality, transport)
    reporter.say(f"baking {lights} directions at {settings.width}x{settings.height} with Cycles")
    bake = Bake(blend, capture_folder, settings)
    if bake_once(replace(bake, roles=("train", "validation")), reporter):
        timings["bake"] = clock() - started
    capture = Capture.open(capture_folder)
    started = clock()
    method = PAGE_FIT if is_split else within_budget(capture, say=reporter.say)
    watch = TrainErrorAccumulator(capture)
    asset = encode(method, capture, FitRun(lambda done, total: progress(done, total, "fit"), watch.look, say=reporter.say))
    timings["fit"] = clock() - started
    asset.save(asset_folder, force=True)
    mesh = None
    if scene.receiver.kind == "lightmap":
        mesh = folder / "scene.glb"
        write_scene_mesh(blend, mesh, capture_folder, force=True, say=reporter.say)
    direct = direct_light() if is_split else "none"
    yield Shown(asset_folder, mesh, lambda: under_sun(asset, direct))
    started = clock()
    if bake_once(bake, reporter):
        timings["held-out lights"] = clock() - started
    capture = Capture.open(capture_folder)
    started = clock()
    errors = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"), watch=watch)
    whole = errors
    if is_split:
        whole = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"), direct=direct, roles=("holdout",))
    timings["evaluate"] = clock() - started
    page = reported(asset, capture, folder, errors, timings, reporter, not (is_split and quality == "draft"))
    fits = {} if is_split else {"maps": RelightingMap(k=MAPS)}
    if quality == "publish" and not is_split:
        fits = {"fine": RelightingMap(k=FINE_MAPS, encoding="uint8"), **fits}
    for fit, maps in fits.items():
        encode(maps, capture, FitRun(say=reporter.say)).save(folder / fit, force=True)
    holdout, size = whole["holdout"], asset.bytes_per_texel()["directional"]
    with_direct = ", direct light included" if is_split else ""
    reporter.say(
        f"held-out PSNR {holdout['psnr']:.2f} dB, relative RMSE {holdout['relative_rmse']:.3f}{with_direct}, at {size} bytes per texel"
    )
    assets = [folder / fit for fit in fits]
    assets.insert(1 if "fine" in fits else 0, asset_folder)
    found = f"{settings.holdout} held-out suns by Cycles: relative RMSE {100 * holdout['relative_rmse']:.1f} %, {holdout['psnr']:.1f} dB"
    return Demo(page, tuple(assets), capture_folder, mesh, error=found)


def reported(
    asset: Asset,
    capture: Capture,
    folder: Path,
    errors: dict[str, Any],
    timings: dict[str, float],
    reporter: Reporter,
    compares: bool = True,
) -> Path:
    """The page of a report, drawn in `folder`, where the asset is kept with its errors.

    `compares`: with other methods, whose fits take longer than the other steps of a draft.
    """
    asset.manifest["error"] = {role: error for role, error in errors.items() if role != "lights"}
    asset_folder, report = folder / "asset", folder / "report"
    asset.save(asset_folder, force=True)
    reporter.say("drawing the report")
    files.make_folder(report)
    methods = None if compares else ()
    return write_report(asset, capture, report, evaluation=errors, timings=timings, asset_folder=asset_folder, methods=methods)


def under_sun(asset: Asset, direct: Direct, sun: DirectionalLight = SUN) -> ndarray:
    """A picture of an asset of distant lights, sRGB bytes (H, W, 3)."""
    return shown_bytes(relight(asset, [sun], direct=direct))
