"""The eigen map: transport of low rank comes back whole, more scalars never cost, and smooth scenes cost little."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.basis.octahedral_table import TABLE_ERROR
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.lights import DirectionalLight, PointLight
from srbf.methods import relight, responses
from srbf.methods.eigen_map import EigenMap
from srbf.methods.relighting_map import RelightingMap
from srbf.sphere import normalize, random_directions

EXACT = 2e-4  # relative: float32 planes, axes of a float32 Gram matrix, a ridge of 1e-9
HEIGHT, WIDTH = 12, 16


def planted(rank: int, seed: int = 0):
    """T = w_0 + sum of `rank` random planes times random RGB numbers, new ones for every light it is asked for."""
    rng = np.random.default_rng(seed)
    planes = rng.normal(size=(rank, HEIGHT, WIDTH))
    return lambda direction: rng.normal(size=3) + np.einsum("jhw,jc->hwc", planes, rng.normal(size=(rank, 3)))


BALLS = [((0.3, 0.2, 0.5), 0.3), ((-0.5, 0.4, 0.4), 0.25), ((0, -0.5, 0.6), 0.3)]  # center, radius
PENUMBRA = 0.5  # rad


def softly_shadowed(height: int, width: int):
    """A Lambert plane [-1, 1]^2 below three balls that a wide light shadows softly: seen(angle to the ball) is a smoothstep."""
    x, y = np.meshgrid(-1 + 2 * (np.arange(width) + 0.5) / width, 1 - 2 * (np.arange(height) + 0.5) / height)
    albedo = np.where((np.floor(3 * x) + np.floor(3 * y)) % 2 == 0, 0.4, 0.8)[..., None] * [1, 0.8, 0.5]

    def response(direction: np.ndarray) -> np.ndarray:
        image = max(direction[2], 0) * albedo
        for center, radius in BALLS:
            to_ball = np.array(center) - np.stack([x, y, np.zeros_like(x)], axis=-1)
            distance = np.linalg.norm(to_ball, axis=-1)
            off = np.arccos(np.clip(to_ball @ direction / distance, -1, 1)) - np.arcsin(radius / distance)
            t = np.clip(off / PENUMBRA + 0.5, 0, 1)
            image = image * (t * t * (3 - 2 * t))[..., None]
        return image

    return response


@pytest.mark.parametrize("rank", [1, 3, 6])
@pytest.mark.parametrize("weighting", ["plain", "relative"])
def test_transport_of_rank_s_is_reproduced_by_s_components(make_capture, rank: int, weighting: str) -> None:
    capture: Capture = make_capture(planted(rank), lights=40, holdout=0)
    asset = EigenMap(components=rank, spread=0.3, ridge=1e-9, weighting=weighting, encoding="float").encode(capture)
    expected = np.stack([capture.image(i) for i in capture.indices("train")])
    got = responses(asset, capture.directions())
    np.testing.assert_allclose(got, expected, atol=EXACT * np.abs(expected).max())
    assert asset.manifest["source"]["fit"]["energy_kept"] == pytest.approx(1, abs=1e-4)
    fewer = EigenMap(components=max(1, rank - 1), spread=0.3, ridge=1e-9, weighting=weighting, encoding="float").encode(capture)
    if rank > 1:  # and by no fewer
        assert np.abs(responses(fewer, capture.directions()) - expected).max() > 0.05 * np.abs(expected).max()


def test_the_error_left_is_that_of_the_truncated_svd(make_capture) -> None:
    rng = np.random.default_rng(1)
    planes = rng.normal(size=(8, HEIGHT, WIDTH)) * 0.5 ** np.arange(8)[:, None, None]
    capture = make_capture(lambda d: np.einsum("jhw,jc->hwc", planes, rng.normal(size=(8, 3))), lights=40, holdout=0)
    asset = EigenMap(components=4, spread=0.3, ridge=1e-9, encoding="float").encode(capture)
    images = np.stack([capture.image(i) for i in range(40)]).astype(np.float64)
    rows = images.reshape(40, -1, 3).transpose(1, 0, 2).reshape(HEIGHT * WIDTH, -1)
    values = np.linalg.svd(rows - rows.mean(axis=0), compute_uv=False)
    error = responses(asset, capture.directions()) - images
    # Lights of a Hammersley set do not all have the same weight, so the error is a little above the least there is.
    assert 1 - 1e-4 <= (error**2).sum() / (values[4:] ** 2).sum() < 1.1


def test_planes_four_to_an_image_and_zero_past_the_last(make_capture) -> None:
    asset = EigenMap(components=6, encoding="uint8").encode(make_capture(planted(7), lights=40))
    assert asset.stored.shape == (2, HEIGHT, WIDTH, 4) and asset.stored.dtype == np.uint8
    assert not asset.coefficients()[1, :, :, 2:].any()
    assert asset.coefficients()[1, :, :, :2].any() and len(asset.light_functions.spreads) == 7


SMOOTH: dict[str, Capture] = {}


@pytest.fixture
def smooth(make_capture) -> Capture:
    """300 lights on the hemisphere, kept in memory for all tests that read them."""
    if not SMOOTH:
        SMOOTH["300"] = make_capture(softly_shadowed(16, 20), lights=300, holdout=30).load()
    return SMOOTH["300"]


def unseen(method: EigenMap | RelightingMap, capture: Capture) -> float:
    """dB at lights that the fit did not see."""
    return evaluate(method.encode(capture), capture)["holdout"]["psnr"]


@pytest.mark.slow
def test_unseen_lights_gain_from_components_and_smooth_scenes_far_more_than_from_relighting_maps(smooth: Capture) -> None:
    eigen = unseen(EigenMap(components=28), smooth)
    assert eigen > 2 + unseen(EigenMap(components=10), smooth)
    assert eigen >= 8 + unseen(RelightingMap(k=25, spread="mean", ridge=0, centers="hammersley"), smooth)


@pytest.mark.slow
def test_bytes_cost_little(smooth: Capture) -> None:
    settings = {"components": 28, "spread": 0.25, "ridge": 1e-3}
    floats, coded = (unseen(EigenMap(**settings, encoding=encoding), smooth) for encoding in ("float", "uint8"))
    assert floats - coded <= 0.3


def test_relative_weighting_serves_the_dark(make_capture) -> None:
    # Six functions hold the bright eighth or the dark rest, not both.
    bright, dark = planted(6, seed=3), planted(6, seed=4)
    lit = np.arange(WIDTH) < 2
    capture = make_capture(lambda d: np.where(lit[:, None], bright(d), 0.02 * dark(d)), lights=40, holdout=0)
    errors = []
    for weighting in ("plain", "relative"):
        asset = EigenMap(components=6, spread=0.3, ridge=1e-9, weighting=weighting, encoding="float").encode(capture)
        images = np.stack([capture.image(i) for i in range(40)])
        errors.append(np.square(responses(asset, capture.directions()) - images).mean(axis=(0, 1, 3)))
    plain, relative = errors
    assert relative[~lit].mean() < plain[~lit].mean() / 3 and plain[lit].mean() < relative[lit].mean() / 3


@pytest.fixture
def plane(make_capture, plane_positions) -> Asset:
    rng = np.random.default_rng(4)
    waves = rng.normal(size=(10, 14, 3, 3))
    return EigenMap(components=8).encode(make_capture(lambda d: 1.5 + np.sin(waves @ d), lights=150, position=plane_positions))


@pytest.mark.slow
def test_far_point_light_tends_to_the_directional_one(plane: Asset) -> None:
    # Directional lights weigh by the functions, point lights by their table: they agree up to the table's error.
    directions = random_directions(12, "hemisphere", np.random.default_rng(5))
    directions[:, 2] = np.maximum(directions[:, 2], 0.3)
    directions = normalize(directions)
    expected = np.stack([relight(plane, [DirectionalLight(tuple(d))]) for d in directions])
    errors = []
    for distance in (2.0, 10.0, 1e4):
        got = np.stack([relight(plane, [PointLight(tuple(d * distance), a0=distance)]) for d in directions])
        errors.append(np.sqrt(((got - expected) ** 2).mean() / (expected**2).mean()))
    assert errors[0] > errors[1] > errors[2]
    assert plane.manifest["w_table"]["error"] <= TABLE_ERROR and errors[2] < 2 * TABLE_ERROR


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"components": 0}, "components"),
        ({"components": 2000}, "components"),
        ({"ridge": 0}, "ridge"),
        ({"spread": float("nan")}, "spread"),
    ],
)
def test_settings_that_no_eigen_map_has(settings: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        EigenMap(**settings)


def test_more_components_than_numbers(make_capture) -> None:
    capture = make_capture(planted(2), lights=4)
    with pytest.raises(InputError, match="at most 12 components for 4 lights, found 13"):
        EigenMap(components=13).encode(capture)
    assert EigenMap(components=12).encode(capture).components == 12


@pytest.mark.slow
def test_validation_lights_steer_and_holdout_does_not(make_capture) -> None:
    capture = make_capture(softly_shadowed(12, 16), lights=80, validation=20, holdout=10).load()
    assert EigenMap(8).encode(capture).manifest["source"]["fit"]["chosen_by"] == "validation"
    without = capture.with_roles([None if light.role == "holdout" else light.role for light in capture.lights])
    blind = capture.with_roles([None if light.role == "validation" else light.role for light in capture.lights])
    one, two = EigenMap(8).encode(capture), EigenMap(8).encode(without)
    np.testing.assert_array_equal(one.tables["light_coefficients"], two.tables["light_coefficients"])
    assert EigenMap(8).encode(blind).manifest["source"]["fit"]["chosen_by"] == "leave-one-light-out"


def test_given_spread_and_ridge_are_kept(make_capture) -> None:
    capture = make_capture(planted(2), lights=30)
    asset = EigenMap(components=2, spread=0.7, ridge=0.5).encode(capture)
    assert set(asset.manifest["light_basis"]["spreads"]) == {0.7}
    heavier = replace(EigenMap(components=2, spread=0.7), ridge=50.0).encode(capture)
    assert (
        np.abs(heavier.tables["light_coefficients"]).sum(axis=(1, 2)) < np.abs(asset.tables["light_coefficients"]).sum(axis=(1, 2))
    ).all()
