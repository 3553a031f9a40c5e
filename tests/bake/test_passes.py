"""Passes of one sample: each is spread over the footprint again, so that their mean is what one bake of many samples gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy import ndarray

from srbf.capture import Capture

pytestmark = pytest.mark.blender

PASSES = 96
HALF = 2.0**-11  # relative rounding of a stored half float
WALL = 0.5  # m: the height of the wall on x = 0, y from 0 to 1, that shades the square of |x|, |y| < 1
SIZE = 48
LEAST, MOST = 0.7, 1.5  # times the noise: 16 samples have rare bright paths; passes are spread over texels against each other


def suns(path: Path, direction: tuple[float, float, float], count: int) -> Path:
    """A light list of one sun, so many times: the capture's images are passes of one sample, each with a seed of its own."""
    path.write_text("\n".join([str(count), *(f"{i} {direction[0]} {direction[1]} {direction[2]}" for i in range(count))]) + "\n")
    return path


def values(capture: Capture) -> ndarray:
    """(passes, H, W), green."""
    return np.stack([capture.image(i)[..., 1] for i in range(len(capture.lights))]).astype(np.float64)


def lit(position: ndarray, sun: tuple[float, float, float], footprint: float) -> ndarray:
    """(H, W) the part of each texel's footprint, a box of so many texels, that the wall leaves in the sun; NaN beside its shadow's ends.

    The sun lies in the plane y = 0: the wall shades x from 0 to -WALL * sun x / sun z, whatever y in (0, 1).
    """
    half = footprint * 2 / SIZE / 2
    x, y = position[..., 0], position[..., 1]
    end = -WALL * sun[0] / sun[2]
    low, high = np.maximum(x - half, min(end, 0)), np.minimum(x + half, max(end, 0))
    part = 1 - np.clip(high - low, 0, None) / (2 * half)
    part[y < 0] = 1
    part[(np.abs(y) < half) | (np.abs(y - 1) < half) | (np.abs(x) < 2 * half)] = np.nan  # beside the wall rays start on its other side
    return part


def test_passes_spread_over_the_footprint(bake, tmp_path: Path) -> None:
    """Against the closed form: the mean over passes is the part of the footprint in the sun, their variance that of so many coins."""
    sun = (0.53, 0.0, 0.86)
    settings = {"width": SIZE, "height": SIZE, "light_list": suns(tmp_path / "suns.lp", sun, PASSES), "holdout": 0, "transport": "indirect"}
    capture = bake("occluder", "lightmap:Plane", **settings).capture
    apart, combined = Capture.open(capture.folder), Capture.open(capture.folder).combined()
    cosine = sun[2] / np.linalg.norm(sun)
    expected = lit(capture.geometry("position").astype(np.float64), sun, apart.manifest["direct"]["footprint"])
    edge = (expected > 0.02) & (expected < 0.98)
    assert edge.sum() > 20
    seen = values(combined) / cosine
    np.testing.assert_allclose(seen[:, expected == 1], 1, rtol=0.01)
    chance = expected[edge]
    error = (seen[:, edge].mean(axis=0) - chance) / np.sqrt(chance * (1 - chance) / PASSES)
    assert abs(error.mean()) < 4 / np.sqrt(edge.sum()) and np.abs(error).max() < 4.5
    squares = ((seen[0, edge] - seen[1, edge]) ** 2).mean() / (2 * chance * (1 - chance)).mean()
    assert 0.4 < squares < 1.6  # of the first two passes, which were the same picture
    variance = seen[:, edge].var(axis=0, ddof=1).mean() / (chance * (1 - chance)).mean()
    assert variance == pytest.approx(1, abs=0.06)


def direct(capture: Capture) -> ndarray:
    """(passes, H, W), green, of an indirect capture: bounces are rare and bright, so that few passes tell nothing of their noise."""
    return values(capture.combined()) - values(capture)


