"""Points in zones: boxes that are halved across their longest side, again and again [Kristensen2005, section 4.2]."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64, Int
from srbf.errors import InputError

ZONES = 8
Stop = Callable[[np.ndarray], bool]  # of the members of a zone: it is not split further


def split_zones(
    positions: Float[ndarray, "P 3"], count: int = ZONES, stop: Stop | None = None
) -> tuple[Int[ndarray, " P"], Float64[ndarray, "Z 2 3"]]:
    """(zone of each point, box of each zone as its lowest and highest corner), m.

    The zone of the largest box, by its longest side, is halved in the middle of that side, and both halves shrink to their points; so no
    zone is empty. It ends with `count` zones, or fewer where no zone can be split: of one place, or of whose members (indices) `stop`
    holds. With `stop` given, set `count` to P for no other limit. Zones are numbered in the order of the tree, so that
    neighbors in number are mostly neighbors in space.
    """
    positions = np.asarray(positions, np.float64)
    if count < 1:
        raise InputError(f"expected `count` of 1 or more zones, found {count}")
    if not np.isfinite(positions).all():
        raise InputError("expected finite positions of the receivers, found others; bake the capture again")
    if not len(positions):
        return np.zeros(0, np.int64), np.zeros((0, 2, 3))
    zones = [np.arange(len(positions))]
    boxes = [_box(positions)]
    sizes = [_size(boxes[0], stop, zones[0])]
    while len(zones) < count and max(sizes) > 0:
        largest = int(np.argmax(sizes))
        low, high = boxes[largest]
        axis = int((high - low).argmax())
        below = positions[zones[largest], axis] <= (low[axis] + high[axis]) / 2
        halves = [zones[largest][below], zones[largest][~below]]
        zones[largest : largest + 1] = halves
        boxes[largest : largest + 1] = [_box(positions[half]) for half in halves]
        sizes[largest : largest + 1] = [_size(boxes[largest + i], stop, half) for i, half in enumerate(halves)]
    found = np.empty(len(positions), np.int64)
    for number, members in enumerate(zones):
        found[members] = number
    return found, np.stack(boxes)


def _box(positions: Float64[ndarray, "n 3"]) -> Float64[ndarray, "2 3"]:
    return np.stack([positions.min(axis=0), positions.max(axis=0)])


def _size(box: Float64[ndarray, "2 3"], stop: Stop | None, members: Int[ndarray, " n"]) -> float:
    """The longest side, 0 where a zone is not to be split: also where its middle rounds to an end."""
    side = box[1] - box[0]
    axis = int(side.argmax())
    splits = (box[0, axis] + box[1, axis]) / 2 < box[1, axis]
    return float(side[axis]) if splits and not (stop is not None and stop(members)) else 0.0
