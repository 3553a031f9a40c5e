"""`python benchmarks/environments.py SCENE.blend CAPTURE ASSET…`: bounces of environment maps against Cycles, by the table and by rays.

`gradient`: blue above, white at the horizon, a dark ground; `half`: one side ten times as bright; `patch` and `sun`: the gradient with a
bright disc of 12 and 4 degrees in radius, seen from `--facing`. Every reference is rendered twice, so that its noise drops out: relative
RMSE = sqrt(sum (a - r1)(a - r2) / sum r1 r2). For each asset the table and the rays, and once the rays from texels for direct light; behind
each the ratio of energies.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from references import rendered, settings_of

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.light_geometry import environment_samples
from srbf.lights import EnvironmentLight
from srbf.methods import linear_response
from srbf.methods.environment_table import has_environment_table, without_environment_table
from srbf.visibility.rays import RayTracer
from srbf.visibility.receivers import Receivers

SIZE = (64, 128)
ZENITH, HORIZON, GROUND, DISC = (0.25, 0.45, 0.9), (1.0, 1.0, 1.05), 0.15, (1.0, 0.9, 0.7)


def environments(facing: np.ndarray) -> dict[str, EnvironmentLight]:
    """By name."""
    directions, _ = environment_samples(np.zeros((*SIZE, 3), np.float32), "sphere", np.eye(3))
    up = np.clip(directions[..., 2:], 0, 1)
    gradient = np.where(directions[..., 2:] > 0, (1 - up) * np.array(HORIZON) + up * np.array(ZENITH), GROUND)
    side = np.where((directions @ np.cross(facing, [0, 0, 1.0]))[..., None] > 0, 3.0, 0.3) * np.ones(3)

    def with_disc(axis: np.ndarray, degrees: float, radiance: float) -> np.ndarray:
        inside = directions @ (axis / np.linalg.norm(axis)) > np.cos(np.radians(degrees))
        return gradient + np.where(inside[..., None], radiance, 0.0) * np.array(DISC)

    across = np.cross([0, 0, 1.0], facing)
    maps = {
        "gradient": gradient,
        "half": side,
        "patch": with_disc(facing + 0.3 * across + [0, 0, 0.5], 12, 30.0),
        "sun": with_disc(facing - 0.4 * across + [0, 0, 0.7], 4, 300.0),
    }
    return {name: EnvironmentLight(image.astype(np.float32)) for name, image in maps.items()}


def cells(found: np.ndarray, first: np.ndarray, second: np.ndarray) -> str:
    """A column per environment; arrays (N, n, 3)."""
    errors = ((found - first) * (found - second)).sum(axis=(1, 2)) / (first * second).sum(axis=(1, 2))
    energy = found.sum(axis=(1, 2)) / ((first + second) / 2).sum(axis=(1, 2))
    return "".join(f"{np.sqrt(max(error, 0)):9.3f}{ratio:6.2f}" for error, ratio in zip(errors, energy, strict=True))


def main() -> None:
    """Print a row per asset and way, a column per environment."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("capture", type=Path)
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--facing", default="0,-1,0", help="out of the windows")
    parser.add_argument("--samples", type=int, default=64)
    asked = parser.parse_args()
    capture = Capture.open(asked.capture)
    covered = capture.coverage() >= COVERED
    named = environments(np.array([float(number) for number in asked.facing.split(",")]))
    lights = list(named.values())
    images = rendered(asked.scene, settings_of(capture), lights, asked.samples, ("indirect", "direct"))
    references = {name: found[:, :, covered] for name, found in images.items()}
    print(f"{'':>32}" + "".join(f"{name:>15}" for name in named))
    for path in asked.assets:
        asset = Asset.open(path)
        for way, own in (("table", asset), ("rays", without_environment_table(asset))):
            if way == "rays" or has_environment_table(asset):
                relit = np.stack([linear_response(own, [light])[covered] for light in lights])
                print(f"{path.name + ', ' + way:>32}{cells(relit, *references['indirect'])}", flush=True)
    tracer = RayTracer(Receivers.of(capture))
    direct = np.stack([tracer.response([light])[covered] for light in lights])
    print(f"{'direct light by rays':>32}{cells(direct, *references['direct'])}")
    for name, (first, second) in references.items():
        noise = np.sqrt(((first - second) ** 2).sum(axis=(1, 2)) / 2 / (first * second).sum(axis=(1, 2)))
        print(f"{'noise of a reference, ' + name:>32}" + "".join(f"{value:9.3f}{'':6}" for value in noise))


if __name__ == "__main__":
    main()
