"""Light through translucent sheets: a furnace, rooms that share a sheet against a radiosity solver, direct light on backs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_rooms import Room
from made_views import surfaces_of
from scipy.sparse import csr_array

from srbf.lights import PointLight
from srbf.visibility.behind import Behind
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.gather_operator import GatherOperator
from srbf.visibility.gather_pool import pool_of
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.received import ReceivedLight
from srbf.visibility.sparse_links import radiosity_of
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.surfels import Surfels

pytest.importorskip("embreex")
pytestmark = pytest.mark.slow

SHEET = 2.0  # m: where it parts the room
PARTED = Room.box((4, 3, 2.5), 0.25, 0.6, wall=(SHEET, 3.0, 3.0))  # from wall to wall
ROOM = replace(PARTED, corners=PARTED.corners[:-2])  # one sheet with two sides, in place of two
MEAN, RMS = 0.03, 0.06  # of a half's irradiance: surfels of 15 cm and cells of 25 cm; view clusters of several cells
REFLECTED, PASSED = np.array([0.2, 0.3, 0.1]), np.array([0.5, 0.3, 0.6])


def pool(reflected: np.ndarray, passed: np.ndarray, walls: float | None = None, count: int = 3000) -> tuple[Surfels, EmbreeTriangles]:
    """Of the parted room, whose sheet has these colors."""
    found = surfaces_of(ROOM, 0.12)
    sheet = (np.abs(found.corners[:, :, 0] - SHEET) < 1e-6).all(axis=1)[:, None]
    albedo = np.where(sheet, reflected, found.albedo if walls is None else walls).astype(np.float32)
    transmission = np.where(sheet, passed, 0).astype(np.float32)
    occluders = EmbreeTriangles(ROOM.corners)
    surfaces = Fragments(found.corners, albedo)
    made = pool_of(
        surfaces, found.objects, occluders, ROOM.free, ROOM.places, ROOM.normals, count, transmission=transmission if passed.any() else None
    )
    return made, occluders


def gathered(pool: Surfels, occluders: EmbreeTriangles) -> GatherOperator:
    points = PixelPoints(ROOM.places, ROOM.normals, np.arange(len(ROOM.places)), np.ones(len(ROOM.places), np.float32), len(ROOM.places))
    return GatherOperator.traced(pool, points, occluders, 2000)


def test_a_furnace_does_not_see_which_side_light_comes_from() -> None:
    """Where all surfaces receive 1 on both sides and reflect and pass 0.7 in all, they get 0.7 / 0.3."""
    operator = gathered(*pool(np.full(3, 0.3), np.full(3, 0.4), 0.7, 1500))
    lit = np.ones((len(operator.cells.places), 3), np.float32)
    found = operator.view.matrix() @ radiosity_of(operator.exchange.matrix(), operator.cells.albedo, lit, None)
    np.testing.assert_allclose(found, 0.7 / 0.3, rtol=2e-3)


def test_a_second_surfel_faces_the_other_way() -> None:
    made, _ = pool(REFLECTED, PASSED)
    behind = Behind.of(made)
    cells = behind.with_backs(made.cells)
    own, back = cells.at(behind.surfels), cells.at(np.arange(made.count, len(cells.places)))
    np.testing.assert_allclose(own.places[:, 0], SHEET, atol=1e-6)
    np.testing.assert_array_equal(back.places, own.places)
    np.testing.assert_array_equal(back.normals, -own.normals)
    np.testing.assert_allclose(back.albedo, np.broadcast_to(PASSED, back.albedo.shape), rtol=1e-5)
    np.testing.assert_allclose(own.albedo, np.broadcast_to(REFLECTED, own.albedo.shape), rtol=1e-5)
    assert own.areas.sum() == pytest.approx(2 * 3 * 2.5, rel=1e-4)  # both sides
    shares = np.random.default_rng(1).uniform(0, 1, (4, made.count)).astype(np.float32)
    doubled = behind.met(csr_array(shares)).toarray()
    np.testing.assert_array_equal(doubled, np.concatenate([shares, shares[:, behind.surfels]], axis=1))


def test_a_scene_without_translucency_has_none() -> None:
    made, occluders = pool(REFLECTED, np.zeros(3), count=400)
    assert made.transmission is None and not len(Behind.of(made).surfels)
    operator = gathered(made, occluders)
    assert operator.cells is made.cells and operator.behind is None


@pytest.mark.parametrize("seed", range(2))
def test_rooms_share_light_through_a_sheet(seed: int) -> None:
    """Against B = (rho + tau P) (e + F B) of the room's cells, P the cell on the other side."""
    made, occluders = pool(REFLECTED, PASSED)
    operator = gathered(made, occluders)
    place = np.array([0.5, 0.6, 0.7]) + np.random.default_rng(seed).uniform(0, 1, 3) * [0.9, 1.8, 1.0]  # left of the sheet
    direct = ROOM.direct(place)
    sheet = np.flatnonzero(np.abs(ROOM.places[:, 0] - SHEET) < 1e-6)
    other = np.zeros((len(direct), len(direct)))
    for i in sheet:
        other[i, sheet[(ROOM.places[sheet] == ROOM.places[i]).all(axis=1) & (sheet != i)]] = 1
    assert (other.sum(axis=1)[sheet] == 1).all()
    factors = ROOM.factors()
    expected = np.zeros((len(direct), 3))
    for c in range(3):
        reflected = ROOM.albedo[:, c].copy()
        reflected[sheet] = REFLECTED[c]
        both = np.diag(reflected) + PASSED[c] * other
        expected[:, c] = factors @ np.linalg.solve(np.eye(len(direct)) - both @ factors, both @ direct)
    x, y, z = place.tolist()
    lit = ReceivedLight(operator.cells, occluders).irradiance(PointLight((x, y, z), falloff="inverse-square")).astype(np.float32)
    light = operator.view.matrix() @ radiosity_of(operator.exchange.matrix(), operator.cells.albedo, lit, None)
    found = (light[operator.nearest] * operator.weights[..., None]).sum(axis=1)
    inner = (np.abs(ROOM.places - ROOM.places.mean(axis=0)) < np.array([1.5, 1.2, 1.0])).sum(axis=1) == 2  # away from edges
    for half in (inner & (ROOM.places[:, 0] < SHEET), inner & (ROOM.places[:, 0] > SHEET)):
        assert half.sum() > 50 and expected[half].min() > 0
        np.testing.assert_allclose(found[half].mean(axis=0), expected[half].mean(axis=0), rtol=MEAN)
        assert np.sqrt(((found - expected)[half] ** 2).mean()) < RMS * np.sqrt((expected[half] ** 2).mean())


def test_files_keep_the_backs(tmp_path: Any) -> None:
    made, occluders = pool(REFLECTED, PASSED, count=400)
    sheet = np.abs(ROOM.places[:, 0] - SHEET) < 1e-6
    own, size = np.flatnonzero(sheet), len(ROOM.places)
    points = PixelPoints(ROOM.places, ROOM.normals, np.arange(size), np.ones(size, np.float32), size)
    backs = PixelPoints(ROOM.places[own], -ROOM.normals[own], own, np.ones(len(own), np.float32), size)
    operator = GatherOperator.traced(made, points, occluders, 300, backs=backs)
    assert operator.behind is not None
    nearest, weights = operator.behind
    assert (weights[~sheet] == 0).all()
    np.testing.assert_allclose(weights[sheet].sum(axis=1), 1, rtol=1e-5)
    assert nearest[weights > 0].min() >= 300 and operator.view.rows > 300  # clusters of their own
    operator.write(tmp_path, "key")
    read = GatherOperator.read(tmp_path)
    assert read.behind is not None
    np.testing.assert_array_equal(read.behind[0], nearest)
    np.testing.assert_allclose(read.behind[1], weights, atol=1e-3)
    np.testing.assert_allclose(read.cells.albedo, operator.cells.albedo)
