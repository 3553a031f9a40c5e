"""The relighting map: per texel, reflected light as a sum of k spherical Gaussians of one spread [Wong2005]."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.basis.gaussian import GaussianBasis, SpreadRule, lookup, r_table, spread_of, weight, weight_curve
from srbf.basis.harmonics import HARMONICS, HarmonicKind, PolynomialTextureMap, SphericalHarmonics
from srbf.capture import Capture
from srbf.compute.threads import each
from srbf.encode.dilation import dilate, nearest_covered
from srbf.encode.model_selection import RIDGES, USUAL_RIDGE, USUAL_SPREAD, Choice, TexelSample, choose, spread_candidates
from srbf.encode.quantization import metric, quantize, quantize_together, rounding_variance
from srbf.errors import InputError, ManifestError
from srbf.gl.uniforms import padded
from srbf.io.image import Encoding
from srbf.light_domain import LightDomain, domain_of_asset, domain_of_capture
from srbf.lights import Light, PointLight
from srbf.methods.carried import carried_images, carried_scene, common_manifest
from srbf.methods.fewer_layers import fewer_maps
from srbf.methods.over_lights import row_chunks, sum_over_lights
from srbf.methods.protocol import MOST_POINT_LIGHTS, QUIET, FitRun, Method, ShaderParts, setting
from srbf.methods.seam_report import seam_report
from srbf.solve.least_squares import StreamedLeastSquares
from srbf.sphere import Domain, PointSet
from srbf.stored_layers import layer_entries

if TYPE_CHECKING:
    from srbf.gl.passes import Passes

Basis = GaussianBasis | SphericalHarmonics | PolynomialTextureMap
NOISE_TEXELS = 512  # any, and so many of the brightest, on which the loss of an encoding is predicted
ROUNDING_MARGIN = 16  # of bytes: held-out lights lost 3 to 15 times what these texels predict
TABLE_ENTRY_TOLERANCE = 1e-5  # float32 rounding of an entry, and of a manifest's spread
LEAST_BYTE_RIDGE = 1e-2  # with less, maps cancel each other by more than bytes can hold


_GLSL = """
/* All directional and environment lights of this asset: weights of srbf.methods.projected_weights. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, vec2 uv, vec4 weights[SRBF_K]) {
    return srbfRelightDirectional(layers, uv, 0, weights, srbfScale, srbfBias);
}

/* One point or spot light of this asset; table is r_table.exr, or pairs of it where SRBF_PAIRS is defined. */
vec3 srbfAssetPoint(highp sampler2DArray layers, vec2 uv, highp sampler2D table, vec3 receiver,
        SrbfPointLight pointLight) {
    return srbfRelightPoint(layers, uv, 0, table, srbfCenters, srbfScale, srbfBias, receiver, pointLight);
}

/* All lights of this asset at once, each texel fetched once: weights as above or 0, point lights in fours
   as srbfUnpackPointLight takes them. */
