"""The subject of a report: the compared lights, their references, one exposure and the demonstration lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.captured_light import ROLES, Role
from srbf.evaluation.errors_by_role import psnr
from srbf.light_domain import LightDomain, domain_of_capture
from srbf.lights import Light, PointLight, SpotLight
from srbf.methods import captured_responses
from srbf.report.point_lights import demonstration_point_lights
from srbf.sphere import farthest_points

SHOWN_LIGHTS = 6  # compared
EXPOSURE_QUANTILE, EXPOSURE_LEVEL = 0.995, 0.9  # the exposure maps this quantile of the references to this linear level
NOUNS = {
    "directions": "directions",
    "cloud": "point lights",
    "surfels": "point lights",
    "pool": "point lights",
    "named": "lights",
}  # by light domain


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
    domain: LightDomain
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
        return psnr(self.evaluation[light.role]["peak"], self._entries[light.file]["rmse"])

    def relative_of(self, index: int) -> float:
        """Root mean square error of one light over the rms of its reference."""
        return float(self._entries[self.capture.lights[index].file].get("relative_rmse", 0.0))

    @property
    def by_relative(self) -> bool:
        """Whether lights are compared by relative error: inside a scene, their brightness depends on where they are."""
        return self.domain.is_inside

    def worst_first(self, indices: Sequence[int]) -> list[int]:
        """Lights in order of their errors, the largest first."""
        return sorted(indices, key=lambda i: -self.relative_of(i) if self.by_relative else self.psnr_of(i))

    def error_words(self, index: int) -> str:
        """The error of one light as text."""
        return f"{100 * self.relative_of(index):.1f} %" if self.by_relative else f"{self.psnr_of(index):.1f} dB"

    def light_words(self, index: int) -> tuple[str, ...]:
        """What one light is, as lines of text."""
        light = self.capture.lights[index]
        if light.kind == "directional":
            x, y, z = light.direction
            return (f"elevation {np.degrees(np.arcsin(z)):.0f}°", f"azimuth {np.degrees(np.arctan2(y, x)):.0f}°")
        if light.kind == "point":
            lines = [f"{axis} {round(value, 2) + 0.0:.2f}" for axis, value in zip("xyz", light.position, strict=True)]
            return (*lines[:2], lines[2] + " m")
        return (str(light.name),) if light.kind == "named" else (f"patch {light.patch}",)

    @cached_property
    def _entries(self) -> dict[str, dict[str, Any]]:
        return {entry["file"]: entry for entry in self.evaluation["lights"]}

    @property
    def role_words(self) -> str:
        """The compared lights as caption text."""
        noun = NOUNS[self.domain.kind]
        if self.role == "train" and self.domain.kind != "directions":
            return "lights, which the fit used" if self.domain.kind == "named" else "train lights, which the fit used"
        return {
            "holdout": f"held-out {noun}",
            "validation": f"validation {noun} (this capture has no holdout lights)",
            "train": f"train {noun}, which the fit used (this capture has neither holdout nor validation lights)",
        }[self.role]


def far_apart(capture: Capture, indices: Sequence[int], count: int) -> list[int]:
    """At most `count` of the lights, far from each other; evenly spaced in the list where they have no places."""
    if all(capture.lights[i].kind in ("directional", "point") for i in indices):
        return [indices[i] for i in farthest_points(domain_of_capture(capture).captured(capture, indices), count)]
    rows = np.unique(np.linspace(0, len(indices) - 1, min(count, len(indices))).astype(np.int64))
    return [indices[i] for i in rows]


def gather(asset: Asset, capture: Capture, evaluation: dict[str, Any], demo_lights: Sequence[Light] | None) -> Subject:
    """Choose lights far apart of the last role that has any (holdout, validation, train), read their references and relight them without
    ambient."""
    role: Role = next(r for r in ROLES[::-1] if capture.indices(r))
    domain = domain_of_capture(capture)
    chosen = far_apart(capture, capture.indices(role), SHOWN_LIGHTS)
    is_distant = domain.kind == "directions"
    if is_distant:
        chosen.sort(key=lambda i: -capture.lights[i].direction[2])
    covered = capture.coverage() >= COVERED
    references = np.stack([capture.image(i) for i in chosen])
    relit = np.maximum(captured_responses(asset, capture, chosen), 0)
    level = float(np.quantile(references[:, covered], EXPOSURE_QUANTILE)) if covered.any() else 0.0
    gain = EXPOSURE_LEVEL / level if level > 0 else 1.0
    points, spots = demonstration_point_lights(asset, covered, demo_lights) if is_distant else ((), ())
    return Subject(asset, capture, domain, evaluation, covered, role, tuple(chosen), references, relit, gain, points, spots)
