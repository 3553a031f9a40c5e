"""Pictures under unseen light: sums are sums, shadow edges are where shadows end, and what the clamp takes."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.evaluation.errors_by_role import psnr
from srbf.evaluation.flip import Flip
from srbf.evaluation.held_out import EDGE_SHARE, MIN_COLOR, SUMS, held_out_error, negative, shadow_edges, sums_of_lights

COVERED = np.ones((12, 16), bool)


def stacks(noise: float, count: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Pictures, and the same with noise."""
    rng = np.random.default_rng(3)
    true = rng.uniform(0.2, 1, (count, 12, 16, 3)).astype(np.float32)
    return true, true + rng.normal(0, noise, true.shape).astype(np.float32)


def test_one_light_is_the_pictures_themselves() -> None:
    true, relit = stacks(0.05)
    error = held_out_error(true, relit, COVERED, 1, 2.0, Flip(0.0))
    each = [psnr(2.0, float(np.sqrt(((np.maximum(b, 0) - a) ** 2).mean()))) for a, b in zip(true, relit, strict=True)]
    assert error.pictures == 5 and error.psnr == pytest.approx(np.mean(each), abs=1e-4)
    assert error.worst == pytest.approx(min(each), abs=1e-4)


@pytest.mark.parametrize(("lights", "count"), [(2, 5), (8, 5)])
def test_a_sum_is_linear_and_as_bright_as_one_light(lights: int, count: int) -> None:
    flat = np.ones((count, 2, 2, 3), np.float32)
    ramp = np.arange(count, dtype=np.float32)[:, None, None, None] * flat
    ones, weighed = sums_of_lights((flat, ramp), lights, np.random.default_rng(0))
    assert len(ones) == SUMS
    assert np.allclose(ones.mean(axis=(1, 2, 3)), 1, atol=1e-6)  # colors add up to one white light, whichever lights were drawn
    again, doubled = sums_of_lights((flat, 2 * ramp), lights, np.random.default_rng(0))
    assert np.allclose(doubled, 2 * weighed) and (again == ones).all()
    assert ones.std(axis=3).max() > 0.01 and ones.min() > MIN_COLOR / 2  # colored, none extinguished


def test_errors_of_independent_lights_average_out() -> None:
    true, relit = stacks(0.05, count=16)
    one, eight = (held_out_error(true, relit, COVERED, n, 1.0, Flip(0.0)).psnr for n in (1, 8))
    assert eight - one == pytest.approx(
        10 * np.log10(8), abs=1.2
    )  # noise of eight equal shares is √8 times less, a little more for unequal


def test_shadow_edges_are_the_steps_of_light_and_not_of_paint() -> None:
    chequer = np.where((np.indices((40, 40)).sum(axis=0) // 4) % 2, 0.8, 0.2)[..., None].repeat(3, axis=2)
    mean = chequer.astype(np.float32)
    shadowed = mean.copy()
    shadowed[:, 20:] *= 0.1
    edges = shadow_edges(shadowed, mean, np.ones((40, 40), bool))
    columns = np.flatnonzero(edges.any(axis=0))
    assert columns.tolist() == [19, 20] and 0 < edges.mean() <= EDGE_SHARE + 0.01
    holed = np.ones((40, 40), bool)
    holed[:, 20:] = False
    assert not shadow_edges(np.where(holed[..., None], mean, 0), mean, holed)[:, 19].all()  # a step into a hole is none


def test_the_clamp_takes_what_is_below_zero() -> None:
    image = np.array([[[3.0, -1.0, 0.0], [4.0, 2.0, -2.0]]], np.float32)[None]
    found = negative(image, np.ones((1, 2), bool))
    assert found.values == pytest.approx(2 / 6)
    assert found.energy == pytest.approx(5 / 34)
    assert found.brightness == pytest.approx(3 / 9)


def test_flip_is_nothing_between_equals_and_sees_a_difference() -> None:
    pytest.importorskip("flip_evaluator")
    true, relit = stacks(0.2, count=1)
    holed = COVERED.copy()
    holed[:, :8] = False
    judge = Flip(0.5)
    assert judge.error_map(true[0], true[0], COVERED).max() == 0
    assert judge.error_map(true[0], relit[0], COVERED).mean() > 0.05
    spoilt = np.where(holed[..., None], true[0], 90.0).astype(np.float32)
    assert judge.error_map(true[0], spoilt, holed).max() == 0  # what is not covered is not looked at
    assert "-1.5 to +2.5 EV" in judge.sentence()
