"""`python benchmarks/door.py SCENE.blend CAPTURE ASSET... --path X,Y,Z/X,Y,Z`: does a light pop where it is carried through a door?

A point light walks a path in even steps. Error of a step: what the relit picture changes, less what Cycles' picture changes; rendered
twice, with the same random numbers in all steps, so that noise drops out. Largest and mean of it and of Cycles' own change, relative to
the rms of all pictures, and the ratio of the largest ones: 1.2 is the bar.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from references import rendered, settings_of

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.lights import PointLight
from srbf.methods import linear_response


def path_of(text: str) -> np.ndarray:
    """(n, 3) corners of a path, m."""
    return np.array([[float(value) for value in corner.split(",")] for corner in text.split("/")])


def walked(corners: np.ndarray, steps: int) -> list[PointLight]:
    """`steps` + 1 lights at even distances along a path."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.linspace(0, along[-1], steps + 1)
    places = np.stack([np.interp(at, along, corners[:, axis]) for axis in range(3)], axis=1)
    return [PointLight((float(x), float(y), float(z)), falloff="inverse-square") for x, y, z in places]


def sizes(first: np.ndarray, second: np.ndarray, scale: float) -> np.ndarray:
    """Rms of each change (N, n, 3) by two estimates of it, in units of `scale`."""
    return np.sqrt(np.maximum((first * second).mean(axis=(1, 2)), 0)) / scale


def main() -> None:
    """Print a row per asset."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("capture", type=Path)
    parser.add_argument("assets", type=Path, nargs="+")
    parser.add_argument("--path", type=path_of, required=True, help="corners X,Y,Z/X,Y,Z in m")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--samples", type=int, default=64)
    asked = parser.parse_args()
    capture = Capture.open(asked.capture)
    covered = capture.coverage() >= COVERED
    lights = walked(asked.path, asked.steps)
    first, second = rendered(asked.scene, settings_of(capture), lights, asked.samples, same_noise=True)["indirect"][:, :, covered]
    scale = float(np.sqrt((first * second).mean()))
    changes = np.diff(first, axis=0), np.diff(second, axis=0)
    true = sizes(*changes, scale)
    print(f"{'asset':>24}{'change':>9}{'largest':>9}{'error':>9}{'largest':>9}{'ratio':>8}")
    for path in asked.assets:
        asset = Asset.open(path)
        step = np.diff(np.stack([linear_response(asset, [light])[covered] for light in lights]), axis=0)
        error = sizes(step - changes[0], step - changes[1], scale)
        print(
            f"{path.name:>24}{true.mean():9.4f}{true.max():9.4f}{error.mean():9.4f}{error.max():9.4f}{error.max() / true.max():8.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
