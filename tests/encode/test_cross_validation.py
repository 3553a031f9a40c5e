"""Errors of lights left out, against fits repeated without them; and which lights make a band."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.basis.gaussian import weight
from srbf.encode.cross_validation import HeldOut
from srbf.light_domain.directions import BANDED_LIGHTS, Directions
from srbf.solve.kernel_ridge import KernelPath
from srbf.sphere import mean_spacing, point_set, random_directions

RIDGE = 0.05
ROUNDING = 1e-6  # relative: Gram matrices and their roots in float64


def ring_dome(counts: tuple[int, ...] = (12, 10, 8), elevations: tuple[float, ...] = (15, 40, 65)) -> np.ndarray:
    rows = []
    for count, elevation in zip(counts, np.radians(elevations), strict=True):
        turn = 2 * np.pi * np.arange(count) / count
        rows.append(np.stack([np.cos(turn) * np.cos(elevation), np.sin(turn) * np.cos(elevation), np.full(count, np.sin(elevation))], 1))
    return np.concatenate(rows)


def test_a_ring_is_a_band() -> None:
    lights = ring_dome()
    groups = [list(group) for array in Directions("sphere").left_out_groups(lights) for group in array]
    assert sorted(group[0] for group in groups) == list(range(30))
    rings = [set(range(12)), set(range(12, 22)), set(range(22, 30))]
    assert all(set(group) in rings for group in groups)


def test_of_many_lights_some_are_the_middle() -> None:
    lights = point_set("fibonacci", 300, "sphere")
    groups = [group for array in Directions("sphere").left_out_groups(lights) for group in array]
    assert len(groups) == BANDED_LIGHTS
    height = 0.4 * mean_spacing(lights)
    for group in groups:
        elevation = np.arcsin(lights[:, 2])
        assert set(group) == set(np.flatnonzero(np.abs(elevation - elevation[group[0]]) < height))


@pytest.mark.parametrize("count", [40, 160])  # fewer and more images than principal directions that are kept
def test_errors_are_those_of_fits_without_the_lights(count: int) -> None:
    rng = np.random.default_rng(1)
    lights = np.concatenate([point_set("hammersley", count, "hemisphere"), random_directions(7, "hemisphere", rng)])
    centers = point_set("fibonacci", 50, "hemisphere")
    basis = weight(lights @ centers.T, 0.4)
    images = basis @ rng.normal(size=(50, 300)) + 0.01 * rng.normal(size=(count + 7, 300))
    held_out = HeldOut.of(images @ images.T / 300, Directions("sphere").left_out_groups(lights[:count]), count)
    kernel = basis @ basis.T
    path = KernelPath.of(kernel[:count, :count])

    def predicted(light: int, rest: np.ndarray) -> np.ndarray:
        solved = np.linalg.solve(kernel[np.ix_(rest, rest)] + RIDGE * np.eye(len(rest)), images[rest])
        return kernel[light, rest] @ solved

    def error(light: int, without: np.ndarray) -> float:
        return float(((images[light] - predicted(light, np.setdiff1d(np.arange(count), without))) ** 2).mean())

    tolerance = ROUNDING if count <= 128 else 0.2  # what is beyond the principal directions counts as noise, equally at all lights
    single, banded = held_out.left_out(path, RIDGE)
    assert single[:12] == pytest.approx([error(i, np.array([i])) for i in range(12)], rel=tolerance)
    groups = [group for array in held_out.groups for group in array]
    assert banded[:6] == pytest.approx([error(int(g[0]), g) for g in groups[:6]], rel=tolerance)
    unseen = held_out.validation(path, RIDGE, kernel[count:, :count])
    assert unseen == pytest.approx([error(count + i, np.array([], np.int64)) for i in range(7)], rel=tolerance)


def test_no_light_drowns_the_rest() -> None:
    lights = ring_dome()
    held_out = HeldOut.of(np.eye(30), Directions("sphere").left_out_groups(lights), 30)
    even, spiked = np.full(30, 1e-2), np.full(30, 1e-3)
    spiked[29] = 10.0
    assert held_out.score(spiked, spiked) < held_out.score(even, even)
    unseen = np.full(5, 1e-2)
    assert held_out.score(even, even, unseen) == pytest.approx(held_out.score(even, even))
