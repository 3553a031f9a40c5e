"""Surfels in groups: where light or its effect differs they stay apart, and what merging loses is what was allowed."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.visibility.surface_cells import Cells
from srbf.visibility.surfel_groups import SurfelEffects

SIDE = 20


def wall() -> Cells:
    """SIDE x SIDE surfels of a square meter."""
    x, y = ((np.indices((SIDE, SIDE)) + 0.5) / SIDE).reshape(2, -1)
    count = SIDE * SIDE
    places = np.stack([x, y, np.zeros(count)], axis=1).astype(np.float32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (count, 1))
    return Cells(places, normals, np.full(count, 1 / count, np.float32), np.full((count, 3), 0.5, np.float32), np.arange(count))


def spots(cells: Cells, lights: int, height: float) -> np.ndarray:
    """(S, V) irradiance of lights so far (m) over the left half of the wall."""
    above = np.random.default_rng(1).random((lights, 3)) * [0.5, 1, 0] + [0, 0, height]
    away = np.linalg.norm(cells.places[:, None] - above, axis=2)
    return height / away**3


def effects(cells: Cells, light: np.ndarray, effect: np.ndarray) -> SurfelEffects:
    """With lights whose pictures have unit norm; `effect` (S, m) of whole surfels."""
    unit = np.linalg.norm(effect.T @ light, axis=0) * np.sqrt(light.shape[1])
    return SurfelEffects(light / unit, effect / cells.areas[:, None])


@pytest.fixture
def near_the_left() -> tuple[Cells, np.ndarray, np.ndarray]:
    """A wall, lights close to its left half, and receivers that see all of it."""
    cells = wall()
    receivers = np.random.default_rng(2).random((60, 3)) + [0, 0, 0.3]
    away = np.linalg.norm(cells.places[:, None] - receivers, axis=2)
    return cells, spots(cells, 80, 0.1), cells.areas[:, None] * receivers[:, 2] ** 2 / away**4


@pytest.mark.parametrize("allowed", [0.003, 0.01, 0.03])
def test_pictures_lose_what_is_allowed(near_the_left: tuple[Cells, np.ndarray, np.ndarray], allowed: float) -> None:
    cells, light, effect = near_the_left
    labels = effects(cells, light, effect).groups(cells, np.zeros(len(light), int), len(light), allowed)
    mean = np.stack([np.bincount(labels, own) for own in light.T], axis=1) / np.bincount(labels)[:, None]  # surfels are equally large
    exact = effect.T @ light
    lost = np.linalg.norm(effect.T @ (mean[labels] - light), axis=0) / np.linalg.norm(exact, axis=0)
    assert np.sqrt((lost**2).mean()) < allowed
    assert labels.max() + 1 < 0.6 * len(light), "but it does merge"


def test_groups_are_small_where_lights_are_near(near_the_left: tuple[Cells, np.ndarray, np.ndarray]) -> None:
    cells, light, effect = near_the_left
    labels = effects(cells, light, effect).groups(cells, np.zeros(len(light), int), 100)
    assert set(labels) == set(range(100))
    left = cells.places[:, 0] < 0.5
    assert len(set(labels[left])) > 2 * len(set(labels[~left]))


def test_groups_are_of_one_owner(near_the_left: tuple[Cells, np.ndarray, np.ndarray]) -> None:
    cells, light, effect = near_the_left
    owners = (cells.places[:, 1] > 0.5).astype(int)
    labels = effects(cells, light, effect).groups(cells, owners, 30)
    assert labels.max() < 30
    assert not set(labels[owners == 0]) & set(labels[owners == 1])


def test_things_apart_and_unlit_ones_join_as_well(near_the_left: tuple[Cells, np.ndarray, np.ndarray]) -> None:
    cells, light, effect = near_the_left
    apart = Cells(np.round(cells.places * 2) * 9, cells.normals, cells.areas, cells.albedo, cells.patches)  # many at the same place
    found = effects(apart, 0 * light + 1e-9, 0 * effect + 1e-9).groups(apart, np.zeros(len(light), int), 2)
    assert set(found) <= {0, 1}
    alone = effects(apart, light, effect).groups(apart, np.arange(len(light)), 2)
    assert len(set(alone)) == len(light), "of an owner each, none may join"
