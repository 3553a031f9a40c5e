"""Bounces of distant lights beside the products of the form factors themselves: an open box, a coarser cubemap, other lights."""

from __future__ import annotations

import numpy as np
import pytest
from made_rooms import Room, divided

from srbf.basis.exitant_harmonics import harmonics
from srbf.brdf_factors import BOUNCE_ORDER
from srbf.cubemap import Cubemap
from srbf.receiver_gloss import framed
from srbf.solve.radiosity import Bounces, reciprocal
from srbf.visibility.distant_bounces import Effort, light_on_surfels, traced
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.form_factors import RayOrigins, form_factors
from srbf.visibility.gathered_harmonics import gathered_harmonics
from srbf.visibility.hemisphere import cosine_directions
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
    found, mixture = traced(surfels, ORIGINS, CUBEMAP, OCCLUDERS, most, Effort(2048, 1024, True, 1024))
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


def test_gloss_adds_harmonics_of_the_same_rays(surfels: Surfels) -> None:
    """The first is the shapes; all of them are means over rays that meet something, of even light."""
    plain, _ = traced(surfels, ORIGINS, CUBEMAP, OCCLUDERS, 2, Effort.sparse(), 9)
    glossy, _ = traced(surfels, ORIGINS, CUBEMAP, OCCLUDERS, 2, Effort.sparse(), 9, gloss=True)
    assert plain.harmonics is None and glossy.harmonics is not None and glossy.rays == plain.rays
    np.testing.assert_allclose(glossy.shapes, plain.shapes, rtol=1e-3, atol=1e-4 * np.abs(plain.shapes).max())
    np.testing.assert_allclose(glossy.harmonics[0] * np.float32(np.sqrt(4 * np.pi)), glossy.shapes, rtol=1e-5, atol=1e-7)
    ways, rays = cosine_directions(ORIGINS.normals[:3].astype(np.float64), 4096, np.random.default_rng(1))[:, 0], 4096
    starts = np.repeat(ORIGINS.points[:3, 0], rays, axis=0)
    met, _ = surfels.met_along(starts + 1e-4 * np.repeat(ORIGINS.normals[:3, 0], rays, axis=0), ways.reshape(-1, 3))
    hit = (met >= 0).reshape(3, rays)
    waves = harmonics(np.einsum("nij,ncj->nci", framed(ORIGINS.normals[:3, 0]), ways), BOUNCE_ORDER)
    found = gathered_harmonics(surfels, ORIGINS, 2048, np.ones((surfels.count, 1), np.float32), 3)[:, :3, 0]
    np.testing.assert_allclose(found, (waves * hit[:, :, None]).mean(axis=1).T, atol=0.02)
