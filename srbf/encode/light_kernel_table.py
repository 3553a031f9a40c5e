"""The article's interpolation as an asset keeps it: captured lights of each zone, merged where they are similar, and their functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.light_domain.cloud_kernel import CloudKernel, Visible
from srbf.lights import PointLight
from srbf.solve.light_merging import Mean, largest_differences, merge_tree, merged, metric_weights

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

    def weights(self, light: PointLight, visible: Visible) -> Float64[ndarray, "F 3"]:
        """Weights of all functions for an isotropic point light."""
        total = np.zeros((len(self.zones), 3))
        for zone, count in enumerate(self.counts):
            kernel = CloudKernel(self.places[zone, :count], visible, self.nearest)
            found = kernel.weights(np.array([light.position])).dense(int(count))[0]
            rows = self.zones == zone
            total[rows] = np.einsum("fnc,n->fc", self.values[rows, :count].astype(np.float64), found)
        return total * self.scale * light.a0**2 * np.array(light.color)


def kernel_table(
    capture: Capture, asset: Asset, kernel: CloudKernel, merge: Literal["none"] | Mean, count: int | Literal["auto"], visible: Visible
) -> KernelTable:
    """The table of a fitted asset, whose columns are the captured lights; `merge` makes fewer of them in each zone.

    The arithmetic mean is that of the columns; for the harmonic one the receivers' responses are merged and solved for again.
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
        tree = merge_tree(kernel.places, apart, sees, *(2 * w for w in metric_weights(kernel.places, apart)))
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
