"""The demo of lights inside a scene: form factors instead of rendered lights, a transfer asset, and pictures beside Cycles."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from srbf.bake.light_sets import MOST_SURFELS, SURFELS, CloudSet
from srbf.bake.point_reference import render_point_lights
from srbf.bake.run import Bake, Reporter
from srbf.bake.scene_query import objects_of, with_light_set
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.demo import Demo, Progress, Quality, Shown, Steps, bake_once, reported, scene_file
from srbf.demo.pictures import InCamera, Place, direct_light, shown_bytes
from srbf.evaluation.errors_by_role import evaluate
from srbf.export.scene_mesh import write_scene_mesh
from srbf.io import files
from srbf.methods import FitRun
from srbf.methods.transfer import Transfer

PICTURE = "beside_cycles.png"
FIT = Transfer(clusters=256, components=12, editable=True)  # 13 bytes per texel


@dataclass(frozen=True)
class Amount:
    """How much of a quality: texels per side, surfels at most and how far apart (m; None: as many as there may be), the fit, held-out
    lights, samples of those and of pictures, pixels of a picture."""

    size: int
    surfels: int
    spacing: float | None
    fit: Transfer
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
            light_set=CloudSet("surfels", amount.surfels, amount.spacing),
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
        Amount(256, SURFELS, 0.3, replace(FIT, clusters=128, surfels=1500), 2, 32, (320, 240)),
        Amount(512, MOST_SURFELS, None, FIT, 12, 256, (800, 600)),
    )
}


def inside_steps(name: str, folder: Path, reporter: Reporter, progress: Progress, quality: Quality = "draft") -> Steps:
    """Build, trace, fit, then have Cycles render what it is measured by, and report and draw the scene `name` in `folder`.

    Another run resumes it. It waits before Cycles renders a light.
    """
    scene = INSIDE[name]
    amount = scene.amount(quality)
    files.make_folder(folder)
    blend, capture_folder, asset_folder = folder / f"{name}.blend", folder / "capture", folder / "asset"
    timings: dict[str, float] = {}
    clock = time.perf_counter
    started = clock()
    scene_file(name, blend, reporter, scene.options)
    receivers = objects_of(blend, [scene.collection], reporter.say)
    settings = scene.settings(receivers, quality)
    reporter.say(f"tracing form factors for {settings.width}x{settings.height} texels of {len(receivers)} objects")
    bake = with_light_set(Bake(blend, capture_folder, settings), reporter.say)
    if bake_once(replace(bake, roles=("train",)), reporter):
        timings["form factors"] = clock() - started
    started = clock()
    asset = amount.fit.encode(Capture.open(capture_folder), FitRun(lambda done, total: progress(done, total, "fit"), say=reporter.say))
    timings["fit"] = clock() - started
    asset.save(asset_folder, force=True)
    mesh = folder / "scene.glb"
    write_scene_mesh(blend, mesh, capture_folder, force=True, say=reporter.say)
    direct, view = direct_light(), scene.view(quality)

    def in_camera() -> InCamera:
        bake_once(Bake(blend, folder / "view", view), reporter)
        return InCamera(asset, Capture.open(folder / "view"), direct)

    yield Shown(asset_folder, mesh, lambda: shown_bytes(in_camera().pictures(scene.places[:1])[0]))
    started = clock()
    reporter.say(f"rendering {settings.holdout} held-out lights and {len(scene.places)} pictures with Cycles")
    if bake_once(bake, reporter):
        timings["held-out lights"] = clock() - started
    started = clock()
    references = render_point_lights(
        blend, view, np.array(scene.places), amount.samples, progress=lambda done, total: progress(int(done), int(total), "Cycles")
    )
    compared = in_camera().beside(scene.places, references, folder / PICTURE)
    timings["pictures"] = clock() - started
    started = clock()
    capture = Capture.open(capture_folder)
    errors = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"))
    whole = evaluate(asset, capture, lambda done, total: progress(done, total, "evaluate"), direct=direct)
    timings["evaluate"] = clock() - started
    page = reported(asset, capture, folder, errors, timings, reporter)
    held_out, on_disk = errors["holdout"], sum(path.stat().st_size for path in asset_folder.iterdir())
    alone = f", their noise of {settings.holdout_samples} samples alone {100 * held_out['noise']:.1f} %" if "noise" in held_out else ""
    reporter.say(
        f"held-out lights: bounces {100 * held_out['relative_rmse']:.1f} % relative RMSE{alone}; with direct light "
        f"{100 * whole['holdout']['relative_rmse']:.1f} % and PSNR {whole['holdout']['psnr']:.1f} dB; "
        f"{asset.bytes_per_texel()['point']} bytes per texel, {on_disk / 1e6:.1f} MB"
    )
    in_pictures = ", ".join(f"{100 * one.relative_rmse:.1f}" for one in compared)
    found = f"{len(compared)} lights in its camera by Cycles: relative RMSE {in_pictures} %, noise included"
    reporter.say(f"{found}; {', '.join(f'{step} {seconds:.0f} s' for step, seconds in timings.items())}")
    return Demo(page, (asset_folder,), capture_folder, mesh, folder / PICTURE, found)
