"""Functions of light direction through values at every texel of a cubemap: one narrow Gaussian per texel, and one solve."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.basis.gaussian import weight
from srbf.basis.light_functions import LightFunctions
from srbf.sphere import mean_spacing

SPREAD = 0.9  # of the directions' mean spacing: wide enough for no dips between them, narrow enough to be well-conditioned
RIDGE = 0.02  # on the diagonal of the Gaussians' matrix, whose entries are 1 there: takes off what overshoots at shadow edges
FUNCTIONS = 512  # solved at a time


def functions_between(directions: Float64[ndarray, "N 3"], values: Float[ndarray, "N F 3"]) -> tuple[LightFunctions, dict[str, Any]]:
    """Smooth functions near `values` at dense `directions`, and the manifest's record of them.

    (R + ridge I) a = values, R_ij = exp(-angle_ij^2 / 2 spread^2) between the directions, which are the centers. Nothing is chosen: with a
    light every few degrees, all that a wider kernel adds is blur. Cost: one N x N solve with 3 F right-hand sides, 8 N^2 bytes. So narrow
    a kernel is well-conditioned, and coefficients rounded to half floats change pictures by 1e-4.
    """
    from scipy.linalg import lu_factor, lu_solve

    spread = SPREAD * mean_spacing(directions)
    kernel = weight(directions @ directions.T, spread)
    kernel[np.diag_indices_from(kernel)] += RIDGE
    factors = lu_factor(kernel, overwrite_a=True, check_finite=False)
    coefficients = np.empty((values.shape[1], len(values), 3), np.float32)
    for start in range(0, values.shape[1], FUNCTIONS):
        part = values[:, start : start + FUNCTIONS]
        solved = lu_solve(factors, part.reshape(len(values), -1).astype(np.float64), check_finite=False)
        coefficients[start : start + FUNCTIONS] = solved.reshape(part.shape).transpose(1, 0, 2).astype(np.float16)
    functions = LightFunctions(directions, np.full(len(coefficients), spread), coefficients)
    return functions, {"kernel": {"narrow": float(spread)}, "ridge": RIDGE}
