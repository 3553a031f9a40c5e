"""The relighting map: theorems of the fit and of relighting, on captures of known responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_captures import write_capture

from srbf.asset import Asset
from srbf.basis.gaussian import GaussianBasis, lookup
from srbf.capture import Capture
from srbf.encode.quantization import quantize
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.lights import DirectionalLight, EnvironmentLight, PointLight, SpotLight
from srbf.methods import linear_response, outside_domain, projected_weights, relight
from srbf.methods.relighting_map import RelightingMap
from srbf.sphere import point_set

FLOAT32 = 3e-6  # relative rounding of a sum of a few dozen float32 products
TABLE = 2.0**-12  # the R table's absolute tolerance, a weight
HALF = 2.0**-11  # relative rounding of a half float
ALBEDO = np.array([0.8, 0.5, 0.2])


def lambert(shape: tuple[int, int]):
    """A plane facing up: E = max(0, z), times a color so that channels differ."""
    return lambda direction: np.broadcast_to(max(0.0, direction[2]) * ALBEDO, (*shape, 3))


def test_sum_of_known_gaussians_is_recovered(make_capture) -> None:
    method = RelightingMap(k=12, ridge=0, encoding="float")
    known = GaussianBasis(point_set("fibonacci", 12, "hemisphere"), 0.6)
    truth = np.random.default_rng(0).normal(size=(12, 5, 6, 3))
    capture = make_capture(lambda d: np.einsum("k,khwc->hwc", known.evaluate(d[None])[0], truth))
    asset = replace(method, spread=0.6).encode(capture)
    condition = asset.manifest["source"]["fit"]["condition_number"]
    np.testing.assert_allclose(asset.coefficients(), truth, atol=condition * 1e-6)
    assert asset.manifest["source"]["fit"]["relative_residual"] < 1e-3


def test_fit_equals_the_slow_twin(make_capture) -> None:
    rng = np.random.default_rng(3)
    images = []
    capture = make_capture(lambda d: images.append(rng.random((4, 3, 3)).astype(np.float32)) or images[-1], lights=40, holdout=0)
    asset = RelightingMap(k=9, centers="hammersley", spread="min", ridge=0, encoding="float").encode(capture)
    matrix = GaussianBasis(asset.basis.centers, asset.basis.spread).evaluate(capture.directions())
    for row in range(4):
        for column in range(3):
            values = np.array([image[row, column] for image in images])
            expected = np.linalg.lstsq(matrix, values, rcond=None)[0]
            np.testing.assert_allclose(asset.coefficients()[:, row, column], expected, atol=1e-4)


@pytest.fixture(scope="module")
def plane(tmp_path_factory: pytest.TempPathFactory, plane_positions: np.ndarray) -> Asset:
    response = lambda d: np.broadcast_to(max(0.0, d[2]), (10, 14, 3))  # noqa: E731
    capture = write_capture(tmp_path_factory.mktemp("plane") / "capture", response, lights=200, position=plane_positions)
    return RelightingMap(k=60, encoding="float").encode(capture)


FIT = 0.02  # of a Lambert cosine by 60 Gaussians away from the horizon


@pytest.mark.lengthy
def test_lambert_under_a_directional_light(plane: Asset) -> None:
    for direction in ([0, 0, 1], [0.6, 0, 0.8], [-0.5, 0.5, np.sqrt(0.5)]):
        np.testing.assert_allclose(relight(plane, [DirectionalLight(tuple(direction))]), direction[2], atol=FIT)


@pytest.mark.parametrize(("falloff", "power"), [("linear", 1), ("inverse-square", 2)])
def test_lambert_under_a_point_light(plane: Asset, plane_positions: np.ndarray, falloff: str, power: int) -> None:
    point_light = np.array([0.3, -0.2, 1.5])
    vectors = point_light - plane_positions
    distance = np.linalg.norm(vectors, axis=2)
    expected = vectors[..., 2] / distance * (1.2 / distance) ** power
    got = relight(plane, [PointLight(tuple(point_light), a0=1.2, falloff=falloff)])
    np.testing.assert_allclose(got, np.repeat(expected[..., None], 3, axis=2), atol=FIT)


def test_lambert_under_a_spot(plane: Asset, plane_positions: np.ndarray) -> None:
    spot = SpotLight((0, 0, 1), direction=(0, 0, -1), inner=0.3, outer=0.6)
    point = relight(plane, [PointLight((0, 0, 1))])
    angle = np.arctan(np.linalg.norm(plane_positions[..., :2], axis=2))
    got = relight(plane, [spot])
    np.testing.assert_allclose(got[angle < 0.3], point[angle < 0.3], atol=FLOAT32)
    assert not got[angle > 0.6].any()


def test_lambert_under_a_constant_environment(plane: Asset) -> None:
    # The irradiance of a uniform environment of radiance 1 is pi.
    environment = EnvironmentLight(np.ones((64, 128, 3), np.float32), color=(1, 2, 0))
    np.testing.assert_allclose(relight(plane, [environment])[0, 0], [np.pi, 2 * np.pi, 0], rtol=FIT)


def test_environment_weight_is_the_integral_of_r(plane: Asset) -> None:
    # A constant environment's weight of center i is the integral of R over the hemisphere; compare with a fine quadrature of its own.
    z = (np.arange(400) + 0.5) / 400
    azimuth = 2 * np.pi * (np.arange(200) + 0.5) / 200
    r = np.sqrt(1 - z**2)
    grid = np.stack([r[:, None] * np.cos(azimuth), r[:, None] * np.sin(azimuth), np.repeat(z[:, None], 200, axis=1)], axis=-1)
    exact = plane.basis.evaluate(grid.reshape(-1, 3)).mean(axis=0) * 2 * np.pi
    got = projected_weights(plane, [EnvironmentLight(np.ones((128, 256, 3), np.float32))])
    np.testing.assert_allclose(got, np.repeat(exact[:, None], 3, axis=1), rtol=2e-3)


def test_a_single_texel_environment_is_a_directional_light(plane: Asset) -> None:
    environment = np.zeros((180, 360, 3), np.float32)
    environment[60, 100] = [3, 2, 1]
    elevation, azimuth = np.radians(90 - 60.5), np.radians(180 - 100.5)
    direction = (np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation))
    solid_angle = 2 * np.pi / 360 * (np.sin(np.radians(30)) - np.sin(np.radians(29)))
    sun = DirectionalLight(direction, tuple(solid_angle * c for c in (3, 2, 1)))
    np.testing.assert_allclose(relight(plane, [EnvironmentLight(environment)]), relight(plane, [sun]), rtol=1e-4)


def test_far_point_light_tends_to_the_directional_one(plane: Asset) -> None:
    direction = np.array([0.48, 0.36, 0.8])
    expected = relight(plane, [DirectionalLight(tuple(direction))])
    errors = []
    for distance in (10.0, 100.0, 1000.0):
        point_light = PointLight(tuple(direction * distance), a0=distance)
        errors.append(np.abs(relight(plane, [point_light]) - expected).max())
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 0.005  # the square spans 1.4 m of 1000 m


def test_encodings_err_as_they_should() -> None:
    values = np.random.default_rng(1).normal(size=(4, 8, 8, 3)).astype(np.float32)
    half, scale, bias = quantize(values, "half")
    assert (scale == 1).all() and (bias == 0).all()
    np.testing.assert_allclose(half.astype(np.float32), values, rtol=HALF, atol=1e-7)
    byte, scale, bias = quantize(values, "uint8")
    step = scale[:, None, None] / 255
    assert (np.abs(byte / 255 * scale[:, None, None] + bias[:, None, None] - values) <= 0.501 * step).all()


def test_past_half_range_is_scaled_and_said() -> None:
    values = np.array([1e6, -3e5, 2.0], np.float32).reshape(1, 1, 1, 3)
    with pytest.warns(UserWarning, match="half"):
        half, scale, _ = quantize(values, "half")
    np.testing.assert_allclose(half[0, 0, 0].astype(np.float32) * scale[0], values[0, 0, 0], rtol=HALF)


def test_weights_read_the_assets_own_table(plane: Asset) -> None:
    """With a table of (1 + cos) / 2, opposite lights give the sum of all maps together, and their difference is linear in the direction."""
    ramp = replace(plane, tables={**plane.tables, "r_table": np.linspace(0, 1, 65, dtype=np.float32)})
    ahead, behind = (
        np.stack([linear_response(ramp, [DirectionalLight(tuple(sign * axis))]) for axis in (*np.eye(3), np.array([0.48, 0.36, 0.8]))])
        for sign in (1.0, -1.0)
    )
    coefficients = plane.coefficients()
    atol = 60 * FLOAT32 * np.abs(coefficients).max()
    np.testing.assert_allclose(ahead + behind, np.broadcast_to(coefficients.sum(axis=0), ahead.shape), atol=atol)
    x, y, z, slanted = ahead - behind
    np.testing.assert_allclose(slanted, 0.48 * x + 0.36 * y + 0.8 * z, atol=atol)
    assert np.abs(slanted).max() > 100 * atol


def test_the_table_is_the_gaussian(plane: Asset) -> None:
    cosine = np.linspace(-1, 1, 999)
    expected = np.exp(-(np.arccos(cosine) ** 2) / (2 * plane.basis.spread**2))
    np.testing.assert_allclose(lookup(plane.table, cosine), expected, atol=TABLE)


def test_too_few_lights(make_capture) -> None:
    capture = make_capture(lambert((3, 3)), lights=10)
    with pytest.raises(InputError, match="10 lights for `k=25`"):
        RelightingMap(k=25, ridge=0).encode(capture)
    assert RelightingMap(k=25).encode(capture).k == 25


@pytest.mark.lengthy
def test_domain_follows_the_lights(make_capture) -> None:
    above = RelightingMap(k=9).encode(make_capture(lambert((3, 3)), name="above"))
    around = RelightingMap(k=9).encode(make_capture(lambert((3, 3)), domain="sphere", name="around"))
    assert (above.domain, around.domain) == ("hemisphere", "sphere")
    assert (above.basis.centers[:, 2] > 0).all() and (around.basis.centers[:, 2] < 0).any()


def test_lights_from_outside_the_capture_are_reported(plane: Asset) -> None:
    notes = outside_domain(plane, [DirectionalLight((0, 0, 1)), DirectionalLight((0, 1, -0.1)), PointLight((0, 0, -1))])
    assert [note.split()[1] for note in notes] == ["1", "2"]


def test_point_light_needs_positions(make_capture) -> None:
    asset = RelightingMap(k=5).encode(make_capture(lambert((3, 3))))
    with pytest.raises(InputError, match="position"):
        relight(asset, [PointLight((0, 0, 1))])


def test_a_moved_asset_is_lit_where_it_stands(plane: Asset) -> None:
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    at = np.array([5.0, -2.0, 1.0])
    to_asset = np.eye(4)
    to_asset[:3, :3], to_asset[:3, 3] = turn.T, -turn.T @ at
    instance = replace(plane, manifest={**plane.manifest, "asset_from_world": to_asset.tolist()})
    point_light, direction = np.array([0.3, -0.2, 1.5]), np.array([0.48, 0.36, 0.8])
    np.testing.assert_allclose(
        relight(instance, [PointLight(tuple(turn @ point_light + at)), DirectionalLight(tuple(turn @ direction))]),
        relight(plane, [PointLight(tuple(point_light)), DirectionalLight(tuple(direction))]),
        atol=1e-5,
    )


@pytest.mark.lengthy
def test_error_matches_its_definitions(make_capture) -> None:
    coverage = np.zeros((6, 8), np.float32)
    coverage[:, 2:] = 1
    rng = np.random.default_rng(2)
    waves = rng.normal(size=(6, 8, 3, 3))
    capture: Capture = make_capture(lambda d: 1 + np.sin(2 * waves @ d), encoding="half", coverage=coverage)
    asset = RelightingMap(k=10).encode(capture)
    result = evaluate(asset, capture)
    train = np.stack([capture.image(i) for i in capture.indices("train")])[:, :, 2:]
    peak = np.quantile(train, 0.999)
    holdout = capture.indices("holdout")
    reference = np.stack([capture.image(i) for i in holdout])[:, :, 2:]
    relit = np.stack([relight(asset, [DirectionalLight(capture.lights[i].direction)]) for i in holdout])[:, :, 2:]
    per_image = np.sqrt(((relit - reference) ** 2).mean(axis=(1, 2, 3)))
    rmse = np.sqrt(((relit - reference) ** 2).mean())
    error = result["holdout"]
    assert error["peak"] == pytest.approx(peak, rel=1e-4)
    assert error["rmse"] == pytest.approx(rmse, rel=1e-4)
    assert error["relative_rmse"] == pytest.approx(rmse / np.sqrt((reference**2).mean()), rel=1e-4)
    assert error["psnr"] == pytest.approx(np.mean(20 * np.log10(peak / per_image)), abs=1e-3)
    assert error["psnr_pooled"] == pytest.approx(20 * np.log10(peak / rmse), abs=1e-3)
    assert [light["rmse"] for light in result["lights"][-len(holdout) :]] == pytest.approx(list(per_image), rel=1e-4)
