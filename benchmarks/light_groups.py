"""`python benchmarks/light_groups.py SCENE.blend`: light mixing of a view by `--light-set named` beside Cycles' light groups.

Cycles renders a picture for each light group in one pass over all lights; it does so for views alone, and keeps one image per group. Both
are rendered in the same process count at given samples; the reference is a bake of its own seed with many. Error: relative RMSE of mixes
with random intensities, 0 to 2, on covered pixels, less the reference's own noise.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.lights import NamedLight
from srbf.methods import linear_response

MIXES = 100
GROUPS = """
import json, sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
width, height, samples, seed = map(int, sys.argv[2:6])
objects, out = json.loads(sys.argv[6]), sys.argv[7]
scene, layer = bpy.context.scene, bpy.context.view_layer
for number, names in enumerate(objects):
    layer.lightgroups.add(name=f"g{number:03d}")
    for name in names:
        (bpy.data.objects[name] if name in bpy.data.objects else scene.world).lightgroup = f"g{number:03d}"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
scene.cycles.samples, scene.cycles.seed, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = samples, seed, False, False
scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
scene.render.film_transparent = True
settings = scene.render.image_settings
if hasattr(settings, "media_type"):
    settings.media_type = "MULTI_LAYER_IMAGE"
settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
scene.render.filepath = out
bpy.ops.render.render(write_still=True)
"""


def light_groups(scene: Path, objects: list[list[str]], size: tuple[int, int], samples: int, folder: Path) -> tuple[np.ndarray, float]:
    """((N, H, W, 3) images of groups of objects, seconds)."""
    import OpenImageIO as oiio

    out, start = folder / "groups.exr", time.perf_counter()
    words = [str(scene), *map(str, (*size, samples, 5)), json.dumps(objects), str(out)]
    subprocess.run([sys.executable, "-c", GROUPS, *words], check=True, capture_output=True)
    seconds = time.perf_counter() - start
    image = oiio.ImageInput.open(str(out))
    names = list(image.spec().channelnames)
    pixels = image.read_image(format=oiio.FLOAT)
    image.close()
    found = []
    for number in range(len(objects)):
        channels = [next(i for i, name in enumerate(names) if f"g{number:03d}.{c}" in name) for c in "RGB"]
        found.append(pixels[..., channels])
    return np.array(found), seconds


def named(scene: Path, size: tuple[int, int], samples: int, seed: int, folder: Path) -> tuple[Capture, float]:
    """A bake of named lights, seconds."""
    start = time.perf_counter()
    words = ["bake", scene, "-o", folder, "--receiver", "view", "--light-set", "named", "--samples", samples, "--seed", seed]
    sized = ["--size", f"{size[0]}x{size[1]}"]
    subprocess.run([sys.executable, "-m", "srbf", *map(str, [*words, *sized])], check=True, capture_output=True)
    return Capture.open(folder), time.perf_counter() - start


def main() -> None:
    """Print a row for each way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--size", type=int, nargs=2, default=(96, 72))
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--reference", type=int, default=256)
    asked = parser.parse_args()
    size, scene = tuple(asked.size), asked.scene.resolve()
    with tempfile.TemporaryDirectory(prefix="srbf-") as name:
        folder = Path(name)
        truth, _ = named(scene, size, asked.reference, 101, folder / "truth")
        again, _ = named(scene, size, asked.reference, 202, folder / "again")
        own, own_seconds = named(scene, size, asked.samples, 303, folder / "own")
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "srbf", "fit", folder / "own", "-o", folder / "mix", "--budget", "13"], check=True, capture_output=True
        )
        fit_seconds = time.perf_counter() - start
        lights = truth.manifest["lights"]
        count = len(lights)
        groups, group_seconds = light_groups(
            scene, [light["objects"] or [light["name"]] for light in lights], size, asked.samples * count, folder
        )
        covered = truth.coverage() >= COVERED
        mixes = np.random.default_rng(7).uniform(0, 2, (MIXES, count)).astype(np.float32)
        first, second, captured = (np.stack([one.image(i)[covered] for i in range(count)]) for one in (truth, again, own))
        asset = Asset.open(folder / "mix")
        relit = [
            linear_response(asset, [NamedLight(light["name"], (float(x),) * 3) for light, x in zip(lights, mix, strict=True)])[covered]
            for mix in mixes
        ]
        print(f"{count} lights, {size[0]} x {size[1]}; {'':14}{'samples':>16}{'seconds':>10}{'error':>9}{'bytes per pixel':>18}")
        each = f"{count} x {asked.samples}"
        for label, pictures, samples, seconds, size_of in (
            ("named lights, all images", np.tensordot(mixes, captured, 1), each, own_seconds, 6 * count),
            ("named lights, light-mix", np.array(relit), each, own_seconds + fit_seconds, 13),
            ("light groups", np.tensordot(mixes, groups[:, covered], 1), asked.samples * count, group_seconds, 6 * count),
        ):
            one, other = np.tensordot(mixes, first, 1), np.tensordot(mixes, second, 1)
            error = np.sqrt(max(float(((pictures - one) * (pictures - other)).sum() / (one * other).sum()), 0))
            print(f"{label:>32}{samples!s:>16}{seconds:>10.0f}{error:>9.3f}{size_of:>18}")


if __name__ == "__main__":
    main()
