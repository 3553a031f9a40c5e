"""What a view gathers: one triangle under one light in closed form, a white furnace, packed links, thinner links, pools, clusters."""

from __future__ import annotations

import numpy as np
import pytest
from made_rooms import Room, divided
from made_views import surfaces_of

from srbf.lights import PointLight
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.gather_operator import GatherOperator
from srbf.visibility.gather_pool import pool_of
from srbf.visibility.packed_links import link_count, packed, share_within, unpacked
from srbf.visibility.pixel_points import PixelPoints
from srbf.visibility.received import ReceivedLight
from srbf.visibility.sparse_links import SparseLinks, radiosity_of
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.surfels import Surfels
from srbf.visibility.view_clusters import ViewClusters

pytest.importorskip("embreex")

ROOM = Room.box((3, 2, 2), 0.25, 0.6)


def points_of(places: np.ndarray, normals: np.ndarray) -> PixelPoints:
    return PixelPoints(places, normals, np.arange(len(places)), np.ones(len(places), np.float32), len(places))


def form_factor(point: np.ndarray, normal: np.ndarray, corners: np.ndarray) -> float:
    """Of a polygon in front of a point, by Lambert's sum over its edges."""
    unit = (corners - point) / np.linalg.norm(corners - point, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(unit, np.roll(unit, -1, axis=0), strict=True):
        across = np.cross(a, b)
        total += np.arccos(np.clip(a @ b, -1, 1)) * (across @ normal) / np.linalg.norm(across)
    return abs(total) / (2 * np.pi)


def test_one_triangle_under_one_light() -> None:
    """E = F rho e: the triangle is lit evenly from afar, the point sees nothing else."""
    triangle = np.array([[[-1, -1, 2], [-1, 1.4, 2], [1.2, -0.3, 2.5]]], np.float32)
    point, normal = np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    light = PointLight((3.0, 4.0, -120.0), a0=100.0, falloff="inverse-square")
    corners = divided(triangle, 0.3)
    occluders = EmbreeTriangles(triangle)
    free = np.array([point, [0.3, 0.2, -1.0]])
    surfaces = Fragments(corners, np.full((len(corners), 3), 0.4, np.float32))
    pool = pool_of(surfaces, np.zeros(len(corners), np.int64), occluders, free, point[None], normal[None], 64)
    operator = GatherOperator.traced(pool, points_of(point[None], normal[None]), occluders, 1)
    lit = ReceivedLight(operator.cells, occluders).irradiance(light).astype(np.float32)
    found = operator.view.matrix() @ radiosity_of(operator.exchange.matrix(), operator.cells.albedo, lit, 12)
    facing = np.cross(triangle[0, 1] - triangle[0, 0], triangle[0, 2] - triangle[0, 0]).astype(np.float64)
    toward = np.array(light.position) - triangle[0].mean(axis=0)
    distance = np.linalg.norm(toward)
    cosine = abs(toward @ facing) / np.linalg.norm(facing) / distance
    expected = form_factor(point, normal, triangle[0].astype(np.float64)) * 0.4 * 100.0**2 * cosine / distance**2
    np.testing.assert_allclose(found, expected, rtol=0.03)


@pytest.mark.lengthy
def test_a_white_furnace_converges() -> None:
    """A closed box of albedo rho whose walls receive 1 gives rho / (1 - rho) everywhere, and a single bounce rho."""
    occluders = EmbreeTriangles(ROOM.corners)
    found = surfaces_of(ROOM, 0.2)
    surfaces = Fragments(found.corners, np.full_like(found.albedo, 0.7))
    pool = pool_of(surfaces, found.objects, occluders, ROOM.free, ROOM.places, ROOM.normals, 1000)
    operator = GatherOperator.traced(pool, points_of(ROOM.places, ROOM.normals), occluders, 200)
    lit = np.ones((pool.count, 3), np.float32)
    for bounces, expected in ((None, 0.7 / 0.3), (1, 0.7), (2, 0.7 + 0.49), (0, 0.0)):
        gathered = operator.view.matrix() @ radiosity_of(operator.exchange.matrix(), operator.cells.albedo, lit, bounces)
        np.testing.assert_allclose(gathered, expected, rtol=2e-3)
    mixed = (gathered[operator.nearest] * operator.weights[..., None]).sum(axis=1)
    assert mixed.shape == (len(ROOM.places), 3)
    np.testing.assert_allclose(operator.weights.sum(axis=1), 1, rtol=1e-5)


@pytest.mark.lengthy
def test_a_pool_is_fine_where_the_view_looks() -> None:
    occluders = EmbreeTriangles(ROOM.corners)
    found = surfaces_of(ROOM, 0.1)
    corner = np.array([[0.2, 0.2, 1e-3]])
    pool = pool_of(Fragments(found.corners, found.albedo), found.objects, occluders, ROOM.free, corner, np.array([[0, 0, 1.0]]), 600)
    assert 500 < pool.count <= 600 and abs(pool.cells.areas.sum() / ROOM.areas.sum() - 1) < 1e-3
    distance = np.linalg.norm(pool.cells.places - corner, axis=1)
    assert 3 * np.median(pool.cells.areas[distance < 1]) < np.median(pool.cells.areas[distance > 2])
    assert pool.owners.max() == pool.count - 1


def test_no_surfel_is_parted_by_a_wall() -> None:
    apart = Room.box((4, 3, 2.5), 0.5, 0.6, (2.0, 3.0, 3.0))  # without a door
    found = surfaces_of(apart, 0.3)
    pool: Surfels = pool_of(
        Fragments(found.corners, found.albedo), found.objects, EmbreeTriangles(apart.corners), apart.free, apart.places, apart.normals, 200
    )
    sides = np.where(found.corners.mean(axis=1)[:, 0] < 2, -1, 1)
    assert len(pool.corners) >= len(found.corners)
    middles = pool.corners.mean(axis=1)[:, 0]
    for owner in pool.owners:
        for surfel in np.unique(owner[owner >= 0]):
            own = middles[owner == surfel]
            assert (own < 2 + 1e-6).all() or (own > 2 - 1e-6).all()
    assert sides.any()


def test_links_are_packed_and_found_again() -> None:
    rng = np.random.default_rng(4)
    sizes = rng.integers(0, 40, 90)
    starts = np.concatenate([[0], np.cumsum(sizes)])
    surfels = np.concatenate([np.sort(rng.choice(60_000, size, replace=False)) for size in sizes]).astype(np.uint16)
    links = SparseLinks(starts, surfels, rng.integers(1, 700, len(surfels)).astype(np.uint16), 700, 60_000)
    again = unpacked(*packed(links), links.rows, 700, 60_000)
    np.testing.assert_allclose((again.matrix() - links.matrix()).toarray(), 0, atol=1e-7)
    with pytest.raises(ValueError, match="surfels"):
        unpacked(*packed(links), links.rows, 700, 100)


def test_fewer_rays_keep_the_light_of_every_row() -> None:
    rng = np.random.default_rng(5)
    counts = rng.integers(1, 9, (50, 60))
    links = SparseLinks(np.arange(51) * 60, np.tile(np.arange(60), 50).astype(np.uint16), counts.ravel().astype(np.uint16), 400, 60)
    for share in (0.5, 0.25, 0.1):
        thin = links.thinned(share)
        kept = np.add.reduceat(thin.counts.astype(np.int64), thin.starts[:-1])
        assert np.abs(kept - share * counts.sum(axis=1)).max() <= 1
        assert abs(len(thin.counts) / link_count(links, share) - 1) < 0.1
    assert abs(link_count(links, share_within(links, 1000)) - 1000) < 20 and share_within(links, 1e9) == 1
    assert links.thinned(1.0) is links


def test_a_wall_keeps_light_of_clusters_apart() -> None:
    """Two floors side by side with a wall between them: a point mixes the clusters on its side alone."""
    steps = np.linspace(-0.9, 0.9, 10)
    places = np.array([[x, y, 0.0] for x in steps for y in steps])
    normals = np.tile([0.0, 0.0, 1.0], (100, 1))
    wall = np.array([[[0, -2, -1], [0, 2, -1], [0, 2, 3]], [[0, -2, -1], [0, 2, 3], [0, -2, 3]]], np.float32)
    clusters = ViewClusters.of_points(places, normals, 40, 2.0)
    nearest, weights = clusters.mixed(places, normals, EmbreeTriangles(wall))
    across = np.sign(clusters.places[nearest][..., 0]) != np.sign(places[:, None, 0])
    assert across.any() and not weights[across].any()
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-5)
    _, open_ = clusters.mixed(places, normals)
    assert open_[across].any()


