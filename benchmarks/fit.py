"""`srbf fit` against raw file input and output, as ratios in one run: `python benchmarks/fit.py [FOLDER]`.

The capture, 400 half ZIP EXRs of 1024² (bumps under moving shadows, noise of a few samples), is made once in FOLDER, or in a
temporary one. The baseline reads the same files as half floats and writes k of them, on all cores, by OpenImageIO alone, without
conversion, storage or flushing. Every fit is a separate process, start-up and error included.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from srbf.capture import Capture
from srbf.compute.threads import cores
from srbf.io import files
from srbf.io.image import write_image
from srbf.receiver_images import MANIFEST
from srbf.sphere import normalize, point_set

ROOT = Path(__file__).resolve().parent.parent
NOISE = 0.15  # of a texel's value: a render of a few samples
TARGETS = {"relighting-map": 1.5, "eigen-map": 2.5, "clustered-eigen-map": 4.0}  # times the baseline
FLAGS: dict[str, list[str]] = {
    "relighting-map": [],
    "eigen-map": ["--method", "eigen-map", "--components", "28"],
    "clustered-eigen-map": ["--method", "clustered-eigen-map", "--clusters", "64", "--components", "8"],
}


def make_capture(folder: Path, lights: int, side: int) -> Capture:
    """A bumpy colored floor under discs that cast sharp shadows, with independent noise per light; all lights are train lights."""
    if (folder / MANIFEST).is_file():
        capture = Capture.open(folder)
        if (len(capture.lights), capture.width) != (lights, side):
            sys.exit(f"expected a capture of {lights} lights and {side}² texels in {folder}, found another; choose another folder")
        return capture
    (folder / "lights").mkdir(parents=True)
    directions = point_set("hammersley", lights, "hemisphere")
    y, x = np.mgrid[-1 : 1 : side * 1j, -1 : 1 : side * 1j].astype(np.float32)
    heights = 0.1 * np.sin(7 * x) * np.cos(5 * y) + 0.05 * np.sin(19 * x + 3 * y)
    slope_y, slope_x = np.gradient(heights, 2 / side)
    normals = normalize(np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=2)).astype(np.float32)
    albedo = np.stack([0.5 + 0.3 * np.sin(9 * x), 0.5 + 0.3 * np.sin(8 * y), 0.5 + 0.2 * np.cos(6 * x * y)], axis=2).astype(np.float32)

    def write(i: int) -> None:
        direction = directions[i].astype(np.float32)
        lit = np.maximum(normals @ direction, 0)
        offset = 0.2 * direction[:2] / max(float(direction[2]), 0.1)
        for cx, cy, radius in ((0.3, 0.2, 0.2), (-0.4, 0.3, 0.15), (0.0, -0.5, 0.25), (-0.5, -0.5, 0.1)):
            lit *= (x - cx + offset[0]) ** 2 + (y - cy + offset[1]) ** 2 > radius**2
        noise = np.random.default_rng(i).standard_normal((side, side, 1), np.float32)
        image = (lit[:, :, None] + 0.05) * albedo * np.maximum(1 + NOISE * noise, 0)
        write_image(folder / f"lights/{i:04d}.exr", image, "half")

    with ThreadPoolExecutor(cores()) as workers:
        list(workers.map(write, range(lights)))
    entries = [
        {"kind": "directional", "direction": direction.tolist(), "role": "train", "file": f"lights/{i:04d}.exr"}
        for i, direction in enumerate(directions)
    ]
    manifest = {"format": "srbf-capture", "version": 1, "quantity": "irradiance", "width": side, "height": side, "lights": entries}
    files.write_json(folder / MANIFEST, manifest)
    return Capture.open(folder)


def read_and_write(sources: Sequence[Path], k: int, target: Path, workers: int, exr_threads: int) -> tuple[float, float]:
    """(wall, processor) seconds to read `sources` as half floats and write the first k again, by `workers` threads of `exr_threads`."""
    oiio.attribute("exr_threads", exr_threads)
    kept: dict[int, np.ndarray] = {}

    def read(i: int) -> None:
        source = oiio.ImageInput.open(str(sources[i]))
        pixels = source.read_image(0, 0, 0, 3, oiio.HALF)
        source.close()
        if i < k:
            kept[i] = pixels

    def write(i: int) -> None:
        height, width, channels = kept[i].shape
        spec = oiio.ImageSpec(width, height, channels, oiio.HALF)
        spec.attribute("compression", "zip")
        path = str(target / f"{i:02d}.exr")
        image = oiio.ImageOutput.create(path)
        if not (image.open(path, spec) and image.write_image(kept[i]) and image.close()):
            sys.exit(f"cannot write {path}: {image.geterror()}")

    target.mkdir()
    started, busy = time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(read, range(len(sources))))
        list(pool.map(write, range(k)))
    seconds = time.perf_counter() - started, time.process_time() - busy
    shutil.rmtree(target)
    return seconds


def baseline(sources: Sequence[Path], k: int, scratch: Path) -> tuple[float, float]:
    """(wall, CPU) seconds of the faster of two ways to use all cores: one thread per image, or OpenEXR's threads within each."""
    return min(read_and_write(sources, k, scratch / "maps", *way) for way in ((cores(), 1), (1, cores())))


