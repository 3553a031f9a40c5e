"""Pictures under light that a fit has not seen: one held-out light at a time, and sums of several, with the worst and the shadow edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32
from srbf.errors import MissingLibraryError
from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.flip import Flip

LIGHTS = (1, 2, 8)  # at once
SUMS = 16  # pictures of several lights
DIMMEST = 0.25  # of a channel of a light's random color, before the sum's colors are brought to a mean of 1
EDGES = 0.05  # of the covered texels: those where the light changes most from one to the next
DARK = 0.1  # of the mean picture's mean: added to it before the picture is divided by it
FLIP_PIXELS = 8 << 16  # that are looked at by FLIP in a row of the table: eight pictures of 256²


@dataclass(frozen=True)
class UnseenError:
    """Error of n pictures of `lights` lights each, over covered texels, both clamped at 0.

    `psnr` (dB) is the mean over pictures, `worst` the lowest of one, `edges` the mean at shadow edges. `flip` is the mean of
    `flip_pictures` of them, the picture of lowest PSNR and others in order, `worst_flip` the largest of one; None without flip-evaluator.
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
    """The same SUMS random sums of `lights` pictures of both stacks, or for one light the stacks as they are.

    Light is linear: a sum of pictures times colors is the picture under those lights. Lights are drawn without repetition where there
    are enough; their colors are uniform in [DIMMEST, 1] a channel, over their sum's mean channel: as bright as one white light.
    """
    if lights == 1:
        return images
    count = len(images[0])
    sums = tuple(np.empty((SUMS, *stack.shape[1:]), np.float32) for stack in images)
    for row in range(SUMS):
        chosen = rng.choice(count, lights, replace=count < lights)
        colors = rng.uniform(DIMMEST, 1, (lights, 3))
        colors /= colors.sum(axis=0).mean()
        for target, stack in zip(sums, images, strict=True):
            target[row] = np.einsum("mhwc,mc->hwc", stack[chosen], colors.astype(np.float32), optimize=True)
    return sums[0], sums[1]


def shadow_edges(
    reference: Float32[ndarray, "H W 3"], mean: Float32[ndarray, "H W 3"], covered: Bool[ndarray, "H W"]
) -> Bool[ndarray, "H W"]:
    """The EDGES of the covered texels where light changes most from a texel to its neighbors, which is where shadows end.

    What changes is the luminance of the reference over that of the mean picture plus DARK of its mean: the surfaces' own colors and
    outlines divide out. Steps to uncovered texels do not count. The definition is ours.
    """
    whole = mean.sum(axis=2)
    floor = DARK * float(whole[covered].mean()) if covered.any() else 0.0
    relative = np.where(covered, np.maximum(reference, 0).sum(axis=2) / np.maximum(whole + floor, 1e-30), np.nan)
    step = np.zeros(covered.shape, np.float32)
    for axis in (0, 1):
        change = np.nan_to_num(np.abs(np.diff(relative, axis=axis)))
        near, far = (slice(None),) * axis + (slice(None, -1),), (slice(None),) * axis + (slice(1, None),)
        step[near] = np.maximum(step[near], change)
        step[far] = np.maximum(step[far], change)
    least = float(np.quantile(step[covered], 1 - EDGES)) if covered.any() else 0.0
    return covered & (step >= least) & (step > 0)


def unseen_error(
    references: Float32[ndarray, "S H W 3"],
    relit: Float32[ndarray, "S H W 3"],
    covered: Bool[ndarray, "H W"],
    lights: int,
    peak: float,
    flip: Flip,
    seed: int = 0,
    floor: float = 0.0,
) -> UnseenError:
    """Error under `lights` of the S held-out lights at once; `relit` before the clamp, which is at `floor`.

    Memory: 2 x SUMS pictures beside the stacks.
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
    return UnseenError(
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
    """How much of relit pictures is clamped: the share of values below 0, and their share of the sum of squares and of the brightness."""

    values: float
    energy: float
    brightness: float


def negative(relit: Float32[ndarray, "S H W 3"], covered: Bool[ndarray, "H W"]) -> Negative:
    """What the clamp at 0 takes of pictures relit one light at a time, over covered texels."""
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
