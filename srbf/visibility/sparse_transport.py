"""Sparse sampling of light transport: dense receivers by local rank, the others as sparse combinations of them [Huang2010]."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.compute.threads import each
from srbf.cubemap import Cubemap
from srbf.errors import MissingLibraryError
from srbf.visibility.element_tracer import Bits, ElementTracer
from srbf.visibility.refined_visibility import FACING, Progress, SampledVisibility, coarse_rows, typical_spacing

ROUND = 0.05  # of the receivers become dense in each round
MOST_DENSE = 0.2  # of them
GOOD = 0.02  # predicted relative RMSE under suns, from which on no more receivers become dense
FEATURES, LEAST_FEATURES = 350 / 6144, 64  # of the directions, which constrain a sparse receiver; at least
NEAREST, FEWEST = 32, 4  # dense neighbors of a sparse receiver: at most, and below which it becomes dense itself
RADIUS = 2.0  # of the mean distance to the NEAREST-th dense neighbor: how far neighbors may be
PENALTY = 0.003  # of the L1 norm, beside half the mean squared error of a feature
KEPT = 0.99  # of a local matrix's energy that its rank explains
RANKED = 2048  # dense receivers whose neighborhoods are ranked in a round
JUDGES = 512  # new dense receivers that are reconstructed from the former ones to predict the error
BATCH = 256  # sparse receivers at a time
Say = Callable[[str], None]


def sparsely_sampled(
    tracer: ElementTracer,
    cubemap: Cubemap,
    seed: int = 0,
    progress: Progress = lambda done, total: None,
    say: Say = lambda line: None,
) -> SampledVisibility:
    """Visibility of all elements from some of its rows and columns.

    Rounds of 5 % make receivers dense, at random by the rank of the transport around them, until the ones before reconstruct those of a
    round well; a dense receiver is sampled on a quarter of the directions and where its samples change (`coarse_rows`). The rest are
    sampled in 350 of 6144 directions: the largest variance among their dense neighbors, times how many have a feature there. Their alpha
    minimizes half the mean squared error of these samples plus PENALTY |alpha|_1 [Huang2010, eq. 4 and 5], and the combination of the
    neighbors' rows, a fraction, is rounded to seen or not. Visibility takes the place of the article's transport: the cosine is known.

    MissingLibraryError without scikit-learn.
    """
    sampler = _Sampler.of(tracer, cubemap, seed)
    rng = np.random.default_rng(seed)
    each_round, most = max(1, round(ROUND * tracer.count)), max(1, int(MOST_DENSE * tracer.count))
    sampler.add_dense(rng.permutation(tracer.count)[:each_round])
    rank = np.ones(tracer.count)
    error = np.inf
    while len(sampler.dense) < most:
        rank = sampler.ranks(rng)
        chance = np.where(sampler.is_dense, 0, rank)
        new = rng.choice(tracer.count, min(each_round, int((chance > 0).sum())), replace=False, p=chance / chance.sum())
        error = sampler.error_at(new[:JUDGES])
        progress(len(sampler.dense), tracer.count)
        if error <= GOOD:
            break
    radius = sampler.radius()
    say(
        f"{len(sampler.dense) / tracer.count:.0%} of the receivers are dense, ranks up to {rank.max():.0f}; "
        f"neighbors within {radius:.3g} m, {sampler.features} features"
    )
    rest = np.flatnonzero(~sampler.is_dense)
    for start in range(0, len(rest), BATCH):
        rows = rest[start : start + BATCH]
        sampler.bits[rows] = sampler.reconstructed(rows, radius)
        progress(len(sampler.dense) + start + len(rows), tracer.count)
    if sampler.alone:
        say(
            f"{sampler.alone} of {tracer.count} receivers have fewer than {FEWEST} dense neighbors within {radius:.3g} m and are sampled "
            "like dense ones"
        )
    return SampledVisibility(sampler.bits, sampler.asked, float(error) if np.isfinite(error) else 0.0)


@dataclass(eq=False)
class _Sampler:
    """Dense receivers so far: their rows of `bits`, their features (bits), how many elements were asked for, and how many receivers were
    `alone`, without neighbors.
    """

    tracer: ElementTracer
    cubemap: Cubemap
    spacing: float
    bits: Bits
    changes: Bits
    dense: Int[ndarray, " d"]
    asked: int
    alone: int = 0

    @staticmethod
    def of(tracer: ElementTracer, cubemap: Cubemap, seed: int) -> _Sampler:
        empty = np.zeros((tracer.count, tracer.row_bytes), np.uint8)
        spacing = typical_spacing(tracer.starts.astype(np.float64), seed)
        return _Sampler(tracer, cubemap, spacing, empty, empty.copy(), np.zeros(0, np.int64), 0)

    @property
    def is_dense(self) -> Bool[ndarray, " R"]:
        mask = np.zeros(self.tracer.count, bool)
        mask[self.dense] = True
        return mask

    @property
    def features(self) -> int:
        """Directions that constrain a sparse receiver."""
        return min(self.cubemap.count, max(LEAST_FEATURES, round(FEATURES * self.cubemap.count)))

    def add_dense(self, rows: Int[ndarray, " n"]) -> None:
        self.asked += coarse_rows(self.tracer, self.cubemap, rows, self.bits, self.changes)
        self.dense = np.concatenate([self.dense, rows])

    def neighbors(self, rows: Int[ndarray, " n"], count: int = NEAREST) -> tuple[Int[ndarray, "n k"], Float64[ndarray, "n k"]]:
        """The nearest dense receivers in place and normal, and how far they are, m."""
        from scipy.spatial import KDTree

        size = self.spacing * np.sqrt(self.tracer.count / max(1, len(self.dense)))

        def placed(chosen: Int[ndarray, " n"]) -> Float64[ndarray, "n 6"]:
            return np.concatenate([self.tracer.starts[chosen], FACING * size * self.tracer.normals[chosen]], axis=1).astype(np.float64)

        apart, found = KDTree(placed(self.dense)).query(placed(rows), min(count, len(self.dense)), workers=-1)
        return self.dense[found.reshape(len(rows), -1)], apart.reshape(len(rows), -1)

    def radius(self) -> float:
        """How far neighbors may be, m: twice the mean distance to the NEAREST-th of some dense receivers."""
        return RADIUS * float(self.neighbors(self.dense[:RANKED])[1][:, -1].mean()) if len(self.dense) > 1 else np.inf

    def ranks(self, rng: np.random.Generator) -> Float64[ndarray, " R"]:
        """The rank of the rows around each receiver: of the nearest dense one's neighborhood."""
        some = self.dense[rng.permutation(len(self.dense))[:RANKED]]
        near, _ = self.neighbors(some)
        found = np.ones(len(some))

        def rank(number: int) -> None:
            rows = self._values(near[number])
            energies = np.maximum(np.linalg.eigvalsh(rows @ rows.T), 0)[::-1]
            if energies[0] > 0:
                found[number] = 1 + np.searchsorted(np.cumsum(energies) / energies.sum(), KEPT)

        each(rank, len(some))
        of_dense = np.ones(self.tracer.count)
        of_dense[some] = found
        ranked = _Sampler(self.tracer, self.cubemap, self.spacing, self.bits, self.changes, some, 0)
        return of_dense[ranked.neighbors(np.arange(self.tracer.count), 1)[0][:, 0]]

    def error_at(self, rows: Int[ndarray, " n"]) -> float:
        """Relative RMSE under suns at receivers told by the dense ones so far; then they become dense themselves."""
        told = self.reconstructed(rows, self.radius(), judged=True)
        self.add_dense(rows)
        cosine = np.maximum(self.tracer.normals[rows] @ self.tracer.directions.T, 0)
        true, guessed = self._values(rows) * cosine, self._unpacked(told) * cosine
        return float(np.sqrt(((true - guessed) ** 2).sum() / max(float((true**2).sum()), 1e-30)))

    def reconstructed(self, rows: Int[ndarray, " n"], radius: float, judged: bool = False) -> Bits:
        """Bits (n, B) of sparse receivers; those with too few neighbors within `radius` are sampled as dense ones are."""
        near, apart = self.neighbors(rows)
        above = self.tracer.above(rows)
        wanted = np.zeros(above.shape, bool)

        def choose(number: int) -> None:
            own = near[number][apart[number] <= radius]
            if len(own) >= FEWEST:
                wanted[number, self._chosen(own, above[number])] = True

        each(choose, len(rows))
        row, column = np.nonzero(wanted)
        samples = np.zeros(above.shape, bool)
        samples[row, column] = self.tracer.seen(rows[row], column)
        self.asked += len(row)
        told = np.zeros(above.shape, bool)
        lonely = np.flatnonzero((apart <= radius).sum(axis=1) < FEWEST)

        def solve(number: int) -> None:
            own = near[number][apart[number] <= radius]
            if len(own) >= FEWEST:
                told[number] = self._combined(own, wanted[number], samples[number])

        each(solve, len(rows))
        told &= above
        if len(lonely) and not judged:
            self.asked += coarse_rows(self.tracer, self.cubemap, rows[lonely], self.bits, self.changes)
            self.alone += len(lonely)
            told[lonely] = self._unpacked(self.bits[rows[lonely]]).astype(bool)
        return np.packbits(told, axis=1)

    def _chosen(self, near: Int[ndarray, " k"], above: Bool[ndarray, " N"]) -> Int[ndarray, " m"]:
        """The directions of the largest variance times number of features among dense neighbors, `features` at most."""
        mean = self._values(near).mean(axis=0)
        weight = mean * (1 - mean) * self._unpacked(self.changes[near]).sum(axis=0) * above
        count = min(self.features, int((weight > 0).sum()))
        return np.argpartition(-weight, count - 1)[:count] if count else np.zeros(0, np.int64)

    def _combined(self, near: Int[ndarray, " k"], wanted: Bool[ndarray, " N"], samples: Bool[ndarray, " N"]) -> Bool[ndarray, " N"]:
        """The row of a receiver from its samples; what all neighbors agree on where there are none."""
        values = self._values(near)  # (k, N)
        if not wanted.any():
            return values.mean(axis=0) > 0.5
        alpha = l1_combination(values[:, wanted].T, samples[wanted].astype(np.float64))
        found = alpha.astype(np.float32) @ values > 0.5
        agreed = values.min(axis=0) == values.max(axis=0)
        found[agreed] = values[0, agreed] > 0.5
        found[wanted] = samples[wanted]
        return found

    def _values(self, rows: Int[ndarray, " k"]) -> Float32[ndarray, "k N"]:
        return self._unpacked(self.bits[rows]).astype(np.float32)

    def _unpacked(self, bits: Bits) -> ndarray:
        return np.unpackbits(bits, axis=1, count=self.cubemap.count)


def l1_combination(rows: Float32[ndarray, "m k"], samples: Float64[ndarray, " m"]) -> Float64[ndarray, " k"]:
    """The alpha that minimizes |rows alpha - samples|^2 / 2m + PENALTY |alpha|_1, by coordinate descent."""
    try:
        from sklearn.linear_model import lasso_path
    except ImportError as error:
        raise MissingLibraryError("sparse sampling by l1 needs scikit-learn: pip install scikit-learn") from error
    design = np.asfortranarray(rows, np.float64)
    _, found, _ = lasso_path(
        design, samples, alphas=[PENALTY], precompute=design.T @ design, Xy=design.T @ samples, max_iter=1000, tol=1e-2, check_input=False
    )
    return found[:, 0]
