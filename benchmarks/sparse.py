"""`python benchmarks/sparse.py SCENE.blend… [--side 32] [--fit]`: sparse sampling of transport beside brute force by the same tracer.

Scenes are of `data/scenes/figure.py`: vertices of Figure and Ground. For each way of sampling the share of the elements of visibility,
rays of direct light and of bounces, and wall time of either, as shares of brute force, then the L2 error (relative RMSE) of all light under
six environment maps and under 200 suns. `--fit`: PSNR of 13 bytes per receiver beside spherical harmonics and Haar wavelets.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from srbf.bake.cubemap_set import CubemapSet
from srbf.bake.cubemap_trace import trace_cubemap
from srbf.bake.light_sets import LIGHT_SET_FILE, FoundPlaces
from srbf.basis.exitant_harmonics import harmonics
from srbf.capture import COVERED, Capture
from srbf.cubemap import Cubemap
from srbf.cubemap_capture import CubemapCapture
from srbf.cubemap_transport import BOUNCES_FILE, VISIBILITY_FILE, stored_arrays
from srbf.fitting.options import fit
from srbf.methods import captured_responses

WAYS = ("full", "neighbors", "l1")
SUNS = 200
LOBES = 6


def prepared(scene: Path, name: str, folder: Path, *more: str) -> Path:
    """The receivers, the scene and its surfels, by a bake of the smallest cubemap with `more` words."""
    words = ["--receiver", f"vertices:{name}", "--light-set", "cubemap:2", "--validation", "0", "--holdout", "0", "--seed", "77", *more]
    subprocess.run([sys.executable, "-m", "srbf", "bake", scene, "-o", folder / name, *words], check=True, capture_output=True)
    return folder / name


def traced(source: Path, way: str, side: int, gloss: int | None = None) -> tuple[Capture, dict[str, float]]:
    """(the capture of one way of sampling, its figures); `gloss`: terms of its receivers."""
    folder = source.with_name(f"{source.name}-{way}")
    shutil.copytree(source, folder)
    for name in (VISIBILITY_FILE, BOUNCES_FILE):
        (folder / name).unlink()
    found = FoundPlaces.of_arrays(dict(np.load(folder / LIGHT_SET_FILE)))
    bare = Capture(folder, Capture.open(source).manifest, ())
    assert found.surfels is not None
    began, told = time.perf_counter(), dict[str, float]()

    def progress(done: float, total: float, what: str) -> None:
        told.setdefault(what.split(",")[0], time.perf_counter() - began)
        told[what.split(",")[0]] = time.perf_counter() - began

    cubemap = CubemapSet(side)
    keys = trace_cubemap(
        bare, found.surfels, found.bounces, "bench", Cubemap(cubemap.side), way, (0, 0), 77, progress, lambda line: None, gloss
    )
    wall = time.perf_counter() - began
    stages = [stored_arrays(folder / name) for name in (VISIBILITY_FILE, BOUNCES_FILE)]
    direct, bounces = (stage for stage in stages if stage is not None)
    figures = {
        "sampled": float(direct["sampled"]),
        "predicted": float(direct["error"]),
        "direct rays": float(direct["rays"]),
        "bounce rays": float(bounces["rays"]),
        "direct s": told["visibility"],
        "bounces s": wall - told["visibility"],
        "cpu s": float(direct["cpu_seconds"]) + float(bounces["cpu_seconds"]),
        "bytes": float(sum((folder / name).stat().st_size for name in (VISIBILITY_FILE, BOUNCES_FILE))),
    }
    manifest = {**bare.manifest, **keys}
    (folder / "capture.json").write_text(json.dumps(manifest), encoding="utf-8")
    return Capture.open(folder), figures


def lighting(side: int) -> np.ndarray:
    """(N, 6 + SUNS) irradiance of every direction: six environments of a bright lobe each, then single texels."""
    cubemap, rng = Cubemap(side), np.random.default_rng(3)
    axes = rng.normal(size=(LOBES, 3)) + [0, 0, 0.8]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    width = np.geomspace(5, 200, LOBES)
    maps = cubemap.solid_angles[:, None] * (0.3 + 0.1 * width * np.exp(width * (cubemap.directions @ axes.T - 1)))
    return np.concatenate([maps, np.eye(cubemap.count)[:, rng.choice(cubemap.count, SUNS, replace=False)]], axis=1).astype(np.float32)


def lit(capture: Capture, lights: np.ndarray) -> np.ndarray:
    """(M, P, 3) of M mixtures of the directions."""
    total = np.zeros((lights.shape[1], capture.width * capture.height, 3), np.float32)
    for first, block in capture.blocks(capture.indices("train")):
        total += np.einsum("bpc,bm->mpc", block, lights[first : first + len(block)], optimize=True)
    return total


def errors(found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """Relative RMSE under the environments, and under the suns."""
    parts = [slice(0, LOBES), slice(LOBES, None)]
    maps, suns = (float(np.linalg.norm(found[p] - true[p]) / np.linalg.norm(true[p])) for p in parts)
    return maps, suns


def compressed(capture: Capture, lights: np.ndarray, true: np.ndarray) -> None:
    """PSNR of an asset of 13 bytes, of SH of order 4 (16 numbers a color) and of 5 Haar wavelets of every receiver's gray row."""
    covered = capture.coverage().ravel() >= COVERED
    began = time.perf_counter()
    asset = fit(capture, budget=16)
    seconds = time.perf_counter() - began
    train, found = capture.indices("train"), np.zeros_like(true)
    for start in range(0, len(train), 256):
        chosen = train[start : start + 256]
        block = captured_responses(asset, capture, chosen).reshape(len(chosen), -1, 3)
        found += np.einsum("bpc,bm->mpc", block, lights[start : start + 256], optimize=True)
    cubemap = Cubemap(round((len(train) / 6) ** 0.5))
    basis = harmonics(cubemap.directions, 3)  # (N, 16)
    weighted = basis * np.sqrt(cubemap.solid_angles)[:, None]
    project = (np.linalg.pinv(weighted) * np.sqrt(cubemap.solid_angles)).astype(np.float32)  # (16, N)
    by_harmonics = lit(capture, project.T @ (basis.T.astype(np.float32) @ lights))
    print(
        f"  fit {seconds:6.1f} s",
        *(
            f"{name} {_psnr(own[:, covered], true[:, covered])}"
            for name, own in (("13 bytes", found), ("SH 4", by_harmonics), ("wavelets", _wavelets(capture, lights, cubemap)))
        ),
    )


