"""In-out factorization: all terms give the BRDF, what few leave out, pictures that no turn of the frame changes, ends, bad input."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.exitant_harmonics import harmonics
from srbf.brdf_factors import BOUNCE_ORDER, MOST_TERMS, factored, interpolated, of_bounces, turned, viewers_of_bounces
from srbf.errors import InputError
from srbf.microfacets import alpha_of, parts_of

COUNT = 4000
METAL, PLASTIC = (0.8, 1.0), (0.04, 1.0)


def upward(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z, turn = rng.random(COUNT), 2 * np.pi * rng.random(COUNT)
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)


LIGHTS, VIEWERS = upward(1), upward(2)


def true(roughness: float, ends: tuple[float, float]) -> np.ndarray:
    alpha = np.full(COUNT, alpha_of(np.array([roughness]))[0])
    even, grazing = parts_of(LIGHTS[:, 2], VIEWERS[:, 2], (LIGHTS * VIEWERS).sum(axis=1), alpha)
    return ends[0] * even + ends[1] * grazing


def told(roughness: float, ends: tuple[float, float], terms: int, lights: np.ndarray = LIGHTS, viewers: np.ndarray = VIEWERS) -> np.ndarray:
    factors = factored(roughness, *ends, terms)
    even, grazing = factors.of_viewers(viewers)
    return (factors.of_lights(lights) * (ends[0] * even + ends[1] * grazing)).sum(axis=1)


def error(found: np.ndarray, expected: np.ndarray) -> float:
    """Relative RMSE, viewers by their cosine."""
    weight = VIEWERS[:, 2]
    return float(np.sqrt((weight * (found - expected) ** 2).sum() / (weight * expected**2).sum()))


@pytest.mark.parametrize("ends", [METAL, PLASTIC])
def test_all_terms_are_the_brdf(ends: tuple[float, float]) -> None:
    assert error(told(1.0, ends, MOST_TERMS), true(1.0, ends)) < 0.02


@pytest.mark.parametrize(("ends", "terms"), [(METAL, 1), (METAL, 4), (METAL, 16), (PLASTIC, 4)])
def test_what_terms_leave_out_is_told(ends: tuple[float, float], terms: int) -> None:
    """Pairs of directions that the tables do not know lack the share that singular values predict."""
    factors = factored(0.7, *ends, terms)
    assert len(factors.orders) == terms
    assert error(told(0.7, ends, terms), true(0.7, ends)) == pytest.approx(np.sqrt(factors.left_out), rel=0.06)


def test_more_terms_leave_less_out_and_sharper_lobes_more() -> None:
    by_terms = [factored(0.7, *METAL, terms).left_out for terms in (1, 2, 4, 8, 16)]
    assert by_terms == sorted(by_terms, reverse=True) and by_terms[-1] < 0.1 * by_terms[0]
    assert factored(1.0, *METAL, 4).left_out < 1e-4 < factored(0.7, *METAL, 4).left_out


@pytest.mark.parametrize("terms", [2, 4, 7])
def test_no_turn_of_the_frame_about_the_normal_changes_a_sum(terms: int) -> None:
    """Whole pairs of cos and sin alone have this: half a pair would show the frame."""
    turn = 0.7
    matrix = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    turned = told(0.7, METAL, terms, LIGHTS @ matrix.T, VIEWERS @ matrix.T)
    np.testing.assert_allclose(turned, told(0.7, METAL, terms), atol=2e-4)


def test_errors_of_terms_are_those_of_radiance() -> None:
    """Each g_i of the material has a mean square of 1/3 over viewers by their cosine, and they are orthogonal."""
    factors = factored(0.7, *METAL, 6)
    even, grazing = factors.of_viewers(upward(3))
    toward = METAL[0] * even + METAL[1] * grazing
    gram = 2 * (toward * upward(3)[:, 2:]).T @ toward / COUNT
    np.testing.assert_allclose(gram, np.eye(6) / 3, atol=0.05)


def test_nothing_comes_from_below_and_below_is_seen_as_the_horizon() -> None:
    factors = factored(0.7, *METAL, 4)
    low = np.array([[0.6, 0.0, -0.8], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    assert not factors.of_lights(low).any()
    below, horizon = factors.of_viewers(low[:1]), factors.of_viewers(low[1:2])
    np.testing.assert_allclose(below, horizon, rtol=1e-6)


def test_along_the_normal_nothing_turns() -> None:
    factors = factored(0.7, *METAL, 4)
    up = np.array([[0.0, 0.0, 1.0]])
    for values in (factors.of_lights(up)[0], *factors.of_viewers(up)[:, 0]):
        assert not values[factors.orders != 0].any() and values[factors.orders == 0].all()


def test_mirrors_are_finite() -> None:
    factors = factored(0.0, *METAL, 4)
    assert np.isfinite(factors.of_lights(LIGHTS)).all() and np.isfinite(factors.of_viewers(VIEWERS)).all() and factors.left_out > 0.5


@pytest.mark.parametrize("roughness", [0.7, 1.0])
@pytest.mark.parametrize("viewer", [(0.0, 0.0, 1.0), (0.6, 0.3, 0.74)])
def test_harmonics_of_bounced_light_are_reflected_as_the_light_is(roughness: float, viewer: tuple[float, float, float]) -> None:
    """Even light, light from near the horizon and light from one side, by quadrature over directions of density NoL."""
    rng = np.random.default_rng(4)
    count = 20_000
    square, turn = (np.arange(count) + 0.5) / count, 2 * np.pi * rng.random(count)
    lights = np.stack([np.sqrt(square) * np.cos(turn), np.sqrt(square) * np.sin(turn), np.sqrt(1 - square)], axis=1)
    seen = np.array([viewer]) / np.linalg.norm(viewer)
    alpha = np.full(count, alpha_of(np.array([roughness]))[0])
    even, grazing = parts_of(lights[:, 2], np.full(count, seen[0, 2]), lights @ seen[0], alpha)
    whole = METAL[0] * even + METAL[1] * grazing
    ends = [interpolated(table, seen[:, 2]) for table in viewers_of_bounces(roughness)]
    orders = np.concatenate([np.arange(-degree, degree + 1) for degree in range(BOUNCE_ORDER + 1)])
    weights = (turned(orders, seen) * (METAL[0] * ends[0] + METAL[1] * ends[1]))[0]
    factors = factored(roughness, *METAL, MOST_TERMS)
    toward = np.sum([end * part for end, part in zip(METAL, factors.of_viewers(seen)[:, 0], strict=True)], axis=0)
    for radiance in (np.ones(count), 1 - lights[:, 2], np.maximum(lights[:, 0], 0)):
        waves = np.pi * (harmonics(lights, BOUNCE_ORDER) * radiance[:, None]).mean(axis=0)
        expected = np.pi * (whole / lights[:, 2] * radiance).mean()
        assert weights @ waves == pytest.approx(expected, rel=0.03, abs=0.01)
        assert toward @ of_bounces(factors) @ waves == pytest.approx(expected, rel=0.04, abs=0.01)


@pytest.mark.parametrize("terms", [0, -1, MOST_TERMS + 1])
def test_other_numbers_of_terms_are_refused(terms: int) -> None:
    with pytest.raises(InputError, match="expected 1 to 64 terms of gloss"):
        factored(0.7, *METAL, terms)
