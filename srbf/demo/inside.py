"""The demo of lights inside a scene: form factors instead of rendered lights, a transfer asset, and pictures beside Cycles."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.bake.light_sets import MOST_SURFELS, SURFELS, CloudSet
from srbf.bake.point_reference import render_point_lights
from srbf.bake.run import Bake, Reporter
from srbf.bake.scene_query import objects_of, with_light_set
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.demo import Demo, Quality, bake_once, build_scene
from srbf.demo.pictures import in_camera
from srbf.errors import ShaderError
from srbf.evaluation.errors_by_role import evaluate
from srbf.export.scene_mesh import write_scene_mesh
from srbf.fitting.auto_method import within_budget
from srbf.gl.context import create_context
from srbf.io import files
from srbf.methods import FitRun
from srbf.relighting.direct_light import Direct
from srbf.report import write_report

BUDGET = 13  # bytes per texel
PICTURE = "beside_cycles.png"
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Amount:
    """How much of a quality: texels per side, surfels, held-out lights, samples of those and of pictures, pixels of a picture."""

    size: int
    surfels: int
    holdout: int
    samples: int
    view: tuple[int, int]


@dataclass(frozen=True)
class InsideScene:
    """A scene that is lit from within: receivers as a collection with one UV layer, options of its script, and places of lights (m)."""

    collection: str
    uv_layer: str
    options: tuple[str, ...]
    places: tuple[Place, ...]
    draft: Amount
    publish: Amount

    def amount(self, quality: Quality) -> Amount:
        """Of a quality."""
        return self.draft if quality == "draft" else self.publish

    def settings(self, receivers: list[str], quality: Quality) -> BakeSettings:
        """Of the lightmap; no light is rendered but held-out ones."""
        amount = self.amount(quality)
        receiver = Receiver("lightmap", receivers[0], self.uv_layer, tuple(receivers[1:]))
        return BakeSettings(
            receiver,
            amount.size,
            amount.size,
            validation=0,
            holdout=amount.holdout,
            holdout_samples=amount.samples,
            transport="indirect",
            light_set=CloudSet("surfels", amount.surfels),
        )

    def view(self, quality: Quality) -> BakeSettings:
        """Of the camera: its geometry, and a sun that makes it a capture."""
        width, height = self.amount(quality).view
        return BakeSettings(
            Receiver("view"), width, height, lights=1, samples=1, validation=0, holdout=0, quantity="radiance", transport="indirect"
        )


INSIDE = {
    "loft": InsideScene(
        "Receivers",
        "atlas",
        ("--unlit", "--diffuse"),
        ((2.9, 2.3, 1.6), (5.0, 2.55, 1.3), (6.6, 2.4, 1.4)),
        Amount(256, SURFELS, 6, 64, (360, 270)),
        Amount(512, MOST_SURFELS, 12, 256, (800, 600)),
    )
}


def run_demo_inside(name: str, folder: Path, reporter: Reporter, progress: Callable[[int, int, str], None], quality: Quality) -> Demo:
    """Build, bake, fit, evaluate, report and draw the scene `name` in `folder`. Another run resumes it."""
    scene = INSIDE[name]
    files.make_folder(folder)
    blend, capture_folder, asset_folder = folder / f"{name}.blend", folder / "capture", folder / "asset"
    timings: dict[str, float] = {}
    clock = time.perf_counter
    started = clock()
    if not blend.is_file():
        reporter.say(f"building {blend}")
        build_scene(name, blend, scene.options)
    receivers = objects_of(blend, [scene.collection], reporter.say)
    settings = scene.settings(receivers, quality)
    reporter.say(
        f"tracing form factors for {settings.width}x{settings.height} texels of {len(receivers)} objects; "
        f"{settings.holdout} held-out lights with Cycles"
    )
    if bake_once(with_light_set(Bake(blend, capture_folder, settings), reporter.say), reporter):
        timings["bake"] = clock() - started
    capture = Capture.open(capture_folder)
    started = clock()
    method = within_budget(capture, BUDGET, say=reporter.say, editable=True)
    asset = method.encode(capture, FitRun(lambda done, total: progress(done, total, "fit")))
    timings["fit"] = clock() - started
    started = clock()
    direct = direct_light()
    errors = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"))
    whole = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"), direct=direct)
    asset.manifest["error"] = {role: error for role, error in errors.items() if role != "lights"}
    timings["evaluate"] = clock() - started
    asset.save(asset_folder, force=True)
    mesh = folder / "scene.glb"
    write_scene_mesh(blend, mesh, capture_folder, force=True, say=reporter.say)
    started = clock()
    reporter.say("drawing pictures beside Cycles")
    view = scene.view(quality)
    bake_once(Bake(blend, folder / "view", view), reporter)
    samples = scene.amount(quality).samples
    references = render_point_lights(
        blend, view, np.array(scene.places), samples, progress=lambda done, total: progress(int(done), int(total), "Cycles")
    )
    compared = in_camera(asset, Capture.open(folder / "view"), scene.places, references, direct, folder / PICTURE)
    timings["pictures"] = clock() - started
    reporter.say("drawing the report")
    files.make_folder(folder / "report")
    page = write_report(asset, capture, folder / "report", evaluation=errors, timings=timings, asset_folder=asset_folder)
    held_out, on_disk = errors["holdout"], sum(path.stat().st_size for path in asset_folder.iterdir())
    reporter.say(
        f"held-out lights, the noise of {settings.holdout_samples} samples included: bounces {100 * held_out['relative_rmse']:.1f} % "
        f"relative RMSE, with direct light {100 * whole['holdout']['relative_rmse']:.1f} % and PSNR {whole['holdout']['psnr']:.1f} dB; "
        f"{asset.bytes_per_texel()['point']} bytes per texel, {on_disk / 1e6:.1f} MB"
    )
    in_pictures = ", ".join(f"{100 * one.relative_rmse:.1f} %" for one in compared)
    reporter.say(f"in the camera, direct light included: relative RMSE {in_pictures}; {', '.join(_seconds(timings))}")
    return Demo(page, (asset_folder,), capture_folder, mesh, folder / PICTURE)


def direct_light() -> Direct:
    """By shadow maps as in engines; by rays where there is no OpenGL."""
    try:
        create_context().release()
    except ShaderError:
        return "ray"
    return "shadow-map"


def _seconds(timings: dict[str, float]) -> list[str]:
    return [f"{name} {seconds:.0f} s" for name, seconds in timings.items()]
