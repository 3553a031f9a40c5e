"""Light mixing: a scene's own lights, each by its name, in a few numbers per texel."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.io.image import Encoding
from srbf.light_domain import domain_of_asset
from srbf.lights import Light
from srbf.methods.light_table_maps import LightTableMaps, check_table_settings, encode_table
from srbf.methods.protocol import QUIET, FitRun, setting

TRIED_CLUSTERS = (1, 16, 64)
MOST_TRIED = 64  # components of a candidate
LEAST_TEXELS = 64  # per cluster of a candidate


@dataclass(frozen=True)
class LightMix(LightTableMaps):
    """The scene's own lights, dimmed, recolored and switched after the bake.

    T(p, l) ~ w_{m,0}(l) + sum_j a_j(p) w_{m,j}(l), l one of N named lights, m the cluster of p     [Kristensen2005, eq. 11]

    Clusters of texels and principal components of each, as of a clustered eigen map; the functions w are a table over the names, solved by
    least squares on the stored components. A picture is linear in the intensities, and no light leaves ambient.

    Parameters
    ----------
    clusters
        1 to 256: the index per texel is one byte; 1 needs none.
    components
        How many numbers per texel; at most three per light are kept.
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
    >>> LightMix(clusters=16, components=8).encoding
    'uint8'
    """

    name: ClassVar[str] = "light-mix"
    order: ClassVar[int] = 4
    domains: ClassVar[tuple[str, ...]] = ("named",)

    clusters: int = setting(64, "How many clusters, at most 256.")
    components: int = setting(12, "How many numbers per texel.")
    smooth: bool = setting(False, "Take the noise of few samples out of the components.")
    encoding: Encoding = setting("uint8", "Of the layers on disk.")
    seed: int = 0

    def __post_init__(self) -> None:
        check_table_settings(self.components, self.clusters, self.encoding)

    def encode(self, capture: Capture, run: FitRun = QUIET) -> Asset:
        """Clusters from a texel sample; a pass to assign every texel, one to project it, one to solve the table.

        Parameters
        ----------
        capture
            Under named lights.
        run
            `stitch` closes the seams of the images.

        Returns
        -------
        Asset
            In memory.

        Raises
        ------
        InputError
            Where there are no train lights, or two of one name.

        Examples
        --------
        >>> LightMix().encode(named).components  # doctest: +SKIP
        12
        """
        return encode_table(self, capture, run, mixes(len(capture.indices("train"))), self.clusters, self.seed)

    @classmethod
    def candidates(cls, size: int, texels: int, numbers: int) -> Iterable[LightMix]:
        """Bytes, four to a layer, and one for the cluster where there are several."""
        for clusters in TRIED_CLUSTERS:
            components = min((size - (clusters > 1)) // 4 * 4, MOST_TRIED, numbers)
            if components >= 1 and (clusters == 1 or clusters * LEAST_TEXELS <= texels):
                yield cls(clusters=clusters, components=components)

    @classmethod
    def column_weights(cls, asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "N 3"]:
        weights = np.zeros((asset.tables["light_values"].shape[1], 3))
        for coordinates, colors in domain_of_asset(asset.manifest).shared(lights):
            weights += coordinates.T @ colors
        return weights

    @classmethod
    def responses(cls, asset: Asset, coordinates: Float64[ndarray, "b N"]) -> Float32[ndarray, "b H W 3"]:
        values = asset.tables["light_values"].astype(np.float64) * asset.manifest["light_values"]["scale"]
        return cls.weighted(asset, np.einsum("fnc,bn->bfc", values, coordinates, optimize=True))

    @classmethod
    def summary(cls, asset: Asset) -> str:
        lights = asset.tables["light_values"].shape[1]
        return f"{lights} named lights, {asset.clusters} clusters of {asset.components} components"

    @classmethod
    def describe(cls, asset: Asset) -> dict[str, Any]:
        return {**super().describe(asset), "names": [entry["name"] for entry in asset.manifest["lights"]]}


def mixes(lights: int) -> Float64[ndarray, "L L"]:
    """Mixtures X of L lights whose squared errors add up to the mean one of random mixes, of intensities uniform in 0 to 2.

    X X = E[w w^T] = 1 1^T + I / 3: errors that add up when many lights are on count more than those of single lights.
    """
    single = 1 / np.sqrt(3)
    together = (np.sqrt(lights + 1 / 3) - single) / lights
    return single * np.eye(lights) + together * np.ones((lights, lights))


METHOD = LightMix
