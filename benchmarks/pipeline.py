"""Fit against reading, and relighting by numpy against the shaders, as ratios in one run: `python benchmarks/pipeline.py`.

A temporary folder gets a synthetic capture of 400 noisy half-float EXRs of 256² texels (`--lights`, `--side`);
every row is the best of several runs.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from srbf import methods
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.evaluation.errors_by_role import evaluate
from srbf.io import files
from srbf.io.image import write_image
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight
from srbf.methods.relighting_map import RelightingMap
from srbf.relighting.relighter import Relighter
from srbf.sphere import point_set

K = 25


def make_capture(folder: Path, count: int, side: int) -> Capture:
    """Noisy cosines, which EXR's ZIP compresses as little as a render of few samples."""
    (folder / "lights").mkdir(parents=True)
    rng = np.random.default_rng(0)
    x = np.linspace(-1, 1, side, dtype=np.float32)
    positions = np.stack([*np.meshgrid(x, -x), np.zeros((side, side), np.float32)], axis=-1)
    write_image(folder / "position.exr", positions, "float")
    lights = []
    for i, direction in enumerate(point_set("hammersley", count, "hemisphere")):
        pixels = direction[2] * rng.random((side, side, 3), np.float32)
        write_image(folder / f"lights/{i:04d}.exr", pixels, "half")
        lights.append({"kind": "directional", "direction": direction.tolist(), "role": "train", "file": f"lights/{i:04d}.exr"})
    manifest = {"format": "srbf-capture", "version": 1, "quantity": "irradiance", "width": side, "height": side, "lights": lights}
    files.write_json(folder / "capture.json", {**manifest, "position": "position.exr"})
    return Capture.open(folder)


def best(work: Callable[[], object], runs: int = 3) -> float:
    """Seconds of the fastest of several runs."""
    times = []
    for _ in range(runs):
        started = time.perf_counter()
        work()
        times.append(time.perf_counter() - started)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lights", type=int, default=400)
    parser.add_argument("--side", type=int, default=256)
    wanted = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        capture = make_capture(Path(name) / "capture", wanted.lights, wanted.side)
        indices = capture.indices("train")
        reading = best(lambda: [None for _ in capture.blocks(indices)])
        fitting = best(lambda: RelightingMap(k=K).encode(capture))
        asset = RelightingMap(k=K).encode(capture)
        evaluating = best(lambda: evaluate(asset, capture), 1)
        print(f"{wanted.lights} lights of {wanted.side}², k = {K}, half floats\n")
        print(f"{'step':<34}{'seconds':>10}{'of reading':>12}")
        for step, seconds in (
            ("reading all images", reading),
            ("fit, reading included", fitting),
            ("evaluate, reading included", evaluating),
        ):
            print(f"{step:<34}{seconds:>10.2f}{seconds / reading:>12.2f}")
        relighting(asset)


def relighting(asset: Asset) -> None:
    """Print the time of a frame of each kind of light, read back into memory."""
    kinds: dict[str, list[Light]] = {
        "directional": [DirectionalLight((0.3, 0.2, 0.9))],
        "100 directional": [DirectionalLight((x, 0.2, 0.9)) for x in np.linspace(-1, 1, 100)],
        "point": [PointLight((0.2, 0.1, 0.7))],
        "spot": [SpotLight((0, 0, 1), direction=(0, 0, -1), inner=0.2, outer=0.6)],
    }
    print(f"\n{'frame, ms':<20}{'numpy':>10}{'gl':>10}{'multi-pass':>12}{'numpy / gl':>12}")
    with Relighter(asset) as relighter:
        for kind, lights in kinds.items():
            numpy_time = best(lambda lights=lights: methods.relight(asset, lights), 5)
            gl_time = best(lambda lights=lights: relighter.relight(lights), 9)
            passes_time = best(lambda lights=lights: relighter.relight(lights, multipass=True), 9)
            print(f"{kind:<20}{numpy_time * 1e3:>10.1f}{gl_time * 1e3:>10.1f}{passes_time * 1e3:>12.1f}{numpy_time / gl_time:>12.1f}")


if __name__ == "__main__":
    main()
