"""The light cloud on glossy surfaces: lights that move inside the scene, and light that changes with the viewer [Kristensen2005]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, get_args

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.asset_reader import AssetReader
from srbf.basis.exitant_harmonics import harmonics, lifted
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.io.image import Encoding
from srbf.light_domain.cloud import isotropic
from srbf.light_domain.cloud_kernel import NEAREST, CloudKernel, all_visible
from srbf.lights import Light, PointLight
from srbf.methods.component_maps import check_layers, read_cluster_index
from srbf.methods.light_table_maps import LightTableMaps, check_table_settings, encode_table, stored_values
from srbf.methods.protocol import QUIET, FitRun, setting
from srbf.sphere import fibonacci
from srbf.visibility.cloud_lights import CloudLights, Interpolation, chosen_interpolation, unseen_lights

MOST_COLUMNS = 768  # harmonics of lights that are compared one by one; of more, so many random mixtures are
JUDGES = 8  # viewers by which ways of interpolation are compared


@dataclass(frozen=True)
class GlossyCloud(LightTableMaps):
    """Radiance toward any viewer of lights inside the scene [Kristensen2005, sections 3, 5 and 6.2].

    L(p, v, x) ~ sum_i f_i(x) y(v) . X_i(p),  X_i(p) ~ w_{m,0}(i) + sum_j a_j(p) w_{m,j}(i), m the cluster of p

    X_i(p) are the K spherical harmonics of the radiance that leaves p under the captured light i, so w are K numbers and color. A frame's
    lights become one weight per function, harmonic and color; a receiver's products give K coefficients, and their sum with the harmonics
    of the viewer's direction is its radiance.

    Parameters
    ----------
    clusters
        1 to 256: the index per texel is one byte.
    components
        How many numbers per texel.
    interpolation
        Between captured lights; `auto`: the one that predicts left-out lights better, `kernel` for combined transport.
    nearest
        kernel: how many captured lights carry a light.
    smooth
        Average components over neighbors on the surface that differ by no more than the capture's noise.
    encoding
        Of the layers on disk: `half`, `float` or `uint8`.
    seed
        Of the clustering's random numbers.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> GlossyCloud(clusters=32).components
    16
    """

    name: ClassVar[str] = "glossy-cloud"
    order: ClassVar[int] = 7
    domains: ClassVar[tuple[str, ...]] = ("cloud",)
    receivers: ClassVar[tuple[str, ...]] = ("lightmap", "vertices")
    has_shader: ClassVar[bool] = False
    on_page: ClassVar[bool] = False
    tables: ClassVar[dict[str, str]] = {
        **LightTableMaps.tables,
        "cells": "cells.exr",
        "cloud": "cloud.exr",
        "fingerprints": "fingerprints.exr",
    }

    clusters: int = setting(40, "How many clusters, at most 256.")
    components: int = setting(16, "How many numbers per texel.")
    interpolation: Interpolation = setting("auto", "Between captured point lights; auto: what predicts left-out lights better.")
    nearest: int = setting(NEAREST, "kernel: captured lights that carry a light.")
    smooth: bool = setting(True, "Take the noise of few samples out of the components.")
    encoding: Encoding = setting("uint8", "Of the layers on disk.")
    seed: int = 0

    def __post_init__(self) -> None:
        check_table_settings(self.components, self.clusters, self.encoding)
        if self.interpolation not in get_args(Interpolation):
            raise InputError(f"expected an interpolation of auto, fingerprint, kernel, found {self.interpolation!r}")
        if self.nearest < 1:
            raise InputError(f"expected 1 or more `nearest` lights, found {self.nearest}")

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Clusters and components of all harmonics of all lights, then what carries a light between the captured ones.

        Parameters
        ----------
        capture
            Of a cloud of point lights, with harmonics.
        run
            `stitch` closes the seams of the images.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where the capture has no harmonics or no normals.

        Examples
        --------
        >>> GlossyCloud().encode(inside).manifest["harmonics"]["order"]  # doctest: +SKIP
        3
        """
        if capture.gloss is None:
            raise InputError(f"expected harmonics of the viewer's direction in {capture.folder}, found none; bake with `gloss=3`")
        if capture.geometry("normal") is None:
            raise InputError(f"expected normals of the receivers in {capture.folder}, found none; bake again")
        train, count = capture.indices("train"), (capture.gloss + 1) ** 2
        for _ in capture.stream(train, run.on_image):
            pass  # the images as seen from above, for whoever watches
        columns = len(train) * count
        mixtures = np.eye(columns)
        if columns > MOST_COLUMNS:
            mixtures = np.random.default_rng(self.seed).standard_normal((MOST_COLUMNS, columns)) / np.sqrt(MOST_COLUMNS)
        quiet = replace(run, on_image=QUIET.on_image)
        asset = encode_table(self, capture.of_harmonics(), quiet, mixtures, self.clusters, self.seed, respond=self._of_columns)
        found = asset.tables["light_values"].astype(np.float32) * np.float32(asset.manifest["light_values"]["scale"])
        rows = found.reshape(len(found), len(train), count, 3).transpose(0, 2, 1, 3).reshape(-1, len(train), 3)
        asset.tables["light_values"], entry = stored_values(rows)
        asset.manifest |= {**entry, "harmonics": {"order": capture.gloss}}
        self._add_interpolation(asset, capture)
        asset.manifest["source"]["fit"]["train_lights"] = len(train)
        return asset

    def _add_interpolation(self, asset: Asset, capture: Capture) -> None:
        """The tables that carry a light between the captured ones."""
        train = capture.indices("train")
        inside = CloudLights.of(capture) if asset.scene is not None else None
        if inside is None and self.interpolation == "fingerprint":
            raise InputError("expected a capture of indirect transport for `interpolation=fingerprint`, found combined; use kernel")
        kernel = CloudKernel(capture.positions(train), all_visible if inside is None else inside.visible, self.nearest)
        unseen = None
        if inside is not None and self.interpolation != "kernel":
            tested = [*train, *capture.indices("validation")]
            unseen = unseen_lights(capture, inside, self.seed, lambda texels: _rows(capture, tested, texels))
        kind, report = chosen_interpolation(self.interpolation, unseen, kernel)
        asset.manifest["interpolation"] = {"kind": kind, **({"nearest": self.nearest} if kind == "kernel" else {})}
        asset.manifest["source"]["fit"] |= report
        if inside is not None:
            asset.tables["cells"] = inside.cells.image()
            asset.manifest["cells"] = {"file": self.tables["cells"]}
        if kind == "kernel":
            asset.tables["cloud"] = np.concatenate([kernel.places, np.ones((len(train), 1))], axis=1, dtype=np.float32)[None]
            asset.manifest["cloud"] = {"file": self.tables["cloud"]}
        else:
            assert unseen is not None
            shares = unseen.prints.weights(np.eye(unseen.prints.received.shape[1]))  # (patches, L)
            asset.tables["fingerprints"] = shares.astype(np.float32)
            asset.manifest["fingerprints"] = {"file": self.tables["fingerprints"], "patches": len(shares)}

    @classmethod
    def is_made_for(cls, capture: Capture) -> bool:
        return capture.gloss is not None

    def caution(self, capture: Capture) -> str | None:
        if capture.transport == "indirect":
            return None
        return "this capture has no scene: captured lights carry a light through walls too; bake `transport=indirect` where there are any"

    @classmethod
    def read_tables(cls, reader: AssetReader) -> dict[str, ndarray]:
        manifest = reader.manifest
        lights, terms = int(manifest["light_values"]["lights"]), (manifest["harmonics"]["order"] + 1) ** 2
        tables = {"light_values": reader.table("light_values", (check_layers(reader) * terms, lights), 3).astype(np.float16)}
        if "cluster_index" in manifest:
            tables["cluster_index"] = read_cluster_index(reader)
        if "cells" in manifest:
            tables["cells"] = reader.rows("cells", 2, 4)
        if "cloud" in manifest:
            tables["cloud"] = reader.table("cloud", (1, lights), 4)
        if "fingerprints" in manifest:
            tables["fingerprints"] = reader.table("fingerprints", (manifest["fingerprints"]["patches"], lights), 1)[:, :, 0]
        return tables

    @classmethod
    def column_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "N 3"]:
        """How much of each captured light all lights together take."""
        if "fingerprints" in asset.tables:
            received = np.sum([CloudLights.of_asset(asset).on_patches(light) for light in lights], axis=0)
            return asset.tables["fingerprints"].T.astype(np.float64) @ received
        places = asset.tables["cloud"][0, :, :3].astype(np.float64)
        visible = all_visible if asset.scene is None else CloudLights.of_asset(asset).visible
        kernel = CloudKernel(places, visible, int(asset.manifest["interpolation"]["nearest"]))
        points = [isotropic(light) for light in lights]
        weights = kernel.weights(np.array([light.position for light in points])).dense(len(places))
        return weights.T @ np.array([np.array(light.color) * light.a0**2 for light in points])

    @classmethod
    def projected_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
        """The kernel takes few of the captured lights: only theirs are added up."""
        values = asset.tables["light_values"]
        if not lights:
            return np.zeros((len(values), 3))
        columns = cls.column_weights(asset, lights) * asset.manifest["light_values"]["scale"]
        used = np.flatnonzero(columns.any(axis=1))
        own = values[:, used].astype(np.float32)
        return np.stack([own[..., c] @ columns[used, c].astype(np.float32) for c in range(3)], axis=1).astype(np.float64)

    @classmethod
    def harmonics_of(cls, asset: Asset, weights: Float64[ndarray, "F 3"]) -> Float32[ndarray, "K H W 3"]:
        """Coefficients of the radiance that leaves every receiver, from a frame's `projected_weights`."""
        return super().weighted(asset, np.ascontiguousarray(weights.reshape(-1, _terms(asset), 3).transpose(1, 0, 2)))

    @classmethod
    def toward(cls, asset: Asset, weights: Float64[ndarray, "F 3"], viewers: ndarray) -> Float32[ndarray, "H W 3"]:
        """Radiance toward unit directions (H, W, 3), those too low raised as a bake does."""
        seen = harmonics(lifted(viewers, asset.images["normal"]), asset.manifest["harmonics"]["order"]).astype(np.float32)
        return np.einsum("khwc,hwk->hwc", cls.harmonics_of(asset, weights), seen)

    @classmethod
    def weighted(cls, asset: Asset, weights: Float64[ndarray, "b F 3"]) -> Float32[ndarray, "b H W 3"]:
        """As seen from straight above every receiver."""
        return np.stack([cls.toward(asset, one, asset.images["normal"]) for one in weights])

    @classmethod
    def radiance_to(cls, asset: Asset, lights: Sequence[Light], viewer: tuple[float, float, float]) -> Float32[ndarray, "H W 3"]:
        if "position" not in asset.images:
            raise InputError("expected positions of the receivers in the asset for `viewer`, found none; fit again")
        ways = np.asarray(viewer, np.float64) - asset.images["position"]
        ways /= np.maximum(np.linalg.norm(ways, axis=2, keepdims=True), 1e-12)
        return cls.toward(asset, cls.projected_weights(asset, lights), ways)

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b 3"]) -> Float32[ndarray, "b H W 3"]:
        lights = [PointLight((x, y, z), falloff="inverse-square") for x, y, z in coordinates.tolist()]
        return cls.weighted(asset, np.stack([cls.projected_weights(asset, [light]) for light in lights]))

    @classmethod
    def _of_columns(cls, asset: Asset, capture: Capture, lights: Sequence[int]) -> Float32[ndarray, "b H W 3"]:
        """Single harmonics of captured lights, while the table has a column of each."""
        values = asset.tables["light_values"][:, list(lights)].astype(np.float64) * asset.manifest["light_values"]["scale"]
        return super().weighted(asset, values.transpose(1, 0, 2))

    @classmethod
    def describe(cls, asset: Asset) -> Mapping[str, Any]:
        return {**super().describe(asset), "harmonics": _terms(asset)}

    @classmethod
    def summary(cls, asset: Asset) -> str:
        lights = asset.tables["light_values"].shape[1]
        return f"{lights} point lights, {_terms(asset)} harmonics of the viewer, {asset.clusters} clusters of {asset.components} components"


def _terms(asset: Asset) -> int:
    return int((asset.manifest["harmonics"]["order"] + 1) ** 2)


def _rows(capture: Capture, lights: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L M"]:
    """What receivers show toward JUDGES viewers above them, colors one after the other: coefficients have more noise than light has."""
    normals = capture.geometry("normal")
    assert normals is not None and capture.gloss is not None
    terms = (capture.gloss + 1) ** 2
    found = capture.of_harmonics().sample([light * terms + k for light in lights for k in range(terms)], texels)
    facing = np.broadcast_to(normals.reshape(-1, 1, 3)[texels], (len(texels), JUDGES, 3))
    seen = harmonics(lifted(np.broadcast_to(fibonacci(JUDGES), facing.shape), facing), capture.gloss).astype(np.float32)
    shown = seen[:, None] @ found.reshape(len(texels), len(lights), terms, 3)
    return shown.reshape(len(texels), len(lights), -1)


METHOD = GlossyCloud
