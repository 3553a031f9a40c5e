"""Samples of texels on the triangles of rounded receivers: what is convex never shades itself, flat or smooth, fine or coarse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rounded import rounded

from srbf.direct.footprints import Footprints
from srbf.direct.ray import RayTracer
from srbf.sphere import random_directions

SUNS = random_directions(4, "sphere", np.random.default_rng(2))


def psnr(found: np.ndarray, expected: np.ndarray) -> float:
    return float(-10 * np.log10(max(((found - expected) ** 2).mean(), 1e-30) / expected.max() ** 2))


@pytest.mark.parametrize(("around", "across"), [(12, 6), (24, 12), (64, 32)])
@pytest.mark.parametrize("size", [48, 160])
def test_a_flat_ball_answers_with_the_cosine_of_its_faces(around: int, across: int, size: int) -> None:
    ball = rounded("ball", around, across, size, smooth=False)
    covered = ball.images["coverage"] > 0
    for sun in SUNS:
        found = RayTracer(ball).directional(sun[None])[0, ..., 0]
        np.testing.assert_allclose(found[covered], np.maximum(ball.images["normal"] @ sun, 0)[covered], atol=1e-5)


@pytest.mark.parametrize(("at", "scale"), [((0, 0, 0), 1e-3), ((300, -200, 50), 1.0), ((0, 0, 0), 1e3)])
def test_neither_place_nor_size_lets_it_shade_itself(at: tuple, scale: float) -> None:
    ball = rounded("ball", 24, 12, 48, smooth=False, at=at, scale=scale)
    covered = ball.images["coverage"] > 0
    found = RayTracer(ball).directional(SUNS[:1])[0, ..., 0]
    assert psnr(found[covered], np.maximum(ball.images["normal"] @ SUNS[0], 0)[covered]) > 60


@pytest.mark.parametrize(("around", "across"), [(12, 6), (24, 12), (64, 32)])
def test_a_smooth_ball_answers_with_the_cosine_of_its_normals(around: int, across: int) -> None:
    ball = rounded("ball", around, across, 96, smooth=True)
    covered = ball.images["coverage"] > 0
    for sun in SUNS:
        found = RayTracer(ball).directional(sun[None])[0, ..., 0]
        assert psnr(found[covered], np.maximum(ball.images["normal"] @ sun, 0)[covered]) > 55  # a texel's mean against its middle


@pytest.mark.parametrize("smooth", [False, True])
def test_without_coordinates_samples_are_put_back_on_the_mesh(smooth: bool) -> None:
    """Captures written before hold none: texels at edges mix faces then, no texel loses half its light."""
    ball = rounded("ball", 24, 12, 48, smooth)
    ball = replace(ball, triangles=replace(ball.triangles, lightmap=None))
    covered = ball.images["coverage"] > 0
    for sun in SUNS:
        found = RayTracer(ball).directional(sun[None])[0, ..., 0]
        assert psnr(found[covered], np.maximum(ball.images["normal"] @ sun, 0)[covered]) > 30


@pytest.mark.parametrize("kind", ["ball", "torus"])
def test_every_texel_finds_its_triangle(kind: str) -> None:
    scene = rounded(kind, 30, 20, 70, smooth=False)
    found = Footprints.of(scene.triangles, scene.images["position"])
    assert found is not None
    texel = np.flatnonzero(scene.images["coverage"] > 0)
    assert (found.triangle[texel] >= 0).all()
    bary = found.weights(texel, np.full((len(texel), 2), -0.0015, np.float32))
    point = np.einsum("nk,nkc->nc", bary, scene.triangles.corners[found.triangle[texel]])
    assert np.abs(point - scene.images["position"].reshape(-1, 3)[texel]).max() < 1e-3
    far = found.weights(texel, np.full((len(texel), 2), 40.0, np.float32))
    assert (far >= 0).all() and np.allclose(far.sum(axis=1), 1, atol=1e-6)


def test_of_triangles_that_overlap_the_one_at_the_texels_position_is_chosen() -> None:
    ball = rounded("ball", 24, 12, 48, smooth=False)
    own = ball.triangles
    twice = {name: np.concatenate([getattr(own, name)] * 2) for name in ("normals", "material", "casts", "lightmap")}
    both = replace(own, corners=np.concatenate([own.corners, own.corners + np.float32([5, 0, 0])]), **twice)
    found = Footprints.of(both, ball.images["position"])
    assert found is not None and (found.triangle[ball.images["coverage"].ravel() > 0] < len(ball.triangles.corners)).all()
