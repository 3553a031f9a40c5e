"""`python benchmarks/deep_framebuffer_paper.py SCENE.blend FOLDER`: the paper's table of deep framebuffers, its form beside ours.

A view of the scene is baked twice and fitted, into FOLDER, unless it is there: `gather-samples` by `--gather 120`, 40,000 view
clusters, and `deep-framebuffer` by 20,000 clusters of 512 rays. For both: triangles of the scene; CPU seconds of bake and fit, Blender's
part included; megabytes as relit, and on disk; CPU milliseconds of one point light, medians: visibility (a shadow ray to each sample or
surfel), direct (light on the pixels' centers, a shadow ray each), indirect (light on samples or surfels, and bounces), links (to clusters
and pixels).

Relative RMSE of indirect light in %, median over lights of the four kinds of `benchmarks/deep_framebuffer.py`. First bounce: of diffuse
light, at random pixels whose samples show one surface, against plain rays from the pixel's center, lit exactly, each with a shadow ray;
our form with one bounce. All bounces: of all pixels against Cycles. Both references are made twice, so that their noise drops out.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from deep_framebuffer import KINDS, error, placed
from numpy import ndarray
from references import rendered, settings_of

from srbf.asset import Asset
from srbf.bake.gather_set import FoundSurfaces
from srbf.bake.light_sets import LIGHT_SET_FILE
from srbf.capture import COVERED, Capture
from srbf.io.scene_glb import read_triangles
from srbf.lights import Light, PointLight, SpotLight
from srbf.methods import linear_response, projected_weights
from srbf.methods.deep_framebuffer import _ready
from srbf.methods.mixed_clusters import pictures, size
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.gathered_samples import light_on_clusters
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.received import ReceivedLight, occluders_of
from srbf.visibility.receivers import Receivers
from srbf.visibility.sparse_links import radiosity_of
from srbf.visibility.surface_cells import OFFSET, Cells, Fragments

FORMS = {"gather-samples": ["--gather", "120"], "deep-framebuffer": []}
FRAMES = 5
LEFT_OUT = ("position.exr", "normal.exr", "coverage.exr", "albedo.exr", "ambient.exr", "glossy.exr", "lobe.exr", "scene.glb", "asset.json")
NOTHING = EmbreeTriangles(np.zeros((0, 3, 3), np.float32))
PIXELS_AT_ONCE = 256


def made(scene: Path, folder: Path, pixels: str) -> dict[str, float]:
    """CPU seconds that each form's bake and fit took, of those that were not there too."""
    told = folder / "seconds.json"
    seconds: dict[str, float] = json.loads(told.read_text()) if told.is_file() else {}
    for form, flags in FORMS.items():
        if form in seconds:
            continue
        before = os.times()
        view = ["--receiver", "view", "--size", pixels, "--light-set", "gather", "--holdout", "0", "--seed", "77"]
        for command in (
            ["bake", scene, "-o", folder / f"{form}-capture", *view, *flags],
            ["fit", folder / f"{form}-capture", "-o", folder / form],
        ):
            subprocess.run([sys.executable, "-m", "srbf", *map(str, command), "--force"], check=True)
        after = os.times()
        seconds[form] = after.children_user + after.children_system - before.children_user - before.children_system
        told.write_text(json.dumps(seconds))
    return seconds


