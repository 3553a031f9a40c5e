"""Temporal stability by method: `python benchmarks/motion.py [CAPTURE…] [--fit "-k 25"]…`; without captures, on analytic scenes.

A light sweeps over 240 frames of great circles between the captured directions. Two scenes have a closed form: an unshadowed Lambert
plane, whose brightness must stay within 2 % of its cosine, and a plane with a pole whose shadow is that of a sun of given size. A given
capture is compared with all its train images interpolated.
Every `--fit` has the flags of one `srbf fit`. Exit status 1 if a target is missed.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.evaluation.light_spacing import shadow_sampling
from srbf.evaluation.temporal_stability import Motion, Reference, compare, dense_reference, great_circles, sampled_texels, sweep
from srbf.io import files
from srbf.io.image import write_image
from srbf.sphere import Domain, domain_of, mean_spacing, point_set

SIDE = 48  # texels of the analytic scenes
LAMBERT_BAR = 0.02
POLE_RADIUS, POLE_HEIGHT = 0.08, 1.0  # on the square [-1, 1]^2
Response = Callable[[np.ndarray], np.ndarray]  # (3,) -> (H, W) responses of a white surface


def lambert(direction: np.ndarray) -> np.ndarray:
    """An unshadowed plane facing up."""
    return np.full((SIDE, SIDE), max(0.0, direction[2]))


@dataclass(frozen=True)
class Pole:
    """A plane facing up around a vertical cylinder, under a sun of angular diameter `sun_angle` (rad); exact except at the shadow's tip.

    A vertical edge hides the part of the sun's disc beyond a great circle; the pole's top does the same by elevation; both factors
    are multiplied.
    """

    sun_angle: float

    def __call__(self, direction: np.ndarray) -> np.ndarray:
        x = -1 + 2 * (np.arange(SIDE) + 0.5) / SIDE
        x, y = np.meshgrid(x, -x)
        distance = np.hypot(x, y)
        half_width = np.arcsin(np.clip(POLE_RADIUS / distance, 0, 1))
        elevation = np.arcsin(np.clip(direction[2], -1, 1))
        off = np.arctan2(direction[1], direction[0]) - np.arctan2(-y, -x)
        left, right = (np.arcsin(np.cos(elevation) * np.sin(off + side * half_width)) for side in (1, -1))
        beside = self._beyond(left) * self._beyond(-right)
        below = self._beyond(np.arctan(POLE_HEIGHT / distance) - elevation)
        hidden = np.where(np.cos(off) > 0, beside * below, 0.0)
        return np.where(distance > POLE_RADIUS, max(0.0, direction[2]) * (1 - hidden), 0.0)

    def _beyond(self, angle: np.ndarray) -> np.ndarray:
        """The part of the disc beyond a great circle at the distance `angle` (rad) from its center."""
        t = np.clip(angle / max(self.sun_angle / 2, 1e-9), -1, 1)
        return 0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi


def make_capture(folder: Path, response: Response, lights: int, domain: Domain) -> Capture:
    """A capture of the responses to the Hammersley directions of a bake, as half floats."""
    (folder / "lights").mkdir(parents=True)
    entries = []
    for i, direction in enumerate(point_set("hammersley", lights, domain)):
        file = f"lights/{i:04d}.exr"
        write_image(folder / file, np.repeat(response(direction)[:, :, None], 3, axis=2), "half")
        entries.append({"kind": "directional", "direction": direction.tolist(), "role": "train", "file": file})
    manifest = {"format": "srbf-capture", "version": 1, "quantity": "irradiance", "width": SIDE, "height": SIDE, "lights": entries}
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)


def truth(response: Response, texels: np.ndarray) -> Reference:
    """The closed form as a sweep's reference."""
    return lambda directions: np.stack([np.repeat(response(d).reshape(-1, 1)[texels], 3, axis=1) for d in directions]).astype(np.float32)


