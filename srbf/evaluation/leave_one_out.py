"""Leave-one-out error, for captures without held-out lights, mostly photographs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.captured_light import Role
from srbf.errors import InputError
from srbf.evaluation.errors_by_role import PEAK_QUANTILE, PeakHistogram, role_error, squared_errors
from srbf.light_domain import domain_of_capture
from srbf.methods import responses

MEMORY_BYTES = 2 << 30  # of responses; larger captures use a sample of texels


def leave_one_out(
    capture: Capture, encode: Callable[[Capture], Asset], progress: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, Any]:
    """For each train light: fit to all others, with all automatic choices made again, and relight that light.

    {"leave_one_out": RoleError as a dict, "lights": one {file, role, rmse} each}, on all covered texels, or on as many random
    ones as fit MEMORY_BYTES, whose number is then in `texels`. Validation and holdout lights are not used. A light without close neighbors
    is an extrapolation, so the result is an upper bound of the error between the lights. Cost: one fit per light.
    InputError with fewer than three train lights.
    """
    lights = capture.indices("train")
    if len(lights) < 3:
        raise InputError(f"expected at least 3 train lights in {capture.folder}, found {len(lights)}")
    covered = np.flatnonzero(capture.coverage().ravel() >= COVERED)
    most = max(1, MEMORY_BYTES // (12 * len(capture.lights)))
    texels = covered if len(covered) <= most else np.sort(np.random.default_rng(0).choice(covered, most, replace=False))
    roles: list[Role | None] = [role if (role := light.role) == "train" else None for light in capture.lights]
    kept = capture.load(texels).with_roles(roles)
    domain = domain_of_capture(kept)
    peaks = PeakHistogram()
    squares, powers = np.empty(len(lights)), np.empty(len(lights))
    for left in range(len(lights)):
        rest = kept.with_roles([None if i == left else "train" for i in range(len(lights))])
        asset = encode(rest)
        response = responses(asset, domain.captured(kept, [left]))[0].reshape(-1, 3)
        reference = kept.image(left).reshape(-1, 3)
        peaks.add(reference)
        squares[left], powers[left] = squared_errors(response, reference)
        progress(left + 1, len(lights))
    peak = 1.0 if capture.source_bits == 8 else peaks.quantile(PEAK_QUANTILE)
    error = asdict(role_error(squares, powers, 3 * len(texels), peak))
    if len(texels) < len(covered):
        error["texels"] = len(texels)
    rows = zip(lights, np.sqrt(squares / (3 * len(texels))), strict=True)
    return {
        "leave_one_out": error,
        "lights": [{"file": capture.lights[i].file, "role": "leave_one_out", "rmse": float(rmse)} for i, rmse in rows],
    }
