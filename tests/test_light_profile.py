"""Profiles of lights in closed form: none and 1 are the same, halves, energy, roll, projected images, motions, caching, refusals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from closed_forms import build_plane
from made_profiles import by_polar, picture, uneven

from srbf import methods
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.light_domain.cloud import isotropic
from srbf.light_entries import entry_of, light_of
from srbf.light_profile import Profile, axes_of, roll_of
from srbf.lights import PointLight, SphereLight, SpotLight, moved
from srbf.sphere import point_set
from srbf.visibility.rays import RayTracer
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells

ONE = by_polar(np.ones(5))
HALF = by_polar(np.repeat([1.0, 0.0], 500))  # ahead, and not behind
POINT = PointLight((0.1, 0.2, 0.8), (1, 0.5, 0.2), falloff="inverse-square")
SPOT = SpotLight((0.0, 0.0, 1.0), direction=(0, 0, -1), inner=0.7, outer=np.pi / 4, falloff="inverse-square")
DIRECTIONS = point_set("fibonacci", 4000, "sphere")


class Unshadowed:
    side = 4

    def visible(self, points: np.ndarray, toward: np.ndarray, distance: np.ndarray | None) -> np.ndarray:
        return np.ones(len(points), bool)


def cells_about(place: np.ndarray, away: np.ndarray) -> Cells:
    """Small ones, 1 m from a place, that face it."""
    zeros = np.zeros((len(away), 3), np.float32)
    return Cells(
        (place + away).astype(np.float32), (-away).astype(np.float32), np.full(len(away), 1e-6, np.float32), zeros, np.zeros(len(away), int)
    )


def received(light: PointLight) -> np.ndarray:
    return ReceivedLight(cells_about(np.array(light.position), DIRECTIONS), Unshadowed()).irradiance(light)


@pytest.mark.parametrize("light", [POINT, SPOT, SphereLight((0.1, 0.2, 0.8), size=0.1)], ids=["point", "spot", "sphere"])
def test_a_profile_of_one_is_none(light: PointLight) -> None:
    np.testing.assert_allclose(received(replace(light, profile=ONE)), received(light), rtol=1e-6)
    pytest.importorskip("embreex")
    tracer = RayTracer(build_plane(size=16))
    np.testing.assert_allclose(tracer.response([replace(light, profile=ONE)]), tracer.response([light]), rtol=1e-5)


def test_half_a_profile_lights_one_side() -> None:
    light = replace(POINT, profile=HALF, direction=(1.0, 0.0, 0.0))
    found, whole = received(light), received(POINT)
    ahead = DIRECTIONS[:, 0]
    np.testing.assert_allclose(found[ahead > 0.01], whole[ahead > 0.01], rtol=1e-6)
    assert (found[ahead < -0.01] == 0).all()


def test_the_energy_of_a_cosine() -> None:
    """The integral of max(0, cos) over the sphere is pi."""
    cosine = by_polar(np.maximum(np.cos(np.linspace(0, np.pi, 721)), 0))
    light = PointLight((0, 0, 0), falloff="inverse-square", direction=(0.3, -0.4, 0.5), profile=cosine)
    assert received(light).mean(axis=0) * 4 * np.pi == pytest.approx([np.pi] * 3, rel=1e-3)


def test_roll_turns_a_profile_counterclockwise_against_the_light() -> None:
    spot = replace(SPOT, profile=Profile(picture(), projected=True))
    x, y, _ = axes_of(spot.direction, 0.0)
    away = np.array([x - y, x + y, -x + y, -x - y]) * 0.9 + 2 * np.array(spot.direction)
    turned = np.stack([c * x + s * y for c, s in [(1, 1), (-1, 1), (-1, -1), (1, -1)]]) * 0.9 + 2 * np.array(spot.direction)
    np.testing.assert_allclose(replace(spot, roll=np.pi / 2).factors(turned), spot.factors(away), atol=1e-12)


def test_an_image_fills_the_square_about_the_cone() -> None:
    """A spot at 1 m and 45 degrees: over [-1, 1]^2, upright for one who looks along the light, +y up where it looks down."""
    image = picture(8)
    spot = replace(SPOT, profile=Profile(image, projected=True))
    centers = -1 + 2 * (np.arange(8) + 0.5) / 8
    at = np.stack(np.meshgrid(centers, -centers), axis=-1).reshape(-1, 2)
    np.testing.assert_allclose(spot.factors(np.column_stack([at, -np.ones(64)])), image.reshape(-1, 3), atol=1e-6)
    assert (spot.factors(np.array([[0.1, 0.1, 1.0]])) == 0).all()  # behind
    sideways = replace(spot, direction=(0, 1, 0))
    upper_left = sideways.factors(np.array([[-0.8, 1.0, 0.8]]))[0]
    np.testing.assert_allclose(upper_left, spot.factors(np.array([[-0.8, 0.8, -1.0]]))[0], atol=1e-12)
    assert upper_left[2] == pytest.approx(1)


def test_a_projected_image_is_that_on_a_plane_by_rays() -> None:
    pytest.importorskip("embreex")
    receivers = build_plane(size=32)
    spot = replace(SPOT, inner=SPOT.outer, profile=Profile(picture(64), projected=True))
    plain = RayTracer(receivers).response([replace(spot, profile=None)])
    ratio = RayTracer(receivers).response([spot]) / np.maximum(plain, 1e-9)
    position = receivers.images["position"]
    inside = np.hypot(position[..., 0], position[..., 1]) < 0.9
    expected = 0.1 + 0.9 * (position[..., 0] + 1) / 2
    np.testing.assert_allclose(ratio[inside][:, 0], expected[inside], atol=0.02)


def test_a_motion_carries_the_profile_along() -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    matrix[:3, :3] *= 2 * np.sign(np.linalg.det(matrix[:3, :3]))
    for light in (replace(POINT, profile=uneven), replace(SPOT, profile=uneven, direction=(0.2, 0.3, -0.4), roll=0.7)):
        there: Any = moved(light, matrix)
        np.testing.assert_allclose(there.factors(DIRECTIONS @ matrix[:3, :3].T), light.factors(DIRECTIONS), rtol=1e-4, atol=1e-4)
    assert moved(POINT, matrix) == replace(POINT, position=moved(POINT, matrix).position, a0=2.0, radius=2e-4)  # type: ignore[union-attr]


@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (0.6, 0.0, -0.8), (0.0, 1.0, 0.0)])
def test_frames_are_orthonormal_upright_and_have_their_roll(direction: tuple[float, float, float]) -> None:
    x, y, ahead = axes_of(direction, 0.3)
    np.testing.assert_allclose(np.stack([x, y, -ahead]) @ np.stack([x, y, -ahead]).T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.cross(x, y), -ahead, atol=1e-12)
    assert roll_of(direction, x) == pytest.approx(0.3)
    assert axes_of(direction, 0.0)[1][2] >= -1e-12


def test_equal_profiles_are_equal_and_hash_alike() -> None:
    again = Profile(uneven.table.copy(), file=("other.ies", b""))
    assert again == uneven and hash(replace(POINT, profile=again)) == hash(replace(POINT, profile=uneven))
    assert replace(POINT, profile=uneven) != POINT and Profile(uneven.table, projected=True) != uneven


def test_entries_have_what_a_profile_needs_and_others_what_they_had() -> None:
    assert set(entry_of(POINT)) == {"kind", "position", "color", "a0", "falloff", "radius"}
    assert set(entry_of(SPOT)) == set(entry_of(POINT)) | {"direction", "inner", "outer"}
    for light in (replace(POINT, profile=uneven, roll=0.5), replace(SPOT, profile=uneven)):
        entry = entry_of(light)
        assert entry["profile"] == "uneven.ies"
        assert light_of(entry, profiles=lambda name: uneven) == light
        with pytest.raises(InputError, match="without files"):
            light_of(entry)


@pytest.mark.parametrize(
    ("made", "line"),
    [
        (lambda: Profile(np.ones((4, 4))), "shape"),
        (lambda: Profile(-np.ones((4, 4, 3))), "at least 0"),
        (lambda: Profile(np.full((4, 4, 3), np.nan)), "finite"),
        (lambda: Profile(np.ones((1, 4, 3))), "2 rows"),
        (lambda: replace(POINT, profile=Profile(picture(), projected=True)), "a spot"),
        (lambda: replace(SPOT, outer=3.0, profile=Profile(picture(), projected=True)), "a spot"),
        (lambda: replace(POINT, roll=np.inf), "roll"),
        (lambda: isotropic(replace(POINT, profile=uneven)), "without a profile"),
    ],
)
def test_what_cannot_be_is_refused(made: Callable[[], object], line: str) -> None:
    with pytest.raises(InputError, match=line):
        made()


def test_methods_of_distant_lights_say_that_they_take_none(make_asset: Callable[..., Asset]) -> None:
    with pytest.raises(InputError, match="without a profile for a relighting-map asset"):
        methods.relight(make_asset(5), [replace(POINT, profile=uneven)])
