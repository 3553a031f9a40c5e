"""`--samples auto`: the noise of the validation lights is not taken for error, and the rule stops where doublings no longer help."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from srbf.bake.accumulation import NOTHING, Sum
from srbf.bake.stopping import Measure, is_enough, measure
from srbf.capture import Capture

NOISE = 0.5  # of one sample, on responses between 0 and 1
PASSES = (1, 3, 4)


def noisy(make_capture: Callable[..., Capture], samples: int) -> tuple[Capture, list[Sum]]:
    """A bumpy floor under 200 lights of `samples` samples and 12 validation lights of 8, in three passes; and the sums of the latter."""
    rng = np.random.default_rng(0)
    tilt = rng.normal(0, 0.2, (24, 24, 2))
    normals = np.concatenate([tilt, np.ones((24, 24, 1))], axis=2)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    sums: list[Sum] = []
    seen = 0

    def response(direction: np.ndarray) -> np.ndarray:
        nonlocal seen
        seen += 1
        truth = np.repeat(np.maximum(normals @ direction, 0)[:, :, None], 3, axis=2)
        if seen <= 200:
            return truth + rng.normal(0, NOISE / samples**0.5, truth.shape)
        total = NOTHING
        for part in PASSES:
            total = total.with_pass(part, (truth + rng.normal(0, NOISE / part**0.5, truth.shape)).astype(np.float32), None, squares=True)
        sums.append(total)
        return total.mean

    return make_capture(response, lights=200, validation=12, holdout=0, name=f"capture{samples}"), sums


@pytest.mark.slow
def test_validation_noise_is_not_taken_for_error(make_capture: Callable[..., Capture]) -> None:
    """Of a smooth floor: its cosines are fitted to within 2 %, while the validation images hold noise of a quarter of their rms."""
    capture, sums = noisy(make_capture, 256)
    found = measure(capture, 256, sums)
    power = np.mean([np.square(total.mean).mean() for total in sums]) - NOISE**2 / 8
    assert found.noise == pytest.approx(NOISE / 8**0.5 / power**0.5, rel=0.03)
    assert found.noise > 0.25
    assert found.relative_rmse < 0.05


@pytest.mark.slow
def test_the_error_falls_with_the_samples(make_capture: Callable[..., Capture]) -> None:
    errors = [measure(*_arguments(make_capture, samples)).relative_rmse for samples in (1, 16)]
    assert errors[1] < 0.6 * errors[0]


def _arguments(make_capture: Callable[..., Capture], samples: int) -> tuple[Capture, int, list[Sum]]:
    capture, sums = noisy(make_capture, samples)
    return capture, samples, sums


@pytest.mark.parametrize(
    ("errors", "stops"),
    [([0.3], False), ([0.3, 0.25], False), ([0.3, 0.296], True), ([0.3, 0.31], True), ([0.3, 0.2, 0.19], False), ([0.3, 0.2, 0.198], True)],
)
def test_it_stops_when_a_doubling_no_longer_helps(errors: list[float], stops: bool) -> None:
    assert is_enough([Measure(2**i, error, 0.1) for i, error in enumerate(errors)]) is stops


def test_it_stops_somewhere() -> None:
    assert is_enough([Measure(512, 0.2, 0.1), Measure(1024, 0.1, 0.1)])