def _wavelets(capture: Capture, lights: np.ndarray, cubemap: Cubemap) -> np.ndarray:
    """Images by the five largest coefficients of the 2D Haar transform of each face, three bytes each."""
    texels, side, total = (
        capture.width * capture.height,
        cubemap.side,
        np.zeros((lights.shape[1], capture.width * capture.height, 3), np.float32),
    )
    haar = np.ones((1, 1))
    while len(haar) < side:
        haar = np.concatenate([np.kron(haar, [1, 1]), np.kron(np.eye(len(haar)), [1, -1])]) / np.sqrt(2)
    basis = haar.astype(np.float32)
    for start in range(0, texels, 1024):
        rows = np.arange(start, min(start + 1024, texels))
        faces = capture.sample(capture.indices("train"), rows).mean(axis=2).reshape(-1, side, side)
        found = (basis @ faces @ basis.T).reshape(len(rows), -1)
        least = np.partition(np.abs(found), -5, axis=1)[:, -5, None]
        kept = np.where(np.abs(found) >= least, found, 0).reshape(-1, side, side)
        total[:, rows] = ((basis.T @ kept @ basis).reshape(len(rows), -1) @ lights).T[:, :, None]
    return total


def _psnr(found: np.ndarray, true: np.ndarray) -> str:
    """Under environments / suns, dB, clamped at 0; the peak is each kind's 99.9 % quantile."""
    words = []
    for part in (slice(0, LOBES), slice(LOBES, None)):
        peak = np.quantile(true[part], 0.999)
        words.append(f"{20 * np.log10(peak / np.sqrt(np.mean((np.maximum(found[part], 0) - true[part]) ** 2))):.1f}")
    return " / ".join(words) + " dB;"


def main() -> None:
    """Print a row per scene, receiver and way of sampling."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--side", type=int, default=32)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--ways", default=",".join(WAYS))
    arguments = parser.parse_args()
    lights = lighting(arguments.side)
    print(
        "scene receiver way | sampled | rays: direct, bounces, of brute force | s: direct, bounces, of brute force | maps suns | predicted"
    )
    for scene in arguments.scenes:
        for name in ("Figure", "Ground"):
            with tempfile.TemporaryDirectory() as scratch:
                source = prepared(scene, name, Path(scratch))
                whole: dict[str, float] = {}
                true = np.zeros(0)
                for way in arguments.ways.split(","):
                    capture, f = traced(source, way, arguments.side)
                    assert isinstance(capture, CubemapCapture)
                    found = lit(capture, lights)
                    whole, true = (f, found) if way == "full" else (whole, true)
                    rays, seconds = f["direct rays"] + f["bounce rays"], f["direct s"] + f["bounces s"]
                    maps, suns = errors(found, true)
                    print(
                        f"{scene.stem} {name} {way} | {f['sampled']:.1%} | {f['direct rays'] / 1e6:.1f} M {f['bounce rays'] / 1e6:.1f} M"
                        f" {rays / (whole['direct rays'] + whole['bounce rays']):.1%} | {f['direct s']:.1f} {f['bounces s']:.1f}"
                        f" {seconds / (whole['direct s'] + whole['bounces s']):.1%} (direct {f['direct s'] / whole['direct s']:.0%}) |"
                        f" {maps:.2%} {suns:.2%} | {f['predicted']:.2%} | {f['bytes'] / 1e6:.1f} MB",
                        flush=True,
                    )
                    if arguments.fit:
                        compressed(capture, lights, true)


if __name__ == "__main__":
    main()
