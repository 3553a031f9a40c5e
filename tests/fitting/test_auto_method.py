"""A method for a number of bytes or of decibels: within the budget, and the right one of the two for what the scene is."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.capture import Capture
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import evaluate
from srbf.fitting.auto_method import DEFAULT_BUDGET, LEAST_LIGHTS, within_budget
from srbf.methods.clustered_eigen_map import ClusteredEigenMap
from srbf.methods.eigen_map import EigenMap
from srbf.sphere import random_directions

pytest.importorskip("sklearn")

HEIGHT, WIDTH = 32, 36  # room for 16 clusters of 64 texels


def shadowed(rng: np.random.Generator):
    """36 patches of texels, each under three small balls of its own: as many functions of the light as patches."""
    balls = random_directions(36 * 3, "hemisphere", rng).reshape(36, 3, 3)
    labels = (np.arange(HEIGHT) * 6 // HEIGHT)[:, None] * 6 + (np.arange(WIDTH) * 6 // WIDTH)[None]
    level = rng.uniform(0.3, 1, (HEIGHT, WIDTH))

    def response(direction: np.ndarray) -> np.ndarray:
        angle = np.arccos(np.clip(balls @ direction, -1, 1))
        seen = np.clip((angle - 0.3) / 0.25, 0, 1).prod(axis=1)
        return (seen[labels] * direction[2] * level)[..., None] * [1, 0.8, 0.6]

    return response


def smooth(bumps: np.random.Generator):
    """Unshadowed cosines about slopes that vary from texel to texel, three functions for them all, and 1 % of a render's noise."""
    slope = bumps.uniform(-0.3, 0.3, (HEIGHT, WIDTH, 2))
    return lambda d: (d[2] + slope @ d[:2] + 0.5)[..., None] * [1, 0.8, 0.6] * bumps.normal(1, 0.01, (HEIGHT, WIDTH, 1))


@pytest.fixture
def shadows(make_capture) -> Capture:
    return make_capture(shadowed(np.random.default_rng(0)), lights=150, validation=20, holdout=0, encoding="half", name="shadows").load()


@pytest.fixture
def cosines(make_capture) -> Capture:
    return make_capture(smooth(np.random.default_rng(1)), lights=60, validation=12, holdout=0, encoding="half").load()


def size(method: EigenMap | ClusteredEigenMap, capture: Capture) -> int:
    return method.encode(capture).bytes_per_texel()["directional"]


@pytest.mark.slow
def test_shadows_ask_for_clusters_and_smooth_light_does_not(shadows: Capture, cosines: Capture) -> None:
    clustered = within_budget(shadows, 9, spread=0.3, ridge=0.01)
    assert isinstance(clustered, ClusteredEigenMap) and clustered.components == 8 and clustered.encoding == "uint8"
    shared = within_budget(cosines, 9, spread=0.3, ridge=0.01)
    assert isinstance(shared, EigenMap) and shared.components == 8
    assert size(clustered, shadows) <= 9 and size(shared, cosines) <= 9


@pytest.mark.slow
@pytest.mark.parametrize("budget", [5, None])
def test_bytes_are_kept_to(shadows: Capture, budget: int | None) -> None:
    assert size(within_budget(shadows, budget, spread=0.3, ridge=0.01), shadows) <= (budget or DEFAULT_BUDGET)


@pytest.mark.slow
def test_a_lower_target_takes_fewer_bytes(shadows: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    settings = {"spread": 0.3, "ridge": 0.01}  # one pair for all: what is asked here is the size
    low, high = (size(within_budget(shadows, psnr=dB, say=said.append, **settings), shadows) for dB in (15.0, 25.0))
    assert low < high
    assert not any("at most" in line for line in said)
    monkeypatch.setattr("srbf.fitting.auto_method.MOST_SIZE", 8)
    within_budget(shadows, psnr=90.0, say=said.append, **settings)
    assert "expected 90 dB" in said[-2] and said[-1].startswith("chose")


@pytest.mark.lengthy
def test_a_relative_error_takes_bytes_that_reach_it(cosines: Capture) -> None:
    said: list[str] = []
    settings = {"spread": 0.3, "ridge": 0.01}
    chosen = within_budget(cosines, error=0.05, say=said.append, **settings)
    assert evaluate(chosen.encode(cosines), cosines, roles=("validation",))["validation"]["relative_rmse"] <= 0.05
    assert len(said) == 1 and "relative RMSE" in said[0]
    within_budget(cosines, 8, error=1e-4, say=said.append, **settings)
    assert "expected an error of 0.01%" in said[1] and "at least" in said[1]


def test_train_lights_stand_in_for_validation(make_capture) -> None:
    capture = make_capture(smooth(np.random.default_rng(2)), lights=LEAST_LIGHTS, holdout=3).load()
    assert isinstance(within_budget(capture, 4), EigenMap)
    few = make_capture(smooth(np.random.default_rng(2)), lights=LEAST_LIGHTS - 1, holdout=3, name="few").load()
    said: list[str] = []
    assert within_budget(few, 4, say=said.append) == EigenMap(components=4, encoding="uint8")
    assert f"fewer than {LEAST_LIGHTS} train lights" in said[0]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"budget": 3}, "at least 4"),
        ({"budget": 8, "psnr": 30.0}, "found both"),
        ({"error": 0.1, "psnr": 30.0}, "`error` or a `psnr`"),
        ({"error": 1.0}, "`error` above 0 and below 1"),
        ({"psnr": float("inf")}, "psnr"),
    ],
)
def test_what_no_method_can_keep_to(cosines: Capture, asked: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        within_budget(cosines, **asked)
