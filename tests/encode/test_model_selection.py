"""What is chosen, against slow twins that fit every candidate again and look."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.gaussian import weight
from srbf.capture import Capture
from srbf.encode.model_selection import TexelSample, choose
from srbf.encode.weighted_rows import LightSpace
from srbf.errors import InputError
from srbf.light_domain import Directions
from srbf.light_images import STRIP
from srbf.sphere import normalize, point_set, random_directions

TRAIN, VALIDATION = 40, 15
RIDGES = (1e-4, 1e-2, 1.0)
SPREADS = (0.35, 0.5, 0.7)
FLOAT32 = 1e-4  # relative: a Gram matrix of float32 images


def sample(noise: float, validated: bool, spread: float = 0.5, seed: int = 0) -> tuple[TexelSample, np.ndarray]:
    """(30 texels that are sums of 12 Gaussians, the centers)."""
    rng = np.random.default_rng(seed)
    centers = point_set("fibonacci", 12, "hemisphere")
    directions = np.concatenate([point_set("hammersley", TRAIN, "hemisphere"), random_directions(VALIDATION, "hemisphere", rng)])
    directions = directions if validated else directions[:TRAIN]
    responses = np.einsum("lk,nkc->nlc", weight(directions @ centers.T, spread), rng.normal(size=(30, 12, 3)))
    responses += noise * rng.normal(size=responses.shape)
    return TexelSample(np.arange(30), responses.astype(np.float32), directions, TRAIN, Directions("hemisphere")), centers


def candidates(of: TexelSample, centers: np.ndarray) -> list[tuple[float, np.ndarray]]:
    return [(s, weight(of.coordinates @ centers.T, s)) for s in SPREADS]


def fitted(matrix: np.ndarray, values: np.ndarray, ridge: float) -> np.ndarray:
    return np.linalg.solve(matrix.T @ matrix + ridge * np.eye(matrix.shape[1]), matrix.T @ values)


@pytest.mark.parametrize("validated", [True, False])
@pytest.mark.parametrize("noise", [0.0, 0.3, 2.0])
def test_choice_equals_the_slow_twin(validated: bool, noise: float) -> None:
    given, centers = sample(noise, validated)
    values = given.responses.transpose(1, 0, 2).reshape(len(given.coordinates), -1).astype(np.float64)
    groups = [group for array in Directions("sphere").left_out_groups(given.coordinates[:TRAIN]) for group in array]
    held_out = given.held_out()
    scores: dict[tuple[float, float], tuple[float, float]] = {}
    for spread, weights in candidates(given, centers):
        for ridge in RIDGES:

            def error(lights: np.ndarray, without: np.ndarray, weights: np.ndarray = weights, ridge: float = ridge) -> np.ndarray:
                rest = np.setdiff1d(np.arange(TRAIN), without)
                return ((values[lights] - weights[lights] @ fitted(weights[rest], values[rest], ridge)) ** 2).mean(axis=1)

            single = np.concatenate([error(np.array([i]), np.array([i])) for i in range(TRAIN)])
            banded = np.concatenate([error(group[:1], group) for group in groups])
            unseen = error(np.arange(TRAIN, len(values)), np.array([], np.int64)) if validated else None
            scores[spread, ridge] = held_out.score(single, banded, unseen), (single if unseen is None else unseen).mean()
    best = min(scores, key=lambda pair: scores[pair][0])
    choice = choose(given, candidates(given, centers), RIDGES)
    assert (choice.spread, choice.ridge) == best
    assert choice.rule == ("validation" if validated else "leave-one-light-out")
    assert choice.error == pytest.approx(scores[best][1], rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("validated", [True, False])
@pytest.mark.parametrize("spread", SPREADS)
def test_planted_spread_is_found_and_noise_asks_for_a_ridge(validated: bool, spread: float) -> None:
    clean, centers = sample(1e-3, validated, spread)
    choice = choose(clean, candidates(clean, centers), RIDGES)
    assert (choice.spread, choice.ridge) == (spread, RIDGES[0])
    noisy, _ = sample(2.0, validated, spread)
    assert choose(noisy, candidates(noisy, centers), RIDGES).ridge > RIDGES[0]


def test_what_an_encoding_loses_steers_the_choice() -> None:
    given, centers = sample(0.01, True)
    plain = choose(given, candidates(given, centers), RIDGES)
    lossy = choose(given, candidates(given, centers), RIDGES, lambda operator, weights: np.full(len(weights), (operator**2).sum()))
    assert lossy.ridge > plain.ridge and lossy.error > plain.error


def tall(make_capture, height: int = 8 * STRIP + 5, **images: np.ndarray) -> Capture:
    rng = np.random.default_rng(3)
    return make_capture(lambda d: rng.normal(size=(height, 6, 3)), lights=5, holdout=1, validation=2, **images)


def test_a_sample_reads_strips_alone_and_equals_the_images(make_capture, monkeypatch: pytest.MonkeyPatch) -> None:
    capture = tall(make_capture)
    read: list = []
    import srbf.receiver_images as module

    whole_reader = module.read_stored

    def spy(path, channels, rows=None):
        read.append(rows)
        return whole_reader(path, channels, rows)

    monkeypatch.setattr(module, "read_stored", spy)
    sampled = TexelSample.of(capture, count=60)
    assert len(read) == 7 and len(sampled.texels) == 60 and sampled.train == 5 and sampled.validated
    touched = {int(t) // 6 // STRIP for t in sampled.texels}
    for rows in read:
        assert {begin // STRIP for begin, _ in rows} == touched and len(touched) <= 3  # of nine strips, a quarter
    lights = [*capture.indices("train"), *capture.indices("validation")]
    images = np.stack([capture.image(i).reshape(-1, 3) for i in lights], axis=1)
    np.testing.assert_array_equal(sampled.responses, images[sampled.texels])
    np.testing.assert_array_equal(sampled.coordinates, capture.directions(lights))


def test_a_sample_is_of_covered_texels(make_capture) -> None:
    coverage = np.zeros((8 * STRIP + 5, 6), np.float32)
    coverage[40:50, 2:5] = 1
    sampled = TexelSample.of(tall(make_capture, coverage=coverage), count=60)
    np.testing.assert_array_equal(sampled.texels, np.flatnonzero(coverage))  # all 30: too few to leave strips out
    with pytest.raises(InputError, match="covered texels"):
        TexelSample.of(tall(make_capture, coverage=0 * coverage, name="none"))


def test_gram_is_the_images_mean_products() -> None:
    given, _ = sample(0.5, True)
    images = given.responses.transpose(1, 0, 2).reshape(TRAIN + VALIDATION, -1).astype(np.float64)
    np.testing.assert_allclose(given.gram, images @ images.T / 90, rtol=FLOAT32, atol=1e-5)


def test_quadrature_weights_of_a_lattice_are_equal_and_twins_share() -> None:
    assert Directions("sphere").quadrature(point_set("fibonacci", 300, "sphere")) == pytest.approx(np.ones(300), rel=0.2)
    octahedron = np.concatenate([np.eye(3), -np.eye(3)])
    np.testing.assert_allclose(Directions("sphere").quadrature(octahedron), 1)
    lights = point_set("fibonacci", 60, "sphere")
    twin = normalize(lights[:1] + 1e-6)
    shares = Directions("sphere").quadrature(np.concatenate([lights, twin]))
    assert shares[[0, -1]] == pytest.approx(shares[1:-1].mean() / 2, rel=0.1)


@pytest.mark.parametrize("weighting", ["plain", "relative"])
def test_light_space_and_back(weighting: str) -> None:
    # Projecting T with `weights`, taking `offsets` off and summing `functions` projects on the axes: all of T for all axes.
    given, _ = sample(0.5, False)
    space = LightSpace.of(given, weighting)
    axes = np.linalg.svd(space.centered, full_matrices=False)[2].astype(np.float32)
    planes = np.einsum("slc,nlc->sn", space.weights(axes), given.responses) - space.offsets(axes)[:, None]
    ones = np.concatenate([np.ones((1, planes.shape[1])), planes])
    np.testing.assert_allclose(np.einsum("fn,lfc->nlc", ones, space.functions(axes)), given.responses, atol=1e-4)
    assert (space.row_weights**2).mean() == pytest.approx(1, rel=1e-5)


def test_the_usual_stays_unless_another_is_much_better() -> None:
    given, centers = sample(0.5, False)
    options = candidates(given, centers)
    best = choose(given, options, RIDGES)
    same = (best.spread, RIDGES[1] if best.ridge != RIDGES[1] else RIDGES[0])
    kept = choose(given, options, RIDGES, usual=same)
    assert (kept.spread, kept.ridge) == same and kept.error < 1.5 * best.error
    assert choose(given, options, RIDGES, usual=(9.0, 9.0)) == best  # not among them
    clean, centers = sample(1e-3, False)
    sure = choose(clean, candidates(clean, centers), RIDGES)
    assert choose(clean, candidates(clean, centers), RIDGES, usual=(SPREADS[0], RIDGES[2])) == sure