@pytest.mark.parametrize(("scene", "receiver"), [("torus", "lightmap:Torus"), ("projected", "lightmap:Strip")])
def test_the_mean_of_passes_has_no_bias_at_chart_borders(bake, tmp_path: Path, scene: str, receiver: str) -> None:
    """Every pass has a value wherever a texel's center is covered, and all together are one bake of many samples."""
    sun = (0.35, 0.25, 0.9)
    settings = {"width": SIZE, "height": SIZE, "holdout": 0, "transport": "indirect"}
    passes = bake(scene, receiver, **settings, light_list=suns(tmp_path / "passes.lp", sun, PASSES)).capture
    whole = bake(scene, receiver, name="whole", **settings, light_list=suns(tmp_path / "one.lp", sun, 1), samples=1024, seed=5).capture
    covered = passes.coverage() == 1
    border = covered & ~(np.roll(covered, 1, 0) & np.roll(covered, -1, 0) & np.roll(covered, 1, 1) & np.roll(covered, -1, 1))
    seen, wanted = direct(passes), direct(whole)[0]
    bright = wanted > 0.9 * (passes.geometry("normal") @ np.array(sun) / np.linalg.norm(sun)).clip(0.3)  # wholly in the sun
    assert (border & bright).sum() > 50
    assert (seen[:, covered & bright] > 0.1).mean() > 0.999
    rounding = 2 * HALF * np.maximum(values(whole.combined())[0], 1e-3)
    error = seen.mean(axis=0) - wanted
    squares = error**2 / (seen.var(axis=0, ddof=1) * (1 / PASSES + 1 / 1024) + rounding**2)
    for where in (border, covered & ~border):
        assert squares[where].mean() < 1.3
        assert abs(error[where].mean()) < 2e-3 * wanted[covered].mean()


def test_passes_of_a_camera_add_up(bake, tmp_path: Path) -> None:
    """At the edges of a colored square against nothing: each pass meets it or not, as coins of the pixel's coverage fall."""
    sun = (0.5, 0.0, 0.86)
    capture = bake("view", "view", width=40, height=30, holdout=0, light_list=suns(tmp_path / "suns.lp", sun, PASSES)).capture
    coverage = capture.coverage()
    edge = (coverage > 0.1) & (coverage < 0.9)
    assert edge.sum() > 20
    seen = values(capture)[:, edge] * coverage[edge] / (0.4 * sun[2] / np.linalg.norm(sun) / np.pi)
    chance = coverage[edge].astype(np.float64)
    coin = chance * (1 - chance)
    assert abs((seen.mean(axis=0) - chance).mean()) < 0.02
    assert 0.4 < ((seen[0] - seen[1]) ** 2).mean() / (2 * coin).mean() < 1.6
    assert seen.var(axis=0, ddof=1).mean() / coin.mean() == pytest.approx(1, abs=0.1)
    noise = seen - seen.mean(axis=0)
    assert abs((noise[1:] * noise[:-1]).mean() / (noise**2).mean()) < 0.05


def test_indirect_images_tell_their_noise(bake) -> None:
    """About as they differ from the same of many samples. Combined captures tell none: passes of direct light differ by twice it."""
    settings = {"validation": 1, "holdout": 2, "transport": "indirect"}
    few, many = (bake("torus", "lightmap:Torus", name=str(n), holdout_samples=n, **settings).capture for n in (16, 1024))
    told = [i for i, light in enumerate(few.lights) if light.noise is not None]
    assert told == [i for i, light in enumerate(few.lights) if light.role != "train" and few.image(i).any()]
    for i in told:
        true = many.image(i).astype(np.float64)
        noise = np.sqrt(((few.image(i) - true) ** 2).mean() / (true**2).mean())
        assert 1e-3 < LEAST * noise <= few.lights[i].noise <= MOST * noise
    combined = bake("torus", "lightmap:Torus", holdout_samples=16).capture
    assert all(light.noise is None for light in combined.lights)
