"""Captures of a floor whose texels have places: under suns that a wall shades, with and without the noise of few samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from srbf.capture import Capture

SIDE = 32
STEP = 0.1  # m
LEVEL = 0.5  # of the bounced light
RECEIVER = {"kind": "lightmap", "object": "Floor", "uv_layer": "lightmap"}


def places(rng: np.random.Generator) -> np.ndarray:
    """(SIDE, SIDE, 3): a grid, moved a little, so that no two neighbors are equally far."""
    rows, columns = np.meshgrid(np.arange(SIDE), np.arange(SIDE), indexing="ij")
    moved = rng.uniform(-0.1, 0.1, (SIDE, SIDE, 2))
    return (np.stack([columns + moved[..., 0], rows + moved[..., 1], np.zeros((SIDE, SIDE))], -1) * STEP).astype(np.float32)


def lit(position: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(H, W, 3): bounced light that varies slowly, and a sun that lights only one side of an edge that no light moves."""
    smooth = LEVEL + 0.2 * np.sin(position[..., 0] + 2 * direction[0]) * direction[2] + 0.1 * position[..., 1] * direction[1]
    sun = np.where(position[..., 0] > STEP * SIDE / 2, direction[2], 0.0)
    return (smooth + sun)[..., None] * np.array([1, 0.8, 0.6])


def floor_capture(
    make_capture: Callable[..., Capture],
    noise: float,
    grain: float = 0.0,
    order: np.ndarray | None = None,
    name: str = "floor",
    lights: int = 40,
    noisier: float = 1.0,
) -> Capture:
    """Of `noise` in the train images, `noisier` times as much in the far three quarters, and of a true `grain` from texel to texel.

    `order`: of the texels in the image.
    """
    order = np.arange(SIDE * SIDE) if order is None else order
    rng = np.random.default_rng(0)
    place, dust = places(rng), 1 + grain * rng.standard_normal((SIDE, SIDE, 1))
    scale = np.where(place[..., 1:2] > STEP * SIDE / 4, noise * noisier, noise)
    images = 0

    def arranged(image: np.ndarray) -> np.ndarray:
        return image.reshape(SIDE * SIDE, -1)[order].reshape(image.shape)

    def response(direction: np.ndarray) -> np.ndarray:
        nonlocal images
        images += 1
        clean = lit(place, direction) * dust
        added = scale * np.random.default_rng([1, images]).standard_normal(clean.shape) if images <= lights else 0.0
        return arranged(clean + added)

    normal = np.broadcast_to(np.array([0, 0, 1], np.float32), place.shape)
    made = make_capture(response, lights=lights, validation=12, holdout=8, name=name, position=arranged(place), normal=normal)
    return replace(made, manifest={**made.manifest, "receiver": RECEIVER})