def fitted(capture: Capture, flags: str, folder: Path) -> Asset | str:
    """The asset of `srbf fit` with these flags, or its last line of output on failure."""
    command = [sys.executable, "-m", "srbf", "fit", str(capture.folder), "-o", str(folder), *shlex.split(flags)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return (done.stderr.strip().splitlines() or ["no message"])[-1]
    return Asset.open(folder)


def nearest_image(capture: Capture, texels: np.ndarray) -> Reference:
    """The response of each direction is that of the nearest train image."""
    train = capture.indices("train")
    images = np.stack([capture.image(i).reshape(-1, 3)[texels] for i in train])
    towards = capture.directions(train).T
    return lambda directions: images[(directions @ towards).argmax(axis=1)]


def baselines(capture: Capture, response: Response | None, texels: np.ndarray, reference: Reference) -> Iterator[tuple[str, Motion]]:
    """Motion of the uncompressed train images: the nearest image, and, for analytic scenes, all interpolated."""
    path = great_circles(domain_of(capture.directions(capture.indices("train"))))
    relighters = {"(nearest image)": nearest_image}
    if response is not None:
        relighters["(all images interpolated)"] = dense_reference
    for name, relighter in relighters.items():
        pictures = (f(path.reshape(-1, 3)).reshape(*path.shape[:2], -1, 3) for f in (relighter(capture, texels), reference))
        yield name, compare(path, *pictures)


def row(name: str, motion: Motion, bar: str = "") -> None:
    print(
        f"{name:<34}{motion.change_ratio:>9.2f}{motion.largest_step:>9.2f}{motion.brightness_error:>11.1%}{motion.largest_flicker:>9.1%}"
        f"{motion.ghosting:>10.2f}{motion.edge_kept:>7.2f}  {bar}"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("captures", nargs="*", type=Path)
    parser.add_argument("--fit", action="append", help="flags of one srbf fit; may be repeated")
    parser.add_argument("--lights", type=int, default=400)
    parser.add_argument("--domain", choices=("hemisphere", "sphere"), default="hemisphere")
    parser.add_argument("--sun-angle", default="auto", help="of the pole's sun: rad, or auto for the spacing of the lights")
    arguments = parser.parse_args()
    methods = arguments.fit or ["-k 25"]
    missed = False
    with tempfile.TemporaryDirectory() as name:
        temporary = Path(name)
        scenes: list[tuple[str, Capture, Response | None]] = [(str(path), Capture.open(path), None) for path in arguments.captures]
        if not scenes:
            spacing = mean_spacing(point_set("hammersley", arguments.lights, arguments.domain))
            angle = spacing if arguments.sun_angle == "auto" else float(arguments.sun_angle)
            pole = f"pole, a sun of {np.degrees(angle):.1f} degrees"
            for title, response in (("Lambert plane", lambert), (pole, Pole(angle))):
                scenes.append(
                    (title, make_capture(temporary / f"capture{len(scenes)}", response, arguments.lights, arguments.domain), response)
                )
        for number, (title, capture, response) in enumerate(scenes):
            print(f"\n{title}: {shadow_sampling(capture).sentence()}")
            print(f"{'srbf fit':<34}{'change':>9}{'step':>9}{'brightness':>11}{'flicker':>9}{'ghosting':>10}{'kept':>7}")
            texels = sampled_texels(capture.coverage() >= COVERED)
            reference = dense_reference(capture, texels) if response is None else truth(response, texels)
            for baseline, motion in baselines(capture, response, texels, reference):
                row(baseline, motion)
            for index, flags in enumerate(methods):
                asset = fitted(capture, flags, temporary / f"asset{number}-{index}")
                if isinstance(asset, str):
                    print(f"{flags:<34}  not fitted: {asset}")
                    continue
                motion = sweep(asset, reference, texels, great_circles(asset.domain))
                bar = ""
                if response is lambert:
                    within = motion.brightness_error <= LAMBERT_BAR
                    bar = f"{'within' if within else 'misses'} {LAMBERT_BAR:.0%} of its cosine"
                    missed |= not within
                row(flags, motion, bar)
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
