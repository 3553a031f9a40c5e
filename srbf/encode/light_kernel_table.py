"""The article's interpolation as an asset keeps it: captured lights of each zone, merged where they are similar, and their functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.light_domain.cloud_kernel import CloudKernel, Fade, Visible
from srbf.lights import PointLight
from srbf.solve.light_merging import Mean, largest_differences, merge_tree, merged, metric_weights

Weight = Literal["auto"] | float

SAMPLE_TEXELS = 2048  # of a zone, by which lights are compared


@dataclass(frozen=True, eq=False)
class KernelTable:
    """Functions (F, N, 3) at the lights of each function's zone, whose places are `places` (Z, N, 3), the first `counts` (Z,) of them.

    `zones` (F,): the zone of every function. `nearest`: as of `CloudKernel`.
    """

    values: ndarray
    places: Float64[ndarray, "Z N 3"]
    counts: Int[ndarray, " Z"]
    zones: Int[ndarray, " F"]
    nearest: int
    scale: float = 1.0

    @staticmethod
    def of(asset: Asset) -> KernelTable:
        """From an asset's tables."""
        image = asset.tables["cloud"]  # (Z, N, 4): place, 1 where there is a light
        zones = np.repeat(np.array(asset.manifest["cluster_zone"], np.int64), asset.components + 1)
        counts = (image[:, :, 3] > 0).sum(axis=1)
        scale = float(asset.manifest["light_values"]["scale"])
        nearest = int(asset.manifest["interpolation"]["nearest"])
        return KernelTable(asset.tables["light_values"], image[:, :, :3].astype(np.float64), counts, zones, nearest, scale)

    def image(self) -> Float32[ndarray, "Z N 4"]:
        """Places as the asset keeps them."""
        image = np.zeros((*self.places.shape[:2], 4), np.float32)
        image[:, :, :3] = self.places
        image[:, :, 3] = np.arange(self.places.shape[1]) < self.counts[:, None]
        return image

    def report(self) -> dict[str, Any]:
        """For `source.fit`."""
        return {"merged_lights": self.counts.tolist()}

    def kernels(self, visible: Visible) -> list[CloudKernel]:
        """The kernel of every zone."""
        return [CloudKernel(self.places[zone, :count], visible, self.nearest) for zone, count in enumerate(self.counts)]

    def weights(self, positions: Float64[ndarray, "n 3"], visible: Visible) -> Float64[ndarray, "n F 3"]:
        """Weights of all functions for each of n white isotropic point lights at `positions`, m."""
        return self.combined([kernel.weights(positions).dense(len(kernel.places)) for kernel in self.kernels(visible)])

    def combined(self, of_lights: Sequence[Float64[ndarray, "n N"]]) -> Float64[ndarray, "n F 3"]:
        """Weights of all functions from those of the captured lights, which each zone has for itself."""
        total = np.zeros((len(of_lights[0]), len(self.zones), 3))
        for zone, weights in enumerate(of_lights):
            rows = self.zones == zone
            values = self.values[rows, : self.counts[zone]].astype(np.float64)
            total[:, rows] = np.einsum("fkc,nk->nfc", values, weights, optimize=True)
        return total * self.scale


class FadedLights:
    """Weights of moving lights from frame to frame: captured lights that one begins or ceases to see fade over `seconds`, see `Fade`.

    A light is known by its place in the list; one that is new starts without a fade.
    """

    def __init__(self, table: KernelTable, visible: Visible, seconds: float) -> None:
        self.table, self.kernels, self.seconds = table, table.kernels(visible), seconds
        self.fades: list[list[Fade]] = []

    def step(self, lights: Sequence[PointLight], dt: float) -> Float64[ndarray, "F 3"]:
        """Weights of all functions for all lights together, `dt` seconds after the last step."""
        del self.fades[len(lights) :]
        total = np.zeros((len(self.table.zones), 3))
        for number, light in enumerate(lights):
            if number == len(self.fades):
                self.fades.append([Fade(kernel, self.seconds) for kernel in self.kernels])
            place = np.array(light.position)
            found = self.table.combined([fade.step(place, dt)[None] for fade in self.fades[number]])[0]
            total += found * (light.a0**2 * np.array(light.color))
        return total


