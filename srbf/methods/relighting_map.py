"""The relighting map: per texel, reflected light as a sum of k spherical Gaussians of one spread [Wong2005]."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset, layer_entries
from srbf.basis.gaussian import GaussianBasis, SpreadRule, lookup, r_table, spread_of
from srbf.basis.harmonics import HARMONICS, HarmonicKind, PolynomialTextureMap, SphericalHarmonics
from srbf.capture import Capture, Look
from srbf.compute.threads import each
from srbf.encode.dilation import dilate, nearest_covered
from srbf.encode.model_selection import RIDGES, USUAL_RIDGE, USUAL_SPREAD, Choice, TexelSample, choose, spread_candidates
from srbf.encode.quantization import metric, quantize, quantize_together, rounding_variance
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.lights import Light, PointLight
from srbf.methods.receivers import (
    CHUNK,
    carried_images,
    carried_scene,
    common_manifest,
    distant_lights,
    finish,
    inside,
    light_vectors,
    seam_report,
    sum_over_lights,
)
from srbf.solve.least_squares import LeastSquaresReport, StreamedLeastSquares
from srbf.sphere import Domain, PointSet, all_around, domain_of, point_set

# (capture, lights, matrix, ridge, progress) -> maps (K, P 3) and report: as `srbf.encode.row_blocks.fit_tiles` with machines to do it
Tiles = Callable[[Capture, list[int], ndarray, float, Callable[[int, int], None]], tuple[ndarray, LeastSquaresReport]]
Basis = GaussianBasis | SphericalHarmonics | PolynomialTextureMap
NOISE_TEXELS = 512  # any, and so many of the brightest, on which the loss of an encoding is foretold
ROUNDING_MARGIN = 16  # of bytes: unseen lights lost 3 to 15 times what these texels foretell
LEAST_BYTE_RIDGE = 1e-2  # with less, maps cancel each other by more than bytes can hold


@dataclass(frozen=True)
class RelightingMap:
    """Per-texel least-squares fit of reflected light by spherical RBFs that share one spread.

    T(p, L) ~ sum_i c_i(p) exp(-acos(L . Q_i)^2 / (2 spread^2))            [Wong2005, eq. 1-2]

    k maps, centers Q_i of a point set on the domain (`auto`: Fibonacci, on the hemisphere where all lights are above it), spread by rule
    or in rad, `ridge` added to the normal equations' diagonal, and the encoding of the maps on disk. `auto` spread and ridge: the one
    pair for all texels that predicts the validation lights best, or train lights left out, the encoding's rounding included.
    `basis`: other functions in the Gaussians' place, as baselines: k = 4, 9, 16 … harmonics, or the 6 of polynomial texture maps.
    """

    k: int = 25
    centers: Literal["auto"] | PointSet = "auto"
    domain: Literal["auto"] | Domain = "auto"
    spread: Literal["auto"] | SpreadRule | float = "auto"
    ridge: Literal["auto"] | float = "auto"
    encoding: Encoding = "half"
    basis: Literal["gaussian"] | HarmonicKind = "gaussian"

    def __post_init__(self) -> None:
        if not 1 <= self.k <= 2048:
            raise InputError(f"expected 1 to 2048 maps (the layers of a texture array), found `k={self.k}`")
        if self.ridge != "auto" and not (np.isfinite(self.ridge) and self.ridge >= 0):
            raise InputError(f"expected a ridge of auto, 0 or more, found {self.ridge:g}")
        if self.domain not in ("auto", *get_args(Domain)):
            raise InputError(f"expected a domain of auto, sphere, hemisphere, found {self.domain!r}")
        if self.encoding not in get_args(Encoding):
            raise InputError(f"expected an encoding of half, float, uint8, found {self.encoding!r}")
        if self.basis not in ("gaussian", *HARMONICS):
            raise InputError(f"expected a basis of gaussian, {', '.join(HARMONICS)}, found {self.basis!r}")
        if self.basis != "gaussian":
            HARMONICS[self.basis](self.k)  # says which k it can have

    def encode(
        self,
        capture: Capture,
        progress: Callable[[int, int], None] = lambda done, total: None,
        look: Look = lambda row, image: None,
        stitch: Stitch | None = None,
        tiles: Tiles | None = None,
    ) -> Asset:
        """Fit the train lights of a capture: one k x L factorization, each image read once, never a solve a texel.

        `auto` reads a sample of the texels before. `look` sees every train image as it streams by (`Capture.stream`); `stitch` closes
        the seams of the dilated maps before they are rounded. Peak memory, whatever the number of lights: 18 k + 40 bytes a texel, two
        blocks of `capture.STREAM_BYTES`, what `look` keeps, and some 0.2 GB of libraries. With `tiles` others stream the images and
        solve, and `look` sees none.

        InputError where the lights are too few for k without a ridge. Numerical trouble (condition, rank, residual) is data in
        the manifest's `source.fit`; coefficients past half's range are kept by a scale and warned of.
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if len(train) < self.k and self.ridge == 0:
            raise InputError(
                f"expected as many train lights as maps, found {len(train)} lights for `k={self.k}`; lower `k`, or leave `ridge=auto`"
            )
        directions = capture.directions(train)
        domain = domain_of(directions) if self.domain == "auto" else self.domain
        basis, ridge, choice = self.model(lambda: TexelSample.of(capture), domain)
        if tiles is not None:
            solved, report = tiles(capture, train, basis.evaluate(directions), ridge, progress)
        else:
            solve = StreamedLeastSquares(basis.evaluate(directions), ridge)
            for first, block in capture.stream(train, look):
                solve.add(first, block)
                progress(first + len(block), len(train))
            report, solved = solve.report(), solve.solve()
            del solve  # its sums are as large as the maps
        coefficients = solved.reshape(self.k, capture.height, capture.width, 3)
        del solved
        nearest = nearest_covered(capture.coverage())
        if nearest is not None:

            def fill(i: int) -> None:
                coefficients[i] = dilate(coefficients[i], nearest)

            each(fill, self.k)
        loose = coefficients.reshape(self.k, -1, 3)[:, stitch.texels] if stitch is not None else None
        if stitch is not None:
            stitch.apply(coefficients)
        if self.encoding == "uint8":
            stored, scale, bias = quantize_together(coefficients, basis.evaluate(all_around(domain)))
        else:
            stored, scale, bias = quantize(coefficients, self.encoding)
        images = carried_images(capture, nearest)
        fit = {"ridge": ridge, **({} if choice is None else {"chosen_by": choice.rule}), **asdict(report)}
        manifest = common_manifest(capture, "relighting-map", domain, images, asdict(self), fit)
        manifest["maps"] = layer_entries("map", self.encoding, scale, bias)
        tables = {}
        if isinstance(basis, GaussianBasis):
            tables["r_table"] = r_table(basis.spread)
            manifest["basis"] = {"kind": "gaussian", "centers": basis.centers.tolist(), "spread": basis.spread}
            manifest["r_table"] = {"file": "r_table.exr", "size": len(tables["r_table"])}
        else:
            manifest["basis"] = {"kind": self.basis}
        asset = Asset(manifest, stored, scale, bias, tables, images, carried_scene(capture))
        if stitch is not None and loose is not None:
            manifest["seams"] = seam_report(asset, capture, stitch, loose, directional_responses)
        return asset

    def model(self, read_sample: Callable[[], TexelSample], domain: Domain) -> tuple[Basis, float, Choice | None]:
        """(basis, ridge, what chose them, if anything was to be chosen, which alone needs a texel sample)."""
        if self.basis != "gaussian":
            basis: Basis = HARMONICS[self.basis](self.k)
            if self.ridge != "auto":
                return basis, self.ridge, None
            sample = read_sample()
            choice = choose(sample, [(0.0, basis.evaluate(sample.directions))], self._ridges(), self._rounding(sample))
            return basis, choice.ridge, choice
        centers = point_set("fibonacci" if self.centers == "auto" else self.centers, self.k, domain)
        if self.spread != "auto" and self.ridge != "auto":
            return GaussianBasis(centers, spread_of(centers, self.spread)), self.ridge, None
        sample = read_sample()
        mean = spread_of(centers, "mean")
        spreads = spread_candidates(mean) if self.spread == "auto" else [spread_of(centers, self.spread)]
        candidates = ((spread, GaussianBasis(centers, spread).evaluate(sample.directions)) for spread in spreads)
        usual = (min(spreads, key=lambda spread: abs(spread - USUAL_SPREAD * mean)), USUAL_RIDGE)
        choice = choose(sample, candidates, self._ridges(), self._rounding(sample), usual)
        return GaussianBasis(centers, choice.spread), choice.ridge, choice

    def _ridges(self) -> list[float]:
        if self.ridge != "auto":
            return [self.ridge]
        return [ridge for ridge in RIDGES if self.encoding != "uint8" or ridge >= LEAST_BYTE_RIDGE]

    def _rounding(self, sample: TexelSample) -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
        """What the encoding adds to a light's squared error: maps that cancel each other do not survive it."""
        if self.encoding == "float":
            return None
        train = sample.responses[:, : sample.train]
        energy = np.einsum("nlc,nlc->n", train, train)
        chosen = np.unique(np.concatenate([np.arange(0, len(train), -(-len(train) // NOISE_TEXELS)), energy.argsort()[-NOISE_TEXELS:]]))
        responses = train[chosen].astype(np.float64).transpose(1, 0, 2)  # (L, n, 3); the brightest set the layers' range
        flat = responses.reshape(sample.train, -1)

        def variance(operator: np.ndarray, weights: np.ndarray) -> np.ndarray:
            maps = (operator @ flat).reshape(self.k, -1, 3)
            lost = rounding_variance(maps.min(axis=1), maps.max(axis=1), self.encoding).mean(axis=1)  # (K,)
            if self.encoding == "uint8":  # rounded together: each map errs by what the maps after it cannot make up for
                return np.full(len(weights), ROUNDING_MARGIN * (np.diag(metric(weights)) ** 2 @ lost))
            return weights**2 @ lost

        return variance


def relight(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights) + ambient, for any number of lights of any kind at once.

    Directional and environment lights fold into one weight a map and color, so a hundred of them cost as one; a point or
    spot light weighs every receiver by itself [Wong2005, "Directional-Source Relighting", "Point-Source Relighting"].
    """
    return finish(asset, linear_response(asset, lights))


def linear_response(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """The sum over lights before the clamp and without ambient: linear in every light's color."""
    weights = projected_weights(asset, lights).astype(np.float32)

    def projected(layers: ndarray, rows: slice) -> ndarray:
        return np.einsum("khwc,kc->hwc", layers, weights, optimize=True)

    def response(layers: ndarray, rows: slice, unit: ndarray) -> ndarray:
        return np.einsum("khwc,hwk->hwc", layers, basis_weights(asset, unit).astype(np.float32), optimize=True)

    return sum_over_lights(asset, lights, projected if weights.any() else None, response)


def directional_responses(asset: Asset, directions: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
    """`linear_response` to a white light from each of many unit directions: one (b, K) x (K, H W 3) product."""
    weights = basis_weights(asset, inside(asset, directions)).astype(np.float32)  # (b, K)
    images = np.empty((len(weights), asset.height, asset.width, 3), np.float32)
    rows_per_chunk = max(1, CHUNK // asset.width)
    for start in range(0, asset.height, rows_per_chunk):
        rows = slice(start, start + rows_per_chunk)
        c = asset.coefficients(rows)
        images[:, rows] = (weights @ c.reshape(asset.k, -1)).reshape(len(weights), *c.shape[1:])
    return images


def basis_weights(asset: Asset, directions: Float64[ndarray, "*shape 3"]) -> Float64[ndarray, "*shape K"]:
    """R_i of unit directions in the asset's frame, from its table [Wong2005, fig. 9]; harmonics by formula."""
    basis = asset.map_functions
    if isinstance(basis, GaussianBasis):
        return lookup(asset.table, directions @ basis.centers.T)
    return basis.evaluate(directions.reshape(-1, 3)).reshape(*directions.shape[:-1], asset.k)


def projected_weights(asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "K 3"]:
    """One weight a map and color for all directional and environment lights: sum of color R_i(L) and of W_i = int E R_i."""
    weights = np.zeros((asset.k, 3))
    for directions, colors in distant_lights(asset, lights):
        weights += basis_weights(asset, directions).T @ colors
    return weights


def directional_weights(asset: Asset, direction: Float64[ndarray, " 3"]) -> Float64[ndarray, " K"]:
    """R_i(L) of every map for one unit direction of the world [Wong2005, fig. 6]."""
    return basis_weights(asset, inside(asset, direction[None]))[0]


def receiver_weights(
    asset: Asset, light: PointLight, positions: Float32[ndarray, "*p 3"]
) -> tuple[Float64[ndarray, "*p K"], Float64[ndarray, "*p"]]:
    """R_i(L^) and the attenuation (times a spot's cone) for receivers at `positions`, in the asset's frame [Wong2005, fig. 8-10]."""
    unit, strength = light_vectors(light, positions)
    return basis_weights(asset, unit), strength
