"""The neural map: per texel a code, and one small network of code and light direction for the whole asset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.basis.neural_decoder import NeuralDecoder, rows_of
from srbf.capture import Capture
from srbf.encode.dilation import nearest_covered
from srbf.encode.learned_codes import learned_codes
from srbf.errors import InputError, ManifestError
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_capture
from srbf.light_domain.distant_lights import distant_lights, node_light
from srbf.lights import DirectionalLight, Light
from srbf.methods.carried import carried_images, carried_scene, common_manifest
from srbf.methods.component_maps import CHANNELS, components_of, stored_components
from srbf.methods.over_lights import row_chunks, sum_over_lights
from srbf.methods.protocol import QUIET, FitRun, Method, setting
from srbf.methods.seam_report import seam_report
from srbf.solve.autoencoder import require_jax
from srbf.sphere import Domain

if TYPE_CHECKING:
    from srbf.gl.passes import Passes

MOST_CODES, MOST_HIDDEN = 32, 32


@dataclass(frozen=True)
class NeuralMap(Method):
    """A learned code per texel, decoded together with the light's direction by a network of two hidden layers.

    T(p, L) ~ f(a(p), L), see `NeuralDecoder`; an encoder makes a(p) of all responses of p     [Dulecha2020]

    The network is one for all texels and takes 3 kB. It follows what a sum of few components cannot, such as highlights that move with
    the light; under hundreds of hard suns it holds less than an eigen map. It is not linear in functions of the light: every directional
    light costs an evaluation, an environment map NODES of them. The paper's decoder has two hidden layers of 50 units and no
    bytes in training.

    Parameters
    ----------
    codes
        How many numbers per texel, 1 to 32; four to a layer.
    hidden
        Units in each hidden layer, a multiple of 4, up to 32.
    steps
        Of training, at most.
    time_limit
        Seconds that training takes at most. Equal seeds give equal assets where it suffices for all steps.
    domain
        `sphere` or `hemisphere`; `auto`: where the lights are.
    encoding
        Of the layers on disk: `half`, `float` or `uint8`. Bytes cost next to nothing.
    seed
        Of the training's random numbers.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> NeuralMap(codes=8).encoding
    'uint8'
    """

    name: ClassVar[str] = "neural-map"
    order: ClassVar[int] = 9
    layers: ClassVar[str] = "planes"
    tables: ClassVar[dict[str, str]] = {"network": "network.exr"}
    implied_by: ClassVar[tuple[str, ...]] = ("codes",)
    quick: ClassVar[bool] = False
    exportable: ClassVar[bool] = False

    codes: int = setting(12, "How many numbers per texel.")
    hidden: int = setting(20, "Units in each hidden layer of the network.")
    steps: int = setting(15000, "Steps of training, at most.")
    time_limit: float = setting(600, "Seconds that training takes at most.", duration=True)
    domain: Literal["auto"] | Domain = setting("auto", "Where light can come from; auto: where the lights are.")
    encoding: Encoding = setting("uint8", "Of the layers on disk.")
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.codes <= MOST_CODES:
            raise InputError(f"expected 1 to {MOST_CODES} `codes`, found {self.codes}")
        if not 4 <= self.hidden <= MOST_HIDDEN or self.hidden % 4:
            raise InputError(f"expected a multiple of 4 up to {MOST_HIDDEN} as `hidden`, found {self.hidden}")
        if self.steps < 1:
            raise InputError(f"expected 1 or more `steps`, found {self.steps}")
        if not self.time_limit > 0:
            raise InputError(f"expected a `time_limit` above 0 s, found {self.time_limit:g}")
        if self.encoding not in get_args(Encoding):
            raise InputError(f"expected an encoding of half, float, uint8, found {self.encoding!r}")

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Training on a sample of the texels, then codes of all of them. Each image is read once, and some or all of its rows before.

        Peak memory: 200 bytes per texel, two blocks of `capture.STREAM_BYTES`, and twice the sample (`learned_codes.SAMPLE_BYTES`).

        Parameters
        ----------
        capture
            With train lights.
        run
            `stitch` closes the seams of the codes. KeyboardInterrupt ends the training, not the fit.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where there are no train lights.
        MissingLibraryError
            Without jax.

        Examples
        --------
        >>> NeuralMap(codes=4, steps=100).encode(capture).manifest["scalars"]  # doctest: +SKIP
        4
        """
        train = capture.indices("train")
        if not train:
            raise InputError(f"expected train lights in {capture.folder}, found none")
        require_jax()
        domain = domain_of_capture(capture, self.domain)
        found = learned_codes(
            capture, self.codes, self.hidden, self.steps, self.time_limit, np.random.default_rng(self.seed), run.progress, run.on_image
        )
        if found.interrupted:
            run.say(f"interrupted after {found.steps} of {self.steps} steps of training: fitting with what it has learned")
        elif found.steps < self.steps:
            run.say(f"the time limit of {self.time_limit:g} s sufficed for {found.steps} of {self.steps} steps of training")
        own = stored_components(capture, self.encoding, found.codes, None, run.stitch)
        images = carried_images(capture, nearest_covered(capture.coverage()))
        fit = {"steps": found.steps, "training_error": found.error}
        manifest = common_manifest(capture, self.name, domain, images, asdict(self), fit)
        manifest |= own.entries(1)
        manifest["network"] = {"file": self.tables["network"], "hidden": self.hidden, "activation": "elu"}
        tables = {"network": found.decoder.table()}
        asset = Asset(manifest, own.stored, own.scale, own.bias, tables, images, carried_scene(capture))
        if run.stitch is not None and own.unstitched is not None:
            manifest["seams"] = seam_report(asset, capture, run.stitch, own.unstitched, self.captured_responses)
        return asset

    def __str__(self) -> str:
        return f"codes of {self.codes} numbers{' as bytes' if self.encoding == 'uint8' else ''}"

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        """The network."""
        manifest = reader.manifest
        codes, hidden = manifest["scalars"], manifest["network"]["hidden"]
        if len(manifest["planes"]) != -(-codes // CHANNELS):
            raise ManifestError(f"expected {codes} codes four to an image in {reader.path}, found {len(manifest['planes'])} images")
        return {"network": reader.table("network", (rows_of(codes, hidden), hidden), 1)[:, :, 0]}

    @classmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """An evaluation per directional, point and spot light and receiver; environments shine from NODES directions."""
        distant = list(zip(*distant_lights(asset.manifest, lights), strict=True))
        decoder = NeuralDecoder.of_table(asset.tables["network"])

        def projected(layers: ndarray, rows: slice) -> ndarray:
            first = decoder.of_codes(_codes(asset, layers))
            total = np.zeros((len(first), 3), np.float32)
            for direction, color in distant:
                total += decoder.toward(first, direction[None]) * color.astype(np.float32)
            return total.reshape(*layers.shape[1:3], 3)

        def response(layers: ndarray, rows: slice, positions: ndarray, coordinates: ndarray) -> ndarray:
            found = decoder.toward(decoder.of_codes(_codes(asset, layers)), coordinates.reshape(-1, 3))
            return found.reshape(*layers.shape[1:3], 3)

        return sum_over_lights(asset, lights, projected if distant else None, response)

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        decoder = NeuralDecoder.of_table(asset.tables["network"])
        images = np.empty((len(coordinates), asset.height, asset.width, 3), np.float32)
        for rows in row_chunks(asset):
            first = decoder.of_codes(_codes(asset, asset.coefficients(rows)))
            for image, direction in zip(images[:, rows], coordinates, strict=True):
                image[:] = decoder.toward(first, direction[None]).reshape(image.shape)
        return images

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        """What environment lights send from each of NODES directions. InputError on directional lights, which no such weights describe."""
        if any(isinstance(light, DirectionalLight) for light in lights):
            raise InputError(
                f"expected environment lights for weights of a {cls.name} asset, found a directional light; relight it with lights"
            )
        return node_light(asset.manifest, lights)

    @classmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        return asset.components

    @classmethod
    def label(cls, asset: Asset) -> str:
        return f"{asset.components} numbers"

    @classmethod
    def summary(cls, asset: Asset) -> str:
        decoder = NeuralDecoder.of_table(asset.tables["network"])
        return f"codes of {asset.components} numbers and a network of {decoder.numbers}"

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        decoder = NeuralDecoder.of_table(asset.tables["network"])
        told = {"codes": asset.components, "hidden": asset.manifest["network"]["hidden"]}
        return {**told, "network_numbers": decoder.numbers, "products_per_texel_and_light": decoder.products}

    @classmethod
    def gl_passes(cls) -> type[Passes]:
        from srbf.gl.neural_map import NeuralPasses

        return NeuralPasses


def _codes(asset: Asset, layers: Float32[ndarray, "N h W 4"]) -> Float32[ndarray, "n C"]:
    return np.ascontiguousarray(components_of(layers, asset.components).reshape(asset.components, -1).T)


METHOD = NeuralMap
