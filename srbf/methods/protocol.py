"""What every method offers: settings, a fit, and what an asset of it can be asked.

A method is a frozen dataclass of its settings in one module of this folder, which ends with `METHOD = TheClass`. `srbf.registry` finds
it by name; the command line builds its flags from its fields; manifests are checked against `schemas/methods/STEM.schema.json`; shaders
are in `glsl/methods/STEM*.glsl`. To add a method, add these files.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.encode.row_blocks import SolveRows
from srbf.encode.uv_seams import Stitch
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_asset, light_of
from srbf.light_images import OnImage
from srbf.lights import Light, PointLight

if TYPE_CHECKING:
    from srbf.gl.passes import Passes


Moving = Callable[[Sequence[Light], float], np.ndarray]

MOST_POINT_LIGHTS = 8  # that srbfAssetLights takes at once


def setting(default: Any, help: str, *, flag: str | None = None, words: tuple[str, ...] = (), duration: bool = False) -> Any:
    """A field of a method's settings that the command line offers: `help`, a `flag` that is not its name, `words` besides a number.

    `duration`: seconds, which the command line takes as 90s or 30m, too.
    """
    return field(default=default, metadata={"help": help, "flag": flag, "words": words, "duration": duration})


def check_error(error: float | None) -> None:
    """InputError on an error that is no share."""
    if error is not None and not 0 < error < 1:
        raise InputError(f"expected `error` above 0 and below 1 (100 %), found {error:g}")


@dataclass(frozen=True)
class FitRun:
    """What a fit reports to, and what does parts of its work.

    `progress(done, total)` counts images. `on_image(row, image)` sees every train image once as it is read, in any thread. `stitch` closes
    the seams of the UV layer. `say` gets a line on what a fit chose. `solve_rows` has blocks of rows solved elsewhere, where the method
    can; `on_image` sees none then.
    """

    progress: Callable[[int, int], None] = lambda done, total: None
    on_image: OnImage = lambda row, image: None
    stitch: Stitch | None = None
    solve_rows: SolveRows | None = None
    say: Callable[[str], None] = lambda line: None


QUIET = FitRun()


@dataclass(frozen=True, eq=False)
class ShaderParts:
    """What a shader of one asset needs of its method, beside the pack's `methods/STEM.glsl` and `methods/STEM_lights.glsl`.

    `functions`: GLSL text of srbfAssetDirectional, srbfAssetPoint and srbfAssetLights, which name what is the asset's own. `defines` are
    counts. `arrays`: name -> (the define that counts its rows, (n, 4) values). `stages`: prefix of the pack's stage files.
    """

    functions: str
    defines: dict[str, int]
    arrays: dict[str, tuple[str, ndarray]]
    stages: str


class Method(ABC):
    """One way of compressing light transport. Class methods are of an asset, whatever its settings were."""

    name: ClassVar[str]  # in manifests and on the command line; with underscores the stem of its files
    order: ClassVar[int]  # of listings, the simplest first
    layers: ClassVar[str]  # key of asset.json that lists the stored layers
    tables: ClassVar[dict[str, str]]  # what it looks up: key of asset.json -> file
    domains: ClassVar[tuple[str, ...]] = ("directions",)
    receivers: ClassVar[tuple[str, ...]] = ("lightmap", "view", "vertices", "probes")
    implied_by: ClassVar[tuple[str, ...]] = ()  # settings, or setting=value, that choose the method where none is named
    rows_are_independent: ClassVar[bool] = False  # blocks of rows may be solved on other machines
    quick: ClassVar[bool] = True  # a fit to a sample of the texels takes seconds, so that choices may compare some
    has_shader: ClassVar[bool] = True  # `glsl/methods/STEM.glsl` is there
    exportable: ClassVar[bool] = True  # layers may be encoded otherwise, for engines
    on_page: ClassVar[bool] = True  # the viewer's page and the npm package show it
    has_report: ClassVar[bool] = True  # `srbf report` draws it
    takes_objects: ClassVar[bool] = False  # whether a named light is an object whose surfaces emit
    takes_profiles: ClassVar[bool] = False  # whether lights inside its scene may have a profile
    takes_links: ClassVar[bool] = False  # whether lights may choose the objects that they shine on, and that shadow them
    filterable: ClassVar[bool] = True  # layers mean the same at neighboring texels: they may be filtered, and have mip levels

    @classmethod
    def stem(cls) -> str:
        """Of its files in every layer."""
        return cls.name.replace("-", "_")

    @classmethod
    def settings(cls) -> tuple[str, ...]:
        """Names of its settings."""
        return tuple(entry.name for entry in fields(cls))  # type: ignore[arg-type]

    @classmethod
    def is_made_for(cls, capture: Capture) -> bool:
        """Whether it is the method of a capture where none is named."""
        return False

    @abstractmethod
    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """The asset of a capture. InputError where the settings do not suit it; numerical trouble is data in `source.fit`."""

    def caution(self, capture: Capture) -> str | None:
        """What to say of settings that suit the capture badly."""
        return None

    def on_sample(self, ratio: float) -> Method:
        """The settings for a trial on a sample of the texels, of which the capture has `ratio` times as many."""
        return self

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[Method]:
        """What a choice within `size` bytes per texel tries, fewest light functions first; `numbers` were captured per texel."""
        return ()

    @classmethod
    def compared(cls) -> tuple[Method, ...]:
        """What a report compares."""
        return ()

    @classmethod
    @abstractmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        """Its tables from the files of an asset; ManifestError or ImageError, in one line, where they do not fit the manifest."""

    @classmethod
    def with_plain_tables(cls, asset: Asset) -> Asset:
        """The asset for code that reads plain images and knows no other form of its tables, as engines' code does."""
        plain = {
            key: {**{name: value for name, value in told.items() if name != "packed"}, "file": cls.tables[key]}
            for key, told in asset.manifest.items()
            if key in asset.tables and "packed" in told
        }
        return replace(asset, manifest={**asset.manifest, **plain})

    @classmethod
    @abstractmethod
    def linear_response(cls, asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """The sum over lights of the asset's frame, before the clamp and without ambient: linear in every light's color."""

    @classmethod
    def radiance_to(cls, asset: Asset, lights: Sequence[Light], viewer: tuple[float, float, float]) -> Float32[ndarray, "H W 3"]:
        """`linear_response` as seen from a place (m) in the asset's frame; InputError where the asset knows one viewer alone."""
        raise InputError(
            f"expected an asset of glossy surfaces for `viewer`, found a {cls.name} one, which looks the same from everywhere; "
            "bake with `light_set=cloud` and `gloss=3`, and fit that"
        )

    @classmethod
    def faded(cls, asset: Asset, seconds: float) -> Moving:
        """`linear_response` from frame to frame, each `dt` seconds after the last; where lights carry others, these fade over `seconds`."""
        kind = asset.manifest.get("interpolation", {}).get("kind", cls.name)
        raise InputError(
            f"expected an asset of captured point lights for `fade`, found {kind}, "
            "whose light is continuous without; leave `fade` out, or fit light-cloud with `interpolation=kernel`"
        )

    @classmethod
    @abstractmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b d"]) -> Float32[ndarray, "b H W 3"]:
        """`linear_response` to a white light at each of many coordinates of the light domain, in the asset's frame."""

    @classmethod
    def local_lights(cls, lights: Sequence[Light]) -> list[PointLight]:
        """Those of `lights` that every receiver sees at coordinates of its own; the rest are in `projected_weights`."""
        return [light for light in lights if isinstance(light, PointLight)]

    @classmethod
    def shader_stem(cls, asset: Asset) -> str:
        """Of the pack's files that draw an asset."""
        return cls.stem()

    @classmethod
    def captured_responses(cls, asset: Asset, capture: Capture, lights: Sequence[int]) -> Float32[ndarray, "b H W 3"]:
        """`linear_response` to each of a capture's `lights`, as the capture has them: what its images are compared with."""
        domain = domain_of_asset(asset.manifest)
        if all(capture.lights[i].kind in domain.captured_kinds for i in lights):
            return cls.responses(asset, domain.captured(capture, lights))
        every = [light_of(capture.lights[i]) for i in lights]
        return np.stack([cls.linear_response(asset, [light]) for light in every if light is not None])

    @classmethod
    @abstractmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        """One weight per map or light function, and color, of all lights that every receiver sees at the same coordinates."""

    @classmethod
    @abstractmethod
    def numbers_per_texel(cls, asset: Asset) -> int:
        """How many numbers an asset keeps per texel."""

    @classmethod
    def family(cls, asset: Asset) -> str:
        """The curve of error against bytes that an asset is on."""
        return cls.name.replace("-", " ")

    @classmethod
    @abstractmethod
    def label(cls, asset: Asset) -> str:
        """What tells an asset of the family from others: how many numbers it keeps."""

    @classmethod
    @abstractmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        """What `srbf info` says of the asset's model."""

    @classmethod
    def summary(cls, asset: Asset) -> str:
        """One line on a fit that has ended."""
        return cls.label(asset)

    @classmethod
    def rounding_functions(cls, asset: Asset) -> Float64[ndarray, "M K"] | None:
        """Functions over the domain through whose sums alone the layers are seen, so that they are rounded together; None: each alone."""
        return None

    @classmethod
    def reducible_from(cls, asset: Asset) -> int | None:
        """How many maps or components the asset has of which `reduced` keeps fewer; None where it cannot."""
        return None

    @classmethod
    def reduced(cls, asset: Asset, manifest: dict[str, Any], count: int, encoding: Encoding) -> Asset:
        """An asset of fewer layers, without the capture; `manifest` is its asset.json, still with the layers and tables of before."""
        raise NotImplementedError(cls.name)

    @classmethod
    def gl_passes(cls) -> type[Passes]:
        """The passes that draw it."""
        raise InputError(f"expected an asset that a shader relights, found a {cls.name} one; relight it by numpy")

    @classmethod
    def shader_parts(cls, asset: Asset, pairs: bool = False) -> ShaderParts:
        """What exports need; `pairs`: relighting maps find the R table as values and differences. InputError without a shader."""
        raise InputError(f"expected an asset that a shader relights, found a {cls.name} one; export it as exr")
