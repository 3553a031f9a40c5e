"""Point sets: closed forms, uniformity, and the hemisphere's rejection."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.errors import InputError
from srbf.sphere import (
    all_around,
    domain_of,
    fibonacci,
    hammersley,
    mean_spacing,
    nearest_neighbor_angles,
    normalize,
    octahedral_decode,
    octahedral_encode,
    point_set,
    random_directions,
    van_der_corput,
)

ROUNDING = 1e-12  # float64 arithmetic on unit vectors


def test_van_der_corput_mirrors_digits() -> None:
    assert van_der_corput(8, 2).tolist() == [0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875]
    np.testing.assert_allclose(van_der_corput(6, 3), [0, 1 / 3, 2 / 3, 1 / 9, 4 / 9, 7 / 9], atol=ROUNDING)


@pytest.mark.parametrize("base", [2, 3])
def test_hammersley_is_its_formula(base: int) -> None:
    points = hammersley(30, base)
    np.testing.assert_allclose(points[:, 2], 2 * van_der_corput(30, base) - 1, atol=ROUNDING)
    azimuth = np.arctan2(points[1:, 1], points[1:, 0]) % (2 * np.pi)  # point 0 is the pole
    np.testing.assert_allclose(azimuth, 2 * np.pi * (np.arange(1, 30) + 0.5) / 30, atol=ROUNDING)


@pytest.mark.parametrize("kind", ["hammersley", "hammersley3", "fibonacci"])
@pytest.mark.parametrize("k", [1, 2, 7, 25, 400])
def test_hemisphere_holds_exactly_k_of_the_smallest_sphere_set(kind: str, k: int) -> None:
    from srbf.sphere import POINT_SETS

    points = point_set(kind, k, "hemisphere")
    assert points.shape == (k, 3)
    assert (points[:, 2] > 0).all()
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=ROUNDING)
    smaller = [n for n in range(k, 3 * k + 16) if (POINT_SETS[kind](n)[:, 2] > 0).sum() == k]
    np.testing.assert_array_equal(points, POINT_SETS[kind](smaller[0])[POINT_SETS[kind](smaller[0])[:, 2] > 0])


@pytest.mark.parametrize("points", [hammersley(512), hammersley(512, 3), fibonacci(512)])
def test_sets_are_uniform(points: np.ndarray) -> None:
    # A uniform set integrates the first spherical harmonics to zero; 512 low-discrepancy points do so to about 1/512.
    assert np.abs(points.mean(axis=0)).max() < 0.01
    np.testing.assert_allclose(points.T @ points / 512, np.eye(3) / 3, atol=0.01)


def test_random_directions_are_uniform_and_above() -> None:
    points = random_directions(20000, "hemisphere", np.random.default_rng(0))
    assert (points[:, 2] > 0).all()
    # Archimedes: z is uniform on (0, 1], so its mean is 1/2 with a standard error of 0.29 / sqrt(20000) = 0.002.
    assert abs(points[:, 2].mean() - 0.5) < 0.01
    assert abs(random_directions(20000, "sphere", np.random.default_rng(0))[:, 2].mean()) < 0.02


def test_nearest_neighbor_angles_of_an_octahedron() -> None:
    corners = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    np.testing.assert_allclose(nearest_neighbor_angles(corners), np.pi / 2, atol=ROUNDING)
    assert nearest_neighbor_angles(corners[:1]).tolist() == [np.pi]
    close = normalize(np.array([[0, 0, 1], [1e-6, 0, 1]]))
    np.testing.assert_allclose(nearest_neighbor_angles(close), 1e-6, rtol=1e-6)


def test_domain_of() -> None:
    assert domain_of(np.array([[0, 0, 1.0], [0.6, 0, 0.8]])) == "hemisphere"
    assert domain_of(np.array([[0, 0, 1.0], [1, 0, 0]])) == "sphere"  # the horizon itself is not above it


@pytest.mark.parametrize("bad", [[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0]])
def test_normalize_refuses(bad: list[float]) -> None:
    with pytest.raises(InputError, match="direction"):
        normalize(np.array(bad, float))


def test_mean_spacing_is_the_pitch_of_a_lattice() -> None:
    pitch = 0.02
    x, y = np.meshgrid(np.arange(-20, 21) * pitch, np.arange(-20, 21) * pitch)
    near_the_pole = normalize(np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3))
    # Gnomonic projection shrinks distances by up to 1 + r^2 = 1.32 at the corners; points of the border look further.
    assert mean_spacing(near_the_pole) == pytest.approx(pitch, rel=0.15)
    octahedron = np.concatenate([np.eye(3), -np.eye(3)])
    assert mean_spacing(octahedron) == pytest.approx(np.pi / 2)
    assert mean_spacing(np.array([[0, 0, 1.0], [1, 0, 0]])) == pytest.approx(np.pi / 2)
    assert mean_spacing(np.array([[0, 0, 1.0]])) == np.pi


@pytest.mark.parametrize("kind", ["hammersley", "fibonacci"])
@pytest.mark.parametrize(("domain", "area"), [("sphere", 4 * np.pi), ("hemisphere", 2 * np.pi)])
def test_mean_spacing_of_a_set_is_the_root_of_a_points_area(kind: str, domain: str, area: float) -> None:
    for n in (200, 400, 1000):
        assert mean_spacing(point_set(kind, n, domain)) == pytest.approx(np.sqrt(area / n), rel=0.05)


def test_octahedral_coordinates_round_trip() -> None:
    directions = np.concatenate([random_directions(500, "sphere", np.random.default_rng(1)), np.eye(3), -np.eye(3)])
    u, v = octahedral_encode(directions)
    assert (np.abs(u) <= 1).all() and (np.abs(v) <= 1).all()
    np.testing.assert_allclose(octahedral_decode(u, v), directions, atol=ROUNDING)
    np.testing.assert_allclose(octahedral_encode(5 * directions), (u, v), atol=ROUNDING)  # of any length
    above = directions[:, 2] > 1e-9
    np.testing.assert_array_equal((np.abs(u) + np.abs(v))[above] < 1, True)
    np.testing.assert_array_equal((np.abs(u) + np.abs(v))[directions[:, 2] < -1e-9] > 1, True)
    assert [float(t) for t in octahedral_encode(np.zeros(3))] == [0, 0]


def test_octahedral_decode_is_continuous_across_the_fold() -> None:
    t = np.linspace(-0.99, 0.99, 50)
    for inner, outer in (
        ((1 - np.abs(t)) * 0.999999, (1 - np.abs(t)) * 1.000001),
        ((np.abs(t) - 1) * 0.999999, (np.abs(t) - 1) * 1.000001),
    ):
        np.testing.assert_allclose(octahedral_decode(t, inner), octahedral_decode(t, outer), atol=1e-5)


@pytest.mark.parametrize("domain", ["sphere", "hemisphere"])
def test_all_around_is_uniform_on_its_domain(domain: str) -> None:
    points = all_around(domain)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=ROUNDING)
    np.testing.assert_allclose(points.mean(axis=0), [0, 0, 0.5 if domain == "hemisphere" else 0], atol=0.01)
    np.testing.assert_allclose(points.T @ points / len(points), np.eye(3) / 3, atol=0.01)  # second moments, on either domain
    assert (points[:, 2] > 0).all() == (domain == "hemisphere")