def test_pixels_of_several_points_mix_their_clusters() -> None:
    pixels = PixelPoints(np.zeros((3, 3)), np.zeros((3, 3)), np.array([1, 1, 0]), np.array([0.25, 0.75, 1], np.float32), 3)
    found, weights = pixels.gathered(np.array([[0, 1], [1, 2], [2, 3]]), np.array([[0.5, 0.5], [0.5, 0.5], [1.0, 0.0]]))
    assert found[0, 0] == 2 and weights[0, 0] == 1 and not weights[2].any()
    assert dict(zip(found[1].tolist(), weights[1].tolist(), strict=True)) == pytest.approx({1: 0.5, 2: 0.375, 0: 0.0})


def test_what_little_a_pixel_shows_of_a_far_surface_stays() -> None:
    """A tenth of it, spread over as many clusters as the rest, which are all close to each other: they are merged among themselves."""
    near, far = np.arange(12), np.arange(12, 24)
    features = np.zeros((24, 6))
    features[near, 0], features[far, 0] = 0.01 * near, 5 + 0.01 * far
    clusters = np.stack([near, far])
    weights = np.stack([np.full(12, 1 / 12), np.full(12, 1 / 12)])
    pixels = PixelPoints(np.zeros((2, 3)), np.zeros((2, 3)), np.array([0, 0]), np.array([0.9, 0.1], np.float32), 1)
    found, amount = pixels.gathered(clusters, weights, features)
    assert found.shape == (1, 10) and amount.sum() == pytest.approx(1)
    assert amount[0][found[0] >= 12].sum() == pytest.approx(0.1)
    dropped, heaviest = pixels.gathered(clusters, weights)
    assert not heaviest[0][dropped[0] >= 12].any()
