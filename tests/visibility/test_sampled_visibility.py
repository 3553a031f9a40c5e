"""Sparse sampling of visibility beside brute force: nothing that varies, order, seeds, receivers that are inside, equal, or alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from closed_forms import ball, quad

from srbf.cubemap import Cubemap
from srbf.visibility import refined_visibility
from srbf.visibility.element_tracer import ElementTracer
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.refined_visibility import AROUND, SampledVisibility, coarse_rows, levels_of, refined
from srbf.visibility.sparse_transport import l1_combination, sparsely_sampled

pytest.importorskip("embreex")

CUBEMAP = Cubemap(8)
SIDE = 40
UP = np.array([0, 0, 1], np.float32)
Sample = Callable[[ElementTracer, Cubemap, int], SampledVisibility]
SAMPLERS = pytest.mark.parametrize("sample", [refined, pytest.param(sparsely_sampled, marks=pytest.mark.slow)])
EQUAL_ROWS = 0.02  # of the elements of equal receivers that may differ, since some are dense and some are not
GOOD: dict[Sample, float] = {refined: 0.03, sparsely_sampled: 0.15}  # relative RMSE under suns, of few receivers and wide texels


def grid(side: int = SIDE) -> tuple[np.ndarray, np.ndarray]:
    """Places of a square of 4 m at z = 0, and their normals."""
    x, y = np.meshgrid(*[np.linspace(-2, 2, side)] * 2)
    places = np.stack([x.ravel(), y.ravel(), np.full(x.size, 1e-4)], axis=1)
    return places.astype(np.float32), np.tile(UP, (x.size, 1))


def tracer_of(corners: np.ndarray, order: np.ndarray | None = None, cubemap: Cubemap = CUBEMAP, side: int = SIDE) -> ElementTracer:
    places, normals = grid(side)
    order = np.arange(len(places)) if order is None else order
    return ElementTracer(places[order], normals[order], cubemap.directions.astype(np.float32), EmbreeTriangles(corners))


BALL = ball(0.6, [0, 0, 0.9]).astype(np.float32)


def under_suns(found: np.ndarray, true: np.ndarray, tracer: ElementTracer) -> float:
    cosine = np.maximum(tracer.normals @ tracer.directions.T, 0)
    guessed, truth = (np.unpackbits(bits, axis=1, count=len(tracer.directions)) * cosine for bits in (found, true))
    return float(np.linalg.norm(guessed - truth) / np.linalg.norm(truth))


def test_brute_force_is_a_ray_for_every_element_above_the_horizon() -> None:
    """A ball of radius r about c hides a direction from a place p where the line passes it by less than r."""
    tracer = tracer_of(ball(0.6, [0, 0, 0.9], 128).astype(np.float32))
    seen = np.unpackbits(tracer.all_seen(), axis=1, count=CUBEMAP.count).view(bool)
    above = tracer.directions[:, 2] > 0
    assert tracer.rays == above.sum() * tracer.count and not seen[:, ~above].any()
    to_center = np.array([0, 0, 0.9]) - tracer.starts
    along = to_center @ tracer.directions.T
    passed = np.sqrt(np.maximum((to_center**2).sum(axis=1)[:, None] - along**2, 0))
    clear = np.abs(passed - 0.6) > 0.01  # the ball is a polyhedron
    expected = (passed > 0.6) | (along < 0)
    assert (seen == expected)[clear & above].all()


def test_asking_for_every_element_is_brute_force() -> None:
    tracer = tracer_of(BALL)
    bits = np.zeros((tracer.count, tracer.row_bytes), np.uint8)
    rows = np.random.default_rng(0).permutation(tracer.count)
    for part in np.array_split(rows, 3):
        tracer.add_seen(bits, part, tracer.above_bits(part))
    np.testing.assert_array_equal(bits, tracer_of(BALL).all_seen())
    row, column = np.divmod(np.arange(0, tracer.count * CUBEMAP.count, 97), CUBEMAP.count)
    single = tracer.seen(row, column) & (tracer.directions[column, 2] > 0)
    np.testing.assert_array_equal(single, np.unpackbits(bits, axis=1, count=CUBEMAP.count)[row, column])


@SAMPLERS
def test_a_part_of_the_elements_tells_the_rest(sample: Sample) -> None:
    whole, tracer = tracer_of(BALL), tracer_of(BALL)
    true, found = whole.all_seen(), sample(tracer, CUBEMAP, 0)
    assert tracer.rays < 0.6 * whole.rays and found.asked < 0.5 * tracer.count * CUBEMAP.count
    assert under_suns(found.bits, true, tracer) < GOOD[sample]
    assert 0 <= found.error < 0.2


def test_directions_between_others_that_agree_need_no_ray(monkeypatch: pytest.MonkeyPatch) -> None:
    cubemap = Cubemap(16)
    true = tracer_of(BALL, cubemap=cubemap).all_seen()
    found: dict[int, SampledVisibility] = {}
    for least in (AROUND, 5):  # of four: none is guessed
        monkeypatch.setattr(refined_visibility, "AROUND", least)
        found[least] = refined(tracer_of(BALL, cubemap=cubemap), cubemap, 0)
    tracer = tracer_of(BALL, cubemap=cubemap)
    guessed, traced = (under_suns(one.bits, true, tracer) for one in found.values())
    assert found[AROUND].asked < 0.85 * found[5].asked
    assert guessed < traced + 0.01


@SAMPLERS
def test_without_occluders_no_features_are_needed(sample: Sample) -> None:
    far = quad([90, 90, -1], [91, 90, -1], [91, 91, -1], [90, 91, -1])
    tracer = tracer_of(far)
    found = sample(tracer, CUBEMAP, 0)
    np.testing.assert_array_equal(found.bits, tracer.above_bits(np.arange(tracer.count)))
    assert found.error == 0 and found.asked < 0.1 * tracer.count * CUBEMAP.count
    assert tracer.rays < 0.1 * tracer.count * CUBEMAP.count


@SAMPLERS
def test_the_order_of_receivers_changes_little_and_a_seed_nothing(sample: Sample) -> None:
    order = np.random.default_rng(5).permutation(SIDE**2)
    tracer, permuted = tracer_of(BALL), tracer_of(BALL, order)
    found, again, other = sample(tracer, CUBEMAP, 3), sample(tracer_of(BALL), CUBEMAP, 3), sample(permuted, CUBEMAP, 3)
    np.testing.assert_array_equal(found.bits, again.bits)
    assert (found.asked, found.error) == (again.asked, again.error)
    assert under_suns(other.bits, tracer_of(BALL, order).all_seen(), permuted) < GOOD[sample]


@SAMPLERS
def test_receivers_inside_geometry_see_nothing_and_duplicates_agree(sample: Sample) -> None:
    places, normals = grid()
    inside = np.tile(np.array([0, 0, 0.9], np.float32), (40, 1))
    starts = np.concatenate([places, inside, np.repeat(places[:1], 40, axis=0)])
    facing = np.concatenate([normals, normals[:80]])
    tracer = ElementTracer(starts, facing, CUBEMAP.directions.astype(np.float32), EmbreeTriangles(BALL))
    found = sample(tracer, CUBEMAP, 0).bits
    assert not found[len(places) : len(places) + 40].any()
    corner = np.unpackbits(found[len(places) + 40 :], axis=1)
    assert (corner != corner[0]).mean() < EQUAL_ROWS and corner.any()


@SAMPLERS
@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_few_receivers_far_apart(sample: Sample, count: int) -> None:
    """None has neighbors near it: each is sampled by itself."""
    places = np.array([[1000.0 * i, 0, 1e-4] for i in range(count)], np.float32)
    normals = np.tile(UP, (count, 1))
    tracer = ElementTracer(places, normals, CUBEMAP.directions.astype(np.float32), EmbreeTriangles(BALL))
    found = sample(tracer, CUBEMAP, 0)
    assert found.bits.shape == (count, tracer.row_bytes) and under_suns(found.bits, tracer.all_seen(), tracer) < 0.2


@pytest.mark.slow
def test_receivers_without_dense_neighbors_are_sampled_and_said() -> None:
    """A ground, and places a kilometer apart."""
    places, normals = grid()
    alone = np.array([[1000.0 * i, 1000, 1e-4] for i in range(40)], np.float32)
    starts, facing = np.concatenate([places, alone]), np.concatenate([normals, np.tile(UP, (40, 1))])
    tracer = ElementTracer(starts, facing, CUBEMAP.directions.astype(np.float32), EmbreeTriangles(BALL))
    said: list[str] = []
    found = sparsely_sampled(tracer, CUBEMAP, 0, say=said.append)
    count, _, rest = said[1].partition(" of ")
    assert 20 <= int(count) <= 40 and rest.startswith(f"{len(starts)} receivers have fewer than 4 dense neighbors within")
    np.testing.assert_array_equal(found.bits[-40:], tracer.all_seen()[-40:])


def test_levels_hold_every_receiver_once() -> None:
    places, normals = grid()
    levels = levels_of(places, normals)
    np.testing.assert_array_equal(np.sort(np.concatenate([rows for _, rows in levels])), np.arange(len(places)))
    sizes = [size for size, _ in levels]
    assert sizes == sorted(sizes, reverse=True) and len(levels[0][1]) < len(levels[-1][1])
    assert levels_of(places[:0], normals[:0]) == []


def test_a_quarter_of_the_directions_is_asked_for_and_those_near_the_horizon() -> None:
    """Nothing hides any direction: within 7 x 7 texels of the horizon alone do samples differ."""
    tracer = tracer_of(quad([90, 90, -1], [91, 90, -1], [91, 91, -1], [90, 91, -1]))
    bits, changed = (np.zeros((tracer.count, tracer.row_bytes), np.uint8) for _ in range(2))
    asked = coarse_rows(tracer, CUBEMAP, np.arange(9), bits, changed)
    assert 9 * CUBEMAP.coarse.sum() <= asked < 0.7 * 9 * CUBEMAP.count
    differ = np.unpackbits(changed[:9], axis=1, count=CUBEMAP.count).any(axis=0)
    assert 0 < tracer.directions[differ, 2].max() < 0.75 and not changed[9:].any()
    np.testing.assert_array_equal(bits[:9], tracer.above_bits(np.arange(9)))


def test_a_sparse_combination_finds_the_row_that_it_is_of() -> None:
    rng = np.random.default_rng(0)
    rows = (rng.random((200, 12)) > 0.5).astype(np.float32)
    alpha = l1_combination(rows, rows[:, 4].astype(np.float64))
    assert alpha.argmax() == 4 and alpha[4] > 0.9 and np.abs(np.delete(alpha, 4)).max() < 0.05