def kernel_table(
    capture: Capture,
    asset: Asset,
    kernel: CloudKernel,
    merge: Literal["none"] | Mean,
    count: int | Literal["auto"],
    visible: Visible,
    metric: tuple[Weight, Weight] = ("auto", "auto"),
) -> KernelTable:
    """The table of a fitted asset, whose columns are the captured lights; `merge` makes fewer of them in each zone.

    `metric`: w1 (1/m) and w2 (one over the capture's unit) of equation 9 [Kristensen2005]; `auto` gives the largest distance and the
    largest difference one unit each. The arithmetic mean is that of the columns; for the harmonic one the receivers' responses are merged
    and solved for again.
    """
    values = asset.tables["light_values"].astype(np.float32) * np.float32(asset.manifest["light_values"]["scale"])
    cluster_zone = np.array(asset.manifest["cluster_zone"], np.int64)
    zones = np.repeat(cluster_zone, asset.components + 1)
    number = int(cluster_zone.max()) + 1
    places = np.repeat(kernel.places[None], number, axis=0)
    if merge == "none":
        return KernelTable(values, places, np.full(number, len(kernel.places)), zones, kernel.nearest)
    train = capture.indices("train")
    sees = np.ones((len(kernel.places),) * 2, bool)
    upper = np.triu_indices(len(kernel.places), 1)
    sees[upper] = visible(kernel.places[upper[0]], kernel.places[upper[1]])
    sees &= sees.T
    index = asset.tables["cluster_index"].ravel().astype(np.int64) if "cluster_index" in asset.tables else np.zeros(values.size, np.int64)
    covered = capture.coverage().ravel() >= COVERED
    groups = []
    for zone in range(number):
        texels = np.flatnonzero(covered & (cluster_zone[index[: len(covered)]] == zone))
        some = texels[:: max(1, len(texels) // SAMPLE_TEXELS)]
        apart = largest_differences(capture.sample(train, some))
        w1, w2 = (2 * own if given == "auto" else given for given, own in zip(metric, metric_weights(kernel.places, apart), strict=True))
        tree = merge_tree(kernel.places, apart, sees, w1, w2)
        groups.append(tree.groups() if count == "auto" else tree.into(count))
    counts = np.array([int(group.max()) + 1 for group in groups])
    result = np.zeros((len(values), int(counts.max()), 3), np.float32)
    own = np.zeros((number, int(counts.max()), 3))
    for zone, group in enumerate(groups):
        rows = np.flatnonzero(zones == zone)
        own[zone, : counts[zone]] = merged(kernel.places, group, "arithmetic")
        if merge == "arithmetic":
            result[rows, : counts[zone]] = merged(values[rows], group, "arithmetic")
    if merge == "harmonic":
        _solve_harmonic(values, asset, groups, cluster_zone, index, covered, result)
    return KernelTable(result, own, counts, zones, kernel.nearest)


def _solve_harmonic(
    values: Float32[ndarray, "F L 3"],
    asset: Asset,
    groups: list[Int[ndarray, " L"]],
    cluster_zone: Int[ndarray, " C"],
    index: Int[ndarray, " P"],
    covered: ndarray,
    result: Float32[ndarray, "F N 3"],
) -> None:
    """Least squares of each cluster's responses, merged by the harmonic mean, on its stored components.

    They are the asset's responses, not the captured ones: one sample that is 0 by chance would make the harmonic mean 0.
    """
    size = asset.components + 1
    planes = asset.coefficients().transpose(0, 3, 1, 2).reshape(-1, asset.height * asset.width)[: asset.components]
    for number, zone in enumerate(cluster_zone):
        texels = np.flatnonzero(covered & (index[: len(covered)] == number))
        if not len(texels):
            continue
        design = np.concatenate([np.ones((1, len(texels))), planes[:, texels].astype(np.float64)])
        fitted = np.einsum("sn,slc->nlc", design, values[number * size : (number + 1) * size].astype(np.float64), optimize=True)
        rows = merged(np.maximum(fitted, 0), groups[zone], "harmonic")  # (n, G, 3)
        solved = np.linalg.pinv(design @ design.T, rcond=1e-9, hermitian=True) @ (design @ rows.reshape(len(texels), -1))
        result[number * size : (number + 1) * size, : rows.shape[1]] = solved.reshape(size, -1, 3)
