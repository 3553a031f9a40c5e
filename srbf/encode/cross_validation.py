"""How well lights are predicted that a fit did not see: single lights left out, and bands of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64, Int
from srbf.solve.kernel_ridge import KernelPath
from srbf.sphere import mean_spacing

BAND = 0.4  # spacings of the lights: half the height of a band
BANDED_LIGHTS = 64  # of many lights as many are the middle of a band, in even steps
RANK = 128  # principal directions of the images that errors are computed by; the rest counts as noise, alike at all lights
LEAST_ERROR = 1e-5  # of the mean power: smaller errors count as this, or lights that leave all black would decide


def bands(directions: Float64[ndarray, "L 3"]) -> list[Int[ndarray, "_ _"]]:
    """Groups of lights of about one elevation, each led by the light in its middle; groups of one size are one array.

    Domes carry their lights on rings. A light of a ring is predicted by its neighbors on the ring, however badly the gap between two
    rings is filled. With the ring left out, the prediction has to come across the gap.
    """
    height = BAND * mean_spacing(directions)
    elevation = np.arcsin(np.clip(directions[:, 2], -1, 1))
    middles = np.unique(np.linspace(0, len(directions) - 1, min(len(directions), BANDED_LIGHTS)).astype(np.int64))
    found = []
    for i in middles:
        members = np.flatnonzero(np.abs(elevation - elevation[i]) < height)
        found.append([int(i), *(int(m) for m in members if m != i)])
    sizes = sorted({len(group) for group in found})
    return [np.array([group for group in found if len(group) == size], np.int64) for size in sizes]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Squared errors of lights that a linear fit did not see, from the inner products of the lights' images alone.

    `root` (L + V, R): its rows' inner products are those of the images of L train and V validation lights, but for `noise`, which each
    image has besides. `groups` are bands of train lights. `least` is the squared error that smaller ones count as.
    """

    root: Float64[ndarray, "M R"]
    noise: float
    groups: list[Int[ndarray, "_ _"]]
    train: int
    least: float

    @staticmethod
    def of(gram: Float64[ndarray, "M M"], directions: Float64[ndarray, "M 3"], train: int) -> HeldOut:
        """From inner products (mean over texels and colors) of the images of lights at unit `directions`, the train lights first."""
        values, vectors = np.linalg.eigh(gram)
        values = np.maximum(values, 0)
        rank = min(RANK, len(gram))
        root = vectors[:, -rank:] * np.sqrt(values[-rank:])
        noise = float(values[:-rank].sum()) / len(gram)
        least = LEAST_ERROR * float(np.trace(gram)) / len(gram) + 1e-30
        return HeldOut(root, noise, bands(directions[:train]), train, least)

    @property
    def validated(self) -> bool:
        """Whether there are validation lights."""
        return len(self.root) > self.train

    def single(self, path: KernelPath, ridge: float) -> Float64[ndarray, " L"]:
        """Of every train light when it alone is left out."""
        solved = path.solve(ridge, self.root[: self.train])
        squares = np.einsum("lr,lr->l", solved, solved) + self.noise * path.diagonal(ridge, 2)
        return squares / path.diagonal(ridge) ** 2

    def in_bands(self, path: KernelPath, ridge: float) -> Float64[ndarray, " G"]:
        """Of the middle light of every band when the band is left out."""
        solved = path.solve(ridge, self.root[: self.train])
        squares = []
        for groups in self.groups:
            weights = path.left_out_weights(ridge, groups)
            residual = np.einsum("gs,gsr->gr", weights, solved[groups])
            noise = np.einsum("gs,gst,gt->g", weights, path.blocks(ridge, groups, 2), weights)
            squares.append(np.einsum("gr,gr->g", residual, residual) + self.noise * noise)
        return np.concatenate(squares)

    def validation(self, path: KernelPath, ridge: float, kernel: Float64[ndarray, "V L"]) -> Float64[ndarray, " V"]:
        """Of every validation light, whose kernel with the train lights is `kernel`."""
        weights = path.solve(ridge, kernel.T).T  # (V, L)
        residual = self.root[self.train :] - weights @ self.root[: self.train]
        return np.einsum("vr,vr->v", residual, residual) + self.noise * (1 + np.einsum("vl,vl->v", weights, weights))

    def score(self, single: Float64[ndarray, " L"], banded: Float64[ndarray, " G"], unseen: Float64[ndarray, " V"] | None = None) -> float:
        """What choices are compared by: mean logarithms of squared errors, so that no light drowns the rest.

        Lights left out alone leave gaps too small between rings, bands leave gaps too wide: both count alike. Validation lights, in gaps
        as they are, count as much as the two.
        """
        seen = (self._mean_log(single) + self._mean_log(banded)) / 2
        return seen if unseen is None else (seen + self._mean_log(unseen)) / 2

    def _mean_log(self, squares: Float64[ndarray, " N"]) -> float:
        return float(np.log(np.maximum(squares, self.least)).mean())
