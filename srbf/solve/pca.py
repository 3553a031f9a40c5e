"""Principal component analysis of a tall sample, for a few leading axes."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64


def principal_axes(rows: Float[ndarray, "n M"], count: int) -> tuple[Float32[ndarray, "count M"], Float64[ndarray, " count"]]:
    """(orthonormal axes, singular values) of `rows`; subtract a mean beforehand if required.

    From the smaller of the two Gram matrices, float64: singular values below about 1e-8 of the first are noise. If the rows have
    fewer axes than `count`, the rest are 0. Cost: n M min(n, M) flops and the leading eigenvectors of min(n, M)^2 numbers.
    """
    from scipy.linalg import eigh

    n, m = rows.shape
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
