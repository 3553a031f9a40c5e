"""`--samples auto`: when more samples no longer help, judged on the validation lights, their own noise taken off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from srbf.bake.accumulation import Sum
from srbf.capture import Capture
from srbf.encode.light_function_fit import choose_functions, dense_centers
from srbf.encode.model_selection import TexelSample
from srbf.sphere import domain_of

TEXELS = 4096
WORTH = 0.02  # of the error: a doubling that lowers it by less was the last
MOST_SAMPLES = 1024


@dataclass(frozen=True)
class Measure:
    """After so many samples a train light: the error of all train images, interpolated, on the validation lights, as a share of their rms.

    `noise` is the validation images' own, likewise, already taken from `relative_rmse` in the square.
    """

    samples: int
    relative_rmse: float
    noise: float


def measure(capture: Capture, samples: int, sums: Sequence[Sum]) -> Measure:
    """How well the capture as it stands predicts its validation lights; `sums` are theirs, in order, with their squares.

    All train images are interpolated by dense SRBFs of the kernel and ridge that predict best: of all that a fit can do with them the most
    sensitive to noise. With v = t + n the error seen is E|f - t|^2 + E|n|^2, and the second is known from how the passes of v differ.
    """
    sample = TexelSample.of(capture, TEXELS)
    train = sample.directions[: sample.train]
    choice = choose_functions(sample, dense_centers(train, domain_of(train)))
    noise = float(np.mean([total.noise_variance().reshape(-1, 3)[sample.texels].mean(dtype=np.float64) for total in sums]))
    power = float((sample.responses[:, sample.train :].astype(np.float64) ** 2).mean()) - noise
    power = max(power, 1e-30)
    return Measure(samples, float(np.sqrt(max(choice.error - noise, 0.0) / power)), float(np.sqrt(noise / power)))


def is_enough(curve: Sequence[Measure]) -> bool:
    """Whether the last doubling lowered the error by less than WORTH of it."""
    if len(curve) < 2:
        return False
    before, now = curve[-2], curve[-1]
    return now.samples >= MOST_SAMPLES or now.relative_rmse >= before.relative_rmse * (1 - WORTH)


def record(curve: Sequence[Measure]) -> list[dict[str, Any]]:
    """For the manifest."""
    return [asdict(entry) for entry in curve]
