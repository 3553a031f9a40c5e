"""Bright surfels that light in closed form: which they are, how much they give, and that pictures are nearer to the truth by them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_rooms import Room
from made_views import view_of_room, without_near

from srbf.asset import Asset
from srbf.lights import PointLight, SphereLight, SpotLight
from srbf.methods import linear_response
from srbf.methods.deep_framebuffer import DeepFramebuffer
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.near_cells import NearCells
from srbf.visibility.near_sources import NearPool, NearReceivers, disc_factors
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells

pytest.importorskip("embreex")

ROOM = Room.box((3, 2, 2), 0.05, 0.6)  # 12,800 cells


def cells_of(room: Room) -> Cells:
    places, normals, areas, albedo = (array.astype(np.float32) for array in (room.places, room.normals, room.areas, room.albedo))
    return Cells(places, normals, areas, albedo, np.arange(len(places)))


CELLS = cells_of(ROOM)
OCCLUDERS = EmbreeTriangles(ROOM.corners)
NEAR_CELLS = NearCells.of(CELLS, OCCLUDERS)
POOL = NearPool(CELLS, NEAR_CELLS)
NEAR = PointLight((0.06, 1.2, 0.8), falloff="inverse-square")
EVEN = 0.06
JUMP = 0.08  # of the light, in a step: 0.05 by cells that stay, 0.11 without blending, 0.40 by cells made again for each light
WHOLE = 0.03  # a disc's form factor is not that of a square right beside it


def first_reflection(light: PointLight) -> np.ndarray:
    return (ROOM.albedo * ReceivedLight(CELLS, EmbreeTriangles(ROOM.corners)).irradiance(light)).astype(np.float32)


def test_all_around_a_point_shares_sum_to_one() -> None:
    receivers = ROOM.free[:20].astype(np.float32)
    normals = np.random.default_rng(1).normal(size=receivers.shape).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(disc_factors(receivers, normals, CELLS).sum(axis=1), 1, atol=WHOLE)


def test_light_from_all_sides_alike_has_no_bright_surfels() -> None:
    assert not POOL.sources(np.ones((len(CELLS.places), 3), np.float32), NEAR).count
    assert not POOL.sources(first_reflection(PointLight((1.5, 1.0, 1.0), falloff="inverse-square")), NEAR).count
    assert not POOL.sources(np.zeros((len(CELLS.places), 3), np.float32), NEAR).count


def test_beside_a_wall_they_are_the_cells_next_to_the_light() -> None:
    near = POOL.sources(first_reflection(NEAR), NEAR)
    away = np.linalg.norm(CELLS.places[near.surfels] - np.array(NEAR.position), axis=1)
    assert near.count > 10 and away.max() < 0.6
    assert (near.parts > 0).all() and (near.parts <= 1).all() and near.parts.max() == 1
    np.testing.assert_allclose(sum(radiosity.sum(axis=0) for _, _, radiosity in near.by_cell()), near.radiosity.sum(axis=0), rtol=1e-5)


def test_cells_are_seen_above_their_surfels_and_parted_by_walls() -> None:
    """A room in two halves with a wall between: no cell has surfels of both, of the floor too, which the grid puts together."""
    assert len(np.unique(NEAR_CELLS.labels)) == len(NEAR_CELLS.places)
    assert ((NEAR_CELLS.places > 0) & (NEAR_CELLS.places < np.array((3, 2, 2)))).all()
    wall = np.array([[[1.52, -1.0, -1.0], [1.52, 9.0, -1.0], [1.52, -1.0, 9.0]]], np.float32)
    parted = NearCells.of(CELLS, EmbreeTriangles(np.concatenate([ROOM.corners, wall])))
    beyond = CELLS.places[:, 0] > 1.52
    for level in parted.labels:
        count = int(level.max()) + 1
        both = (np.bincount(level, beyond, count) > 0) & (np.bincount(level, ~beyond, count) > 0)
        assert not both.any()


@pytest.mark.lengthy
def test_what_receivers_see_does_not_jump() -> None:
    """A light slides 6 cm beside a wall, in front of which are boards: no step changes much of what it lays on the others."""
    boards = np.array([[[0.1, y, 0.0], [0.1, y + 0.1, 0.0], [0.1, y, 4.0]] for y in (0.9, 1.1, 1.3, 1.5)], np.float32)
    occluders = EmbreeTriangles(np.concatenate([ROOM.corners, boards]))
    cells = NearCells.of(CELLS, occluders)
    pool, receivers = NearPool(CELLS, cells), NearReceivers(CELLS.places[::7], CELLS.normals[::7], cells, occluders)
    received, former, steps = ReceivedLight(CELLS, occluders), None, []
    for y in np.arange(1.0, 1.3, 0.005):
        light = replace(NEAR, position=(0.06, float(y), 0.8))
        near = pool.sources((ROOM.albedo * received.irradiance(light)).astype(np.float32), light)
        found = receivers.irradiance(replace(near, radiosity=np.ones_like(near.radiosity) * near.parts[:, None]))
        if former is not None:
            steps.append(np.linalg.norm(found - former) / np.linalg.norm(found))
        former = found
    assert max(steps) < JUMP
    assert receivers.traced < len(steps)  # most cells are known from former places


def test_a_moving_light_takes_out_its_surfels_gradually() -> None:
    """No surfel goes from nothing to whole within a millimeter."""
    parts = []
    for step in (0, 1e-3):
        light: Any = replace(NEAR, position=(0.2 + step, 1.2, 0.8))
        near = POOL.sources(first_reflection(light), light)
        every = np.zeros(len(CELLS.places))
        every[near.surfels] = near.parts
        parts.append(every)
    assert parts[0].any() and np.abs(parts[1] - parts[0]).max() < 0.1


def test_what_stands_between_shadows_them() -> None:
    """Behind a wall with a door there is less, above the wall all."""
    first = first_reflection(NEAR)
    near = POOL.sources(first, NEAR)
    points, normals = np.array([[2.9, 1.2, 0.8], [2.9, 0.3, 1.8]]), np.array([[-1.0, 0, 0]] * 2)
    wall = np.array([[[1.5, 0.0, 0.0], [1.5, 4.0, 0.0], [1.5, 0.0, 4.0]], [[1.5, 4.0, 0.0], [1.5, 4.0, 4.0], [1.5, 0.0, 4.0]]], np.float32)
    aside, edge = (wall + np.array([0, 0, height], np.float32) for height in (1.1, 1.35))
    open_, hidden, above, partly = (
        NearReceivers(points, normals, NEAR_CELLS, EmbreeTriangles(corners)).irradiance(near)
        for corners in (ROOM.corners, wall, aside, edge)
    )
    assert (open_ > 0).all() and not hidden.any()
    assert (above[0] == open_[0]).all() and not above[1].any()
    toward = near.geometry.places - points[1]
    distance = np.linalg.norm(toward, axis=1)
    starts = np.repeat(points[1:], near.count, axis=0)
    seen = ~EmbreeTriangles(edge).occluded(starts, toward / distance[:, None], distance - 1e-3)
    factors = disc_factors(points[1:].astype(np.float32), normals[1:].astype(np.float32), near.geometry)[0]
    assert 0.1 < seen.mean() < 0.9
    np.testing.assert_allclose(partly[1], (factors * seen) @ near.radiosity, rtol=0.2)  # cells are seen or not as one


@pytest.fixture(scope="module")
def lit(tmp_path_factory: pytest.TempPathFactory) -> Asset:
    """Of coarse cells, whose light from a few surfels few rays meet."""
    return DeepFramebuffer().encode(view_of_room(tmp_path_factory.mktemp("near") / "capture", Room.box((3, 2, 2), 0.25, 0.6), 8000, 400))


@pytest.mark.lengthy
def test_pictures_have_no_blotches(lit: Asset) -> None:
    """Light 3 cm off a wall on the one across: even, where links alone scatter."""
    light = PointLight((0.03, 1.1, 0.9), falloff="inverse-square")
    linked = without_near(lit)
    covered = (lit.images["coverage"] > 0.5) & (lit.images["normal"][:, :, 0] < -0.5)
    place = lit.images["position"][covered]
    features = np.column_stack([np.ones(len(place)), place[:, 1:], place[:, 1:] ** 2, place[:, 1] * place[:, 2]])
    rough = []
    for asset in (linked, lit):
        values = linear_response(asset, [light])[covered][:, 0]
        slope = features @ np.linalg.lstsq(features, values, rcond=None)[0]
        rough.append(float(np.sqrt(((values - slope) ** 2).mean()) / values.mean()))
    assert rough[1] < 0.4 * rough[0]


@pytest.mark.lengthy
def test_lights_still_add_up_in_their_colors(lit: Asset) -> None:
    one, other = (
        PointLight((0.03, 1.1, 0.9), (1, 0.5, 0.2), falloff="inverse-square"),
        SphereLight((2.5, 0.1, 0.4), (0.1, 0.3, 1), size=0.05),
    )
    both = linear_response(lit, [one, other])
    np.testing.assert_allclose(both, linear_response(lit, [one]) + linear_response(lit, [other]), rtol=1e-4, atol=1e-6 * both.max())
    white = linear_response(lit, [replace(one, color=(1.0, 1.0, 1.0))])
    np.testing.assert_allclose(linear_response(lit, [one]), white * np.array(one.color), rtol=1e-4, atol=1e-6 * white.max())


@pytest.mark.parametrize("bounces", [0, 1, 2])
def test_light_is_reflected_as_often_as_by_links(lit: Asset, bounces: int) -> None:
    """In the sum over all pixels, where blotches of links even out; a bounce adds much more than the tolerance."""
    light = PointLight((0.03, 1.1, 0.9), falloff="inverse-square")
    limited = replace(lit, manifest={**lit.manifest, "gather": {**lit.manifest["gather"], "bounces": bounces}})
    linked = without_near(limited)
    found, expected = linear_response(limited, [light]).sum(), linear_response(linked, [light]).sum()
    assert found == pytest.approx(expected, rel=EVEN)
    assert bounces == 0 or found < 0.8 * linear_response(lit, [light]).sum()


@pytest.mark.lengthy
def test_an_asset_keeps_the_places(lit: Asset, tmp_path: Path) -> None:
    lit.save(tmp_path / "asset")
    light = [PointLight((0.03, 1.1, 0.9), falloff="inverse-square")]
    np.testing.assert_allclose(linear_response(Asset.open(tmp_path / "asset"), light), linear_response(lit, light), rtol=1e-4)


def test_a_cone_ends_within_cells() -> None:
    """The light of a narrow spot on a wall is that of its cone, wherever its edge is: 12 directions, of cells half as wide as the spot."""
    room = Room.box((3, 2, 2), 0.25, 0.6)
    cells = cells_of(room)
    received = ReceivedLight(cells, EmbreeTriangles(room.corners))
    outer = 0.2
    for y in np.linspace(0.8, 1.2, 12):
        spot = SpotLight((0.5, float(y), 1.0 + 0.1 * float(y)), falloff="inverse-square", direction=(1, 0, 0), inner=outer, outer=outer)
        flux = float((received.irradiance(spot)[:, 0] * cells.areas).sum())
        assert flux == pytest.approx(2 * np.pi * (1 - np.cos(outer)), rel=0.08)
