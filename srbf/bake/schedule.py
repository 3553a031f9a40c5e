"""Which light is rendered when, and how often: an order whose every prefix covers the domain, and passes that double the samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from srbf.bake.settings import PlannedLight
from srbf.sphere import farthest_points

FIRST_SAMPLES = 2  # of a light's first pass: a pass costs as much again as half a sample, whatever it renders
TESTED_GROWTH = 4  # validation and holdout lights, few and of many samples, grow faster than the others


def render_order(lights: Sequence[PlannedLight]) -> list[PlannedLight]:
    """Train lights from the highest on, each the farthest from those before; validation and holdout lights evenly between them."""
    train = [light for light in lights if light.role == "train"]
    tested = [light for light in lights if light.role != "train"]
    places = np.array([light.place for light in train]).reshape(-1, 3)
    order = farthest_points(places, len(places))
    ranked = [((i + 1.0) / len(train), 0, train[j]) for i, j in enumerate(order)]
    # Their roles stand one after the other: taken in turn, so that a prefix has some of each.
    turned = sorted(range(len(tested)), key=lambda i: (_turn(tested, i), i))
    ranked += [((i + 1.0) / len(tested), 1, tested[j]) for i, j in enumerate(turned)]
    return [light for _, _, light in sorted(ranked, key=lambda entry: entry[:2])]


def next_samples(light: PlannedLight, done: int, goal: int, first: int = FIRST_SAMPLES) -> int:
    """How many samples the next pass of a light adds to the `done` ones, of `goal`: as many again, tested lights three times as many."""
    if done == 0:
        return min(first, goal)
    growth = 2 if light.role == "train" else TESTED_GROWTH
    return min(done * (growth - 1), goal - done)


def _turn(tested: Sequence[PlannedLight], index: int) -> float:
    same = [i for i, light in enumerate(tested) if light.role == tested[index].role]
    return (same.index(index) + 1) / len(same)
