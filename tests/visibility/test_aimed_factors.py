"""Form factors to small surfels that emit: closed form from far away, a shadow, rays where they are near, less noise than rays."""

from __future__ import annotations

import numpy as np
import pytest
from test_form_factors import square

from srbf.visibility.aimed_factors import AimedFactors
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.form_factors import RayOrigins, form_factors
from srbf.visibility.surface_cells import Fragments
from srbf.visibility.surfels import Surfels, surfels_of

pytest.importorskip("embreex")

SIDE = 0.04  # m, of a square that emits 1 m above a floor


def under_a_small_square(shade: bool = False) -> Surfels:
    floor = square(0, True)
    above = square(0, False, 2) * [SIDE, SIDE, 0] + [0.5 - SIDE / 2, 0.5 - SIDE / 2, 1.0]
    below = square(0, True, 2) * [0.2, 0.2, 0] + [0.4, 0.4, 0.9]
    corners = np.concatenate([floor, above, *([below] if shade else [])]).astype(np.float32)
    objects = np.where(corners[:, 0, 2] == 1, 1, 0)
    emission = np.broadcast_to((objects == 1)[None, :, None], (2, len(corners), 3)).astype(np.float32)
    free = np.random.default_rng(0).uniform(0.1, 0.8, (64, 3))
    albedo = np.full((len(corners), 3), 0.5, np.float32)
    return surfels_of(Fragments(corners, albedo), objects, EmbreeTriangles(corners), free, None, 64, emission)


def places(count: int = 16) -> RayOrigins:
    """On the floor, one of them 2 cm below the square."""
    points = np.random.default_rng(1).uniform([0, 0, 0], [1, 1, 0], (count, 3))
    points[0] = [0.5, 0.5, 0.98]
    normals = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    return RayOrigins.even(points[:, None], normals[:, None])


def small(factors, found: Surfels) -> np.ndarray:
    return factors.toarray()[:, (found.emission.any(axis=1)) & (found.cells.normals[:, 2] < 0)].sum(axis=1)


def test_a_far_square_by_its_closed_form() -> None:
    """F = A cos cos' / (pi r^2) of what is small; 64 rays of a receiver would meet it once in 1000."""
    found, origins = under_a_small_square(), places()
    by_rays = form_factors(found, origins, 64)
    aimed = AimedFactors(found).put(by_rays, origins, 16, 0)
    away = np.array([0.5, 0.5, 1.0]) - origins.points[1:, 0]
    squared = (away**2).sum(axis=1)
    expected = SIDE**2 * away[:, 2] ** 2 / (np.pi * squared**2)
    np.testing.assert_allclose(small(aimed, found)[1:], expected, rtol=0.02)
    assert np.abs(small(by_rays, found)[1:] / expected - 1).mean() > 0.9
    assert small(aimed, found)[0] == small(by_rays, found)[0] > 0.2, "near, the rays stay"
    others = ~found.emission.any(axis=1)
    np.testing.assert_array_equal(aimed.toarray()[:, others], by_rays.toarray()[:, others])


def test_what_stands_between_casts_a_shadow() -> None:
    found = under_a_small_square(shade=True)
    points = np.array([[0.5, 0.5, 0.0], [0.45, 0.55, 0.5], [0.5, 0.5, 0.0]])
    normals = np.array([[0, 0, 1.0], [0, 0, 1.0], [0, 0, -1.0]])
    origins = RayOrigins.even(points[:, None], normals[:, None])
    aimed = AimedFactors(found).put(form_factors(found, origins, 64), origins, 3, 0)
    np.testing.assert_array_equal(small(aimed, found), 0)


def test_points_of_a_receiver_weigh_as_told() -> None:
    found = under_a_small_square()
    points, normals = np.array([[[0.1, 0.1, 0], [0.5, 0.5, 0]]]), np.broadcast_to([0.0, 0.0, 1.0], (1, 2, 3))
    apart = [RayOrigins.even(points[:, k : k + 1], normals[:, :1]) for k in (0, 1)]
    first, second = (small(AimedFactors(found).put(form_factors(found, one, 64), one, 1, 0), found)[0] for one in apart)
    one = RayOrigins(points, normals, np.array([[0.0, 2.0]]))
    both = RayOrigins(points, normals, np.array([[1.0, 1.0]]))
    of_one, of_both = (small(AimedFactors(found).put(form_factors(found, own, 64), own, 1, 0), found)[0] for own in (one, both))
    assert of_one == pytest.approx(second, rel=0.02) and of_both == pytest.approx((first + second) / 2, rel=0.02)


def test_without_emission_rays_stay_as_they_are() -> None:
    found = under_a_small_square()
    dark = Surfels(found.cells, found.corners, found.owners, found.objects, np.zeros_like(found.emission))
    factors = form_factors(found, places(), 64)
    assert AimedFactors(dark).put(factors, places(), 16, 0) is factors
