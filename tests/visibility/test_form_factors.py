"""Form factors by rays: closed rooms lose nothing, two plates against the analytic factor, both sides of a wall."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.form_factors import RayOrigins, form_factors
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.surface_cells import Fragments, cells_of
from srbf.visibility.surfels import Surfels, surfels_of

pytest.importorskip("embreex")

PLATES = 0.19982  # of two parallel unit squares one side apart [Siegel1992, configuration C-11]


def square(z: float, up: bool, parts: int = 8) -> np.ndarray:
    """(2 parts^2, 3, 3): a unit square in small triangles, its normal up or down."""
    triangles = []
    for i in range(parts):
        for j in range(parts):
            a, b, c, d = ((np.array([i + x, j + y, 0]) / parts + [0, 0, z]) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
            triangles += [[a, b, c], [a, c, d]] if up else [[a, c, b], [a, d, c]]
    return np.array(triangles, np.float32)


def surfels(corners: np.ndarray, free: np.ndarray, count: int, albedo: float = 0.5) -> Surfels:
    surfaces = Fragments(corners, np.full((len(corners), 3), albedo, np.float32))
    return surfels_of(surfaces, np.zeros(len(corners), np.int64), EmbreeTriangles(corners), free, None, count)


def between_plates() -> Surfels:
    free = np.random.default_rng(0).uniform(0.1, 0.9, (64, 3))
    return surfels(np.concatenate([square(0, True), square(1, False)]), free, 64)


def centers(found: Surfels) -> RayOrigins:
    return RayOrigins.even(found.cells.places[:, None], found.cells.normals[:, None])


def test_two_plates() -> None:
    found = between_plates()
    lower = found.cells.normals[:, 2] > 0
    factors = form_factors(found, centers(found), 4096).toarray()
    share = factors[np.ix_(lower, ~lower)].sum(axis=1) @ found.cells.areas[lower] / found.cells.areas[lower].sum()
    assert share == pytest.approx(PLATES, rel=0.02)
    assert not factors[np.ix_(lower, lower)].any()
    flux = found.cells.areas[:, None] * factors
    np.testing.assert_allclose(flux[np.ix_(lower, ~lower)].sum(), flux[np.ix_(~lower, lower)].sum(), rtol=0.02)


def test_sides_that_no_free_place_sees_have_no_surfel() -> None:
    found = between_plates()
    assert set(np.sign(found.cells.normals[:, 2])) == {-1, 1}
    assert (found.cells.normals[:, 2] > 0)[found.cells.places[:, 2] < 0.5].all(), "the lower plate's back is out of reach"
    outside = found.seen_along(np.array([[0.5, 0.5, -1.0], [0.5, 0.5, 0.5]]), np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]))
    assert outside[0] == -1 and outside[1] >= 0


def test_black_surfaces_have_larger_surfels_unless_they_emit() -> None:
    """They may be made to emit after the bake."""
    corners, free = square(0, True, 16), np.array([[0.5, 0.5, 0.5]])
    gray = surfels(corners, free, 64).count
    black = Fragments(corners, np.zeros((len(corners), 3), np.float32))
    numbers, occluders = np.zeros(len(corners), np.int64), EmbreeTriangles(corners)
    dark = surfels_of(black, numbers, occluders, free, None, 64)
    assert 0.5 * gray < dark.count <= 64 and not dark.emission.any()
    dark = surfels_of(black, numbers, occluders, free, 0.125, 64)
    shining = surfels_of(black, numbers, occluders, free, 0.125, 64, np.full((2, len(corners), 3), 2.0, np.float32))
    assert 2 * dark.count < shining.count == 64
    np.testing.assert_allclose(shining.emission, 2.0)


def test_surfels_of_two_objects_or_of_light_and_dark_are_not_mixed() -> None:
    corners, free = square(0, True, 16), np.array([[0.5, 0.5, 0.5]])
    middle = corners.mean(axis=1)[:, 0]
    albedo, occluders = np.full((len(corners), 3), 0.5, np.float32), EmbreeTriangles(corners)
    objects = (middle > 0.4).astype(np.int64)
    emission = np.where(middle[:, None] > 0.7, np.array([3.0, 2.0, 0.0], np.float32), 0)
    found = surfels_of(
        Fragments(corners, albedo), objects, occluders, free, 0.25, 200, np.stack([emission, 0 * emission]).astype(np.float32)
    )
    shares = [np.bincount(found.owners[0], of, found.count) / np.bincount(found.owners[0]) for of in (objects, middle > 0.7)]
    assert all(np.isin(share, (0, 1)).all() for share in shares)
    np.testing.assert_array_equal(found.objects, shares[0])
    np.testing.assert_allclose(found.emission, shares[1][:, None] * [3, 2, 0])


def test_the_back_of_what_emits_lights_the_wall_behind() -> None:
    """A picture 5 mm off a wall: no free place sees its back. The inside of what is closed lights nothing else."""
    wall, picture = square(0, True), square(0.005, True) * [0.5, 0.5, 1] + [0.25, 0.25, 0]
    corners = np.concatenate([wall, picture]).astype(np.float32)
    objects = np.repeat([0, 1], len(wall))
    emission = np.broadcast_to((objects == 1)[None, :, None], (2, len(corners), 3)).astype(np.float32)
    albedo = np.full((len(corners), 3), 0.5, np.float32)
    free = np.random.default_rng(0).uniform([0.4, 0.4, 0.3], [0.6, 0.6, 0.5], (64, 3))
    for numbers, sides in ((objects, {-1, 1}), (0 * objects, {1})):  # a picture; a closed thing of one object
        found = surfels_of(Fragments(corners, albedo), numbers, EmbreeTriangles(corners), free, None, 200, emission)
        assert set(np.sign(found.cells.normals[found.emission.any(axis=1), 2])) == sides
        np.testing.assert_array_equal(found.hidden, found.emission.any(axis=1) & (found.cells.normals[:, 2] < 0))


def test_what_lies_on_a_floor_parts_its_surfels() -> None:
    """A rug 2 mm above it: under the rug is another surface than beside it, and a dark one."""
    floor, rug = square(0, True, 4), square(0.002, True, 4) * [0.4, 0.4, 1] + [0.3, 0.3, 0]
    free = np.random.default_rng(0).uniform([0.1, 0.1, 0.3], [0.9, 0.9, 0.9], (64, 3))
    found = surfels(np.concatenate([floor, rug]).astype(np.float32), free, 64)
    on_floor = found.cells.places[:, 2] < 0.001
    assert (found.cells.normals[:, 2] > 0).all()
    np.testing.assert_allclose(found.cells.areas[on_floor].sum(), 1 - 0.16, rtol=0.02)
    under, beside = np.array([[0.5, 0.5, 0.001], [0.32, 0.68, 0.001]]), np.array([[0.1, 0.5, 0.001], [0.76, 0.5, 0.001]])
    down = np.broadcast_to([0.0, 0.0, -1.0], (2, 3))
    assert (found.seen_along(under, down) == -1).all() and (found.seen_along(beside, down) >= 0).all()


def test_no_cell_has_two_walls_one_behind_another() -> None:
    walls = Fragments(np.concatenate([square(0, True), square(0.1, True)]), np.full((256, 3), 0.5, np.float32))
    owner = cells_of(walls, 0.5)[1]
    assert not set(owner[:128]) & set(owner[128:])
    assert len(set(owner)) == 2 * len(set(cells_of(walls.at(np.arange(128)), 0.5)[1]))


def test_no_more_surfels_than_asked() -> None:
    corners = np.concatenate([square(0, True, 16), square(1, False, 16)])
    free = np.random.default_rng(0).uniform(0.1, 0.9, (64, 3))
    assert surfels(corners, free, 100).count <= 100


def test_directions_have_the_density_of_the_cosine() -> None:
    normals = np.array([[0, 0, 1.0], [0, 0, -1.0], [0.6, 0, 0.8], [-1, 0, 0]])
    directions = cosine_directions(normals[:, None], 4096, np.random.default_rng(1))[:, 0]
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1, atol=1e-12)
    cosine = np.einsum("ncd,nd->nc", directions, normals)
    assert (cosine >= 0).all()
    np.testing.assert_allclose(cosine.mean(axis=1), 2 / 3, atol=2e-3)  # of density cos / pi
    np.testing.assert_allclose(directions.mean(axis=1), 2 / 3 * normals, atol=5e-3)


def test_the_same_seed_gives_the_same_rays() -> None:
    found = between_plates()
    one, again = (form_factors(found, centers(found), 64, 3).toarray() for _ in range(2))
    np.testing.assert_array_equal(one, again)
    assert (one != form_factors(found, centers(found), 64, 4).toarray()).any()


def test_rays_of_a_receivers_points_are_one_even_set() -> None:
    found = between_plates()
    points, normals = found.spread(16)
    apart = [form_factors(found, RayOrigins.even(points[:, q, None], normals[:, q, None]), 16, q).toarray() for q in range(16)]
    together = form_factors(found, RayOrigins.even(points, normals), 16).toarray()
    lower = found.cells.normals[:, 2] > 0
    exact = form_factors(found, RayOrigins.even(points, normals), 1024, 1).toarray()[lower][:, ~lower].sum(axis=1)
    error_apart, error_together = (np.std(factors[lower][:, ~lower].sum(axis=1) - exact) for factors in (np.mean(apart, axis=0), together))
    assert error_together < 0.7 * error_apart


def test_points_of_a_surfel_are_spread_over_its_area() -> None:
    found = between_plates()
    points, normals = found.spread(64)
    np.testing.assert_allclose(points.mean(axis=1), found.cells.places, atol=0.02)
    np.testing.assert_allclose(normals, np.broadcast_to(found.cells.normals[:, None], normals.shape), atol=1e-6)
    side = np.sqrt(found.cells.areas)
    assert (np.abs(points - found.cells.places[:, None]).max(axis=(1, 2)) < side).all()


def test_what_lit_surfaces_see_has_surfels_although_no_free_place_sees_it() -> None:
    """A shelf close above a floor: places above it see neither its lower side nor the floor below."""
    floor, shelf = square(0, True, 16), square(0.05, True, 16) * [0.5, 0.5, 1] + [0.25, 0.25, 0]
    free = np.random.default_rng(0).uniform([0.4, 0.4, 0.3], [0.6, 0.6, 0.5], (64, 3))
    found = surfels(np.concatenate([floor, shelf]).astype(np.float32), free, 400)
    under = (np.abs(found.cells.places[:, 2] - 0.05) < 1e-3) & (found.cells.normals[:, 2] < 0)
    assert under.any(), "the lower side is lit by the floor around it"
    assert not (found.cells.normals[:, 2][found.cells.places[:, 2] < 0.01] < 0).any(), "nothing lights the floor from below"
