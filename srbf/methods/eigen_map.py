"""The eigen map: per texel, reflected light as a sum of a few components, each weighted by an RGB function of light direction."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.encode.light_function_fit import functions_through
from srbf.encode.model_selection import TexelSample
from srbf.encode.weighted_rows import LightSpace, Weighting
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_capture
from srbf.methods.coefficient_maps import CoefficientMaps, check_settings, coefficient_maps_asset
from srbf.methods.fewer_layers import fewer_components
from srbf.methods.protocol import QUIET, FitRun, setting
from srbf.solve.pca import principal_axes
from srbf.solve.streamed_product import StreamedProduct
from srbf.sphere import Domain

SAMPLE_TEXELS = 1 << 14
MOST_TRIED = 64  # components of a candidate

_GLSL = """
/* All directional and environment lights of this asset: weights (SRBF_COMPONENTS + 1) x 1 texels of srbf.methods.projected_weights. */
vec3 srbfAssetDirectional(highp sampler2DArray layers, vec2 uv, highp sampler2D weights) {
    return srbfEigenMapDirectional(layers, uv, 0, weights, srbfScale, srbfBias);
}

/* One point or spot light of this asset; table is w_table.exr. */
vec3 srbfAssetPoint(highp sampler2DArray layers, vec2 uv, highp sampler2D table, vec3 receiver,
        SrbfPointLight pointLight) {
    return srbfEigenMapPoint(layers, uv, 0, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLight);
}

/* All lights of this asset at once, each texel fetched once: weights as above or 0, point lights in fours
   as srbfUnpackPointLight takes them. */
vec3 srbfAssetLights(highp sampler2DArray layers, vec2 uv, float level, highp sampler2D weights, highp sampler2D table,
                     vec3 receiver, vec4 pointLights[4 * SRBF_POINT_LIGHTS], int pointLightCount) {
    return srbfEigenMapLights(layers, uv, level, 0, weights, table, SRBF_TABLE_SIZE, srbfScale, srbfBias, receiver, pointLights,
        pointLightCount);
}
"""


@dataclass(frozen=True)
class EigenMap(CoefficientMaps):
    """Joint-color principal components of T, their light functions smooth on the sphere.

    T(p, L, c) ~ w_0(L, c) + sum_j a_j(p) w_j(L, c), j = 1 … `components`

    The rows of T, (L x 3) numbers per texel, lose their mean w_0 and are projected on the leading axes of a texel sample: a_j is one
    number per texel for all three colors. What an axis holds at the lights becomes a function of every direction by kernel
    ridge regression on a dense set of spherical Gaussians. One kernel, of one spread or of two, and one ridge serve all functions: those
    that predict best the lights left out and the validation lights (`auto`, `light_function_fit.choose_functions`). Columns of T are
    weighted by the solid angle of their light; `weighting` says how rows are: `plain` gives the least squared error, `relative` divides
    each by its mean, so that dark texels count as much as bright ones.
    """

    name: ClassVar[str] = "eigen-map"
    order: ClassVar[int] = 2
    implied_by: ClassVar[tuple[str, ...]] = ("components", "weighting")
    functions_text: ClassVar[str] = _GLSL

    components: int = setting(28, "How many numbers per texel.")
    domain: Literal["auto"] | Domain = setting("auto", "Where light can come from; auto: where the lights are.")
    spread: Literal["auto"] | float = setting("auto", "Width of the light functions' kernel, rad.", words=("auto",))
    ridge: Literal["auto"] | float = setting("auto", "Added to the diagonal of the kernel matrix.", words=("auto",))
    weighting: Weighting = setting("plain", "Plain squared error, or relative to each texel's mean.")
    encoding: Encoding = setting("half", "Of the layers on disk.")

    def __post_init__(self) -> None:
        check_settings(self.components, self.spread, self.ridge, self.encoding)
        if self.weighting not in get_args(Weighting):
            raise InputError(f"expected a weighting of plain, relative, found {self.weighting!r}")

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Axes from a texel sample, then one projection of every texel: each image read once, and some of its rows before.

        Peak memory, whatever the number of lights: about 12 `components` + 40 bytes per texel, two blocks of `capture.STREAM_BYTES`, the
        sample (12 bytes per light and texel of SAMPLE_TEXELS), what `run.on_image` keeps, and some 0.2 GB of libraries.
        InputError where there are no train lights, or more components than captured numbers per texel.
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if self.components > 3 * len(train):
            raise InputError(f"expected at most {3 * len(train)} components for {len(train)} lights, found {self.components}")
        domain = domain_of_capture(capture, self.domain)
        sample = TexelSample.of(capture, SAMPLE_TEXELS)
        space = LightSpace.of(sample, self.weighting)
        axes, values = principal_axes(space.centered * space.row_weights[:, None], self.components)
        product = StreamedProduct(space.weights(axes))
        for first, block in capture.stream(train, run.on_image):
            product.add(first, block)
            run.progress(first + len(block), len(train))
        components = product.result - space.offsets(axes)[:, None]
        functions, chosen = functions_through(sample, space.functions(axes), domain, self.spread, self.ridge)
        fit = {
            **chosen,
            "singular_values": (values / max(float(values[0]), 1e-30)).tolist(),
            "energy_kept": space.energy_kept(values),
        }
        return coefficient_maps_asset(self, capture, domain, components, functions, fit, stitch=run.stitch)

    def __str__(self) -> str:
        return f"{self.components} components{' as bytes' if self.encoding == 'uint8' else ''}"

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[EigenMap]:
        """Bytes, four to a layer."""
        if size >= 4:
            yield cls(components=min(size // 4 * 4, MOST_TRIED, numbers), encoding="uint8")

    @classmethod
    def compared(cls) -> tuple[EigenMap, ...]:
        return tuple(cls(components=s, encoding="uint8") for s in (8, 16, 32))

    @classmethod
    def reducible_from(cls, asset: Asset) -> int:
        return asset.components

    @classmethod
    def reduced(cls, asset: Asset, manifest: dict[str, Any], count: int, encoding: Encoding) -> Asset:
        return fewer_components(asset, manifest, count, encoding)


METHOD = EigenMap
