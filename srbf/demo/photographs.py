"""A light dome as used for photographs of reliefs, and its photographs: 8-bit JPEGs with light lists."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.capture import Capture
from srbf.io import files
from srbf.io.image import encode_srgb
from srbf.sphere import point_set, random_directions

POINT_LIGHTS, DIRS, TEST = "point_lights.lp", "dirs.lp", "test.lp"
QUALITY = 95  # of the JPEGs
WHITE_QUANTILE = 0.998  # of the pixels of all photographs; it becomes white


@dataclass(frozen=True)
class Dome:
    """A photographer's light dome: `point_lights` to fit and `tests` to hold out, all above the elevation `lowest` (degrees)."""

    point_lights: int
    tests: int
    lowest: float


def dome_directions(dome: Dome) -> Float64[ndarray, "L 3"]:
    """Unit directions of a dome's lights: those to fit, evenly spread above its lowest elevation, then the random held-out ones."""
    floor = np.sin(np.radians(dome.lowest))
    even = point_set("fibonacci", dome.point_lights, "hemisphere")
    random = random_directions(dome.tests, "hemisphere", np.random.default_rng(5))
    return np.concatenate([_lifted(even, floor), _lifted(random, floor)])


def _lifted(directions: Float64[ndarray, "n 3"], floor: float) -> Float64[ndarray, "n 3"]:
    """Directions of the hemisphere mapped onto the cap above z = floor; the map preserves area up to a factor."""
    z = floor + directions[:, 2] * (1 - floor)
    across = directions[:, :2] * np.sqrt((1 - z**2) / np.maximum(1 - directions[:, 2] ** 2, 1e-12))[:, None]
    return np.column_stack([across, z])


def write_list(path: Path, names: list[str], directions: Float64[ndarray, "n 3"]) -> None:
    """Write a .lp file: one name and direction per light."""
    lines = [f"{name} {x:.6f} {y:.6f} {z:.6f}" for name, (x, y, z) in zip(names, directions, strict=True)]
    files.write_text(path, "\n".join([str(len(lines)), *lines]) + "\n")


def write_point_lights(path: Path, dome: Dome) -> None:
    """Write the light list of the bake."""
    directions = dome_directions(dome)
    write_list(path, [f"{i:03d}" for i in range(len(directions))], directions)


def photograph(rendered: Path, dome: Dome, folder: Path) -> None:
    """Write every image of a baked dome as a JPEG with one exposure, and the light lists to fit and to test."""
    from PIL import Image

    files.make_folder(folder)
    capture = Capture.open(rendered)
    everything = np.concatenate([image[::4, ::4].ravel() for image in map(capture.image, range(len(capture.lights)))])
    gain = 1.0 / float(np.quantile(everything, WHITE_QUANTILE))
    names = [f"{'test' if i >= dome.point_lights else 'photo'}_{i:03d}.jpg" for i in range(len(capture.lights))]
    for i, name in enumerate(names):
        bytes_ = np.round(encode_srgb(np.clip(capture.image(i) * gain, 0, 1)) * 255).astype(np.uint8)
        with files.atomic_path(folder / name) as temporary:
            Image.fromarray(bytes_).save(temporary, "JPEG", quality=QUALITY, subsampling=0)
    directions = capture.directions()
    write_list(folder / DIRS, names[: dome.point_lights], directions[: dome.point_lights])
    write_list(folder / TEST, names[dome.point_lights :], directions[dome.point_lights :])
