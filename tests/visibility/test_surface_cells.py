"""Which sides of surfaces free places see."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.visibility import surface_cells
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.surface_cells import Fragments, exposed, places_for

pytest.importorskip("embreex")


def floor(steps: int) -> Fragments:
    """The unit square at z = 0, both sides of 2 steps^2 triangles."""
    x, y = (np.indices((steps, steps)) / steps).reshape(2, -1, 1, 1)
    corners = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]) / steps
    plane = np.concatenate([np.stack([x + corners[..., 0], y + corners[..., 1], np.zeros((len(x), 2, 3))], axis=-1)]).reshape(-1, 3, 3)
    return Fragments(plane.astype(np.float32), np.ones((len(plane), 3), np.float32)).both_sides()


@pytest.mark.parametrize("rays", [surface_cells.MOST_RAYS, 1])
def test_a_floor_is_seen_from_above_alone(rays: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surface_cells, "MOST_RAYS", rays)
    sides = floor(30)
    above = np.random.default_rng(1).random((2000, 3)) + [0, 0, 0.1]
    seen = exposed(sides, EmbreeTriangles(sides.corners[: len(sides.corners) // 2]), above)
    assert (seen == (sides.normals[:, 2] > 0)).all()


def test_a_great_many_points_are_tested_by_fewer_places() -> None:
    assert places_for(1000) > 4096, "those of a usual scene by all"
    assert places_for(2_000_000) == surface_cells.FEWEST_PLACES
    assert places_for(0) > 4096
