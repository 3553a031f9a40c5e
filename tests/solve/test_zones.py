"""Zones: a partition into boxes that are apart."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.solve.zones import split_zones

POINTS = np.random.default_rng(0).uniform((0, 0, 0), (8, 5, 3), (3000, 3))


@pytest.mark.parametrize("count", [1, 2, 8, 13, 100])
def test_every_point_is_in_one_zone_and_in_its_box(count: int) -> None:
    zone, boxes = split_zones(POINTS, count)
    assert sorted(set(zone.tolist())) == list(range(count)) and boxes.shape == (count, 2, 3)
    for number in range(count):
        np.testing.assert_array_equal(boxes[number], [POINTS[zone == number].min(axis=0), POINTS[zone == number].max(axis=0)])


def test_boxes_of_different_zones_do_not_meet() -> None:
    _, boxes = split_zones(POINTS, 30)
    for i in range(30):
        for j in range(i):
            assert ((boxes[i, 1] < boxes[j, 0]) | (boxes[j, 1] < boxes[i, 0])).any()


def test_the_longest_side_is_halved_first() -> None:
    zone, _ = split_zones(POINTS, 2)
    low, high = POINTS[:, 0].min(), POINTS[:, 0].max()
    np.testing.assert_array_equal(zone, POINTS[:, 0] > (low + high) / 2)


def test_eight_zones_of_a_cube_are_its_octants() -> None:
    points = np.random.default_rng(1).uniform(-1, 1, (4000, 3))
    points[:2] = [(-1, -1, -1), (1, 1, 1)]
    zone, _ = split_zones(points)
    octant = (points > 0) @ (1, 2, 4)
    same = np.array([np.bincount(octant[zone == number]).max() for number in range(8)])
    assert same.sum() > 0.98 * len(points)  # boxes are tight: their middles are near 0


def test_permuted_points_keep_their_zone() -> None:
    order = np.random.default_rng(2).permutation(len(POINTS))
    np.testing.assert_array_equal(split_zones(POINTS[order], 20)[0], split_zones(POINTS, 20)[0][order])


def test_more_zones_refine_fewer() -> None:
    few, many = split_zones(POINTS, 7)[0], split_zones(POINTS, 40)[0]
    assert len(set(zip(many.tolist(), few.tolist(), strict=True))) == 40


def test_a_stopping_criterion_ends_the_splits() -> None:
    zone, _ = split_zones(POINTS, len(POINTS), stop=lambda members: len(members) <= 200)
    sizes = np.bincount(zone)
    assert sizes.max() <= 200 and len(sizes) < 100


def test_places_that_cannot_be_parted() -> None:
    zone, boxes = split_zones(np.zeros((5, 3)), 8)
    assert zone.tolist() == [0] * 5 and len(boxes) == 1
    two, _ = split_zones(np.repeat([[0.0, 0, 0], [1, 0, 0]], 4, axis=0), 8)
    assert two.tolist() == [0] * 4 + [1] * 4
    tight = np.array([[1.0, 0, 0], [np.nextafter(1.0, 2), 0, 0]])
    assert sorted(set(split_zones(tight, 8)[0].tolist())) == [0, 1]
    assert len(split_zones(np.zeros((0, 3)))[0]) == 0


def test_what_has_no_meaning() -> None:
    with pytest.raises(InputError, match="`count` of 1 or more"):
        split_zones(POINTS, 0)
    with pytest.raises(InputError, match="finite"):
        split_zones(np.full((2, 3), np.nan))
