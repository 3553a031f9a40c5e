"""The light domain of places: lights inside the scene, by where they are [Kristensen2005]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.light_domain.protocol import LightDomain
from srbf.lights import AreaLight, Falloff, Light, PointLight, SpotLight

MARGIN = 0.1  # of a box's longest side, m: a light this far outside the places is reported


def isotropic(light: Light) -> PointLight:
    """A point or sphere light of inverse-square falloff, InputError for others: all that a cloud of captured point lights can be."""
    if not isinstance(light, PointLight) or isinstance(light, SpotLight) or light.falloff != "inverse-square" or light.profile is not None:
        raise InputError(
            "expected point lights of inverse-square falloff, without a profile, for a cloud of captured point lights or without embreex, "
            "found another; "
            "capture patches for any light, and install embreex"
        )
    return light


@dataclass(frozen=True)
class Cloud(LightDomain):
    """Places (m) of isotropic point lights of unit irradiance at 1 m. `places` (n, 3): random ones in the free space of the scene."""

    kind: ClassVar[str] = "cloud"
    captured_kinds: ClassVar[tuple[str, ...]] = ("point", "patch")
    falloff: ClassVar[Falloff] = "inverse-square"
    is_inside: ClassVar[bool] = True
    places: tuple[tuple[float, float, float], ...]

    @classmethod
    def of_capture(cls, capture: Capture, region: str = "auto") -> Cloud:
        """The free places of a capture, or where it has none its lights."""
        places = capture.manifest.get("free_places") or [light.place for light in capture.lights if light.kind == "point"]
        return cls(tuple((float(x), float(y), float(z)) for x, y, z in places))

    @classmethod
    def of_manifest(cls, manifest: dict[str, Any]) -> Cloud:
        return cls(tuple((float(x), float(y), float(z)) for x, y, z in manifest.get("free_places", ())))

    def manifest(self) -> dict[str, Any]:
        return {"light_domain": self.kind, "free_places": [list(place) for place in self.places]}

    @staticmethod
    def captured(capture: Capture, lights: Sequence[int] | None = None) -> Float64[ndarray, "L 3"]:
        """Positions of point lights."""
        return capture.positions(lights)

    def light(self, coordinates: Float64[ndarray, " 3"]) -> PointLight:
        x, y, z = coordinates.tolist()
        return PointLight((x, y, z), falloff="inverse-square")

    @staticmethod
    def moved(coordinates: Float64[ndarray, "n 3"], matrix: Float64[ndarray, "4 4"]) -> Float64[ndarray, "n 3"]:
        return coordinates @ matrix[:3, :3].T + matrix[:3, 3]

    def outside(self, lights: Sequence[Light], positions: Float32[ndarray, "n 3"] | None, fit: dict[str, Any]) -> list[str]:
        """Lights outside the box of the free places by more than a tenth of its longest side."""
        if not self.places:
            return []
        low, high = np.min(self.places, axis=0), np.max(self.places, axis=0)
        notes = []
        for i, light in enumerate(lights):
            if not isinstance(light, (PointLight, AreaLight)):
                continue
            beyond = np.maximum(low - light.position, light.position - high).max()
            if beyond > MARGIN * float((high - low).max()):
                notes.append(f"light {i} is {beyond:.2g} m outside the space that lights were captured in: its response is extrapolated")
        return notes

    def probes(self, count: int | None = None) -> Float64[ndarray, "n 3"]:
        """Free places; by default 100."""
        every = np.array(self.places, np.float64).reshape(-1, 3)
        wanted = min(len(every), 100 if count is None else count)
        return every[np.linspace(0, len(every) - 1, wanted).astype(np.int64)] if wanted else every

    def spacing(self, coordinates: Float64[ndarray, "L 3"]) -> float:
        """Mean distance to the nearest other light, m."""
        if len(coordinates) < 2:
            return 1.0
        from scipy.spatial import cKDTree

        return float(cKDTree(coordinates).query(coordinates, 2)[0][:, 1].mean())
