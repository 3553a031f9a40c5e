"""A light between the lights of a cloud: the kernel (1 - d/r)^4 over the nearest that it sees, and fades where sight begins or ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float64, Int
from srbf.errors import InputError

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Visible = Callable[[np.ndarray, np.ndarray], np.ndarray]  # (n, 3) origins, (n, 3) targets, m: (n,) bool, nothing lies between
NEAREST = 16  # with 8, all are equally far at the middle of a cell of a regular grid
BATCH = 1 << 18  # pairs of a place and a light at once
SAME_PLACE = 1e-9  # m
LEVEL = 1e-6  # 1 - d/r below which all lights count as equally far


@dataclass(frozen=True, eq=False)
class KernelWeights:
    """Of n places: m captured lights each, and weights that sum to one.

    `seen` is the number of captured lights that carry a place: where it is 1 the nearest visible one has all the weight; where it is 0
    the place sees none, and the nearest of all has it.
    """

    lights: Int[ndarray, "n m"]
    weights: Float64[ndarray, "n m"]
    seen: Int[ndarray, " n"]

    def dense(self, count: int) -> Float64[ndarray, "n L"]:
        """The weights of all `count` captured lights."""
        found = np.zeros((len(self.lights), count))
        np.add.at(found, (np.arange(len(found))[:, None], self.lights), self.weights)
        return found


@dataclass(frozen=True, eq=False)
class CloudKernel:
    """Interpolation between L captured point lights at `places` (m) [Kristensen2005, section 6.1].

        w_i = (1 - d_i / r)^4 / sum,   r = distance to the farthest of the `nearest` lights that the place sees

    `visible` says which straight lines nothing blocks. So no light reaches through a wall; the weights are a smoother, not an interpolant:
    at a captured light its neighbors keep theirs. Fewer visible lights than `nearest` are used as they are. Cost: a query of the kd-tree
    and rays to twice as many lights as it takes, at most to all L.
    """

    places: Float64[ndarray, "L 3"]
    visible: Visible
    nearest: int = NEAREST

    def __post_init__(self) -> None:
        if not len(self.places):
            raise InputError("expected the places of one or more captured lights, found none; capture lights with `light_set=cloud`")
        if self.nearest < 1:
            raise InputError(f"expected `nearest` of 1 or more lights, found {self.nearest}")

    @cached_property
    def tree(self) -> cKDTree:
        from scipy.spatial import cKDTree

        return cKDTree(self.places)

    def weights(self, positions: Float[ndarray, "n 3"]) -> KernelWeights:
        """Weights of the captured lights for isotropic point lights at `positions` (m)."""
        positions = np.asarray(positions, np.float64)
        rows = max(1, BATCH // len(self.places))
        found = [self._nearest_visible(positions[i : i + rows]) for i in range(0, max(len(positions), 1), rows)]
        lights, distances = (np.concatenate(part) for part in zip(*found, strict=True))
        seen = np.isfinite(distances).sum(axis=1)
        lights[seen == 0, 0] = self.tree.query(positions[seen == 0])[1]
        distances[seen == 0, 0] = 0
        return KernelWeights(lights, _normalized(_kernel(distances), np.isfinite(distances)), seen)

    def sees(self, positions: Float64[ndarray, "n 3"], lights: Int[ndarray, "n k"]) -> Bool[ndarray, "n k"]:
        """Which of its `lights` each place sees; one that it is at, always."""
        origins = np.broadcast_to(positions[:, None], (*lights.shape, 3))
        targets = self.places[lights]
        apart = np.linalg.norm(targets - origins, axis=2) > SAME_PLACE
        found = np.ones(lights.shape, bool)
        if apart.any():
            found[apart] = self.visible(origins[apart], targets[apart])
        return found

    def _nearest_visible(self, positions: Float64[ndarray, "n 3"]) -> tuple[Int[ndarray, "n m"], Float64[ndarray, "n m"]]:
        """(lights, distances) in rising order, distance infinite where there are no more."""
        total, wanted = len(self.places), min(self.nearest, len(self.places))
        lights = np.zeros((len(positions), wanted), np.int64)
        distances = np.full((len(positions), wanted), np.inf)
        pending, count = np.arange(len(positions)), 0
        seen = np.zeros((len(positions), 0), bool)
        while len(pending):
            before, count = count, min(total, max(2 * count, 2 * wanted))
            far, order = self.tree.query(positions[pending], np.arange(1, count + 1))
            seen = np.concatenate([seen, self.sees(positions[pending], order[:, before:])], axis=1)
            enough = (seen.sum(axis=1) >= wanted) | (count == total)
            first = np.argsort(~seen[enough], axis=1, kind="stable")[:, :wanted]
            lights[pending[enough]] = np.take_along_axis(order[enough], first, axis=1)
            kept = np.where(seen[enough], far[enough], np.inf)
            distances[pending[enough]] = np.take_along_axis(kept, first, axis=1)
            pending, seen = pending[~enough], seen[~enough]
        return lights, distances


def all_visible(origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Of a scene in which nothing lies between any two places."""
    return np.ones(len(origins), bool)


