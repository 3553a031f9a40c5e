"""The light cloud: lights that move inside the scene, with bounces that follow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.capture import Capture
from srbf.encode.light_kernel_table import FadedLights, KernelTable, Weight, kernel_table
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.light_domain.cloud import isotropic
from srbf.light_domain.cloud_kernel import NEAREST, CloudKernel
from srbf.lights import Light
from srbf.methods.kept_visibility import RECEIVER_VISIBILITY_HELP, VISIBILITY_HELP, check_visibility, light_on_patches
from srbf.methods.light_table_maps import check_table_settings, encode_table, stored_values
from srbf.methods.lights_inside_maps import LightsInsideMaps
from srbf.methods.protocol import QUIET, FitRun, Moving, setting
from srbf.solve.light_merging import Mean
from srbf.visibility.cloud_lights import CloudLights, Interpolation, chosen_interpolation, unseen_lights
from srbf.visibility.embree import has_embree

VIRTUAL_LIGHTS = 600  # places whose responses the components are made for
TRIED_CLUSTERS = (32, 64)
MOST_TRIED = 64  # components of a candidate
LEAST_TEXELS = 64  # per cluster of a candidate


@dataclass(frozen=True)
class LightCloud(LightsInsideMaps):
    """Indirect light of lights inside the scene, at the cost of one distant light per texel [Kristensen2005].

    T(p, x) ~ sum_k f_k(x) G_k(p),  G_k(p) ~ w_{m,0}(k) + sum_j a_j(p) w_{m,j}(k), m the cluster of p

    Of a capture of patches, f_k is the irradiance that a light lays on patch k, so that any light is one: points, spots, areas, suns. Of a
    cloud of captured point lights, either f_k is the same and G_k comes from ridge regression on the irradiance (`fingerprint`), or k are
    the captured lights and f_k the kernel (1 - d/r)^4 over those that the light sees (`kernel`, the article's).

    Parameters
    ----------
    clusters
        1 to 256: the index per texel is one byte.
    components
        How many numbers per texel.
    interpolation
        Between captured point lights; `auto`: the one that predicts left-out lights better. Patches need none.
    nearest
        kernel: how many captured lights carry a light.
    zones
        kernel: parts of the scene, with merged lights and clusters of their own.
    mean_components
        Their mean number per texel: clusters get more where these cut the error most, at most `components`. `auto`: all have all.
    merge
        kernel: similar lights of a zone become one, by the `harmonic` or `arithmetic` mean; `none` merges none.
    merged
        kernel: how many lights are left in each zone; `auto`: all pairs of a merged light are nearer than 1 in the article's metric.
    distance_weight, response_weight
        merge: w1 (1/m) and w2 (one over the unit of light) of the article's metric; `auto`: the largest distance and difference count 1.
    smooth
        Average components over neighbors on the surface that differ by no more than the capture's noise.
    encoding
        Of the layers on disk: `half`, `float` or `uint8`.
    visibility
        `pca:COUNT`: keep what each surfel sees as so many coefficients, for light without rays [Nowrouzezahrai2007]; `none`.
    receiver_visibility
        Keep what each receiver sees as well, for direct light without shadow maps.
    seed
        Of the clustering's random numbers.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> LightCloud(clusters=32).components
    12
    """

    name: ClassVar[str] = "light-cloud"
    order: ClassVar[int] = 5
    domains: ClassVar[tuple[str, ...]] = ("cloud",)
    tables: ClassVar[dict[str, str]] = {**LightsInsideMaps.tables, "cloud": "cloud.exr"}

    clusters: int = setting(64, "How many clusters, at most 256.")
    components: int = setting(12, "How many numbers per texel.")
    mean_components: Literal["auto"] | float = setting(
        "auto", "How many numbers per texel on average, more where they cut the error most.", words=("auto",)
    )
    interpolation: Interpolation = setting("auto", "Between captured point lights; auto: what predicts left-out lights better.")
    nearest: int = setting(NEAREST, "kernel: captured lights that carry a light.")
    zones: int = setting(1, "kernel: parts of the scene with merged lights of their own.")
    merge: Literal["none"] | Mean = setting("none", "kernel: how similar lights of a zone become one.")
    merged: Literal["auto"] | int = setting("auto", "kernel: lights left in each zone.", words=("auto",))
    distance_weight: Weight = setting("auto", "merge: weight of distance between lights, 1/m.", words=("auto",))
    response_weight: Weight = setting("auto", "merge: weight of difference between lights, one over the unit of light.", words=("auto",))
    smooth: bool = setting(True, "Take the noise of few samples out of the components.")
    encoding: Encoding = setting("uint8", "Of the layers on disk.")
    visibility: str = setting("none", VISIBILITY_HELP)
    receiver_visibility: bool = setting(False, RECEIVER_VISIBILITY_HELP)
    seed: int = 0

    def __post_init__(self) -> None:
        check_table_settings(self.components, self.clusters, self.encoding)
        check_visibility(self.visibility, self.receiver_visibility)
        if self.interpolation not in get_args(Interpolation):
            raise InputError(f"expected an interpolation of auto, fingerprint, kernel, found {self.interpolation!r}")
        if self.merge not in ("none", *get_args(Mean)):
            raise InputError(f"expected `merge` none, harmonic or arithmetic, found {self.merge!r}")
        if self.nearest < 1 or self.zones < 1:
            raise InputError(f"expected 1 or more `nearest` lights and `zones`, found {self.nearest} and {self.zones}")
        if self.merged != "auto" and not self.merged >= 1:
            raise InputError(f"expected `merged` auto or 1 or more lights, found {self.merged}")
        if self.mean_components != "auto" and not 0 <= self.mean_components <= self.components:
            raise InputError(f"expected `mean_components` auto or 0 to {self.components} `components`, found {self.mean_components}")
        for name in ("distance_weight", "response_weight"):
            weight = getattr(self, name)
            if weight != "auto" and not (0 <= weight < np.inf and self.merge != "none"):
                raise InputError(f"expected `{name}` auto, or 0 or more with `merge`, found {weight}")
        if self.interpolation == "kernel" and self.visibility != "none":
            raise InputError(
                "expected `visibility=none` with `interpolation=kernel`, which needs rays between lights, found another; leave it out"
            )
        if self.interpolation != "kernel" and (self.zones > 1 or self.merge != "none"):
            raise InputError("expected `zones` and `merge` with `interpolation=kernel`, found another; add it")

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Clusters from a texel sample, made for lights all over the free space; passes to assign, project and solve; a table of places.

        Parameters
        ----------
        capture
            Of patches, or of a cloud of point lights.
        run
            `stitch` closes the seams of the images.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where there are no train lights, or the capture lacks its scene.

        Examples
        --------
        >>> LightCloud().encode(inside).manifest["interpolation"]["kind"]  # doctest: +SKIP
        'patches'
        """
        inside = CloudLights.of(capture)
        train = capture.indices("train")
        kind: str = "patches"
        report: dict[str, Any] = {}
        if capture.kind == "patch":
            mixtures = inside.received(inside.free[:VIRTUAL_LIGHTS])
            asset = encode_table(self, capture, run, mixtures, self.clusters, self.seed)
        else:
            kernel = CloudKernel(capture.positions(train), inside.visible, self.nearest)
            unseen = unseen_lights(capture, inside, self.seed) if self.interpolation != "kernel" else None
            wanted = "fingerprint" if self.visibility != "none" else self.interpolation
            kind, report = chosen_interpolation(wanted, unseen, kernel)
            mixtures = np.eye(len(train))
            if kind == "fingerprint" and unseen is not None:  # sums of captured lights have less noise than single ones
                mixtures = unseen.prints.weights(inside.received(inside.free[:VIRTUAL_LIGHTS]))
            asset = encode_table(self, capture, run, mixtures, self.clusters, self.seed, self.zones, _captured_columns)
            if kind == "fingerprint":
                assert unseen is not None
                found = asset.tables["light_values"].astype(np.float32) * np.float32(asset.manifest["light_values"]["scale"])
                asset.tables["light_values"], entry = stored_values(unseen.prints.on_patches(found))
                asset.manifest |= entry
            else:
                metric = (self.distance_weight, self.response_weight)
                table = kernel_table(capture, asset, kernel, self.merge, self.merged, inside.visible, metric)
                asset.tables["light_values"], entry = stored_values(table.values)
                asset.tables["cloud"] = table.image()
                asset.manifest |= {**entry, "cloud": {"file": self.tables["cloud"]}}
                report |= table.report()
        asset.manifest["interpolation"] = {"kind": kind, **({"nearest": self.nearest} if kind == "kernel" else {})}
        asset.manifest["source"]["fit"] |= report
        self.add_places(asset, inside)
        self.add_visibility(asset, inside)
        return asset

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[LightCloud]:
        """Bytes, four to a layer, and one for the cluster."""
        components = min((size - 1) // 4 * 4, MOST_TRIED, numbers)
        for clusters in TRIED_CLUSTERS:
            if components >= 1 and (clusters * LEAST_TEXELS <= texels or clusters == TRIED_CLUSTERS[0]):
                yield cls(clusters=clusters, components=components)

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        tables = super().read_tables(reader)
        if "cloud" in reader.manifest:
            tables["cloud"] = reader.rows("cloud", max(reader.manifest["cluster_zone"]) + 1, 4)
        return tables

    @classmethod
    def column_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "N 3"]:
        """Of patches: the irradiance that all lights lay on them."""
        on_patches = light_on_patches(asset)
        return np.sum([on_patches(light) for light in lights], axis=0)

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        if asset.manifest["interpolation"]["kind"] != "kernel" or not lights or not has_embree():
            return super().projected_weights(asset, lights)
        points = [isotropic(light) for light in lights]
        found = KernelTable.of(asset).weights(np.array([point.position for point in points]), CloudLights.of_asset(asset).visible)
        return np.einsum("nfc,nc->fc", found, np.array([np.array(point.color) * point.a0**2 for point in points]))

    @classmethod
    def faded(cls, asset: Asset, seconds: float) -> Moving:
        if asset.manifest["interpolation"]["kind"] != "kernel":
            return super().faded(asset, seconds)
        fades = FadedLights(KernelTable.of(asset), CloudLights.of_asset(asset).visible, seconds)
        return lambda lights, dt: cls.weighted(asset, fades.step([isotropic(light) for light in lights], dt)[None])[0]

    @classmethod
    def at_places(cls, asset: Asset, places: Float64[ndarray, "b 3"]) -> Float64[ndarray, "b F 3"]:
        if asset.manifest["interpolation"]["kind"] == "kernel" and has_embree():
            return KernelTable.of(asset).weights(places, CloudLights.of_asset(asset).visible)
        return super().at_places(asset, places)

    @classmethod
    def summary(cls, asset: Asset) -> str:
        lights, kind = asset.tables["light_values"].shape[1], asset.manifest["interpolation"]["kind"]
        what = {"patches": "patches", "fingerprint": "patches (from captured point lights)", "kernel": "point lights"}[kind]
        return f"{lights} {what}, {asset.clusters} clusters of {asset.components} components"


def _captured_columns(asset: Asset, capture: Capture, lights: Sequence[int]) -> Float32[ndarray, "b H W 3"]:
    """Responses to captured point lights while these are still the columns of the table."""
    train = capture.indices("train")
    return LightCloud.columns(asset, [train.index(i) for i in lights])


METHOD = LightCloud
