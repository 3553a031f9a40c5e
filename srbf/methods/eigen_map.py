"""The eigen map: per texel, reflected light as a sum of a few scalars, each weighed by an RGB function of light direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Literal, get_args

from srbf.asset import Asset
from srbf.capture import Capture, OnImage
from srbf.encode.light_function_fit import functions_through
from srbf.encode.model_selection import TexelSample
from srbf.encode.uv_seams import Stitch
from srbf.encode.weighted_rows import LightSpace, Weighting
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.methods.coefficient_maps import (
    check_plane_settings,
    coefficient_maps_asset,
    directional_responses,
    linear_response,
    projected_weights,
    relight,
)
from srbf.solve.pca import principal_axes
from srbf.solve.streamed_product import StreamedProduct
from srbf.sphere import Domain, domain_of

__all__ = ["EigenMap", "directional_responses", "projected_weights", "linear_response", "relight"]

SAMPLE_TEXELS = 1 << 14


@dataclass(frozen=True)
class EigenMap:
    """Joint-color principal components of T, their light functions smooth on the sphere.

    T(p, L, c) ~ w_0(L, c) + sum_j a_j(p) w_j(L, c), j = 1 … `scalars`

    The rows of T, (L x 3) numbers a texel, lose their mean w_0 and are projected on the leading axes of a texel sample: a_j is one
    number a texel for all three colors. What an axis holds at the lights becomes a function of every direction by kernel
    ridge regression on a dense set of spherical Gaussians. One kernel, of one spread or of two, and one ridge serve all functions: those
    that predict best the lights left out and the validation lights (`auto`, `light_function_fit.choose_functions`). Columns of T are
    weighted by the solid angle of their light; `weighting` says how rows are: `plain` gives the least squared error, `relative` divides
    each by its mean, so that dark texels count as much as bright ones.
    """

    scalars: int = 28
    domain: Literal["auto"] | Domain = "auto"
    spread: Literal["auto"] | float = "auto"
    ridge: Literal["auto"] | float = "auto"
    weighting: Weighting = "plain"
    encoding: Encoding = "half"

    def __post_init__(self) -> None:
        check_plane_settings(self.scalars, self.spread, self.ridge, self.encoding)
        if self.weighting not in get_args(Weighting):
            raise InputError(f"expected a weighting of plain, relative, found {self.weighting!r}")

    def encode(
        self,
        capture: Capture,
        progress: Callable[[int, int], None] = lambda done, total: None,
        on_image: OnImage = lambda row, image: None,
        stitch: Stitch | None = None,
    ) -> Asset:
        """Axes from a texel sample, then one projection of every texel: each image read once, and some of its rows before.

        Peak memory, whatever the number of lights: about 12 `scalars` + 40 bytes a texel, two blocks of `capture.STREAM_BYTES`, the sample
        (12 bytes a light and texel of SAMPLE_TEXELS), what `on_image` keeps, some 0.2 GB of libraries. `stitch` closes the planes' seams.
        InputError where there are no train lights, or fewer than 3 times as many numbers a texel as scalars.
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        if self.scalars > 3 * len(train):
            raise InputError(f"expected at most {3 * len(train)} scalars for {len(train)} lights, found {self.scalars}")
        sample = TexelSample.of(capture, SAMPLE_TEXELS)
        directions = capture.directions(train)
        domain = domain_of(directions) if self.domain == "auto" else self.domain
        space = LightSpace.of(sample, self.weighting)
        axes, values = principal_axes(space.centered * space.row_weights[:, None], self.scalars)
        product = StreamedProduct(space.weights(axes))
        for first, block in capture.stream(train, on_image):
            product.add(first, block)
            progress(first + len(block), len(train))
        planes = product.result - space.offsets(axes)[:, None]
        functions, chosen = functions_through(sample, space.functions(axes), domain, self.spread, self.ridge)
        fit = {
            **chosen,
            "singular_values": (values / max(float(values[0]), 1e-30)).tolist(),
            "energy_kept": space.energy_kept(values),
        }
        return coefficient_maps_asset(capture, "eigen-map", domain, planes, functions, self.encoding, asdict(self), fit, stitch=stitch)
