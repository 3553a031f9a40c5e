"""Errors under held-out lights, one at a time and in sums of several: mean, worst image, shadow edges, FLIP, clamped light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32
from srbf.errors import MissingLibraryError
from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.flip import Flip

LIGHTS = (1, 2, 8)  # at once
SUMS = 16  # images of several lights
MIN_COLOR = 0.25  # of a channel of a light's random color, before the colors of a sum are normalized to a mean of 1
EDGE_SHARE = 0.05  # of the covered texels: those where the light changes most to a neighbor
DIVISOR_FLOOR = 0.1  # of the mean image's mean, added to the mean image before the division by it
FLIP_PIXELS = 8 << 16  # evaluated by FLIP per row of the table: eight images of 256²


@dataclass(frozen=True)
class HeldOutError:
    """Error of `pictures` images of `lights` lights each, over covered texels, both clamped at 0.

    `psnr` (dB) is the mean over images, `worst` the lowest, `edges` the mean at shadow edges. `flip` is the mean over
    `flip_pictures` of them, the image of lowest PSNR and others in order, `worst_flip` the largest; None without flip-evaluator.
    """

    lights: int
    pictures: int
    psnr: float
    worst: float
    edges: float
    flip: float | None
    worst_flip: float | None
    flip_pictures: int


def sums_of_lights(
    images: tuple[Float32[ndarray, "S H W 3"], Float32[ndarray, "S H W 3"]], lights: int, rng: np.random.Generator
) -> tuple[Float32[ndarray, "n H W 3"], Float32[ndarray, "n H W 3"]]:
    """The same SUMS random sums of `lights` images of both stacks; for one light, the stacks unchanged.

    Relighting is linear: a sum of images times colors is the image under those lights. Lights are drawn without repetition if there
    are enough. Their colors are uniform in [MIN_COLOR, 1] per channel, divided by the mean channel of their sum, so that a sum is as
    bright as one white light.
    """
    if lights == 1:
        return images
    count = len(images[0])
    sums = tuple(np.empty((SUMS, *stack.shape[1:]), np.float32) for stack in images)
    for row in range(SUMS):
        chosen = rng.choice(count, lights, replace=count < lights)
        colors = rng.uniform(MIN_COLOR, 1, (lights, 3))
        colors /= colors.sum(axis=0).mean()
        for target, stack in zip(sums, images, strict=True):
            target[row] = np.einsum("mhwc,mc->hwc", stack[chosen], colors.astype(np.float32), optimize=True)
    return sums[0], sums[1]


def shadow_edges(
    reference: Float32[ndarray, "H W 3"], mean: Float32[ndarray, "H W 3"], covered: Bool[ndarray, "H W"]
) -> Bool[ndarray, "H W"]:
    """The EDGE_SHARE of the covered texels where light changes most to a neighbor: the shadow edges.

    The measure is the channel sum of the reference over that of the mean image plus DIVISOR_FLOOR of its mean, so that the
    colors and outlines of surfaces cancel. Steps to uncovered texels do not count. The definition is ours.
    """
    whole = mean.sum(axis=2)
    floor = DIVISOR_FLOOR * float(whole[covered].mean()) if covered.any() else 0.0
    relative = np.where(covered, np.maximum(reference, 0).sum(axis=2) / np.maximum(whole + floor, 1e-30), np.nan)
    step = np.zeros(covered.shape, np.float32)
    for axis in (0, 1):
        change = np.nan_to_num(np.abs(np.diff(relative, axis=axis)))
        near, far = (slice(None),) * axis + (slice(None, -1),), (slice(None),) * axis + (slice(1, None),)
        step[near] = np.maximum(step[near], change)
        step[far] = np.maximum(step[far], change)
    least = float(np.quantile(step[covered], 1 - EDGE_SHARE)) if covered.any() else 0.0
    return covered & (step >= least) & (step > 0)


def held_out_error(
    references: Float32[ndarray, "S H W 3"],
    relit: Float32[ndarray, "S H W 3"],
    covered: Bool[ndarray, "H W"],
    lights: int,
    peak: float,
    flip: Flip,
    seed: int = 0,
    floor: float = 0.0,
) -> HeldOutError:
    """Error under `lights` of the S held-out lights at once; `relit` before the clamp at `floor`.

    Memory: 2 x SUMS images in addition to the stacks.
    """
    mean = references.mean(axis=0)
    true, shown = sums_of_lights((references, relit), lights, np.random.default_rng([seed, lights]))
    whole, edges = [], []
    for reference, picture in zip(true, shown, strict=True):
        squares = (np.maximum(picture, floor) - np.maximum(reference, floor)) ** 2
        whole.append(psnr(peak, float(np.sqrt(squares[covered].mean(dtype=np.float64)))))
        at_edges = shadow_edges(reference, mean, covered)
        if at_edges.any():
            edges.append(psnr(peak, float(np.sqrt(squares[at_edges].mean(dtype=np.float64)))))
    order = sorted(range(len(true)), key=lambda i: (i != int(np.argmin(whole)), i))
    looked = order[: max(1, FLIP_PIXELS // covered.size)]
    try:
        flips = [float(flip.error_map(true[i], shown[i], covered)[covered].mean()) for i in looked]
    except MissingLibraryError:
        flips = []
    return HeldOutError(
        lights=lights,
        pictures=len(true),
        psnr=float(np.mean(whole)),
        worst=float(np.min(whole)),
        edges=float(np.mean(edges)) if edges else float(np.mean(whole)),
        flip=float(np.mean(flips)) if flips else None,
        worst_flip=float(np.max(flips)) if flips else None,
        flip_pictures=len(flips),
    )


@dataclass(frozen=True)
class Negative:
    """The clamped part of relit images: the share of values below 0, and their share of the sum of squares and of the brightness."""

    values: float
    energy: float
    brightness: float


def negative(relit: Float32[ndarray, "S H W 3"], covered: Bool[ndarray, "H W"]) -> Negative:
    """The part that the clamp at 0 removes from images relit one light at a time, over covered texels."""
    below = squares = cut_squares = total = cut = 0.0
    for image in relit:
        values = image[covered].astype(np.float64)
        clipped = np.minimum(values, 0)
        below += float((values < 0).mean()) / len(relit)
        squares += float((values**2).sum())
        cut_squares += float((clipped**2).sum())
        total += float(np.maximum(values, 0).sum())
        cut -= float(clipped.sum())
    return Negative(below, cut_squares / max(squares, 1e-30), cut / max(total, 1e-30))
