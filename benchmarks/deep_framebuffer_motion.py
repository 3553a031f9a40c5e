"""`python benchmarks/deep_framebuffer_motion.py CAPTURE ASSET...`: how evenly the indirect light of a deep framebuffer follows a light.

A point light slides along surfaces in view, 5, 10 and 30 cm off them, in straight lines of 5 mm a step. The change of the picture's
indirect light from step to step, rms over its own: median over all steps of a distance, the largest, and the largest ratio of a step to
the mean of the two beside it; above about 2 something jumps. Cells of bright surfels that are seen for the first time, in a step.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.lights import PointLight
from srbf.methods import linear_response
from srbf.methods.deep_framebuffer import _ready

OFF = (0.05, 0.1, 0.3)  # m
STEP = 5e-3  # m


def paths(capture: Capture, off: float, count: int, steps: int, seed: int = 5) -> list[list[PointLight]]:
    """`count` straight lines of `steps` lights, in front of random pixels."""
    rng = np.random.default_rng([seed, int(1000 * off)])
    covered = capture.coverage().ravel() >= COVERED
    images = capture.geometry("position"), capture.geometry("normal")
    position, normal = (image.reshape(-1, 3)[covered].astype(np.float64) for image in images if image is not None)
    found = []
    for pixel in rng.integers(len(position), size=count):
        along = np.cross(normal[pixel], rng.normal(size=3))
        along *= STEP / np.linalg.norm(along)
        places = position[pixel] + off * normal[pixel] + np.arange(steps)[:, None] * along
        found.append([PointLight((float(x), float(y), float(z)), falloff="inverse-square") for x, y, z in places])
    return found


def main() -> None:
    """Print a row per asset and distance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--paths", type=int, default=6)
    parser.add_argument("--steps", type=int, default=24)
    asked = parser.parse_args()
    capture = Capture.open(asked.capture)
    covered = capture.coverage() >= COVERED
    print(f"{'asset':>24}{'off':>8}{'median':>9}{'largest':>9}{'jump':>7}{'new cells':>11}")
    for path in asked.assets:
        asset = Asset.open(path)
        for off in OFF:
            changes, jumps, before = [], [], _seen(asset)
            lines = paths(capture, off, asked.paths, asked.steps)
            for line in lines:
                images = [linear_response(asset, [light])[covered] for light in line]
                steps = np.array([np.linalg.norm(b - a) / max(np.linalg.norm(b), 1e-30) for a, b in zip(images, images[1:], strict=False)])
                changes.append(steps)
                jumps.append((steps[1:-1] / np.maximum((steps[:-2] + steps[2:]) / 2, 1e-30)).max())
            cells = (_seen(asset) - before) / (len(lines) * asked.steps)
            every = np.concatenate(changes)
            numbers = f"{100 * np.median(every):>8.1f}%{100 * every.max():>8.1f}%{max(jumps):>7.2f}{cells:>11.2f}"
            print(f"{path.name:>24}{100 * off:>6.0f}cm{numbers}", flush=True)


def _seen(asset: Asset) -> int:
    near = _ready(asset).near
    return 0 if near is None else near[1].traced


if __name__ == "__main__":
    main()
