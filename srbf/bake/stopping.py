"""Where a bake stops: by its time, or, with `samples=auto`, once the validation lights' error, without their noise, stops improving."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from srbf.bake.accumulation import Sum
from srbf.capture import Capture
from srbf.encode.light_function_fit import choose_functions, dense_centers
from srbf.encode.model_selection import TexelSample

TEXELS = 4096
MIN_IMPROVEMENT = 0.02  # of the error: a doubling that lowers it by less is the last
MOST_SAMPLES = 1024


@dataclass(frozen=True)
class Measure:
    """The error of the interpolated train images on the validation lights, relative to their rms, at so many `samples` per train light.

    noise: that of the validation images, relative too; its square is already subtracted from that of `relative_rmse`.
    """

    samples: int
    relative_rmse: float
    noise: float


def time_is_up(samples: Sequence[int]) -> str:
    """A line for a bake whose train lights have so many samples each."""
    if not any(samples):
        return "the time was up before the first light was done; the same command resumes the bake"
    return f"the time is up at {min(samples)} to {max(samples)} samples per texel; the same command adds more"


def measure(capture: Capture, samples: int, sums: Sequence[Sum]) -> Measure:
    """How well the capture predicts its validation lights; `sums` are theirs, in order, with squares.

    All train images are interpolated by dense SRBFs with the kernel and ridge that predict best, the fit most sensitive to noise. With a
    validation image v = t + n, truth and noise, the measured error is E|f - t|^2 + E|n|^2; the second term follows from the differences
    of v's passes.
    """
    sample = TexelSample.of(capture, TEXELS)
    train = sample.coordinates[: sample.train]
    choice = choose_functions(sample, dense_centers(train, sample.domain))
    noise = float(np.mean([total.noise_variance().reshape(-1, 3)[sample.texels].mean(dtype=np.float64) for total in sums]))
    power = float((sample.responses[:, sample.train :].astype(np.float64) ** 2).mean()) - noise
    power = max(power, 1e-30)
    return Measure(samples, float(np.sqrt(max(choice.error - noise, 0.0) / power)), float(np.sqrt(noise / power)))


def is_enough(curve: Sequence[Measure]) -> bool:
    """Whether the last doubling lowered the error by less than MIN_IMPROVEMENT of it, or MOST_SAMPLES are reached."""
    if len(curve) < 2:
        return False
    before, now = curve[-2], curve[-1]
    return now.samples >= MOST_SAMPLES or now.relative_rmse >= before.relative_rmse * (1 - MIN_IMPROVEMENT)


def record(curve: Sequence[Measure]) -> list[dict[str, Any]]:
    """JSON for the manifest."""
    return [asdict(entry) for entry in curve]
