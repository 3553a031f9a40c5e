"""Samples that a bake needs: few against 32 per light, held-out error and CPU time, in one run: `python benchmarks/bake.py`.

`srbf bake` bakes each scene of the demo under 400 lights at 256²: with 32 samples, with 2, and with `--samples auto`, whose cost includes
its validation lights. The 32 test lights are a separate bake at 64 samples. CPU time is that of all processes of a bake.
`--keep FOLDER` stores the captures there with their times, and reuses those that it finds.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from srbf.capture import Capture
from srbf.demo import SCENES, build_scene
from srbf.evaluation.errors_by_role import evaluate
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap

METHODS = {
    "25 maps": RelightingMap(k=25),
    "28 components": EigenMap(components=28),
    "64 clusters of 12": ClusteredEigenMap(clusters=64, components=12),
}
BAKES = {
    "32 samples": ["--samples", "32", "--validation", "0", "--holdout", "0"],
    "2 samples": ["--samples", "2", "--validation", "0", "--holdout", "0"],
    "auto": ["--samples", "auto", "--validation", "16", "--holdout-samples", "16", "--holdout", "0"],
}
TEST_LIGHTS = ["--lights", "1", "--samples", "1", "--validation", "16", "--holdout", "32", "--holdout-samples", "64"]


def cpu_of(command: list[str]) -> tuple[float, float]:
    """(CPU seconds of the command and all its children, wall seconds)."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, time.perf_counter() - started


def baked(name: str, blend: Path, folder: Path, size: int, flags: list[str]) -> dict[str, float]:
    """Times of a bake of a demo scene, from this or an earlier run."""
    scene, record = SCENES[name], folder.with_suffix(".json")
    if not record.is_file():
        receiver = f"{scene.receiver.kind}:{scene.receiver.name}" if scene.receiver.name else scene.receiver.kind
        command = [sys.executable, "-m", "srbf", "bake", str(blend), "-o", str(folder), "--receiver", receiver, "--force"]
        cpu, wall = cpu_of([*command, "--size", str(size), "--quantity", scene.quantity, *flags])
        record.write_text(json.dumps({"cpu": cpu, "wall": wall}))
    return json.loads(record.read_text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), help="of the demo")
    parser.add_argument("--keep", type=Path, help="folder for the captures")
    parser.add_argument("--lights", type=int, default=400)
    parser.add_argument("--size", type=int, default=256)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="srbf-") as scratch:
        root = asked.keep or Path(scratch)
        for name in asked.scenes or list(SCENES):
            folder = root / name
            folder.mkdir(parents=True, exist_ok=True)
            blend = folder / f"{name}.blend"
            if not blend.is_file():
                build_scene(name, blend)
            baked(name, blend, folder / "tests", asked.size, TEST_LIGHTS)
            tests = Capture.open(folder / "tests")
            compare(name, blend, folder, asked.size, asked.lights, tests)


def compare(name: str, blend: Path, folder: Path, size: int, lights: int, tests: Capture) -> None:
    """Print the table of a scene."""
    print(f"\n{name}, {lights} lights, {size}²; held-out relative RMSE, and as a ratio to that of 32 samples")
    print("| bake | samples | CPU s | ratio | " + " | ".join(METHODS) + " |")
    print("|---|---|---|---|" + "---|" * len(METHODS))
    whole: dict[str, float] = {}
    full = 1.0
    for label, flags in BAKES.items():
        target = folder / label.replace(" ", "-")
        times = baked(name, blend, target, size, ["--lights", str(lights), *flags])
        capture = Capture.open(target)
        cells = []
        for method, settings in METHODS.items():
            error = evaluate(settings.encode(capture), tests)["holdout"]["relative_rmse"]
            whole.setdefault(method, error)
            cells.append(f"{error:.4f} ({error / whole[method]:.3f})")
        full = times["cpu"] if label == "32 samples" else full
        samples = capture.manifest["source"]["settings"]["samples"]
        print(f"| {label} | {samples} | {times['cpu']:.0f} | {times['cpu'] / full:.3f} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
