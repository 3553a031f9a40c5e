"""Stitching of UV seams: least squares over points of their edges makes texels on both sides agree [Sylvan2015]."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Float64, Int
from srbf.capture import Capture
from srbf.compute.threads import each
from srbf.encode.dilation import nearest_covered

# Measured on a torus in four charts and a square in two: these weights leave a fiftieth of a gap or less, change covered texels beside a
# seam by a tenth of it, and overshoot the maps' range in the gutter by a tenth. A hundred times larger HOLD moves the gutter alone, which
# then overshoots by a third; a tenth of it changes covered texels by a third of the gap.
HOLD = 0.1  # weight of a covered texel's old value against the difference at one sample
FREE = 1e-3  # the same for a texel outside the receiver, which only filtering at a chart's edge reads

LIGHT_BATCH = 16


@dataclass(frozen=True, eq=False)
class Stitch:
    """The change of maps that makes both sides of every seam agree under a bilinear filter.

    min over x of |D x|^2 + sum_i h_i (x_i - x0_i)^2, row s of D the bilinear weights of sample s on one side minus those on the other

    x are the texels that a sample touches, `texels` (n,), in every map and channel: the minimum is linear in x0, and so commutes
    with any sum of maps. h is HOLD on covered texels, FREE on the rest, so the matrix D^T D + diag(h) is symmetric and positive; it
    is factored once, about n log n work since seams are lines, and solved for all maps together.
    """

    texels: Int[ndarray, " n"]
    sources: Int[ndarray, " n"]  # the covered texels that dilation fills them from
    differences: Any  # D, a csr_array of (S, n)
    factor: Any  # SuperLU of D^T D + diag(h)
    edges: int

    @property
    def samples(self) -> int:
        """Number of points at which the two sides are compared."""
        return int(self.differences.shape[0])

    @staticmethod
    def of(capture: Capture, hold: float = HOLD) -> Stitch | None:
        """The stitch of a capture's seams; None without seams."""
        edges = capture.seam_edges()
        return None if edges is None or len(edges) == 0 else Stitch.along(edges, capture.coverage() > 0, hold)

    @staticmethod
    def along(edges: Float32[ndarray, "E 8"], covered: Bool[ndarray, "H W"], hold: float = HOLD) -> Stitch:
        """The stitch of given edges (u0 v0 u1 v1, v up, of one side, then of the other), about one sample per texel."""
        from scipy.sparse import csr_array, diags_array
        from scipy.sparse.linalg import splu

        height, width = covered.shape
        left, right = edge_points(edges, width, height)
        places, weights = zip(bilinear(left, width, height), bilinear(right, width, height), strict=True)
        texels, columns = np.unique(np.concatenate(places, axis=1), return_inverse=True)
        rows = np.repeat(np.arange(len(left)), 8)
        values = np.concatenate([weights[0], -weights[1]], axis=1)
        differences = csr_array((values.ravel(), (rows, columns.ravel())), shape=(len(left), len(texels)))
        held = np.where(covered.ravel()[texels], hold, FREE)
        normal = (differences.T @ differences + diags_array(held)).tocsc()
        factor = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        nearest = nearest_covered(covered.astype(np.float32))
        sources = texels if nearest is None else nearest.ravel()[texels]
        return Stitch(texels, sources, differences, factor, len(edges))

    def change(self, values: Float[ndarray, "n M"]) -> Float64[ndarray, "n M"]:
        """The change to add to `values` of `texels`, for each column separately."""
        pull = self.differences.T @ (self.differences @ values.astype(np.float64))
        return -self.factor.solve(np.ascontiguousarray(pull))

    def apply(self, maps: Float32[ndarray, "N H W C"]) -> None:
        """Stitch dilated maps in place. Each thread copies `texels` of one map as float64."""
        flat = maps.reshape(len(maps), -1, maps.shape[3])

        def stitch(i: int) -> None:
            flat[i, self.texels] += self.change(flat[i, self.texels]).astype(np.float32)

        each(stitch, len(maps))

    def blocks(self, capture: Capture, lights: Sequence[int]) -> Iterator[tuple[int, Float32[ndarray, "b n 3"]]]:
        """A capture's responses of `texels`, dilated and stitched, in blocks of lights: (position of the first, (b, n, 3))."""
        for first in range(0, len(lights), LIGHT_BATCH):
            responses = capture.sample(lights[first : first + LIGHT_BATCH], self.sources)
            flat = responses.reshape(len(responses), -1)
            responses += self.change(flat).astype(np.float32).reshape(responses.shape)
            yield first, np.ascontiguousarray(responses.transpose(1, 0, 2))

    def difference(self, values: Float[ndarray, "n M"]) -> float:
        """Root mean square difference between the two sides of all seams, over samples and columns, of `values` of `texels`."""
        return float(np.sqrt(np.square(self.differences @ values.astype(np.float64)).mean()))


def edge_points(edges: Float32[ndarray, "E 8"], width: int, height: int) -> tuple[Float64[ndarray, "S 2"], Float64[ndarray, "S 2"]]:
    """(left, right) points (column, row), in texels from the first one's center: the same positions on both sides, about one per texel."""
    ends = edges.reshape(-1, 2, 2, 2).astype(np.float64)  # side, vertex, (u, v)
    ends = np.stack([ends[..., 0] * width - 0.5, (1 - ends[..., 1]) * height - 0.5], axis=-1)
    lengths = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1).max(axis=1)
    counts = np.maximum(np.ceil(lengths), 1).astype(np.int64)
    edge = np.repeat(np.arange(len(ends)), counts)
    place = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    along = ((place + 0.5) / counts[edge])[:, None]
    left, right = (ends[edge, side, 0] * (1 - along) + ends[edge, side, 1] * along for side in (0, 1))
    return left, right


def bilinear(points: Float64[ndarray, "S 2"], width: int, height: int) -> tuple[Int[ndarray, "S 4"], Float64[ndarray, "S 4"]]:
    """(flat texels, weights) of a bilinear filter at (column, row) points, clamped at the image's border."""
    base = np.floor(points).astype(np.int64)
    part = points - base
    columns = np.clip(base[:, :1] + [0, 1], 0, width - 1)
    rows = np.clip(base[:, 1:] + [0, 1], 0, height - 1)
    across = np.concatenate([1 - part[:, :1], part[:, :1]], axis=1)
    down = np.concatenate([1 - part[:, 1:], part[:, 1:]], axis=1)
    texels = rows[:, :, None] * width + columns[:, None, :]
    weights = down[:, :, None] * across[:, None, :]
    return texels.reshape(-1, 4), weights.reshape(-1, 4)
