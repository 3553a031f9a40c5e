"""Cross-validation over lights: errors at single lights and at bands of lights that are left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64, Int
from srbf.solve.kernel_ridge import KernelPath

RANK = 128  # principal components of the images, used for errors; the rest counts as equal noise of all lights
LEAST_ERROR = 1e-5  # of the mean power, the smallest error counted; otherwise black images would dominate


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Squared errors of a linear fit at left-out lights, from the inner products of the lights' images.

    `root` (L + V, R): its rows' inner products are those of the images of L train and V validation lights without the `noise` of
    each image. `groups` are train lights to leave out together. `least` is the smallest squared error counted.
    """

    root: Float64[ndarray, "M R"]
    noise: float
    groups: list[Int[ndarray, "_ _"]]
    train: int
    least: float

    @staticmethod
    def of(gram: Float64[ndarray, "M M"], groups: list[Int[ndarray, "_ _"]], train: int) -> HeldOut:
        """From inner products (mean over texels and colors) of the images of lights, the train lights first."""
        values, vectors = np.linalg.eigh(gram)
        values = np.maximum(values, 0)
        rank = min(RANK, len(gram))
        root = vectors[:, -rank:] * np.sqrt(values[-rank:])
        noise = float(values[:-rank].sum()) / len(gram)
        least = LEAST_ERROR * float(np.trace(gram)) / len(gram) + 1e-30
        return HeldOut(root, noise, groups, train, least)

    @property
    def validated(self) -> bool:
        """Whether there are validation lights."""
        return len(self.root) > self.train

    def left_out(self, path: KernelPath, ridge: float) -> tuple[Float64[ndarray, " L"], Float64[ndarray, " G"]]:
        """Squared errors of every train light if it alone is left out, and of the middle light of every band if the band is."""
        solved = path.solve(ridge, self.root[: self.train])
        single = np.einsum("lr,lr->l", solved, solved) + self.noise * path.diagonal(ridge, 2)
        squares = []
        for groups in self.groups:
            weights = path.left_out_weights(ridge, groups)
            residual = np.einsum("gs,gsr->gr", weights, solved[groups])
            noise = np.einsum("gs,gst,gt->g", weights, path.blocks(ridge, groups, 2), weights)
            squares.append(np.einsum("gr,gr->g", residual, residual) + self.noise * noise)
        return single / path.diagonal(ridge) ** 2, np.concatenate(squares)

    def validation(self, path: KernelPath, ridge: float, kernel: Float64[ndarray, "V L"]) -> Float64[ndarray, " V"]:
        """Squared error of every validation light, whose kernel with the train lights is `kernel`."""
        weights = path.solve(ridge, kernel.T).T  # (V, L)
        residual = self.root[self.train :] - weights @ self.root[: self.train]
        return np.einsum("vr,vr->v", residual, residual) + self.noise * (1 + np.einsum("vl,vl->v", weights, weights))

    def score(self, single: Float64[ndarray, " L"], banded: Float64[ndarray, " G"], unseen: Float64[ndarray, " V"] | None = None) -> float:
        """The criterion of choices: mean logarithms of squared errors, so that no light dominates.

        Single left-out lights leave too small gaps between rings, bands too wide ones; both have equal weight. Validation lights, in
        the real gaps, have the weight of both together.
        """
        seen = (self._mean_log(single) + self._mean_log(banded)) / 2
        return seen if unseen is None else (seen + self._mean_log(unseen)) / 2

    def _mean_log(self, squares: Float64[ndarray, " N"]) -> float:
        return float(np.log(np.maximum(squares, self.least)).mean())
