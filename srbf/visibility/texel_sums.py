"""Sums of samples per texel, and which texels need more of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.vectors import largest_component

REFINE_STEP = 0.005  # over the usual irradiance: between samples of one texel, or between neighbors, from which it is refined
NEIGHBOR_STEP = 0.05  # between neighbors: a shadow edge may cross a corner without samples
EDGE_STEP = 0.01  # between samples of one texel, from which it is refined once more
SMOOTH, VERY_SMOOTH = 0.04, 0.1  # between samples of one texel, over the brightest: less is a gradient, which few samples get right
MIN_DIFFUSE = 1e-12  # share
COUNTS = 1e-5  # least importance of a sample whose difference to others counts


@dataclass(frozen=True, eq=False)
class TexelSums:
    """Sums of P texels: light and shares, whose ratio times the albedo is the radiance for any mixture; minimum and maximum.

    `scale` (P,): the irradiance that texels have unshadowed, at most, over the usual one, see `relative`; None, of a sun: 1. `sized`, of a
    light with a size: samples have weights of their own; the light of each texel is the weighted mean of what is visible, times the mean
    unshadowed irradiance; minimum and maximum are those of what is visible, of other lights of their light.
    """

    height: int
    width: int
    scale: Float64[ndarray, " P"] | None
    sized: bool
    total: Float64[ndarray, "P 3"]
    share: Float64[ndarray, "P 3"]
    seen: Float64[ndarray, "P 3"]
    weight: Float64[ndarray, "P 3"]
    low: Float32[ndarray, "P 3"]
    high: Float32[ndarray, "P 3"]
    usual: float = 1.0

    @staticmethod
    def empty(height: int, width: int, scale: Float64[ndarray, " P"] | None, sized: bool = False) -> TexelSums:
        """Of no sample."""
        shape = (height * width, 3)
        total, share = np.zeros(shape), np.zeros(shape)
        seen = total if scale is None else np.zeros(shape)
        weight = np.zeros(shape) if sized else share
        low, high = np.full(shape, np.inf, np.float32), np.zeros(shape, np.float32)
        return TexelSums(height, width, scale, sized, total, share, seen, weight, low, high)

    def relative(self, texels: Int[ndarray, " T"]) -> TexelSums:
        """The same with `scale` over the usual irradiance of `texels` by the samples so far, shadows included.

        That is their root mean square, or the mean of those that are lit where it is less.
        """
        if self.scale is None:
            return self
        light = self._visible().max(axis=1)[texels] * self.scale[texels]
        lit = light > 0
        usual = min(float(np.sqrt((light**2).mean())), float(light[lit].mean())) if lit.any() else 1.0
        return replace(self, scale=self.scale / usual, usual=usual)

    def add(
        self,
        texels: Int[ndarray, " T"],
        share: Float[ndarray, "n _"],
        importance: Float64[ndarray, " n"],
        visible: Float32[ndarray, "n 3"],
        irradiance: Float64[ndarray, " n"],
    ) -> None:
        """Add as many samples of each of some distinct texels, ordered by sample: what each sees of the light, its unshadowed irradiance.

        Threads may add to different texels.
        """
        samples = max(1, len(visible) // max(1, len(texels)))
        assert samples * len(texels) == len(visible), "as many samples of every texel"
        light = visible * irradiance[:, None].astype(np.float32)
        every = np.broadcast_to(share, light.shape)
        weight = every * importance[:, None] if self.sized else every

        def by_sample(values: Float[ndarray, "n 3"]) -> Float[ndarray, "s T 3"]:
            return values.reshape(samples, len(texels), 3)

        def count(sums: Float64[ndarray, "P 3"], values: Float[ndarray, "n 3"]) -> None:
            sums[texels] += by_sample(values).sum(axis=0, dtype=np.float64)

        count(self.total, every * irradiance[:, None] if self.sized else every * light)
        count(self.share, every)
        if self.seen is not self.total:
            count(self.seen, weight * visible)
        if self.sized:
            count(self.weight, weight)
        real = (largest_component(weight) > COUNTS)[:, None]
        measured = visible if self.sized else light
        self.low[texels] = np.minimum(self.low[texels], by_sample(np.where(real, measured, np.float32(np.inf))).min(axis=0))
        self.high[texels] = np.maximum(self.high[texels], by_sample(np.where(real, measured, np.float32(0))).max(axis=0))

    def mean(self) -> Float64[ndarray, "P 3"]:
        """Mean light of every texel."""
        mean = self.total / np.maximum(self.share, MIN_DIFFUSE)
        return mean * self._visible() if self.sized else mean

    def _visible(self) -> Float64[ndarray, "P 3"]:
        return self.seen / np.maximum(self.weight, MIN_DIFFUSE)

    def ragged(self) -> Bool[ndarray, " P"]:
        """Texels whose samples differ, or that differ from a neighbor."""
        return self._differ(REFINE_STEP, SMOOTH) | (self._steps() > REFINE_STEP)

    def edges(self) -> Bool[ndarray, " P"]:
        """Texels whose samples differ so much that an edge of a shadow or of a surface may cross them, or that lie right at a light."""
        return self._differ(EDGE_STEP, VERY_SMOOTH) | (self._steps() > NEIGHBOR_STEP)

    def _differ(self, step: float, smooth: float) -> Bool[ndarray, " P"]:
        spread, high = np.maximum((self.high - self.low).max(axis=1), 0), self.high.max(axis=1)  # 0 without samples
        if self.sized:
            return spread * (1 if self.scale is None else self.scale) > step
        return (spread > step * self.usual) & (spread > smooth * high)

    def _steps(self) -> Float64[ndarray, " P"]:
        """Largest difference of each texel to a neighbor."""
        from scipy import ndimage

        image = self._visible().max(axis=1).reshape(self.height, self.width)
        steps = (ndimage.maximum_filter(image, 3) - ndimage.minimum_filter(image, 3)).ravel()
        return steps if self.scale is None else steps * self.scale