vec3 srbfAssetLights(highp sampler2DArray layers, vec2 uv, float level, vec4 weights[SRBF_K], highp sampler2D table, vec3 receiver,
                     vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    return srbfRelightLights(layers, uv, level, 0, weights, table, srbfCenters, srbfScale, srbfBias, receiver, pointLights,
        pointLightCount);
}
"""


@dataclass(frozen=True)
class RelightingMap(Method):
    """Per-texel least-squares fit of reflected light by spherical RBFs that share one spread.

    T(p, L) ~ sum_i c_i(p) exp(-acos(L . Q_i)^2 / (2 spread^2))            [Wong2005, eq. 1-2]

    Parameters
    ----------
    k
        How many maps, 1 to 2048: each of C = 3 colors.
    centers
        Point set of the Q_i on the domain; `auto`: Fibonacci.
    domain
        `sphere` or `hemisphere`; `auto`: the hemisphere where all lights are above it.
    spread
        Width of the Gaussians: rad, above 0, or a rule, `mean` or `min`.
    ridge
        Added to the diagonal of the normal equations, 0 or more. `auto` spread and ridge: the one pair for all texels that predicts the
        validation lights best, or train lights left out, the encoding's rounding included.
    encoding
        Of the maps on disk: `half`, `float` or `uint8`.
    basis
        Other functions in the Gaussians' place, as baselines: k = 4, 9, 16 … harmonics, or the 6 of polynomial texture maps.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> method = RelightingMap(k=9, ridge=1e-3)
    >>> fit(capture, method).k
    9
    >>> RelightingMap(k=0)
    Traceback (most recent call last):
    srbf.errors.InputError: expected 1 to 2048 maps (the layers of a texture array), found `k=0`
    """

    name: ClassVar[str] = "relighting-map"
    order: ClassVar[int] = 1
    layers: ClassVar[str] = "maps"
    tables: ClassVar[dict[str, str]] = {"r_table": "r_table.exr"}
    implied_by: ClassVar[tuple[str, ...]] = ("k", "basis", "centers")
    rows_are_independent: ClassVar[bool] = True

    k: int = setting(25, "How many maps.", flag="-k")
    centers: Literal["auto"] | PointSet = setting("auto", "Point set of the Gaussians; auto: fibonacci.")
    domain: Literal["auto"] | Domain = setting("auto", "Where light can come from; auto: where the lights are.")
    spread: Literal["auto"] | SpreadRule | float = setting("auto", "Width of the Gaussians, rad.", words=("auto", "mean", "min"))
    ridge: Literal["auto"] | float = setting("auto", "Added to the diagonal of the normal equations.", words=("auto",))
    encoding: Encoding = setting("half", "Of the layers on disk.")
    basis: Literal["gaussian"] | HarmonicKind = setting("gaussian", "Gaussians, or others as baselines.")

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

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Fit the train lights of a capture: one k x L factorization, each image read once, never a solve per texel.

        Numerical trouble (condition, rank, residual) is data in the manifest's `source.fit`; coefficients past half's range are kept by a
        scale and warned of. Peak memory, whatever the number of lights: 18 k + 40 bytes per texel, two blocks of `capture.STREAM_BYTES`,
        what `run.on_image` keeps, and some 0.2 GB of libraries.

        Parameters
        ----------
        capture
            With train lights. `auto` reads a sample of its texels before.
        run
            `stitch` closes the seams of the dilated maps before they are rounded; with `solve_rows` others stream the images and solve.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where the lights are too few for k without a ridge, and on a domain or basis that the lights cannot have.

        Examples
        --------
        >>> fitted = RelightingMap(k=9, ridge=1e-3).encode(capture)
        >>> fitted.manifest["source"]["fit"]["ridge"]
        0.001
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if len(train) < self.k and self.ridge == 0:
            raise InputError(
                f"expected as many train lights as maps, found {len(train)} lights for `k={self.k}`; lower `k`, or leave `ridge=auto`"
            )
        domain = domain_of_capture(capture, self.domain)
        if self.basis == "hemispherical-harmonics":
            domain_of_capture(capture, "hemisphere")  # refuses lights that are all below
        coordinates = domain.captured(capture, train)
        basis, ridge, choice = self.model(lambda: TexelSample.of(capture), domain)
        if run.solve_rows is not None:
            solved, report = run.solve_rows(capture, train, basis.evaluate(coordinates), ridge, run.progress)
        else:
            solve = StreamedLeastSquares(basis.evaluate(coordinates), ridge)
            for first, block in capture.stream(train, run.on_image):
                solve.add(first, block)
                run.progress(first + len(block), len(train))
            report, solved = solve.report(), solve.solve()
            del solve  # its sums are as large as the maps
        coefficients = solved.reshape(self.k, capture.height, capture.width, 3)
        del solved
        nearest = nearest_covered(capture.coverage())
        if nearest is not None:

            def fill(i: int) -> None:
                coefficients[i] = dilate(coefficients[i], nearest)

            each(fill, self.k)
        stitch = run.stitch
        unstitched = coefficients.reshape(self.k, -1, 3)[:, stitch.texels] if stitch is not None else None
        if stitch is not None:
            stitch.apply(coefficients)
        if self.encoding == "uint8":
            stored, scale, bias = quantize_together(coefficients, basis.evaluate(domain.probes()))
        else:
            stored, scale, bias = quantize(coefficients, self.encoding)
        images = carried_images(capture, nearest)
        fit = {"ridge": ridge, **({} if choice is None else {"chosen_by": choice.rule}), **asdict(report)}
        manifest = common_manifest(capture, self.name, domain, images, asdict(self), fit)
        manifest["maps"] = layer_entries("map", self.encoding, scale, bias)
        tables = {}
        if isinstance(basis, GaussianBasis):
            tables["r_table"] = r_table(basis.spread)
            curve = weight_curve(basis.spread)
            manifest["basis"] = {"kind": "gaussian", "centers": basis.centers.tolist(), "spread": basis.spread}
            manifest["basis"]["curve"] = {"coefficients": curve.coefficients.tolist(), "error": curve.error}
            manifest["r_table"] = {"file": "r_table.exr", "size": len(tables["r_table"])}
        else:
            manifest["basis"] = {"kind": self.basis}
        asset = Asset(manifest, stored, scale, bias, tables, images, carried_scene(capture))
        if stitch is not None and unstitched is not None:
            manifest["seams"] = seam_report(asset, capture, stitch, unstitched, self.captured_responses)
        return asset

    def model(self, read_sample: Callable[[], TexelSample], domain: LightDomain) -> tuple[Basis, float, Choice | None]:
        """(basis, ridge, what chose them, if anything was to be chosen, which alone needs a texel sample)."""
        if self.basis != "gaussian":
            basis: Basis = HARMONICS[self.basis](self.k)
            if self.ridge != "auto":
                return basis, self.ridge, None
            sample = read_sample()
            choice = choose(sample, [(0.0, basis.evaluate(sample.coordinates))], self._ridges(), self._rounding(sample))
            return basis, choice.ridge, choice
        centers = domain.centers(self.k, "fibonacci" if self.centers == "auto" else self.centers)
        if self.spread != "auto" and self.ridge != "auto":
            return GaussianBasis(centers, spread_of(centers, self.spread)), self.ridge, None
        sample = read_sample()
        mean = spread_of(centers, "mean")
        spreads = spread_candidates(mean) if self.spread == "auto" else [spread_of(centers, self.spread)]
        candidates = ((spread, GaussianBasis(centers, spread).evaluate(sample.coordinates)) for spread in spreads)
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

    def __str__(self) -> str:
        return f"{self.k} maps"

    def caution(self, capture: Capture) -> str | None:
        """More maps than train lights: the ridge alone decides between solutions."""
        lights = len(capture.indices("train"))
        if self.k <= lights:
            return None
        return (
            f"caution: {self.k} maps of {lights} train lights hold more than was captured; "
            f"more photographs, or `k={lights}` and fewer, cost less"
        )

    @classmethod
    def compared(cls) -> tuple[RelightingMap, ...]:
        return (*(cls(k=k) for k in (9, 25, 49)), *(cls(k=k, basis="spherical-harmonics") for k in (4, 9, 16)))

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        """The R table; refuses centers and a spread that are not its own."""
        manifest, path = reader.manifest, reader.path
        if manifest["basis"]["kind"] != "gaussian":
            return {}
        if "r_table" not in manifest:
            raise ManifestError(f"expected an r_table for Gaussians in {path}, found none")
        reader.check_unit(manifest["basis"]["centers"])
        if len(manifest["basis"]["centers"]) != len(manifest["maps"]):
            found = f"{len(manifest['basis']['centers'])} centers, {len(manifest['maps'])} maps"
            raise ManifestError(f"expected as many centers as maps in {path}, found {found}")
        size, spread = manifest["r_table"]["size"], manifest["basis"]["spread"]
        table = np.ascontiguousarray(reader.table("r_table", (1, size), 1)[0, :, 0])
        error = float(np.abs(table - weight(np.linspace(-1, 1, size), spread)).max())
        if error > TABLE_ENTRY_TOLERANCE:
            raise ManifestError(f"expected the R table of spread {spread:g} in {path}, found one off by {error:.2g}")
        return {"r_table": table}

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """Directional and environment lights fold into one weight per map and color, so a hundred of them cost as one.

        A point or spot light has weights of its own at every receiver [Wong2005, "Directional-Source Relighting", "Point-Source
        Relighting"].
        """
        weights = cls.projected_weights(asset, lights).astype(np.float32)

        def projected(layers: ndarray, rows: slice) -> ndarray:
            return np.einsum("khwc,kc->hwc", layers, weights, optimize=True)

        def response(layers: ndarray, rows: slice, positions: ndarray, coordinates: ndarray) -> ndarray:
            return np.einsum("khwc,hwk->hwc", layers, basis_weights(asset, coordinates).astype(np.float32), optimize=True)

        return sum_over_lights(asset, lights, projected if weights.any() else None, response)

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b d"]) -> Float32[ndarray, "b H W 3"]:
        """One (b, K) x (K, H W 3) product."""
        weights = basis_weights(asset, coordinates).astype(np.float32)  # (b, K)
        images = np.empty((len(weights), asset.height, asset.width, 3), np.float32)
        for rows in row_chunks(asset):
            c = asset.coefficients(rows)
            images[:, rows] = (weights @ c.reshape(asset.k, -1)).reshape(len(weights), *c.shape[1:])
        return images

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "K 3"]:
        """The sum of color R_i(L), and of W_i = int E R_i for environment maps."""
        weights = np.zeros((asset.k, 3))
        for coordinates, colors in domain_of_asset(asset.manifest).shared(lights):
            weights += basis_weights(asset, coordinates).T @ colors
        return weights

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return 3 * asset.k

    @classmethod
    def family(cls, asset: Asset) -> str:
        kind = asset.manifest.get("basis", {}).get("kind", "gaussian")
        return super().family(asset) if kind == "gaussian" else kind.replace("-", " ")

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.k} maps"

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        basis = asset.manifest["basis"]
        return {"k": asset.k, "basis": basis["kind"], **({"spread": basis["spread"]} if "spread" in basis else {})}

    @classmethod
    def summary(cls, asset: Asset) -> str:
        fit = asset.manifest["source"]["fit"]
        condition = f"{fit['condition_number']:.3g}" if fit["condition_number"] is not None else "infinite"
        spread = f"spread {asset.basis.spread:.4g} rad, " if asset.manifest["basis"]["kind"] == "gaussian" else ""
        return (
            f"{asset.k} maps, {spread}ridge {fit['ridge']:.3g}, condition {condition}, rank {fit['rank']}, "
            f"residual {fit['relative_residual']:.3g}"
        )

    @classmethod
    def rounding_functions(cls, asset: Asset) -> Float64[ndarray, "M K"]:
        return asset.map_functions.evaluate(domain_of_asset(asset.manifest).probes())

    @classmethod
    def reducible_from(cls, asset: Asset) -> int:
        return asset.k

    @classmethod
    def reduced(cls, asset: Asset, manifest: dict[str, Any], count: int, encoding: Encoding) -> Asset:
        return fewer_maps(asset, manifest, count, encoding)

    @classmethod
    def gl_passes(cls) -> type[Passes]:
        from srbf.gl.relighting_map import MapPasses

        return MapPasses

    @classmethod
    def shader_parts(cls, asset: Asset, pairs: bool = False) -> ShaderParts:
        defines = {"SRBF_K": len(asset.basis.centers), "SRBF_POINT_LIGHTS": MOST_POINT_LIGHTS}
        defines |= ({"SRBF_PLAIN": 1} if asset.is_plain() else {}) | ({"SRBF_PAIRS": 1} if pairs else {})
        arrays = {"srbfCenters": padded(asset.basis.centers), "srbfScale": padded(asset.scale), "srbfBias": padded(asset.bias)}
        return ShaderParts(_GLSL, defines, {name: ("SRBF_K", rows) for name, rows in arrays.items()}, "")


def basis_weights(asset: Asset, coordinates: Float64[ndarray, "*shape 3"]) -> Float64[ndarray, "*shape K"]:
    """R_i of unit directions in the asset's frame, from its table [Wong2005, fig. 9]; harmonics by formula."""
    basis = asset.map_functions
    if isinstance(basis, GaussianBasis):
        return lookup(asset.table, coordinates @ basis.centers.T)
    return basis.evaluate(coordinates.reshape(-1, 3)).reshape(*coordinates.shape[:-1], asset.k)


def receiver_weights(
    asset: Asset, light: PointLight, positions: Float32[ndarray, "*p 3"]
) -> tuple[Float64[ndarray, "*p K"], Float64[ndarray, "*p"]]:
    """R_i(L) and the strength of a point or spot light for receivers at `positions`, in the asset's frame [Wong2005, fig. 8-10]."""
    coordinates, strength = domain_of_asset(asset.manifest).toward(light, positions)
    return basis_weights(asset, coordinates), strength


METHOD = RelightingMap
