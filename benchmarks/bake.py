"""Samples, lights and texels that a bake needs: held-out error and CPU time, in one run: `python benchmarks/bake.py`.

`srbf bake` bakes each scene of the demo at 256 texels on the longer side: under 400 lights with 2 samples and with 1, and under 400,
640 and 1024 with a quarter of the texels each. `--long` compares 32 samples, 2, and `--samples auto`, whose cost includes its validation
lights. The 32 test lights are a separate bake at 48 samples. CPU time is that of all processes of a bake. `--keep FOLDER` stores the
captures there with their times, and reuses those that it finds.
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

import numpy as np

from srbf.capture import COVERED, Capture
from srbf.demo import SCENES, build_scene
from srbf.encode.light_function_fit import choose_functions, dense_centers
from srbf.encode.model_selection import TexelSample
from srbf.evaluation.errors_by_role import evaluate
from srbf.light_domain import domain_of_capture
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.solve.kernel_ridge import KernelPath

METHODS = {
    "25 maps": RelightingMap(k=25),
    "28 components": EigenMap(components=28),
    "64 clusters of 12": ClusteredEigenMap(clusters=64, components=12),
}
TEXELS = 8192  # of which all captured images are interpolated
UNTESTED = ["--validation", "0", "--holdout", "0"]
BAKES = {  # lights, in units of those asked for, and flags
    "2 samples": (1.0, ["--samples", "2", *UNTESTED]),
    "1 sample": (1.0, ["--samples", "1", *UNTESTED]),
    "1/4 of the texels": (1.0, ["--samples", "1", "--share", "1/4", *UNTESTED]),
    "1/4, more lights": (1.6, ["--samples", "1", "--share", "1/4", *UNTESTED]),
    "1/4, most lights": (2.56, ["--samples", "1", "--share", "1/4", *UNTESTED]),
}
LONG = {
    "32 samples": (1.0, ["--samples", "32", *UNTESTED]),
    "2 samples": BAKES["2 samples"],
    "auto": (1.0, ["--samples", "auto", "--validation", "16", "--holdout-samples", "16", "--holdout", "0"]),
}
TEST_LIGHTS = ["--lights", "1", "--samples", "1", "--validation", "16", "--holdout", "32", "--holdout-samples", "48"]


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
        side = size * scene.size[1] // scene.size[0]
        receiver = f"{scene.receiver.kind}:{scene.receiver.name}" if scene.receiver.name else scene.receiver.kind
        command = [sys.executable, "-m", "srbf", "bake", str(blend), "-o", str(folder), "--receiver", receiver, "--force"]
        cpu, wall = cpu_of([*command, "--size", f"{size}x{side}", "--quantity", scene.quantity, *flags])
        record.write_text(json.dumps({"cpu": cpu, "wall": wall}))
    return json.loads(record.read_text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), help="of the demo")
    parser.add_argument("--keep", type=Path, help="folder for the captures")
    parser.add_argument("--long", action="store_true", help="32 samples, 2 and auto")
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
            compare(name, blend, folder, asked.size, asked.lights, tests, LONG if asked.long else BAKES)


def compare(
    name: str, blend: Path, folder: Path, size: int, lights: int, tests: Capture, bakes: dict[str, tuple[float, list[str]]]
) -> None:
    """Print the table of a scene."""
    print(f"\n{name}, {tests.width}x{tests.height}; held-out relative RMSE, and as a ratio to that of the first row")
    print("| bake | lights | samples | CPU s | ratio | all images | " + " | ".join(METHODS) + " |")
    print("|---|---|---|---|---|---|" + "---|" * len(METHODS))
    first: list[float] = []
    for label, (times_as_many, flags) in bakes.items():
        target = folder / label.replace(" ", "-").replace("/", "-").replace(",", "")
        count = round(lights * times_as_many)
        times = baked(name, blend, target, size, ["--lights", str(count), *flags])
        capture = Capture.open(target)
        errors = [interpolated(capture, tests)]
        errors += [evaluate(settings.encode(capture), tests)["holdout"]["relative_rmse"] for settings in METHODS.values()]
        first = first or [times["cpu"], *errors]
        cells = [f"{error:.4f} ({error / of_first:.3f})" for error, of_first in zip(errors, first[1:], strict=True)]
        samples = capture.manifest["source"]["settings"]["samples"]
        print(
            f"| {label} | {count} | {samples} | {times['cpu']:.0f} | {times['cpu'] / first[0]:.2f} | " + " | ".join(cells) + " |",
            flush=True,
        )


def interpolated(capture: Capture, tests: Capture) -> float:
    """Held-out relative RMSE of all captured images interpolated, without a fit; the validation lights choose the kernel."""
    train, validation, holdout = capture.indices("train"), tests.indices("validation"), tests.indices("holdout")
    covered = np.flatnonzero(tests.coverage().ravel() >= COVERED)
    texels = np.sort(np.random.default_rng(0).permutation(covered)[:TEXELS])
    seen, domain = capture.sample(train, texels), domain_of_capture(capture)
    lights, unseen = capture.directions(train), tests.sample(holdout, texels)
    both = np.concatenate([seen, tests.sample(validation, texels)], axis=1)
    sample = TexelSample(texels, both, np.concatenate([lights, tests.directions(validation)]), len(train), domain)
    centers = dense_centers(lights, domain)
    model = choose_functions(sample, centers)
    path = KernelPath.of(model.kernel.between(lights, lights, centers))
    weights = path.solve(model.ridge, model.kernel.between(tests.directions(holdout), lights, centers).T).T  # (V, L)
    predicted = np.maximum(np.einsum("vl,plc->pvc", weights.astype(np.float32), seen, optimize=True), 0)
    return float(np.sqrt(((predicted - unseen) ** 2).mean() / (unseen**2).mean()))


if __name__ == "__main__":
    main()
