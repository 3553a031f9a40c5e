"""The subject of a report: the compared lights, their references, one exposure and the demonstration lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.captured_light import ROLES, Role
from srbf.evaluation.errors_by_role import psnr
from srbf.light_domain import domain_of_capture
from srbf.lights import Light, PointLight, SpotLight
from srbf.methods import responses
from srbf.report.point_lights import demonstration_point_lights
from srbf.sphere import farthest_points

SHOWN_LIGHTS = 6  # compared
EXPOSURE_QUANTILE, EXPOSURE_LEVEL = 0.995, 0.9  # the exposure maps this quantile of the references to this linear level


@dataclass(frozen=True)
class Picture:
    """One figure of the report and its caption; if `omitted`, there is no file and the caption gives the reason."""

    file: str
    title: str
    caption: str
    omitted: bool = False


@dataclass(frozen=True, eq=False)
class Subject:
    """Asset, capture and evaluation; `covered` (H, W) bool; the `shown` lights of `role`, their references, and `gain`."""

    asset: Asset
    capture: Capture
    evaluation: dict[str, Any]
    covered: ndarray
    role: Role
    shown: tuple[int, ...]
    references: Float32[ndarray, "S H W 3"]
    relit: Float32[ndarray, "S H W 3"]
    gain: float
    points: tuple[PointLight, ...]
    spots: tuple[SpotLight, ...]

    def direction(self, row: int) -> Float64[ndarray, " 3"]:
        """Unit direction of the row-th shown light."""
        return np.array(self.capture.lights[self.shown[row]].direction)

    def psnr_of(self, index: int) -> float:
        """PSNR (dB) of one light, with the evaluation's peak."""
        light = self.capture.lights[index]
        rmse = next(entry["rmse"] for entry in self.evaluation["lights"] if entry["file"] == light.file)
        return psnr(self.evaluation[light.role]["peak"], rmse)

    @property
    def role_words(self) -> str:
        """The compared directions as caption text."""
        return {
            "holdout": "held-out directions",
            "validation": "validation directions (this capture has no holdout lights)",
            "train": "train directions, which the fit used (this capture has neither holdout nor validation lights)",
        }[self.role]


def gather(asset: Asset, capture: Capture, evaluation: dict[str, Any], demo_lights: Sequence[Light] | None) -> Subject:
    """Choose lights far apart of the last role that has any (holdout, validation, train), read their references and relight them without
    ambient."""
    role: Role = next(r for r in ROLES[::-1] if capture.indices(r))
    indices = capture.indices(role)
    directions = domain_of_capture(capture).captured(capture, indices)
    chosen = [indices[i] for i in farthest_points(directions, SHOWN_LIGHTS)]
    chosen.sort(key=lambda i: -capture.lights[i].direction[2])
    covered = capture.coverage() >= COVERED
    references = np.stack([capture.image(i) for i in chosen])
    relit = np.maximum(responses(asset, domain_of_capture(capture).captured(capture, chosen)), 0)
    level = float(np.quantile(references[:, covered], EXPOSURE_QUANTILE)) if covered.any() else 0.0
    gain = EXPOSURE_LEVEL / level if level > 0 else 1.0
    points, spots = demonstration_point_lights(asset, covered, demo_lights)
    return Subject(asset, capture, evaluation, covered, role, tuple(chosen), references, relit, gain, points, spots)
