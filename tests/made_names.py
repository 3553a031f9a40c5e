"""Captures of named lights: smooth random images, each of a light of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from srbf.capture import Capture
from srbf.io import files
from srbf.io.image import write_image

NAMES = ("Desk lamp", "Window", "TV", "Ceiling", "Sconce & rail", "World", "Neon", "Candles")  # words: ok


def smooth_images(lights: int = len(NAMES), height: int = 16, width: int = 16, seed: int = 2) -> np.ndarray:
    """(lights, H, W, 3) not negative: pools of light about random places, each of a color, over a weak even one."""
    rng = np.random.default_rng(seed)
    y, x = np.meshgrid(np.arange(height) / height, np.arange(width) / width, indexing="ij")
    images = np.empty((lights, height, width, 3))
    for image in images:
        u, v = rng.uniform(0, 1, 2)
        pool = np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * rng.uniform(0.15, 0.4) ** 2))
        image[:] = (0.05 + pool)[..., None] * rng.uniform(0.2, 1, 3) * rng.uniform(0.3, 3)
    return images.astype(np.float32)


def capture_of_names(
    folder: Path, images: np.ndarray | None = None, names: tuple[str, ...] = NAMES, transport: str = "combined", holes: bool = True
) -> Capture:
    """`images` (N, H, W, 3) in `folder`; with `holes`, a corner is not covered and holds nonsense."""
    images = smooth_images(len(names)) if images is None else images
    height, width = images.shape[1:3]
    coverage = np.ones((height, width, 1), np.float32)
    if holes:
        coverage[: height // 4, : width // 3] = 0
    (folder / "lights").mkdir(parents=True)
    lights = []
    for number, (name, image) in enumerate(zip(names, images, strict=True)):
        file = f"lights/{number:04d}.exr"
        write_image(folder / file, np.where(coverage > 0, image, 40).astype(np.float32), "half")
        lights.append({"kind": "named", "name": name, "objects": [name], "role": "train", "file": file})
    write_image(folder / "coverage.exr", coverage, "float")
    y, x = np.meshgrid(np.arange(height) / height, np.arange(width) / width, indexing="ij")
    write_image(folder / "position.exr", np.stack([x, 1 - y, 0 * x], 2).astype(np.float32), "float")
    manifest = {
        "format": "srbf-capture",
        "version": 1,
        "quantity": "irradiance",
        "transport": transport,
        "width": width,
        "height": height,
        "lights": lights,
        "coverage": "coverage.exr",
        "position": "position.exr",
    }
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)
