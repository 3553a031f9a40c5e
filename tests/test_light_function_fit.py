"""The one choice for all light functions: against a grid of pairs on boards under ring domes, and against slow twins."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.gaussian import weight
from srbf.basis.light_functions import LightFunctions
from srbf.light_function_fit import choose_functions, dense_centers, fit_functions, functions_through
from srbf.model_selection import TexelSample
from srbf.sphere import mean_spacing, normalize, point_set, random_directions

Dome = tuple[tuple[int, ...], tuple[float, ...]]
DOMES: dict[str, Dome] = {  # lights and elevation (degrees) of each ring
    "3 rings": ((20, 16, 12, 1), (20, 45, 68, 90)),
    "4 rings": ((18, 14, 10, 6, 1), (12, 33, 54, 74, 90)),
    "6 rings": ((12, 12, 10, 8, 5, 2), (10, 25, 40, 55, 70, 84)),
    "as SynthRTI": ((18, 12, 10, 8, 1), (10, 30, 50, 70, 90)),
}
SPREADS = tuple(np.geomspace(0.5, 4, 8))  # of the lights' spacing
RIDGES = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
BELOW_BEST = 1.5  # dB that the choice may lose against the best pair of the grid in hindsight; one choice a function lost 5 to 10


def on_rings(dome: Dome) -> np.ndarray:
    counts, elevations = dome
    rows = []
    for number, (count, elevation) in enumerate(zip(counts, np.radians(elevations), strict=True)):
        turn = 2 * np.pi * (np.arange(count) + 0.5 * (number % 2)) / count
        rows.append(np.stack([np.cos(turn) * np.cos(elevation), np.sin(turn) * np.cos(elevation), np.full(count, np.sin(elevation))], 1))
    return np.concatenate(rows)


def between_rings(dome: Dome, rng: np.random.Generator, count: int = 20) -> np.ndarray:
    edges = np.radians(dome[1])
    elevation = ((edges[1:] + edges[:-1]) / 2)[np.arange(count) % (len(edges) - 1)]
    turn = rng.uniform(0, 2 * np.pi, count)
    return np.stack([np.cos(turn) * np.cos(elevation), np.sin(turn) * np.cos(elevation), np.sin(elevation)], 1)


def glossy_board(lights: np.ndarray, rng: np.random.Generator, texels: int = 250) -> np.ndarray:
    """Stored values (texels, L, 3) of a nearly flat board of four materials seen from above, their highlights as bytes."""
    normal = normalize(np.concatenate([0.1 * rng.normal(size=(texels, 2)), np.ones((texels, 1))], axis=1))
    roughness = rng.choice([0.1, 0.2, 0.35, 0.6], texels)[:, None]
    albedo = rng.uniform(0.06, 0.6, (texels, 3))
    half = normalize(lights + [0, 0, 1])
    NoL = np.clip(normal @ lights.T, 0, 1)
    slope = np.tan(np.arccos(np.clip(normal @ half.T, 1e-3, 1)))
    highlight = 0.04 * NoL * np.exp(-((slope / roughness) ** 2)) / (np.pi * roughness**2)
    linear = albedo[:, None] / np.pi * NoL[..., None] + highlight[..., None]
    exposed = np.clip(linear / np.quantile(linear, 0.995), 0, 1)
    return (np.round(exposed ** (1 / 2.2) * 255) / 255).astype(np.float32)


def psnr(predicted: np.ndarray, true: np.ndarray) -> float:
    """Mean over lights; both (L, n, 3)."""
    rmse = np.sqrt(((np.maximum(predicted, 0) - true) ** 2).mean(axis=(1, 2)))
    return float(np.mean(-20 * np.log10(rmse)))


@pytest.mark.parametrize("dome", DOMES)
def test_no_pair_of_a_grid_is_much_better(dome: str) -> None:
    rng = np.random.default_rng(len(dome))
    lights, tests = on_rings(DOMES[dome]), between_rings(DOMES[dome], rng)
    images = glossy_board(np.concatenate([lights, tests]), rng).transpose(1, 0, 2)
    values, true = images[: len(lights)].astype(np.float64), images[len(lights) :]
    sample = TexelSample(np.arange(images.shape[1]), images[: len(lights)].transpose(1, 0, 2), lights, len(lights))
    chosen, _ = functions_through(sample, values, "hemisphere")
    centers = dense_centers(lights, "hemisphere")
    best = 0.0
    for factor in SPREADS:
        spread = min(1.0, factor * mean_spacing(lights))
        basis, towards = weight(lights @ centers.T, spread), weight(tests @ centers.T, spread)
        for ridge in RIDGES:
            solved = np.linalg.solve(basis @ basis.T + ridge * np.eye(len(lights)), values.reshape(len(lights), -1))
            best = max(best, psnr((towards @ (basis.T @ solved)).reshape(true.shape), true))
    assert psnr(chosen.evaluate(tests), true) >= best - BELOW_BEST


def planted(noise: float, validated: bool = False) -> tuple[TexelSample, np.ndarray, LightFunctions]:
    rng = np.random.default_rng(3)
    train = point_set("hammersley", 60, "hemisphere")
    directions = np.concatenate([train, random_directions(12, "hemisphere", rng)]) if validated else train
    centers = dense_centers(train, "hemisphere")
    truth = LightFunctions(centers, np.full(5, 0.6), rng.normal(size=(5, len(centers), 3)).astype(np.float32))
    images = truth.evaluate(directions) + noise * rng.normal(size=(len(directions), 5, 3))
    return TexelSample(np.arange(5), images.transpose(1, 0, 2).astype(np.float32), directions, 60), centers, truth


@pytest.mark.parametrize("validated", [True, False])
def test_noise_asks_for_a_ridge(validated: bool) -> None:
    clean, noisy = (choose_functions(*planted(noise, validated)[:2]) for noise in (0.0, 6.0))
    assert clean.rule == ("validation" if validated else "leave-one-light-out")
    assert noisy.ridge > 10 * clean.ridge and noisy.error > clean.error


def test_what_is_given_is_kept() -> None:
    sample, centers, _ = planted(0.1)
    model = choose_functions(sample, centers, 0.5, 0.02)
    assert (model.kernel.narrow, model.kernel.wide, model.ridge) == (0.5, None, pytest.approx(0.02))
    assert choose_functions(sample, centers, 0.5).kernel.narrow == 0.5
    assert choose_functions(sample, centers, ridge=0.02).ridge == pytest.approx(0.02)


def test_given_pair_is_ridge_regression_on_the_centers() -> None:
    sample, centers, _ = planted(0.1)
    values = sample.answers.transpose(1, 0, 2).astype(np.float64)
    found = fit_functions(sample, values, choose_functions(sample, centers, 0.5, 0.02), centers, "hemisphere")
    basis = weight(sample.directions @ centers.T, 0.5)
    expected = np.linalg.solve(basis.T @ basis + 0.02 * np.eye(len(centers)), basis.T @ values.reshape(60, -1))
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found.coefficients.transpose(1, 0, 2).reshape(len(centers), -1), expected, atol=1e-4 * scale)


def test_one_light_and_two_are_fitted() -> None:
    for count in (1, 2):
        lights = point_set("fibonacci", 8, "hemisphere")[:count]
        sample = TexelSample(np.arange(4), np.ones((4, count, 3), np.float32), lights, count)
        functions, facts = functions_through(sample, np.ones((count, 2, 3)), "hemisphere")
        assert np.isfinite(functions.coefficients).all() and facts["ridge"] > 0
