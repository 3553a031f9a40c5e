"""Covariance of light functions between two directions: spherical Gaussians of one spread, or of a narrow and a wide one together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.basis.gaussian import weight
from srbf.basis.light_functions import LightFunctions
from srbf.sphere import Domain, fibonacci, mean_spacing

REPRODUCING = 0.7  # center spacings: Gaussians of this spread reproduce wider ones within about 1e-3
DENSITY = 4  # directions per center in the replacement of one set of Gaussians by another
DAMPING = 1e-9  # of the mean squared weight, in that replacement


@dataclass(frozen=True)
class LightKernel:
    """K(x, y) = sum_b over shared centers of the mean of R_b(x) R_b(y) for one spread (rad), or for two, weighted by `wide_share`.

    `wide` None: one spread, unscaled. Otherwise both parts are scaled to a mean of 1 at the lights: K = (1 - s) K_narrow + s K_wide. The
    wide part explains slow changes; the narrow one prevents oscillations around a highlight that few lights show.
    """

    narrow: float
    wide: float | None = None
    wide_share: float = 0.0

    def between(self, a: Float[ndarray, "N 3"], b: Float[ndarray, "L 3"], centers: Float64[ndarray, "B 3"]) -> Float64[ndarray, "N L"]:
        """K of unit directions a with the lights b."""
        return sum((w * kernel_of_spread(spread, a, b, centers) for spread, w in self.parts(b, centers)), np.zeros((len(a), len(b))))

    def parts(self, lights: Float[ndarray, "L 3"], centers: Float64[ndarray, "B 3"]) -> list[tuple[float, float]]:
        """(spread, weight of its kernel) of each part."""
        if self.wide is None:
            return [(self.narrow, 1.0)]
        shares = ((self.narrow, 1 - self.wide_share), (self.wide, self.wide_share))
        return [(spread, share / mean_variance(spread, lights, centers)) for spread, share in shares]

    def functions(
        self, solved: Float64[ndarray, "L N"], lights: Float[ndarray, "L 3"], centers: Float64[ndarray, "B 3"], domain: Domain
    ) -> LightFunctions:
        """w_f(x, c) = K(x, lights) solved, column 3 f + c of N = 3 F, as Gaussians of one spread on the centers.

        With two spreads, the wide Gaussians are replaced by narrow ones, by least squares over the domain and as far below the horizon
        as the centers extend.
        """
        parts = self.parts(lights, centers)
        spread = parts[0][0]
        coefficients = np.zeros((len(centers), solved.shape[1]))
        for other, w in parts:
            own = w * (weight(lights @ centers.T, other).T @ solved)
            coefficients += own if other == spread else replacement(other, spread, centers, domain) @ own
        shaped = coefficients.reshape(len(centers), -1, 3).transpose(1, 0, 2)
        return LightFunctions(centers, np.full(len(shaped), spread), shaped.astype(np.float32))


def kernel_of_spread(
    spread: float, a: Float[ndarray, "N 3"], b: Float[ndarray, "L 3"], centers: Float64[ndarray, "B 3"]
) -> Float64[ndarray, "N L"]:
    """sum_b R_b(x) R_b(y) of Gaussians of one spread (rad)."""
    return weight(a @ centers.T, spread) @ weight(b @ centers.T, spread).T


def mean_variance(spread: float, lights: Float[ndarray, "L 3"], centers: Float64[ndarray, "B 3"]) -> float:
    """The mean of K(x, x) over the lights."""
    weights = weight(lights @ centers.T, spread)
    return float(np.einsum("lb,lb->", weights, weights)) / len(lights)


def replacement(wide: float, narrow: float, centers: Float64[ndarray, "B 3"], domain: Domain) -> Float64[ndarray, "B B"]:
    """The matrix that turns coefficients of wide Gaussians into those of narrow ones which sum to nearly the same function."""
    everywhere = fibonacci(DENSITY * len(centers) * (1 if domain == "sphere" else 2))
    lowest = -1.0 if domain == "sphere" else float(centers[:, 2].min())
    directions = everywhere[everywhere[:, 2] >= lowest]
    target, source = weight(directions @ centers.T, narrow), weight(directions @ centers.T, wide)
    gram = target.T @ target
    gram += DAMPING * np.trace(gram) / len(gram) * np.eye(len(gram))
    return np.linalg.solve(gram, target.T @ source)


def narrowest(centers: Float64[ndarray, "B 3"]) -> float:
    """The smallest spread (rad) whose Gaussians on these centers reproduce wider ones."""
    return REPRODUCING * mean_spacing(centers)
