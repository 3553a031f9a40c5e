"""Functions of a point light's place as a table on a grid of nodes, interpolated between the nodes that the light sees."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float16, Float32, Float64, Int
from srbf.encode.table_steps import steps_by_cluster

MOST_NODES = 2048
LEAST_SPACING = 0.2  # m
FINE = 4  # places per cell and axis at which it is known which corners are seen
MOST_RANK = 96
NODE_STEP = 2.0**-7  # of the rms of an axis
RANK_ERROR = 0.01  # of the nodes' values, rms
SEEN = 1e-4  # sum of weights below which a light sees no node
CORNERS = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])

Visible = Callable[[ndarray, ndarray], ndarray]  # (n, 3), (n, 3) -> (n,) bool: nothing stands between two places
Values = Callable[[ndarray], ndarray]  # (n, 3) places -> (n, F, 3)


@dataclass(frozen=True, eq=False)
class PositionTable:
    """F RGB functions at nodes `spacing` m apart from `origin`, nx x ny x nz of them, x fastest: `nodes` (N, R) times `basis` (R, F, 3).

    `seen` (fine places of the cells, 8) bytes: how much of each corner of its cell a light there sees, rows by z and y, columns by x and
    corner.
    """

    origin: Float64[ndarray, " 3"]
    spacing: float
    counts: tuple[int, int, int]
    nodes: Float32[ndarray, "N R"]
    basis: Float16[ndarray, "R F 3"]
    seen: ndarray

    def in_steps(self, clusters: int) -> PositionTable:
        """The same with values as even steps, which files pack well."""
        basis = steps_by_cluster(self.basis.transpose(1, 0, 2), clusters).transpose(1, 0, 2)
        return replace(self, nodes=np.round(self.nodes / NODE_STEP) * np.float32(NODE_STEP), basis=np.ascontiguousarray(basis))

    def manifest(self) -> dict[str, Any]:
        """Its keys of asset.json."""
        return {
            "position_table": {
                "origin": self.origin.tolist(),
                "spacing": self.spacing,
                "nodes": list(self.counts),
                "fine": FINE,
                "rank": self.nodes.shape[1],
            },
            **{key: {"file": file} for key, file in FILES.items()},
        }

    def tables(self) -> dict[str, ndarray]:
        """Its tables of an asset."""
        return {"position_nodes": self.nodes, "position_basis": self.basis, "position_visibility": self.seen}

    @staticmethod
    def of(manifest: dict[str, Any], tables: dict[str, ndarray]) -> PositionTable:
        """From `manifest` and `tables`."""
        told = manifest["position_table"]
        nx, ny, nz = told["nodes"]
        names = ("position_nodes", "position_basis", "position_visibility")
        nodes, basis, seen = (tables[name] for name in names)
        return PositionTable(np.array(told["origin"], np.float64), float(told["spacing"]), (nx, ny, nz), nodes, basis, seen)

    def weights(self, place: Float64[ndarray, " 3"]) -> tuple[Int[ndarray, " 8"], Float64[ndarray, " 8"], bool]:
        """(nodes, their weights, whether the light sees any) at a place, m."""
        counts = np.array(self.counts)
        at = np.clip((place - self.origin) / self.spacing, 0, counts - 1)
        cell = np.minimum(at.astype(np.int64), counts - 2)
        part = at - cell
        corner = np.prod(np.where(CORNERS == 1, part, 1 - part), axis=1)
        fine = np.clip(at * FINE - 0.5, cell * FINE, cell * FINE + FINE - 1)  # of the light's own cell alone
        low = np.minimum(fine.astype(np.int64), cell * FINE + FINE - 2)
        between = fine - low
        seen = np.zeros(8)
        for offset in CORNERS:
            x, y, z = low + offset
            amount = np.prod(np.where(offset == 1, between, 1 - between))
            row = z * FINE * (counts[1] - 1) + y
            seen += amount * self.seen[row, x * 8 : x * 8 + 8] / 255.0
        weight = corner * seen
        total = weight.sum()
        inside = bool(total >= SEEN)
        weight = weight / total if inside else corner
        x, y, z = (cell + CORNERS).T
        return (z * counts[1] + y) * counts[0] + x, weight, inside

    def evaluate(self, place: Float64[ndarray, " 3"]) -> Float64[ndarray, "F 3"]:
        """The functions at a place, m."""
        nodes, weight, _ = self.weights(place)
        return np.einsum("r,rfc->fc", weight @ self.nodes[nodes], self.basis.astype(np.float64))


FILES = {
    "position_nodes": "position_nodes.exr",
    "position_basis": "position_basis.exr",
    "position_visibility": "position_visibility.png",
}


def position_table(values: Values, visible: Visible, free: Float64[ndarray, "n 3"]) -> PositionTable:
    """A table of `values` over the box of the free places. Nodes that no free place sees are in no corner's weight.

    The spacing is as fine as MOST_NODES allow, at least LEAST_SPACING. The nodes' values are stored by their leading axes, up to an error
    of RANK_ERROR.
    """
    low, high = free.min(axis=0), free.max(axis=0)
    extent = np.maximum(high - low, 1e-3)
    spacing = max(LEAST_SPACING, float(np.cbrt(extent.prod() / MOST_NODES)))
    while True:
        counts = np.maximum(np.ceil(extent / spacing).astype(np.int64) + 1, 2)
        if counts.prod() <= MOST_NODES:
            break
        spacing *= 1.05
    origin = (low + high) / 2 - spacing * (counts - 1) / 2
    z, y, x = np.meshgrid(*(np.arange(n) for n in counts[::-1]), indexing="ij")
    nodes = origin + spacing * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    from scipy.spatial import cKDTree

    _, near = cKDTree(free).query(nodes, min(8, len(free)))
    near = near.reshape(len(nodes), -1)
    usable = np.zeros(len(nodes), bool)
    for column in near.T:  # a node inside geometry or outside the rooms sees none of the free places nearest to it
        usable |= visible(nodes, free[column])
    seen = _seen(nodes, usable, origin, spacing, counts, visible)
    whole = values(nodes[usable])
    shape = whole.shape[1:]
    flat = whole.reshape(len(whole), -1).astype(np.float64)
    gram = flat @ flat.T
    energy, vectors = np.linalg.eigh(gram)
    energy, vectors = np.maximum(energy[::-1], 0), vectors[:, ::-1]
    left = 1 - np.cumsum(energy) / max(float(energy.sum()), 1e-30)
    rank = min(MOST_RANK, int(np.searchsorted(-left, -(RANK_ERROR**2))) + 1, len(energy))
    found = np.zeros((len(nodes), rank), np.float32)
    axes = vectors[:, :rank] * np.sqrt(len(whole))  # of unit variance: the basis carries the units
    found[usable] = axes
    basis = (axes.T @ flat / len(whole)).reshape(rank, *shape)
    return PositionTable(origin, spacing, (int(counts[0]), int(counts[1]), int(counts[2])), found, basis.astype(np.float16), seen)


def _seen(
    nodes: Float64[ndarray, "N 3"],
    usable: Bool[ndarray, " N"],
    origin: Float64[ndarray, " 3"],
    spacing: float,
    counts: Int[ndarray, " 3"],
    visible: Visible,
) -> ndarray:
    """Which usable corners of its cell each fine place sees, 255 or 0."""
    fine = (counts - 1) * FINE
    z, y, x = np.meshgrid(*(np.arange(n) for n in fine[::-1]), indexing="ij")
    at = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    place = origin + spacing * (at + 0.5) / FINE
    cell = at // FINE
    seen = np.zeros((len(at), 8), np.uint8)
    for c, offset in enumerate(CORNERS):
        i, j, k = (cell + offset).T
        node = (k * counts[1] + j) * counts[0] + i
        chosen = np.flatnonzero(usable[node])
        seen[chosen, c] = 255 * visible(place[chosen], nodes[node[chosen]])
    return seen.reshape(int(fine[2] * fine[1]), int(fine[0] * 8))
