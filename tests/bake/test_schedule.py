"""The order of lights and their passes: closed forms and bounds, no Blender."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.bake.light_sets import PlacedLight
from srbf.bake.planned_lights import PlannedLight
from srbf.bake.schedule import next_samples, render_order
from srbf.bake.settings import BakeSettings, Receiver, plan_lights
from srbf.sphere import all_around, farthest_points, point_set

RECEIVER = Receiver("lightmap", "Plane")


def covering_radius(points: np.ndarray, domain: str) -> float:
    """The largest angle from any direction of the domain to the nearest of `points`."""
    return float(np.arccos(np.clip((all_around(domain, 4096) @ points.T).max(axis=1), -1, 1)).max())


@pytest.mark.parametrize("domain", ["hemisphere", "sphere"])
def test_every_prefix_covers_the_domain(domain: str) -> None:
    """Greedy farthest point is within twice the best radius; the best for n caps of angle r has n (1 - cos r) / 2 >= the domain's share."""
    settings = BakeSettings(RECEIVER, lights=400, domain=domain, holdout=0, validation=0)
    lights = render_order(plan_lights(settings))
    directions = np.array([light.place for light in lights])
    whole = covering_radius(directions, domain)
    area = 0.5 if domain == "hemisphere" else 1.0
    for n in [2, 3, 5, 8, 13, 25, 50, 100, 150, 200, 300, 399]:
        best = np.arccos(np.clip(1 - 2 * area / n, -1, 1))
        assert covering_radius(directions[:n], domain) <= 2 * best + whole, n


def test_hammersleys_own_order_does_not() -> None:
    """Why there is an order: half of the set in its own order leaves a hole as wide as a quarter of the hemisphere."""
    points = point_set("hammersley", 400, "sphere")
    assert covering_radius(points[:200], "sphere") > np.pi / 3
    chosen = points[farthest_points(points, 200)]
    assert covering_radius(chosen, "sphere") < np.pi / 10


def test_the_order_is_a_permutation_even_of_equal_points() -> None:
    points = np.repeat(np.eye(3), 3, axis=0)
    order = farthest_points(points, 9)
    assert sorted(order) == list(range(9)) and order[0] == 6
    assert {int(i) // 3 for i in order[:3]} == {0, 1, 2}


def test_tested_lights_stand_between_the_others() -> None:
    settings = BakeSettings(RECEIVER, lights=100, validation=10, holdout=20)
    planned = plan_lights(settings)
    lights = render_order(planned)
    assert sorted(light.index for light in lights) == [light.index for light in planned]
    assert lights[0].place[2] == max(light.place[2] for light in planned if light.role == "train")
    for n in (30, 65, 104):
        roles = [light.role for light in lights[:n]]
        assert abs(roles.count("holdout") - n * 20 / 130) <= 2
        assert abs(roles.count("validation") - n * 10 / 130) <= 2


@pytest.mark.parametrize(
    ("role", "goal", "first", "expected"),
    [
        ("train", 2, 2, [2]),
        ("train", 1, 2, [1]),
        ("train", 32, 2, [2, 2, 4, 8, 16]),
        ("train", 5, 1, [1, 1, 2, 1]),
        ("holdout", 64, 2, [2, 6, 24, 32]),
        ("validation", 64, 1, [1, 3, 12, 48]),
    ],
)
def test_passes_double_the_samples(role: str, goal: int, first: int, expected: list[int]) -> None:
    light = PlannedLight(0, PlacedLight("directional", (0, 0, 1)), role, goal, 0)
    passes: list[int] = []
    while sum(passes) < goal:
        passes.append(next_samples(light, sum(passes), goal, first))
    assert passes == expected
