"""Visibility of cluster borders: the error, and its jumps, across borders against the same beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.captured_light import Role
from srbf.errors import InputError
from srbf.light_domain import domain_of_capture
from srbf.methods import responses


@dataclass(frozen=True)
class ClusterBorders:
    """Root mean squares over the lights of one role, colors and pairs of neighboring covered texels; e = relit - reference, clamped at 0.

    border       share of the pairs whose texels belong to different clusters
    error        rms of e on both sides of a border, and on the texels of adjacent pairs within one cluster
    jump         rms of the change of e across a border, and across those adjacent pairs
    contrast     rms of the reference's change across a border, which masks a jump

    A border is visible if e jumps across it by more than it changes beside it. A `jump_ratio` near 1 means an invisible border.
    """

    border: float
    error_at_border: float
    error_beside: float
    jump_at_border: float
    jump_beside: float
    contrast_at_border: float

    @property
    def error_ratio(self) -> float:
        """Error at the borders over error beside them."""
        return self.error_at_border / max(self.error_beside, 1e-30)

    @property
    def jump_ratio(self) -> float:
        """Jump of the error across a border, over its change beside it."""
        return self.jump_at_border / max(self.jump_beside, 1e-30)


def cluster_borders(asset: Asset, capture: Capture, role: Role = "holdout", index: ndarray | None = None) -> ClusterBorders:
    """Errors at the borders of a clustered asset, or of any asset at the borders of `index`, another asset's `cluster_index` (H, W).

    InputError without clusters or without lights of the role.
    """
    clusters = asset.tables.get("cluster_index") if index is None else index
    if clusters is None:
        raise InputError(f"expected an asset with clusters, found {asset.method}")
    lights = capture.indices(role)
    if not lights:
        raise InputError(f"expected {role} lights in {capture.folder}, found none")
    covered = capture.coverage() >= COVERED
    pairs = [_masks(clusters, covered, axis) for axis in (0, 1)]
    coordinates = domain_of_capture(capture).captured(capture, lights)
    sums = np.zeros(5)
    for first, block in capture.blocks(lights):
        relit = np.maximum(responses(asset, coordinates[first : first + len(block)]), 0)
        true = np.maximum(block.reshape(relit.shape), 0)
        for error, reference in zip(relit - true, true, strict=True):
            for axis, (border, beside) in enumerate(pairs):
                sums += [
                    _ends(error, axis, border),
                    _ends(error, axis, beside),
                    _changes(error, axis, border),
                    _changes(error, axis, beside),
                    _changes(reference, axis, border),
                ]
    at, next_to = (sum(int(mask[k].sum()) for mask in pairs) for k in (0, 1))
    every = sum(int(_both(covered, axis).sum()) for axis in (0, 1))
    counts = 3 * len(lights) * np.maximum([2 * at, 2 * next_to, at, next_to, at], 1)
    return ClusterBorders(at / max(every, 1), *np.sqrt(sums / counts).tolist())


def _masks(clusters: ndarray, covered: Bool[ndarray, "H W"], axis: int) -> tuple[ndarray, ndarray]:
    """Masks of the pairs along an axis across a border, and of those within a cluster that share a texel with such a pair."""
    near, far = _sides(clusters, axis)
    both = _both(covered, axis)
    border = (near != far) & both
    beside = np.zeros_like(border)
    before, after = _sides(border, axis)
    _sides(beside, axis)[1][...] |= before
    _sides(beside, axis)[0][...] |= after
    return border, beside & ~border & both


def _sides(image: ndarray, axis: int) -> tuple[ndarray, ndarray]:
    return (image[:-1], image[1:]) if axis == 0 else (image[:, :-1], image[:, 1:])


def _both(covered: Bool[ndarray, "H W"], axis: int) -> ndarray:
    near, far = _sides(covered, axis)
    return near & far


def _ends(image: Float32[ndarray, "H W 3"], axis: int, mask: ndarray) -> float:
    return sum(float(np.square(side[mask], dtype=np.float64).sum()) for side in _sides(image, axis))


def _changes(image: Float32[ndarray, "H W 3"], axis: int, mask: ndarray) -> float:
    near, far = _sides(image, axis)
    return float(np.square(far[mask] - near[mask], dtype=np.float64).sum())
