"""Surfels in groups that measure light as one: those first whose light, or whose effect on the receivers, hardly differs.

A group has the mean of its light. Where two surfels a and b of areas A become one, the picture of a light e changes by

    |e_a - e_b| |r_a - r_b| A_a A_b / (A_a + A_b),

r what irradiance on a square meter of each adds to the picture, all bounces included. So walls that are lit evenly, and surfaces that
hardly show on the receivers, take few groups, while places close to lights keep theirs.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.visibility.surface_cells import Cells
from srbf.visibility.transfer_basis import TransferBasis, random_signs

LIGHT_SUMS, EFFECT_SUMS = 128, 64  # random ones, by which differences are known to 6 and 9 %
NEIGHBORS = 8
TRIES, SAFE = 4, 0.9  # at what costs make, since errors of neighbors add up where receivers see them together
COMPACT = 1e-2  # of the rms of light and effect: what differs by as much as the scene is large, or by its normal


@dataclass(frozen=True, eq=False)
class SurfelEffects:
    """Of S surfels: the light (S, k) that many lights lay on each, and what a square meter of it adds to pictures (S, m).

    Products of differences are shares of a picture, rms over the lights.
    """

    light: Float64[ndarray, "S k"]
    effect: Float64[ndarray, "S m"]

    @staticmethod
    def of(
        cells: Cells, irradiance: Float32[ndarray, "S V"], basis: TransferBasis, repainted: bool = False, seed: int = 0
    ) -> SurfelEffects:
        """By random sums over V lights, each of which counts as much, and over the shapes of `basis`, whose surfels these are.

        `repainted`: surfels of any albedo, so that dark ones stay apart as well.
        """
        rng = np.random.default_rng(seed)
        signs = random_signs(rng, basis.shapes.shape[1], EFFECT_SUMS) * basis.sizes[:, None]
        by_color = [np.ascontiguousarray(basis.transfer[:, :, c].T) @ signs for c in range(3)]
        effect = np.concatenate(by_color, axis=1) / np.float32(np.sqrt(3))  # (S, 192)
        pictures = np.linalg.norm(effect.T @ irradiance, axis=0)
        unit = np.sqrt(irradiance.shape[1]) * np.maximum(pictures, max(1e-6 * float(pictures.max(initial=0)), 1e-30))
        light = (irradiance / unit.astype(np.float32)) @ random_signs(rng, irradiance.shape[1], LIGHT_SUMS)
        if repainted:
            effect = np.concatenate([effect, basis.gather.T @ signs], axis=1)
        effect /= np.maximum(cells.areas, 1e-30)[:, None]
        extent = max(float(np.ptp(cells.places, axis=0).max(initial=0)), 1e-9)
        where = np.concatenate([cells.places / extent, cells.normals], axis=1)
        light, effect = (np.concatenate([own, COMPACT * _rms(own) * where], axis=1).astype(np.float64) for own in (light, effect))
        return SurfelEffects(light, effect)

    def groups(self, cells: Cells, owners: Int[ndarray, " S"], count: int, left_out: float = 0) -> Int[ndarray, " S"]:
        """The group of every surfel, 0 to at most `count` - 1, each of one owner; fewer while these leave out no more than `left_out`."""
        allowed = left_out
        for _ in range(TRIES):
            labels = self._merged(cells, owners, count, allowed)
            lost = self.lost(cells, labels) if left_out else 0.0
            if lost <= left_out or labels.max() + 1 == count:
                break
            allowed *= SAFE * left_out / lost
        return labels

    def lost(self, cells: Cells, labels: Int[ndarray, " S"]) -> float:
        """The share of a picture that groups leave out, rms over the lights."""
        weights = np.bincount(labels, cells.areas)[:, None]
        mean = np.stack([np.bincount(labels, cells.areas * own) for own in self.light.T], axis=1) / np.maximum(weights, 1e-30)
        return float(np.linalg.norm((self.effect * cells.areas[:, None]).T @ (mean[labels] - self.light)))

    def _merged(self, cells: Cells, owners: Int[ndarray, " S"], count: int, allowed: float) -> Int[ndarray, " S"]:
        """The cheapest pairs first, until there are at most `count` groups and their costs, as if independent, sum to `allowed`."""
        merging = _Merging(self, cells.areas)
        spent = 0.0
        while True:
            alive = np.flatnonzero(merging.alive)
            merging.offer(_neighbors(cells.places[alive], owners[alive], alive))
            merged = False
            while (found := merging.cheapest()) is not None:
                if merging.count <= count and not spent + found[0] ** 2 < allowed**2:
                    break
                spent += found[0] ** 2
                merging.join(found[1], found[2])
                merged = True
            if merging.count <= count or not merged:
                return np.unique(merging.roots(), return_inverse=True)[1].ravel()


class _Merging:
    """Groups of surfels, each told by the surfel that it began with, and pairs of them by what it costs to join these."""

    def __init__(self, effects: SurfelEffects, areas: Float32[ndarray, " S"]) -> None:
        self._light, self._effect = effects.light.copy(), effects.effect.copy()
        self._areas = np.maximum(areas.astype(np.float64), 1e-30)
        self._into = np.arange(len(areas))
        self._changes = np.zeros(len(areas), np.int64)
        self._beside: list[set[int]] = [set() for _ in areas]
        self._pairs: list[tuple[float, int, int, int, int]] = []
        self.alive = np.ones(len(areas), bool)
        self.count = len(areas)

    def offer(self, pairs: Int[ndarray, "n 2"]) -> None:
        """Pairs that may be joined."""
        for one, other in pairs.tolist():
            self._beside[one].add(other)
            self._beside[other].add(one)
        for one in np.unique(pairs[:, 0]).tolist():
            self._push(one, (other for other in self._beside[one] if other > one))

    def cheapest(self) -> tuple[float, int, int] | None:
        """(what it costs, the two groups), None where no pair is left."""
        while self._pairs:
            cost, one, other, *changes = self._pairs[0]
            if self.alive[one] and self.alive[other] and changes == [self._changes[one], self._changes[other]]:
                return cost, one, other
            heapq.heappop(self._pairs)
        return None

    def join(self, one: int, other: int) -> None:
        """Make them one."""
        share = self._areas[other] / (self._areas[one] + self._areas[other])
        for values in (self._light, self._effect):
            values[one] += share * (values[other] - values[one])
        self._areas[one] += self._areas[other]
        self._into[other], self.alive[other] = one, False
        self._changes[one] += 1
        self.count -= 1
        for near in self._beside[other]:
            self._beside[near].discard(other)
            if near != one:
                self._beside[near].add(one)
                self._beside[one].add(near)
        self._beside[other].clear()
        self._push(one, self._beside[one])

    def roots(self) -> Int[ndarray, " S"]:
        """The group of every surfel."""
        found = self._into
        while (further := found[found]).tolist() != found.tolist():
            found = further
        return found

    def _push(self, one: int, others: Iterable[int]) -> None:
        beside = np.fromiter(others, np.int64)
        area = self._areas[one] * self._areas[beside] / (self._areas[one] + self._areas[beside])
        costs = area * np.linalg.norm(self._light[beside] - self._light[one], axis=1)
        costs *= np.linalg.norm(self._effect[beside] - self._effect[one], axis=1)
        for cost, other in zip(costs.tolist(), beside.tolist(), strict=True):
            heapq.heappush(self._pairs, (cost, one, other, self._changes[one], self._changes[other]))


def _neighbors(places: Float32[ndarray, "n 3"], owners: Int[ndarray, " n"], names: Int[ndarray, " n"]) -> Int[ndarray, "m 2"]:
    """Pairs of the names of places that are among the nearest of each other, of one owner each, the smaller first."""
    from scipy.spatial import KDTree

    pairs = [np.zeros((0, 2), np.int64)]
    for owner in np.unique(owners):
        own = np.flatnonzero(owners == owner)
        near = KDTree(places[own]).query(places[own], min(NEIGHBORS + 1, len(own)))[1].reshape(len(own), -1)
        pairs.append(names[np.stack([np.repeat(own, near.shape[1]), own[near].ravel()], axis=1)])
    found = np.sort(np.concatenate(pairs), axis=1)
    return np.unique(found[found[:, 0] < found[:, 1]], axis=0)


def _rms(values: ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(values.astype(np.float64) ** 2, axis=1))))
