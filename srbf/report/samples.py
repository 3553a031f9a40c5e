"""The error curve by which `srbf bake --samples auto` stopped."""

from __future__ import annotations

from typing import Any

import numpy as np

from srbf.capture import Capture
from srbf.report.inline import figure
from srbf.report.plot import Axis, Plot
from srbf.report.section import Section


def samples_plot(curve: list[dict[str, Any]]) -> str:
    """Error on the validation lights without their noise, and that noise, after each doubling of the samples."""
    samples = np.array([entry["samples"] for entry in curve], np.float64)
    error = np.array([entry["relative_rmse"] for entry in curve])
    noise = np.array([entry["noise"] for entry in curve])
    across = Axis(
        float(samples[0]) * 0.9,
        float(samples[-1]) * 1.1,
        "samples per texel of each fitted light (log scale)",
        log=True,
        ticks=tuple(samples),
    )
    plot = Plot(520, 280, across, Axis(0.0, 1.15 * float(max(error.max(), noise.max())), "share of the rms", form=".2g"), (24, 90, 42, 58))
    plot.line(samples, error, "blue")
    plot.dots(samples, error, "blue")
    plot.label(float(samples[-1]), float(error[-1]), "error", "strong blue", dx=10, dy=4)
    plot.line(samples, noise, "red thin dash")
    plot.label(float(samples[-1]), float(noise[-1]), "their noise", "red", dx=10, dy=4)
    caption = (
        f"The bake stopped at {samples[-1]:.0f} samples: after each doubling it interpolates all fitted images and measures the "
        "relative RMSE on the validation lights without their noise. It does not use the holdout lights."
    )
    return figure('<div class="plots">' + plot.svg("Validation error by samples") + "</div>", caption)


def samples_section(capture: Capture) -> list[Section]:
    """The section of a capture that was baked with automatic samples; else none."""
    curve = capture.manifest.get("source", {}).get("validation_curve")
    return [Section("Samples", samples_plot(curve))] if curve else []