def first_bounce(surfaces: FoundSurfaces, points: ndarray, normals: ndarray, lights: list[Light], rays: int, seed: int) -> ndarray:
    """(L, n, 3) irradiance at points of light that was reflected once, by `rays` rays of each point and a shadow ray of each hit."""
    triangles, casters = EmbreeTriangles(surfaces.corners), EmbreeTriangles(surfaces.occluders)
    facing = Fragments(surfaces.corners, surfaces.albedo).normals
    lift = OFFSET * float(np.ptp(surfaces.corners.reshape(-1, 3), axis=0).max())
    total = np.zeros((len(lights), len(points), 3))
    for start in range(0, len(points), PIXELS_AT_ONCE):
        part = slice(start, start + PIXELS_AT_ONCE)
        directions = cosine_directions(normals[part, None], rays, np.random.default_rng([seed, start]))[:, 0].reshape(-1, 3)
        origins = np.repeat(points[part] + lift * normals[part], rays, axis=0)
        triangle, distance, _ = triangles.first_hit(origins, directions)
        met = np.flatnonzero(triangle >= 0)
        hits = origins[met] + distance[met, None].astype(np.float64) * directions[met]
        normal = facing[triangle[met]] * np.where(np.einsum("nk,nk->n", facing[triangle[met]], directions[met]) > 0, -1.0, 1.0)[:, None]
        albedo, row = surfaces.albedo[triangle[met]], met // rays
        starts = hits + lift * normal
        for number, light in enumerate(lights):
            assert isinstance(light, PointLight)
            vector = np.array(light.position) - hits
            squared = np.einsum("nk,nk->n", vector, vector)
            unit = vector / np.sqrt(squared)[:, None]
            amount = np.maximum(np.einsum("nk,nk->n", unit, normal), 0) / squared
            if isinstance(light, SpotLight):
                amount *= -(unit @ np.array(light.direction)) >= np.cos(light.outer)
            lit = np.flatnonzero(amount > 0)
            toward = np.array(light.position) - starts[lit]
            far = np.linalg.norm(toward, axis=1)
            amount[lit[casters.occluded(starts[lit].astype(np.float32), toward / far[:, None], far)]] = 0
            for c in range(3):
                total[number, part, c] = np.bincount(row, amount * albedo[:, c], len(points[part])) / rays
    return total


def timed(work: Callable[[], object]) -> float:
    """CPU ms of one call, the median of some after a first one."""
    spent = []
    work()
    for _ in range(FRAMES):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return 1e3 * float(np.median(spent))


def passes(asset: Asset, light: Light) -> list[float]:
    """CPU ms of visibility, direct, indirect, links."""
    assert asset.scene is not None
    told, tables, occluders = asset.manifest["gather"], asset.tables, occluders_of(asset.scene)
    places, normals = (asset.images[name].reshape(-1, 3)[asset.covered.ravel()].astype(np.float32) for name in ("position", "normal"))
    pixels = Cells(places, normals, np.full(len(places), 1e-9, np.float32), np.zeros_like(places), np.zeros(len(places), np.int64))
    received = ReceivedLight(pixels, occluders)
    direct = timed(lambda: received.irradiance(light))
    weights = projected_weights(asset, [light])
    mixing = timed(lambda: pictures(asset, weights[None]))
    if "samples" in told:
        low, high = tables["sample_places_low"], tables["sample_places_high"]
        samples = low + (high.astype(np.uint16) << 8), np.array(told["box"]), tables["sample_normals"], tables["sample_reflectance"]
        whole = timed(lambda: light_on_clusters(*samples, occluders, [light]))
        indirect = timed(lambda: light_on_clusters(*samples, NOTHING, [light]))
        return [whole - indirect, direct, indirect, mixing]
    ready = _ready(asset)
    pool = ready.cells
    irradiance = ready.received.irradiance(light).astype(np.float32)
    bounced = radiosity_of(ready.exchange, ready.cells.albedo, irradiance, told.get("bounces"))
    whole, plain = timed(lambda: ready.received.irradiance(light)), ReceivedLight(pool, NOTHING)
    unshadowed = timed(lambda: plain.irradiance(light))
    exchange = timed(lambda: radiosity_of(ready.exchange, ready.cells.albedo, irradiance, told.get("bounces")))
    links = timed(lambda: [own @ bounced for own in (ready.view, ready.gloss) if own is not None])
    return [whole - unshadowed, direct, unshadowed + exchange, links + mixing]


def of_first_bounce(asset: Asset) -> Asset:
    """Of diffuse light that was reflected once."""
    dull = {name: np.zeros_like(image) if name == "glossy" else image for name, image in asset.images.items()}
    return replace(asset, manifest={**asset.manifest, "gather": {**asset.manifest["gather"], "bounces": 1}}, images=dull)


