"""Bounces of distant lights beside the products of the form factors themselves: an open box, a coarser cubemap, other lights."""

from __future__ import annotations

import numpy as np
import pytest
from made_rooms import Room, divided

from srbf.cubemap import Cubemap
from srbf.solve.radiosity import Bounces, reciprocal
from srbf.visibility.distant_bounces import Effort, light_on_surfels, traced
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.form_factors import RayOrigins, form_factors
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.surfels import Surfels, surfels_of

pytest.importorskip("embreex")

CUBEMAP = Cubemap(8)
BOX = Room.box((2, 1.5, 1.5), 0.25, lid=False)
OCCLUDERS = EmbreeTriangles(BOX.corners.astype(np.float32))
ORIGINS = RayOrigins.even(BOX.places[:, None] + 1e-4 * BOX.normals[:, None], BOX.normals[:, None])
NOISE, COARSE = 0.04, 0.1  # relative RMSE of rays; and of a quarter of the directions, 22 degrees apart


@pytest.fixture(scope="module")
def surfels() -> Surfels:
    corners = divided(BOX.corners, 0.25)
    albedo = np.tile(np.array([0.7, 0.5, 0.2], np.float32), (len(corners), 1))
    return surfels_of(Fragments(corners, albedo), np.zeros(len(corners), np.int64), OCCLUDERS, BOX.free, None, 400)


def expected(surfels: Surfels, directions: np.ndarray, most: int | None) -> np.ndarray:
    """(R, n, 3): form factors of many rays times the bounces of the light on the surfels."""
    receivers = form_factors(surfels, ORIGINS, 4096, 11)
    exchange = reciprocal(form_factors(surfels, RayOrigins.even(*surfels.spread(16, 5)), 256, 12).toarray(), surfels.cells.areas)
    lit, _ = light_on_surfels(surfels, directions, OCCLUDERS)
    albedo = surfels.cells.albedo.astype(np.float64)
    return np.stack([receivers @ Bounces(exchange, albedo[:, c], most).radiosity(lit) for c in range(3)], axis=2)


def apart(found: np.ndarray, true: np.ndarray) -> float:
    return float(np.linalg.norm(found - true) / np.linalg.norm(true))


@pytest.mark.slow
@pytest.mark.parametrize("most", [1, 4, None])
def test_shapes_times_weights_are_the_bounces(surfels: Surfels, most: int | None) -> None:
    found, mixture = traced(surfels, ORIGINS, CUBEMAP, OCCLUDERS, most, Effort(2048, 1024, True))
    true = expected(surfels, CUBEMAP.directions, most)
    assert apart(np.einsum("pr,rnc->pnc", found.shapes, found.weights), true) < NOISE
    others = CUBEMAP.directions[::7] @ np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    lit, _ = light_on_surfels(surfels, others, OCCLUDERS)
    between = np.einsum("pr,rsc,sn->pnc", found.shapes, mixture.transfer, lit, optimize=True)
    assert apart(between, expected(surfels, others, most)) < NOISE
    assert found.rays > 2048 * len(BOX.places)


@pytest.mark.lengthy
def test_a_quarter_of_the_directions_tells_the_others_and_takes_fewer_rays(surfels: Surfels) -> None:
    whole, _ = traced(surfels, ORIGINS, CUBEMAP, OCCLUDERS, 4, Effort.full(len(BOX.places)))
    sparse, _ = traced(surfels, ORIGINS, CUBEMAP, OCCLUDERS, 4, Effort.sparse())
    images = [np.einsum("pr,rnc->pnc", one.shapes, one.weights) for one in (sparse, whole)]
    assert apart(*images) < 2 * COARSE and sparse.rays < 0.6 * whole.rays
    assert sparse.weights.shape[1:] == (CUBEMAP.count, 3)


@pytest.mark.lengthy
def test_a_seed_gives_the_same_again(surfels: Surfels) -> None:
    one, two = (traced(surfels, ORIGINS, CUBEMAP, OCCLUDERS, 2, Effort.sparse(), 9)[0] for _ in range(2))
    np.testing.assert_array_equal(one.shapes, two.shapes)
    np.testing.assert_array_equal(one.weights, two.weights)
