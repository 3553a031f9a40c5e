"""Rounded receivers by rays: nothing convex shades itself, and what is bent is lit as its own triangles say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rounded import Lightmap, lightmap, sphere, torus

from srbf.io.scene_glb import Triangles
from srbf.sphere import random_directions
from srbf.visibility.rays import RayTracer

ROUNDING = 1e-5
BEND = 2e-4  # of irradiance: what N.L changes over a footprint of 1e-4 texels, and normals in single precision
SUNS = random_directions(2, "sphere", np.random.default_rng(11))


def covered(mapped: Lightmap) -> np.ndarray:
    return mapped.receivers.images["coverage"] > 0


@pytest.mark.lengthy
@pytest.mark.parametrize("mapped", [True, False], ids=["with coordinates", "without"])
@pytest.mark.parametrize("faces", [(12, 6), (24, 12), (64, 32)])
@pytest.mark.parametrize("size", [48, pytest.param(96, marks=pytest.mark.slow)])
def test_a_flat_ball_alone_has_the_cosine_of_its_faces(faces: tuple[int, int], size: int, mapped: bool) -> None:
    made = lightmap(sphere, *faces, size, smooth=False, mapped=mapped)
    for sun, found in zip(SUNS, RayTracer(made.receivers).directional(SUNS), strict=True):
        expected = np.maximum(made.face @ sun, 0)
        np.testing.assert_allclose(found[..., 0][covered(made)], expected[covered(made)], atol=ROUNDING)


@pytest.mark.lengthy
@pytest.mark.parametrize("faces", [(24, 12), (64, 32)])
@pytest.mark.parametrize("size", [48, pytest.param(96, marks=pytest.mark.slow)])
def test_a_smooth_ball_alone_has_the_cosine_of_its_normals(faces: tuple[int, int], size: int) -> None:
    made = lightmap(sphere, *faces, size, smooth=True, footprint=1e-4)
    for sun, found in zip(SUNS, RayTracer(made.receivers).directional(SUNS), strict=True):
        expected = np.maximum(made.receivers.images["normal"] @ sun, 0)
        np.testing.assert_allclose(found[..., 0][covered(made)], expected[covered(made)], atol=BEND)


@pytest.mark.slow
def test_a_torus_is_shaded_by_itself_where_a_ray_from_its_center_says() -> None:
    """Its own shadow is that of its triangles: texels whose footprint no edge crosses are lit or not as their center is."""
    mapped = lightmap(torus, 48, 20, 128, smooth=False)
    at_center = replace(mapped.receivers, sampling={"sun_angle": 0.0, "footprint": 1e-4})
    found, point = RayTracer(mapped.receivers).directional(SUNS), RayTracer(at_center).directional(SUNS)
    shaded = (point[..., 0] == 0) & (np.einsum("hwc,sc->shw", mapped.face, SUNS) > 0.01)
    assert 0.02 < shaded.mean() < 0.5
    assert (np.abs(found - point).max(axis=3) > ROUNDING).mean() < 0.05
    assert abs(found.mean() - point.mean()) < 1e-3


@pytest.mark.lengthy
def test_far_from_the_origin_it_is_the_same() -> None:
    """Rays start as far off their surface as single precision there needs."""
    mapped = lightmap(sphere, 24, 12, 48, smooth=False)
    shift = np.float32([500, -300, 40])
    triangles = mapped.receivers.triangles
    moved = Triangles(triangles.corners + shift, triangles.normals, triangles.material, triangles.casts, triangles.transmittance)
    images = {**mapped.receivers.images, "position": mapped.receivers.images["position"] + shift}
    found = RayTracer(replace(mapped.receivers, triangles=moved, images=images)).directional(SUNS)
    for sun, image in zip(SUNS, found, strict=True):
        np.testing.assert_allclose(image[..., 0][covered(mapped)], np.maximum(mapped.face @ sun, 0)[covered(mapped)], atol=1e-4)


def test_a_texel_that_an_edge_crosses_is_sampled_on_the_triangle_under_its_center() -> None:
    """As Cycles bakes it: a roof's two slopes never mix, whatever part of the footprint lies on the other one."""
    mapped = lightmap(sphere, 5, 3, 31, smooth=False)  # edges cross texels everywhere
    wide = replace(mapped.receivers, sampling={"sun_angle": 0.0, "footprint": 1.0})
    found = RayTracer(wide).directional(SUNS[:1])[0, ..., 0]
    np.testing.assert_allclose(found[covered(mapped)], np.maximum(mapped.face @ SUNS[0], 0)[covered(mapped)], atol=ROUNDING)
