"""Principal component analysis of a tall sample, for a few leading axes."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64

LARGE = 4096  # of the smaller side of the rows, from which on axes come from random mixtures of them [Halko2011]
OVERSAMPLED, POWER_STEPS = 16, 3


def principal_axes(rows: Float[ndarray, "n M"], count: int) -> tuple[Float32[ndarray, "count M"], Float64[ndarray, " count"]]:
    """(orthonormal axes, singular values) of `rows`; subtract a mean beforehand if required.

    From the smaller of the two Gram matrices, float64: singular values below about 1e-8 of the first are noise. If the rows have
    fewer axes than `count`, the rest are 0. Cost: n M min(n, M) flops and the leading eigenvectors of min(n, M)^2 numbers. Where both n and
    M are LARGE, subspace iteration on random mixtures instead, 4 (POWER_STEPS + 1) n M (count + OVERSAMPLED) flops.
    """
    from scipy.linalg import eigh

    n, m = rows.shape
    if min(n, m) >= LARGE and count < LARGE // 8:
        return _by_mixtures(rows, count)
    found = min(count, n, m)
    axes, values = np.zeros((count, m), np.float32), np.zeros(count)
    gram = (rows.T @ rows if m <= n else rows @ rows.T).astype(np.float64)
    last = len(gram) - 1
    energies, vectors = eigh(gram, subset_by_index=(last - found + 1, last))
    energies, vectors = np.maximum(energies[::-1], 0), vectors[:, ::-1]
    values[:found] = np.sqrt(energies)
    held = energies > 1e-14 * max(float(energies[0]), 1e-300)
    if m <= n:
        axes[:found][held] = vectors.T[held]
    else:
        axes[:found][held] = (vectors.T @ rows)[held] / np.sqrt(energies[held])[:, None]
    return axes, values


def _by_mixtures(rows: Float[ndarray, "n M"], count: int) -> tuple[Float32[ndarray, "count M"], Float64[ndarray, " count"]]:
    """The same by subspace iteration; the seed is fixed."""
    trial = np.random.default_rng(0).standard_normal((rows.shape[1], count + OVERSAMPLED), np.float32)
    for _ in range(POWER_STEPS):
        trial, _ = np.linalg.qr(rows.T @ (rows @ trial))
    _, values, turn = np.linalg.svd(rows @ trial, full_matrices=False)
    axes = (turn @ trial.T)[:count].astype(np.float32)
    axes[values[:count] <= 1e-7 * max(float(values[0]), 1e-300)] = 0
    return axes, values[:count].astype(np.float64)
