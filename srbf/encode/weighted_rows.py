"""T's rows as vectors that can be compared: lights weighed by the solid angle they stand for, the mean taken off, texels weighed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.encode.model_selection import TexelSample

Weighting = Literal["plain", "relative"]

BRIGHTNESS_FLOOR = 0.02  # of the mean response, which `relative` adds to a texel's own, to bound the weight of black texels


@dataclass(frozen=True, eq=False)
class LightSpace:
    """A texel sample seen as n vectors of 3 L numbers, sqrt(solid angle) (T - mean), and the way back.

    quadrature (L,), 1 in the mean; mean (L, 3); centered (n, 3 L); row_weights (n,), 1 in the rms.
    """

    sample: TexelSample
    quadrature: Float64[ndarray, " L"]
    mean: Float64[ndarray, "L 3"]
    centered: Float32[ndarray, "n M"]
    row_weights: Float32[ndarray, " n"]

    @staticmethod
    def of(sample: TexelSample, weighting: Weighting, angles: Float64[ndarray, " L"] | None = None) -> LightSpace:
        """Weights and mean of a sample's train lights. `angles`: solid angles that they stand for, 1 in the mean, where these are known."""
        responses = sample.responses[:, : sample.train]
        angles = sample.domain.quadrature(sample.coordinates[: sample.train]) if angles is None else angles
        rows = np.ones(len(responses), np.float32)
        if weighting == "relative":
            own = np.abs(responses).mean(axis=(1, 2))
            rows = (1 / (own + BRIGHTNESS_FLOOR * max(float(own.mean()), 1e-30))).astype(np.float32)
            rows /= np.sqrt((rows**2).mean())
        mean = np.tensordot(rows.astype(np.float64) ** 2, responses, 1) / float((rows.astype(np.float64) ** 2).sum())
        centered = (responses - mean.astype(np.float32)) * np.sqrt(angles).astype(np.float32)[:, None]
        return LightSpace(sample, angles, mean, centered.reshape(len(responses), -1), rows)

    @property
    def scale(self) -> float:
        """The factor that gives components the magnitude of responses, for any number of lights."""
        return float(np.sqrt(self.sample.train))

    def weights(self, axes: Float32[ndarray, "S M"]) -> Float64[ndarray, "S L 3"]:
        """Weights of the values of T in the projection on `axes`."""
        shaped = axes.reshape(len(axes), -1, 3).astype(np.float64)
        return shaped * np.sqrt(self.quadrature)[:, None] / self.scale

    def offsets(self, axes: Float32[ndarray, "S M"], mean: Float32[ndarray, " M"] | None = None) -> Float32[ndarray, " S"]:
        """The projection of the mean, and of a cluster's `mean` of the centered rows, to subtract from the projection of T."""
        offsets = np.einsum("slc,lc->s", self.weights(axes), self.mean)
        if mean is not None:
            offsets = offsets + axes.astype(np.float64) @ mean / self.scale
        return offsets.astype(np.float32)

    def functions(self, axes: Float32[ndarray, "S M"], mean: Float32[ndarray, " M"] | None = None) -> Float64[ndarray, "L F 3"]:
        """Values at the train lights of the mean's function (plus the cluster's mean) and of the functions of the components on `axes`."""
        weighed = np.sqrt(self.quadrature)[:, None]
        shaped = axes.reshape(len(axes), -1, 3).astype(np.float64) * self.scale / weighed
        first = self.mean if mean is None else self.mean + mean.reshape(-1, 3) / weighed
        return np.concatenate([first[None], shaped]).transpose(1, 0, 2)

    def energy_kept(self, values: Float64[ndarray, " S"]) -> float:
        """Share of the weighted sample's squared distance from its mean that axes with these singular values explain."""
        rows = self.centered * self.row_weights[:, None]
        return float((values**2).sum() / max(float(np.einsum("nm,nm->", rows, rows, dtype=np.float64)), 1e-30))