def main() -> None:
    """Print the table of a scene."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", default="400x400")
    parser.add_argument("--lights", type=int, default=4, help="of a kind")
    parser.add_argument("--samples", type=int, default=24, help="of a reference by Cycles; 0: none")
    parser.add_argument("--pixels", type=int, default=2048, help="for the first bounce")
    parser.add_argument("--rays", type=int, default=1024, help="of such a pixel, twice")
    parser.add_argument("--kinds", default=",".join(KINDS))
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    seconds = made(asked.scene, asked.folder, asked.size)
    capture = Capture.open(asked.folder / "gather-samples-capture")
    assets = {form: Asset.open(asked.folder / form) for form in FORMS}
    scene = capture.scene()
    assert scene is not None
    print(f"{asked.scene.name}: {len(read_triangles(scene).corners)} triangles, {asked.size} pixels; CPU times")
    print(f"{'':>18}{'bake s':>8}{'MB':>8}{'on disk':>9}{'visib. ms':>11}{'direct':>8}{'indirect':>10}{'links':>8}{'frame':>8}")
    for form, asset in assets.items():
        light = placed(capture, "point", 1)[0]
        files = sum(path.stat().st_size for path in (asked.folder / form).iterdir() if path.name not in LEFT_OUT)
        took = passes(asset, light)
        cells = f"{took[0]:>11.0f}{took[1]:>8.0f}{took[2]:>10.0f}{took[3]:>8.0f}{sum(took):>8.0f}"
        print(f"{form:>18}{seconds[form]:>8.0f}{size(asset) / 1e6:>8.1f}{files / 1e6:>9.1f}{cells}", flush=True)
    with np.load(capture.folder / LIGHT_SET_FILE) as stored:
        surfaces = FoundSurfaces.of_arrays(stored)
    view = PixelPoints.of_view(Receivers.of(capture))
    alone = np.flatnonzero(np.bincount(view.pixels, minlength=view.size)[view.pixels] == 1)
    alone = np.random.default_rng(5).permutation(alone)[: asked.pixels]
    texels = view.pixels[alone]
    albedo = capture.channel("albedo")
    assert albedo is not None
    reflects = albedo.reshape(-1, 3)[texels] / np.pi
    covered = capture.coverage() >= COVERED
    print(f"{'relative RMSE, %':>26}{'first bounce':>14}{'energy':>8}{'noise':>8}{'all bounces':>13}{'energy':>8}{'noise':>8}")
    kept = asked.folder / "references.npz"
    known = dict(np.load(kept)) if kept.is_file() else {}
    for kind in asked.kinds.split(","):
        lights = placed(capture, kind, asked.lights)
        if f"first {kind}" not in known:
            once = [first_bounce(surfaces, view.points[alone], view.normals[alone], lights, asked.rays, seed) * reflects for seed in (1, 2)]
            known[f"first {kind}"] = np.stack(once)
        if f"all {kind}" not in known and asked.samples:
            known[f"all {kind}"] = rendered(asked.scene, settings_of(capture), lights, asked.samples, ("indirect",), gloss=True)["indirect"]
        np.savez(kept, **known)
        for form, asset in assets.items():
            once, whole = known[f"first {kind}"], known.get(f"all {kind}")
            own = np.stack([linear_response(of_first_bounce(asset), [light]).reshape(-1, 3)[texels] for light in lights])
            cells = columns(own, once)
            if whole is not None:
                cells += columns(np.stack([linear_response(asset, [light])[covered] for light in lights]), whole[:, :, covered])
            print(f"{form:>18}{kind:>8}{cells}", flush=True)


def columns(own: ndarray, references: ndarray) -> str:
    """Median error over lights, ratio of energies of all of them, median noise of a reference."""
    errors, noise, energy = [], [], np.zeros(2)
    for one, first, second in zip(own, *references, strict=True):
        known = np.isfinite(first + second).all(axis=1)  # Cycles leaves a few pixels of spots with sharp edges as NaN
        one, first, second = one[known], first[known], second[known]
        errors.append(error(one, first, second))
        noise.append(np.sqrt(((first - second) ** 2).sum() / 2 / (first * second).sum()))
        energy += float(one.sum()), float((first + second).sum() / 2)
    return f"{100 * np.median(errors):>13.1f}{energy[0] / energy[1]:>9.3f}{100 * np.median(noise):>8.0f}"


if __name__ == "__main__":
    main()