class Fade:
    """Weights of one moving light over time: captured lights that it begins or ceases to see come and go over `seconds`.

    Each captured light has an opacity, which moves to 1 while it is visible and to 0 while not, at the rate 1/seconds; where no light is
    visible it stays. Opacities multiply the kernel, and r encloses `nearest` of them, counted by opacity. So weights are continuous in time
    [Kristensen2005, section 6.1], motion itself does not lag, and after `seconds` at a place that sees a light they are
    `CloudKernel.weights`. Steps of dt and dt' at one place equal one of dt + dt'. Cost: rays to all captured lights at each step.
    """

    def __init__(self, kernel: CloudKernel, seconds: float = 0.25) -> None:
        if not seconds >= 0:
            raise InputError(f"expected `seconds` of 0 or more, found {seconds}")
        self.kernel, self.seconds = kernel, seconds
        self.opacity = np.zeros(len(kernel.places))

    def step(self, position: Float[ndarray, " 3"], dt: float) -> Float64[ndarray, " L"]:
        """Weights at `position` (m), `dt` seconds after the last step; they sum to one. A first step starts without a fade."""
        if not dt >= 0:
            raise InputError(f"expected `dt` of 0 seconds or more, found {dt}")
        place = np.asarray(position, np.float64)
        target = self.kernel.sees(place[None], np.arange(len(self.opacity))[None])[0].astype(np.float64)
        if not self.opacity.any():
            self.opacity = target
        elif target.any():
            self.opacity = approach(self.opacity, target, dt / self.seconds if self.seconds else 1.0)
        distances = np.linalg.norm(self.kernel.places - place, axis=1)
        if not self.opacity.any():
            return np.eye(len(distances))[distances.argmin()]
        radius = self._radius(distances)
        shape = self.opacity * np.maximum(1 - distances / max(radius, SAME_PLACE), 0) ** 4
        if shape.sum() <= LEVEL**4:  # all equally far
            shape = self.opacity * (distances <= radius * (1 + LEVEL) + SAME_PLACE)
        return shape / shape.sum()

    def _radius(self, distances: Float64[ndarray, " L"]) -> float:
        """Mean distance of the last unit of opacity within the `nearest` units: of the farthest light, where all are visible."""
        order = np.argsort(distances, kind="stable")
        ends = np.minimum(np.cumsum(self.opacity[order]), self.kernel.nearest)
        starts = np.maximum(np.concatenate([[0.0], ends[:-1]]), max(ends[-1] - 1, 0.0))
        shares = np.maximum(ends - starts, 0)
        return float(shares @ distances[order] / shares.sum())


def approach(values: Float64[ndarray, " L"], target: Float64[ndarray, " L"], most: float) -> Float64[ndarray, " L"]:
    """`values` moved toward `target` by at most `most` each."""
    return values + np.clip(target - values, -most, most)


def _kernel(distances: Float64[ndarray, "n m"]) -> Float64[ndarray, "n m"]:
    """1 - d/r to the fourth power, r the largest finite distance of a row; 1 for all where all are equally far."""
    known = np.isfinite(distances)
    radius = np.where(known, distances, 0).max(axis=1, keepdims=True)
    share = np.where(known, 1 - np.where(known, distances, 0) / np.maximum(radius, SAME_PLACE), 0)
    level = share.max(axis=1, keepdims=True) < LEVEL
    return np.where(level | (radius <= SAME_PLACE), 1.0, np.maximum(share, 0) ** 4)


def _normalized(values: Float64[ndarray, "n m"], known: Bool[ndarray, "n m"]) -> Float64[ndarray, "n m"]:
    values = np.where(known, values, 0)
    return values / values.sum(axis=1, keepdims=True)
