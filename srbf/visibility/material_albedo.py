"""The albedo of each material that a pixel shows: a view keeps only the mean of what is in a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int

REACH = 2  # pixels to each side in which a material is looked for
LEAST_SHARE = 0.05  # of a pixel, from which its mean says what an unknown material of it reflects


@dataclass(frozen=True, eq=False)
class MaterialAlbedo:
    """`pure` (P,): the one material of a pixel, or -1. `keys`, sorted: pixel and material of the others, with the albedo of each."""

    pure: Int[ndarray, " P"]
    own: Float32[ndarray, "P 3"]
    keys: Int[ndarray, " n"]
    values: Float32[ndarray, "n 3"]
    count: int
    width: int

    @staticmethod
    def of(
        albedo: Float32[ndarray, "H W 3"], pure: Int[ndarray, " P"], pixels: Int[ndarray, " n"], materials: Int[ndarray, " n"]
    ) -> MaterialAlbedo:
        """From the mean albedo of pixels, and samples of those that show several: pixel and material of each, evenly in its filter.

        What is seen alone in a pixel nearby has the albedo there. What is left of a pixel's mean is the albedo of the one material that is
        not, A = sum_m s_m a_m; of several the mean of such a material in the image, else the pixel's.
        """
        height, width = albedo.shape[:2]
        own = np.maximum(albedo.reshape(-1, 3), 0)
        count = int(max(pure.max(initial=0), materials.max(initial=0))) + 1
        keys, samples = np.unique(pixels * count + materials, return_counts=True)
        pixel, material = np.divmod(keys, count)
        source = nearest_pure(pure, (height, width), pixel, material)
        known = source >= 0
        values = np.where(known[:, None], own[source], 0).astype(np.float64)
        share = samples / np.bincount(pixel, samples, height * width)[pixel]
        parts = np.stack([np.bincount(pixel, share * values[:, c], height * width) for c in range(3)], axis=1)
        rest = np.bincount(pixel, np.where(known, 0, share), height * width)
        unknown = np.bincount(pixel, ~known, height * width)
        solved = ~known & (unknown[pixel] == 1) & (rest[pixel] >= LEAST_SHARE)
        left = (own[pixel[solved]] - parts[pixel[solved]]) / rest[pixel[solved], None]
        values[solved] = np.clip(left, 0, 1)
        mean, weight = _means(values, material, np.where(solved, share, 0), count)
        open_ = ~known & ~solved
        values[open_] = np.where(weight[material[open_], None] > 0, mean[material[open_]], own[pixel[open_]])
        return MaterialAlbedo(pure, own, keys, values.astype(np.float32), count, width)

    def at(self, pixels: Int[ndarray, " n"], materials: Int[ndarray, " n"]) -> Float32[ndarray, "n 3"]:
        """The albedo of a material in a pixel; that of a pixel beside it with the material alone, else the pixel's own, where no sample of
        `of` met it."""
        key = pixels * self.count + np.minimum(materials, self.count - 1)
        place = np.minimum(np.searchsorted(self.keys, key), max(0, len(self.keys) - 1))
        found = self.own[pixels]
        listed = np.zeros(len(key), bool) if not len(self.keys) else (self.keys[place] == key) & (materials < self.count)
        found[listed] = self.values[place[listed]]
        lost = np.flatnonzero(~listed & (self.pure[pixels] != materials))
        source = nearest_pure(self.pure, (len(self.pure) // self.width, self.width), pixels[lost], materials[lost])
        found[lost[source >= 0]] = self.own[source[source >= 0]]
        return found


def nearest_pure(
    pure: Int[ndarray, " P"], shape: tuple[int, int], pixels: Int[ndarray, " n"], materials: Int[ndarray, " n"]
) -> Int[ndarray, " n"]:
    """The nearest pixel within REACH that shows a material alone, -1 where there is none."""
    height, width = shape
    found = np.full(len(pixels), -1)
    open_ = np.arange(len(pixels))
    side = np.arange(-REACH, REACH + 1)
    steps = sorted(((int(x), int(y)) for x in side for y in side), key=lambda step: step[0] ** 2 + step[1] ** 2)
    for right, down in steps:
        column, row = pixels[open_] % width + right, pixels[open_] // width + down
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        beside = np.where(inside, row * width + column, pixels[open_])
        matched = pure[beside] == materials[open_]
        found[open_[matched]] = beside[matched]
        open_ = open_[~matched]
        if not len(open_):
            break
    return found


def _means(
    values: Float64[ndarray, "n 3"], material: Int[ndarray, " n"], weight: Float[ndarray, " n"], count: int
) -> tuple[Float64[ndarray, "M 3"], Float64[ndarray, " M"]]:
    """Weighted means per material, and the sums of weights."""
    total = np.bincount(material, weight, count).astype(np.float64)
    sums = np.stack([np.bincount(material, weight * values[:, c], count) for c in range(3)], axis=1)
    return sums / np.maximum(total, 1e-30)[:, None], total
