"""One map of each of the scene's own lights: exact light mixing, for few lights or as a reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.encode.dilation import dilate, nearest_covered
from srbf.encode.quantization import quantize
from srbf.errors import InputError, ManifestError
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_asset, domain_of_capture
from srbf.lights import Light, PointLight
from srbf.methods.carried import carried_images, carried_scene, common_manifest
from srbf.methods.over_lights import row_chunks
from srbf.methods.protocol import MOST_POINT_LIGHTS, QUIET, FitRun, Method, ShaderParts, setting
from srbf.methods.seam_report import seam_report
from srbf.stored_layers import layer_entries

if TYPE_CHECKING:
    from srbf.gl.passes import Passes

MOST_LIGHTS = 2048  # layers of a texture array


@dataclass(frozen=True)
class NamedMaps(Method):
    """The captured images themselves, a map per light: T(p, l) = c_l(p).

    Parameters
    ----------
    exact
        Implies this method on the command line.
    encoding
        Of the maps on disk: `half`, `float` or `uint8`.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> NamedMaps().encoding
    'half'
    """

    name: ClassVar[str] = "named-maps"
    order: ClassVar[int] = 6
    layers: ClassVar[str] = "maps"
    tables: ClassVar[dict[str, str]] = {}
    domains: ClassVar[tuple[str, ...]] = ("named",)
    implied_by: ClassVar[tuple[str, ...]] = ("exact",)

    exact: bool = setting(True, "One map per named light.")
    encoding: Encoding = setting("half", "Of the layers on disk.")

    def __post_init__(self) -> None:
        if self.encoding not in get_args(Encoding):
            raise InputError(f"expected an encoding of half, float, uint8, found {self.encoding!r}")

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Every train image, dilated and stitched; all of them are in memory.

        Parameters
        ----------
        capture
            Under named lights.
        run
            `stitch` closes the seams of the maps.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where there are no train lights, or more than a texture array has layers.

        Examples
        --------
        >>> NamedMaps(exact=True).name
        'named-maps'
        """
        train = capture.indices("train")
        if not 1 <= len(train) <= MOST_LIGHTS:
            raise InputError(f"expected 1 to {MOST_LIGHTS} named lights for a map each, found {len(train)}; fit a light-mix, by `budget`")
        domain = domain_of_capture(capture)
        nearest = nearest_covered(capture.coverage())
        maps = np.empty((len(train), capture.height, capture.width, 3), np.float32)
        for first, block in capture.stream(train, run.on_image):
            for row, image in enumerate(block, start=first):
                maps[row] = dilate(image.reshape(capture.height, capture.width, 3).astype(np.float32), nearest)
            run.progress(first + len(block), len(train))
        stitch = run.stitch
        unstitched = None if stitch is None else maps.reshape(len(train), -1, 3)[:, stitch.texels]
        if stitch is not None:
            stitch.apply(maps)
        stored, scale, bias = quantize(maps, self.encoding)
        images = carried_images(capture, nearest)
        manifest = common_manifest(capture, self.name, domain, images, asdict(self), {})
        manifest["maps"] = layer_entries("map", self.encoding, scale, bias)
        asset = Asset(manifest, stored, scale, bias, {}, images, carried_scene(capture))
        if stitch is not None and unstitched is not None:
            manifest["seams"] = seam_report(asset, capture, stitch, unstitched, self.captured_responses)
        return asset

    def __str__(self) -> str:
        return "a map per light"

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        maps, lights = len(reader.manifest["maps"]), len(reader.manifest["lights"])
        if maps != lights:
            raise ManifestError(f"expected as many maps as lights in {reader.path}, found {maps} maps of {lights} lights")
        return {}

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "N 3"]:
        """The colors of the lights."""
        weights = np.zeros((len(asset.stored), 3))
        for coordinates, colors in domain_of_asset(asset.manifest).shared(lights):
            weights += coordinates.T @ colors
        return weights

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        return _weighted(asset, cls.projected_weights(asset, lights)[None])[0]

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b N"]) -> Float32[ndarray, "b H W 3"]:
        return _weighted(asset, np.repeat(coordinates[:, :, None], 3, axis=2))

    @classmethod
    def local_lights(cls, lights: Sequence[Light]) -> list[PointLight]:
        return []

    @classmethod
    def shader_stem(cls, asset: Asset) -> str:
        return "relighting_map"

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return 3 * len(asset.stored)

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{len(asset.stored)} lights"

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        return {"lights": len(asset.stored), "names": [entry["name"] for entry in asset.manifest["lights"]]}

    @classmethod
    def summary(cls, asset: Asset) -> str:
        return f"a map of each of {len(asset.stored)} named lights"

    @classmethod
    def gl_passes(cls) -> type[Passes]:
        from srbf.gl.relighting_map import MapPasses

        return MapPasses

    @classmethod
    def shader_parts(cls, asset: Asset, pairs: bool = False) -> ShaderParts:
        defines = {"SRBF_K": len(asset.stored), "SRBF_POINT_LIGHTS": MOST_POINT_LIGHTS} | ({"SRBF_PLAIN": 1} if asset.is_plain() else {})
        from srbf.gl.uniforms import padded

        arrays = {"srbfScale": padded(asset.scale), "srbfBias": padded(asset.bias)}
        return ShaderParts("", defines, {name: ("SRBF_K", rows) for name, rows in arrays.items()}, "")


def _weighted(asset: Asset, weights: Float64[ndarray, "b N 3"]) -> Float32[ndarray, "b H W 3"]:
    images = np.empty((len(weights), asset.height, asset.width, 3), np.float32)
    for rows in row_chunks(asset):
        images[:, rows] = np.einsum("nhwc,bnc->bhwc", asset.coefficients(rows), weights.astype(np.float32), optimize=True)
    return images


METHOD = NamedMaps