def fit(capture: Path, k: int, method: str, scratch: Path) -> tuple[float, float, float] | None:
    """(wall seconds, processor seconds, peak GB) of `srbf fit` as a process; None if the command does not know the method."""
    asset = scratch / "asset"
    size = ["-k", str(k)] if method == "relighting-map" else []
    command = [sys.executable, "-m", "srbf", "fit", str(capture), "-o", str(asset), *size, *FLAGS[method]]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    started = time.perf_counter()
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
    assert process.stderr is not None
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - started
    process.returncode = os.waitstatus_to_exitcode(status)
    shutil.rmtree(asset, ignore_errors=True)
    if process.returncode == 2:
        print(f"{method}: skipped, this srbf fit does not know {' '.join(FLAGS[method])}")
        return None
    if process.returncode:
        sys.exit(f"{' '.join(command)} failed: {said.strip()}")
    return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e9


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, help="folder of the capture, made if missing")
    parser.add_argument("--methods", nargs="+", choices=list(FLAGS), default=list(FLAGS))
    parser.add_argument("--lights", type=int, default=400)
    parser.add_argument("--side", type=int, default=1024)
    parser.add_argument("-k", type=int, default=25)
    parser.add_argument("--rounds", type=int, default=2, help="repetitions of baseline and fits; the best counts")
    wanted = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        capture = make_capture(wanted.folder or Path(name) / "capture", wanted.lights, wanted.side)
        sources = [capture.folder / light.file for light in capture.lights]
        megabytes = sum(path.stat().st_size for path in sources) / 1e6
        print(f"{wanted.lights} half ZIP EXRs of {wanted.side}², {megabytes / len(sources):.2f} MB each, {megabytes / 1e3:.2f} GB in all")
        bare: list[tuple[float, float]] = []
        fits: dict[str, list[tuple[float, float, float]]] = {}
        methods = list(wanted.methods)
        for _ in range(wanted.rounds):
            bare.append(baseline(sources, wanted.k, Path(name)))
            for method in list(methods):
                done = fit(capture.folder, wanted.k, method, Path(name))
                if done is None:
                    methods.remove(method)
                else:
                    fits.setdefault(method, []).append(done)
        print(f"\n{'':<36}{'seconds':>9}{'ratio':>7}{'bar':>6}{'processor':>11}{'ratio':>7}{'peak GB':>9}")
        wall, busy = min(bare)
        print(f"{f'read all, write {wanted.k} maps (baseline)':<36}{wall:>9.2f}{1:>7.2f}{'':>6}{busy:>11.2f}{1:>7.2f}")
        for method, runs in fits.items():
            seconds, used, _ = min(runs)
            ratio = f"{seconds / wall:>7.2f}{TARGETS[method]:>6.2f}{used:>11.2f}{used / busy:>7.2f}"
            print(f"{'srbf fit, ' + method:<36}{seconds:>9.2f}{ratio}{max(peak for _, _, peak in runs):>9.2f}")


if __name__ == "__main__":
    main()
