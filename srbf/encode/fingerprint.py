"""Lights by their fingerprints: the irradiance that each lays on patches of the surfaces, at several scales, as coordinates.

Two lights with one fingerprint have one response, so responses are interpolated between captured lights by kernel ridge regression on
fingerprints: K = sum_s n_s F_s F_s^T. What comes out is linear in the irradiance on the patches, and so serves any light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.solve.kernel_ridge import KernelPath

RIDGES = tuple(float(r) for r in 10.0 ** np.arange(-8, 1.1, 0.5))  # of the kernel's mean variance
SCALES = (1, 8, 32, 64, 128, 256, 512)  # groups of patches, and each patch by itself; the first keeps the energy


@dataclass(frozen=True, eq=False)
class Fingerprints:
    """L captured lights by their irradiance on K patches (L, K), and the groups of patches of every scale, averaged by area (K,).

    `errors` are the relative squared errors at left-out lights for RIDGES; `ridge` is that of the least.
    """

    received: Float64[ndarray, "L K"]
    areas: Float64[ndarray, " K"]
    groups: tuple[Int[ndarray, " K"], ...]
    ridge: float
    errors: Float64[ndarray, " L"]
    path: KernelPath
    shares: tuple[float, ...]

    @staticmethod
    def of(
        received: Float64[ndarray, "L K"],
        areas: Float64[ndarray, " K"],
        groups: tuple[Int[ndarray, " K"], ...],
        gram: Float64[ndarray, "L L"],
    ) -> Fingerprints:
        """`gram`: inner products of the lights' responses on a sample of texels, by which the ridge is chosen: exact leave-one-out."""
        scales = [_averaged(received, areas, group) for group in groups]
        shares = tuple(len(received) / max(float((scale**2).sum()), 1e-30) for scale in scales)
        kernel = np.asarray(sum(share * scale @ scale.T for share, scale in zip(shares, scales, strict=True)))
        path = KernelPath.of(kernel)
        mean = float(np.diag(kernel).mean())
        found = [(ridge * mean, left_out_errors(path, ridge * mean, gram)) for ridge in RIDGES]
        ridge, errors = min(found, key=lambda one: float(np.log(np.maximum(one[1], 1e-12)).mean()))
        return Fingerprints(received, areas, groups, ridge, errors, path, shares)

    def weights(self, received: Float64[ndarray, "n K"]) -> Float64[ndarray, "n L"]:
        """How much of each captured light n others take, by the irradiance that they lay on the patches."""
        kernel = np.zeros((len(received), len(self.received)))
        for share, group in zip(self.shares, self.groups, strict=True):
            kernel += share * _averaged(received, self.areas, group) @ _averaged(self.received, self.areas, group).T
        return self.path.solve(self.ridge, kernel.T).T

    def on_patches(self, values: Float32[ndarray, "F L 3"]) -> Float32[ndarray, "F K 3"]:
        """Functions known at the captured lights as functions of the irradiance on each patch: sum_s n_s M_s F_s^T (K + ridge)^-1 w."""
        flat = values.transpose(1, 0, 2).reshape(values.shape[1], -1).astype(np.float64)
        solved = self.path.solve(self.ridge, flat)  # (L, 3 F)
        total = np.zeros((self.received.shape[1], flat.shape[1]))
        for share, group in zip(self.shares, self.groups, strict=True):
            own = _averaged(self.received, self.areas, group).T @ solved  # (K_s, 3 F)
            area = np.bincount(group, self.areas)
            total += share * (self.areas / area[group])[:, None] * own[group]
        return np.ascontiguousarray(total.reshape(len(total), len(values), 3).transpose(1, 0, 2)).astype(np.float32)


def left_out_errors(path: KernelPath, ridge: float, gram: Float64[ndarray, "L L"]) -> Float64[ndarray, " L"]:
    """Relative squared error at each light, left out alone, without another fit: (A G A)_ii / A_ii^2 / G_ii, A = (K + ridge)^-1."""
    inverse = path.solve(ridge, np.eye(len(gram)))
    squares = np.einsum("ij,jk,ki->i", inverse, gram, inverse, optimize=True) / np.diag(inverse) ** 2
    return squares / np.maximum(np.diag(gram), 1e-30)


def scales_of(features: Float64[ndarray, "K D"], areas: Float64[ndarray, " K"], seed: int = 0) -> tuple[Int[ndarray, " K"], ...]:
    """Groups of patches with like features, for every number of SCALES below K, and each patch by itself."""
    from sklearn.cluster import KMeans

    groups = []
    for count in SCALES:
        if count < len(features):
            found = KMeans(count, n_init=1, random_state=seed).fit(features, sample_weight=areas).labels_
            groups.append(np.unique(found, return_inverse=True)[1].ravel().astype(np.int64))
    return (*groups, np.arange(len(features)))


def _averaged(received: Float64[ndarray, "L K"], areas: Float64[ndarray, " K"], group: Int[ndarray, " K"]) -> Float64[ndarray, "L k"]:
    """Means over groups of patches, by area."""
    count = int(group.max()) + 1
    matrix = np.zeros((len(group), count))
    matrix[np.arange(len(group)), group] = areas / np.bincount(group, areas)[group]
    return received @ matrix
