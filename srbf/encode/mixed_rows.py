"""T's rows seen through mixtures of its lights: the responses to V virtual lights, each a weighted sum of the captured ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64


@dataclass(frozen=True, eq=False)
class MixedSpace:
    """Sampled rows as n vectors of 3 V numbers, X (T - mean), X (V, L) the mixtures; mean (L, 3) of the sample.

    Noise of single images averages out in mixtures, and what is the same under all virtual lights costs no component.
    """

    mixtures: Float64[ndarray, "V L"]
    mean: Float64[ndarray, "L 3"]
    centered: Float32[ndarray, "n M"]

    @staticmethod
    def of(rows: Float32[ndarray, "n L 3"], mixtures: Float64[ndarray, "V L"]) -> MixedSpace:
        """Of sampled rows of T."""
        mean = rows.mean(axis=0, dtype=np.float64)
        own = (rows - mean.astype(np.float32)).transpose(0, 2, 1).reshape(-1, rows.shape[1])  # (3 n, L)
        mixed = (own @ mixtures.T.astype(np.float32)).reshape(len(rows), 3, -1).transpose(0, 2, 1)
        return MixedSpace(mixtures, mean, np.ascontiguousarray(mixed).reshape(len(rows), -1))

    @property
    def scale(self) -> float:
        """The factor that gives components the magnitude of responses, for any number of virtual lights."""
        return float(np.sqrt(len(self.mixtures)))

    def weights(self, axes: Float32[ndarray, "S M"]) -> Float64[ndarray, "S L 3"]:
        """Weights of the values of T in the projection on `axes`."""
        shaped = axes.reshape(len(axes), -1, 3).astype(np.float64)
        return np.einsum("svc,vl->slc", shaped, self.mixtures, optimize=True) / self.scale

    def offsets(self, axes: Float32[ndarray, "S M"], mean: Float32[ndarray, " M"] | None = None) -> Float32[ndarray, " S"]:
        """The projection of the mean, and of a cluster's `mean` of the centered rows, to subtract from the projection of T."""
        offsets = np.einsum("slc,lc->s", self.weights(axes), self.mean)
        if mean is not None:
            offsets = offsets + axes.astype(np.float64) @ mean / self.scale
        return offsets.astype(np.float32)

    def functions(self, axes: Float32[ndarray, "S M"], mean: Float32[ndarray, " M"] | None = None) -> Float64[ndarray, "V F 3"]:
        """Values at the virtual lights: the mean's function (plus the cluster's mean), and the functions of the components on `axes`."""
        shaped = axes.reshape(len(axes), -1, 3).astype(np.float64) * self.scale
        first = self.mixtures @ self.mean
        first = first if mean is None else first + mean.reshape(-1, 3)
        return np.concatenate([first[None], shaped]).transpose(1, 0, 2)
