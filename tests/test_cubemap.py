"""Cubemaps of directions: solid angles, texels, windows across edges, interpolation."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.cubemap import Cubemap
from srbf.errors import InputError
from srbf.sphere import random_directions

SIDES = (2, 3, 8, 32)


@pytest.mark.parametrize("side", SIDES)
def test_texels_cover_the_sphere_once(side: int) -> None:
    cubemap = Cubemap(side)
    np.testing.assert_allclose(np.linalg.norm(cubemap.directions, axis=1), 1)
    assert cubemap.solid_angles.sum() == pytest.approx(4 * np.pi) and (cubemap.solid_angles > 0).all()
    np.testing.assert_array_equal(cubemap.texel_of(7 * cubemap.directions), np.arange(cubemap.count))
    np.testing.assert_allclose(cubemap.solid_angles @ cubemap.directions, 0, atol=1e-12)


def test_solid_angles_are_shares_of_random_directions() -> None:
    cubemap, count = Cubemap(4), 200_000
    found = np.bincount(cubemap.texel_of(random_directions(count, "sphere", np.random.default_rng(1))), minlength=cubemap.count)
    expected = cubemap.solid_angles / (4 * np.pi)
    assert np.abs(found / count - expected).max() < 5 * np.sqrt(expected.max() / count)


@pytest.mark.parametrize("side", SIDES)
def test_windows_hold_what_is_near(side: int) -> None:
    cubemap = Cubemap(side)
    near = cubemap.window(1)
    assert near.shape == (cubemap.count, 9) and (near[:, 4] == np.arange(cubemap.count)).all()
    cosines = np.einsum("nwc,nc->nw", cubemap.directions[near], cubemap.directions)
    assert np.arccos(np.clip(cosines, -1, 1)).max() < 2.5 * 2 / side
    assert cubemap.coarse.sum() == 6 * (-(-side // 2)) ** 2


def test_interpolation_gives_the_texels_back_and_reproduces_smooth_functions() -> None:
    cubemap = Cubemap(16)
    texels, shares = cubemap.bilinear(cubemap.directions)
    found = np.zeros((cubemap.count, cubemap.count))
    np.add.at(found, (np.arange(cubemap.count)[:, None], texels), shares)
    np.testing.assert_allclose(found, np.eye(cubemap.count), atol=1e-6)
    axis = np.array([0.48, -0.6, 0.64])
    directions = random_directions(500, "sphere", np.random.default_rng(2))
    texels, shares = cubemap.bilinear(directions)
    np.testing.assert_allclose(shares.sum(axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(((cubemap.directions @ axis)[texels] * shares).sum(axis=1), directions @ axis, atol=0.01)


@pytest.mark.parametrize("side", [-1, 0, 1, 65])
def test_other_sides_are_refused(side: int) -> None:
    with pytest.raises(InputError, match="expected a cubemap of 2 to 64"):
        Cubemap(side)
