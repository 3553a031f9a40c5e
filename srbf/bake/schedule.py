"""The order of rendering, every prefix of which covers the domain, and passes that double the samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from srbf.bake.planned_lights import PlannedLight
from srbf.sphere import farthest_points

FIRST_SAMPLES = 2  # of a light's first pass: a pass has a fixed cost of about half a sample
TESTED_GROWTH = 4  # growth per pass of validation and holdout lights, which are few and have many samples


def render_order(lights: Sequence[PlannedLight]) -> list[PlannedLight]:
    """Train lights, the highest first, then each time the one farthest from those before; validation and holdout lights evenly between."""
    train = [light for light in lights if light.role == "train"]
    tested = [light for light in lights if light.role != "train"]
    places = np.array([light.place for light in train]).reshape(-1, 3)
    order = farthest_points(places, len(places))
    ranked = [((i + 1.0) / len(train), 0, train[j]) for i, j in enumerate(order)]
    # They are listed by role: interleaved here, so that a prefix has some of each.
    turned = sorted(range(len(tested)), key=lambda i: (_turn(tested, i), i))
    ranked += [((i + 1.0) / len(tested), 1, tested[j]) for i, j in enumerate(turned)]
    return [light for _, _, light in sorted(ranked, key=lambda entry: entry[:2])]


def next_samples(light: PlannedLight, done: int, goal: int, first: int = FIRST_SAMPLES) -> int:
    """Samples that the next pass of a light adds to `done` of `goal`: as many again; three times as many for validation and holdout."""
    if done == 0:
        return min(first, goal)
    growth = 2 if light.role == "train" else TESTED_GROWTH
    return min(done * (growth - 1), goal - done)


def _turn(tested: Sequence[PlannedLight], index: int) -> float:
    same = [i for i, light in enumerate(tested) if light.role == tested[index].role]
    return (same.index(index) + 1) / len(same)
