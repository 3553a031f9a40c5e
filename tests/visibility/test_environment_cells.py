"""Environments as cells: an open plane, a closed box, a box without a lid, a colored pane, and energy of surfels and cells together."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import build_plane, flat_normals, quad
from test_form_factors import PLATES, centers, square

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.lights import EnvironmentLight
from srbf.sphere import random_directions
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.environment_cells import SIDE, EnvironmentRows, Openings, cell_of, cell_radiance
from srbf.visibility.form_factors import RayOrigins, factors_and_environment
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.surfels import Surfels, surfels_of

pytest.importorskip("embreex")

RAYS = 4096
UNIFORM = EnvironmentLight(np.full((8, 16, 3), 0.5, np.float32), color=(2.0, 1.0, 0.0))  # radiance 1, 0.5 and 0


def box(lid: bool) -> np.ndarray:
    """(T, 3, 3): the inside of the unit cube, without or with its lid, its floor first."""
    floor = square(0, True)
    turned = [(floor - 0.5) @ matrix + 0.5 for matrix in _turns()]
    return np.concatenate([floor, *turned[: 5 if lid else 4]]).astype(np.float32)


def _turns() -> list[np.ndarray]:
    """Rotations that carry the floor to the four walls and to the lid."""
    x, y = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    return [x.astype(float), x.T.astype(float), y.astype(float), y.T.astype(float), (x @ x).astype(float)]


def inside(corners: np.ndarray) -> Surfels:
    free = np.random.default_rng(0).uniform(0.1, 0.9, (64, 3))
    surfaces = Fragments(corners, np.full((len(corners), 3), 0.5, np.float32))
    return surfels_of(surfaces, np.zeros(len(corners), np.int64), EmbreeTriangles(corners), free, None, 200)


def openings(corners: np.ndarray, panes: np.ndarray | None = None, passed: float = 0.5, casts: bool = True) -> Openings:
    every = corners if panes is None else np.concatenate([corners, panes])
    curve = np.full((KNOTS, 3), 1.0, np.float32) * np.array([passed, 1.0, 0.0], np.float32)
    material = (np.arange(len(every)) >= len(corners)).astype(np.int64)
    return Openings(Triangles(every, flat_normals(every), material, np.full(len(every), casts), np.stack([np.zeros_like(curve), curve])))


def test_an_open_plane_has_pi_times_the_radiance_of_an_even_environment() -> None:
    plane = build_plane()
    origins = RayOrigins.even(np.zeros((3, 1, 3)), np.array([[[0, 0, 1.0]], [[0, 0.6, 0.8]], [[1.0, 0, 0]]]))
    empty = inside(box(True))
    far = Surfels(empty.cells, empty.corners + 100, empty.owners, empty.objects, empty.emission)
    _, environment = factors_and_environment(far, Openings(plane.triangles), origins, RAYS)
    shares = np.asarray(environment.matrix().sum(axis=1)).ravel()
    np.testing.assert_allclose(shares[0], 1, atol=1e-5)
    np.testing.assert_allclose(shares[1], 0.9, atol=2e-3, err_msg="a plane below a tilted one leaves (1 + cos) / 2 of the environment")
    np.testing.assert_allclose(environment.irradiance(cell_radiance(UNIFORM))[0], [np.pi, np.pi / 2, 0], rtol=1e-5)


def test_a_closed_box_sees_no_environment_and_costs_no_bytes() -> None:
    corners = box(True)
    found = inside(corners)
    factors, environment = factors_and_environment(found, openings(corners), centers(found), 1024)
    assert not len(environment.cells) and not len(environment.shares)
    np.testing.assert_allclose(factors.sum(axis=1), 1, atol=1e-5)


def test_a_box_without_a_lid() -> None:
    """Its floor sees of the environment what it would see of the lid: the factor of two parallel squares; and nothing is lost."""
    corners = box(False)
    found = inside(corners)
    points, normals = found.spread(16)
    factors, environment = factors_and_environment(found, openings(corners), RayOrigins.even(points, normals), RAYS // 16)
    floor, areas = found.cells.normals[:, 2] > 0.5, found.cells.areas
    shares = np.asarray(environment.matrix().sum(axis=1)).ravel()
    assert shares[floor] @ areas[floor] / areas[floor].sum() == pytest.approx(PLATES, rel=0.01)
    walls = shares[~floor] @ areas[~floor] / areas[~floor].sum()
    assert walls == pytest.approx((1 - PLATES) / 4, rel=0.01)  # what the lid does not send to the floor, and reciprocity
    np.testing.assert_allclose(np.asarray(factors.sum(axis=1)).ravel() + shares, 1, atol=1e-5)


def test_light_comes_from_where_the_environment_is_bright() -> None:
    """A wall of a box without a lid: of a bright half of the environment only what lies in front of it arrives."""
    corners = box(False)
    found = inside(corners)
    _, environment = factors_and_environment(found, openings(corners), centers(found), 1024)
    image = np.zeros((16, 32, 3), np.float32)
    image[:, 8:24] = 1  # x > 0: the middle of the map
    lit = environment.irradiance(cell_radiance(EnvironmentLight(image)))[:, 0]
    facing = found.cells.normals[:, 0]
    assert not lit[facing < -0.5].any() and (lit[facing > 0.5] > 0).mean() > 0.8
    turned = EnvironmentLight(image, rotation=np.diag([-1.0, -1.0, 1.0]))
    lit = environment.irradiance(cell_radiance(turned))[:, 0]
    assert not lit[facing > 0.5].any() and (lit[facing < -0.5] > 0).mean() > 0.8


def test_panes_dim_by_color() -> None:
    corners, pane = box(False), quad([-1, -1, 1.5], [2, -1, 1.5], [2, 2, 1.5], [-1, 2, 1.5])
    found = inside(corners)
    _, clear = factors_and_environment(found, openings(corners), centers(found), 256)
    _, environment = factors_and_environment(found, openings(corners, pane), centers(found), 256)
    assert clear.shares.shape[1] == 1 and environment.shares.shape[1] == 3
    floor = np.flatnonzero(found.cells.normals[:, 2] > 0.5)
    whole = clear.matrix().sum(axis=1)[floor]
    for channel, passed in enumerate((0.5, 1.0, 0.0)):
        np.testing.assert_allclose(environment.matrix(channel).sum(axis=1)[floor], passed * whole, rtol=1e-5)


def test_what_casts_no_shadow_lets_the_environment_pass() -> None:
    corners = box(True)
    found = inside(corners)
    _, environment = factors_and_environment(found, openings(corners, casts=False), centers(found), 256)
    np.testing.assert_allclose(environment.matrix().sum(axis=1), 1, atol=1e-5)


def test_cells_hold_the_whole_sphere_and_a_map_of_any_size() -> None:
    directions = random_directions(20000, "sphere", np.random.default_rng(0))
    assert len(np.unique(cell_of(directions))) == SIDE**2
    for size in ((1, 2), (8, 16), (64, 128), (100, 37)):
        np.testing.assert_allclose(cell_radiance(EnvironmentLight(np.full((*size, 3), 0.7, np.float32))), 0.7, rtol=1e-6)


def test_parts_of_the_environment_and_rows_add_up() -> None:
    corners = box(False)
    found = inside(corners)
    _, environment = factors_and_environment(found, openings(corners), centers(found), 256)
    np.testing.assert_allclose(environment.parts().sum(axis=1), environment.matrix().sum(axis=1), rtol=1e-4)
    both = EnvironmentRows.stacked([EnvironmentRows.none(2), environment]).matrix()
    np.testing.assert_array_equal(both[2:].toarray(), environment.matrix().toarray())
