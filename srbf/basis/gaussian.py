"""Spherical radial basis functions: Gaussians of the geodesic distance that share one spread, and their 1D table."""

from __future__ import annotations

import functools
import warnings
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64
from srbf.errors import InputError
from srbf.sphere import nearest_neighbor_angles

SpreadRule = Literal["mean", "min"]

MAX_TABLE_SIZE = 4096
CURVE_PLACES, CURVE_ROUNDS = 4001, 60
TABLE_TOLERANCE = 2.0**-12  # absolute error of linear interpolation: a quarter of an 8-bit step


def weight(cos_theta: Float[ndarray, "*shape"], spread: float) -> Float64[ndarray, "*shape"]:
    """R(cos theta) = exp(-acos(cos theta)^2 / (2 spread^2)), 1 at the center [Wong2005, eq. 2].

    cos_theta in [-1, 1] (clipped), spread in rad. Geodesic Gaussians are not positive definite on the sphere: their Gram
    matrices can be indefinite, so solve least squares with them, never Cholesky.
    """
    theta = np.arccos(np.clip(np.asarray(cos_theta, np.float64), -1, 1))
    return np.exp(-0.5 * (theta / spread) ** 2)


@dataclass(frozen=True, eq=False)
class GaussianBasis:
    """K Gaussians R_i(L) = weight(L . Q_i) around unit centers Q_i, of one shared spread (rad) [Wong2005, eq. 2]."""

    centers: Float64[ndarray, "K 3"]
    spread: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.spread) and self.spread > 0):
            raise InputError(f"expected a spread above 0 rad, found {self.spread}")

    def evaluate(self, directions: Float[ndarray, "N 3"]) -> Float64[ndarray, "N K"]:
        """R_i of every unit direction; N x K exponentials."""
        return weight(np.asarray(directions, np.float64) @ self.centers.T, self.spread)


def spread_of(centers: Float[ndarray, "K 3"], rule: SpreadRule | float) -> float:
    """The shared spread, rad: `mean` nearest-neighbor distance (the authors' released code), `min` (the article), or a number."""
    if isinstance(rule, (int, float)):
        spread = float(rule)
        if not (np.isfinite(spread) and spread > 0):
            raise InputError(f"expected a spread above 0 rad, found {rule}")
        return spread
    distances = nearest_neighbor_angles(centers)
    if rule == "mean":
        return float(distances.mean())
    if rule == "min":
        return float(distances.min())
    raise InputError(f"expected a spread of mean, min or a number of radians, found {rule!r}")


def r_table(spread: float) -> Float32[ndarray, " n"]:
    """R as a table: entry j is R at cos theta = -1 + 2 j / (n - 1), the smallest power of two n within TABLE_TOLERANCE.

    Below about 0.11 rad, and above about 1 rad where R has a square-root cusp at cos theta = -1, MAX_TABLE_SIZE entries do not
    reach the tolerance; the table then has them and a warning states its error.
    """
    n = 16
    while True:
        table = weight(np.linspace(-1, 1, n), spread).astype(np.float32)
        error = interpolation_error(table, spread)
        if error <= TABLE_TOLERANCE:
            return table
        if n == MAX_TABLE_SIZE:
            warnings.warn(
                f"a spread of {spread:.4g} rad leaves the R table of {n} entries off by up to {error:.2g} (expected at most "
                f"{TABLE_TOLERANCE:.2g}); spreads between 0.11 and 1 rad do not",
                stacklevel=2,
            )
            return table
        n *= 2


def interpolation_error(table: Float32[ndarray, " n"], spread: float) -> float:
    """Largest absolute error of the linearly interpolated table, on 16 points per entry, denser at both ends."""
    n = len(table)
    h = 2 / (n - 1)
    ends = np.geomspace(h * 1e-4, h, 64)
    x = np.unique(np.concatenate([np.linspace(-1, 1, 16 * n), -1 + ends, 1 - ends]))
    return float(np.abs(lookup(table, x) - weight(x, spread)).max())


def lookup(table: Float32[ndarray, " n"], cos_theta: Float[ndarray, "*shape"]) -> Float64[ndarray, "*shape"]:
    """R from the table by fetch and mix, as in the shaders [Wong2005, fig. 9]; cos_theta is clipped to [-1, 1]."""
    n = len(table)
    x = (np.clip(np.asarray(cos_theta, np.float64), -1, 1) + 1) * (0.5 * (n - 1))
    j = np.minimum(x.astype(np.int64), n - 2)
    t = x - j
    return table[j] * (1 - t) + table[j + 1] * t


@dataclass(frozen=True, eq=False)
class WeightCurve:
    """R of one spread as 2 to the power of a polynomial in the versine v = 1 - cos theta, which GPUs evaluate without a table.

    `coefficients`: of v to v^5; `error`: the largest absolute one on [0, 2].
    """

    coefficients: Float64[ndarray, " 5"]
    error: float

    def evaluate(self, versine: Float[ndarray, "*shape"]) -> Float64[ndarray, "*shape"]:
        """R at versines, which are clipped to [0, 2]."""
        v = np.clip(np.asarray(versine, np.float64), 0, 2)
        exponent = np.zeros_like(v)
        for coefficient in self.coefficients[::-1]:
            exponent = (exponent + coefficient) * v
        return np.exp2(exponent)


@functools.lru_cache(maxsize=64)
def weight_curve(spread: float) -> WeightCurve:
    """The curve of a spread (rad) with a small largest error: least squares, weighed again by the errors [Lawson1961].

    Within 3e-6 of R up to 0.45 rad, 1e-4 up to 0.65 rad, 5e-3 at 1 rad, where theta^2 is no polynomial at the far pole.
    """
    theta = np.linspace(0, np.pi, CURVE_PLACES)
    versine = 2 * np.sin(theta / 2) ** 2
    exact = np.exp(-0.5 * (theta / spread) ** 2)
    exponent = -((theta / spread) ** 2) / (2 * np.log(2))
    powers = versine[:, None] ** np.arange(1, 6)
    counts = np.ones(len(theta))
    best = WeightCurve(np.zeros(5), np.inf)
    for _ in range(CURVE_ROUNDS):
        scale = np.sqrt(counts) * exact + 1e-9
        found = WeightCurve(np.linalg.lstsq(powers * scale[:, None], exponent * scale, rcond=None)[0], 0.0)
        off = np.abs(found.evaluate(versine) - exact)
        if off.max() < best.error:
            best = WeightCurve(found.coefficients, float(off.max()))
        counts *= 1e-3 + off / off.max()
        counts /= counts.mean()
    return best
