"""The light domain of names: the scene's own lights, each by itself (light mixing)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.light_domain.protocol import LightDomain
from srbf.lights import Falloff, Light, NamedLight

SHOWN = 8  # names in a message


@dataclass(frozen=True)
class Named(LightDomain):
    """Lights by name. Coordinates are the intensities of all N `names`, in order: 1 is as the scene has a light set."""

    kind: ClassVar[str] = "named"
    captured_kinds: ClassVar[tuple[str, ...]] = ("named",)
    falloff: ClassVar[Falloff] = "inverse-square"
    lights: tuple[tuple[str, tuple[str, ...]], ...]  # name, and the objects that shine

    @property
    def names(self) -> tuple[str, ...]:
        """Of the lights, in the order of their coordinates."""
        return tuple(name for name, _ in self.lights)

    @classmethod
    def of_capture(cls, capture: Capture, region: str = "auto") -> Named:
        """Of its train lights; InputError where two have one name."""
        train = [capture.lights[i] for i in capture.indices("train")]
        names = [str(light.name) for light in train]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise InputError(f"expected a name of its own for every light of {capture.folder}, found {_listed(twice)} twice")
        return cls(tuple((str(light.name), light.objects) for light in train))

    @classmethod
    def of_manifest(cls, manifest: dict[str, Any]) -> Named:
        return cls(tuple((entry["name"], tuple(entry.get("objects", ()))) for entry in manifest["lights"]))

    def manifest(self) -> dict[str, Any]:
        return {"light_domain": self.kind, "lights": [{"name": name, "objects": list(objects)} for name, objects in self.lights]}

    @staticmethod
    def captured(capture: Capture, lights: Sequence[int] | None = None) -> Float64[ndarray, "L N"]:
        """Each train light alone, at intensity 1."""
        train = capture.indices("train")
        chosen = range(len(capture.lights)) if lights is None else lights
        return np.eye(len(train))[[train.index(i) for i in chosen]]

    def light(self, coordinates: Float64[ndarray, " N"]) -> NamedLight:
        """The light of these intensities, which must be one."""
        (index,) = np.flatnonzero(coordinates)
        intensity = float(coordinates[index])
        return NamedLight(self.names[index], (intensity, intensity, intensity))

    @staticmethod
    def moved(coordinates: Float64[ndarray, "n N"], matrix: Float64[ndarray, "4 4"]) -> Float64[ndarray, "n N"]:
        """The same: the lights move with the scene."""
        return coordinates

    def outside(self, lights: Sequence[Light], positions: Float32[ndarray, "n 3"] | None, fit: dict[str, Any]) -> list[str]:
        """None: a light that is not one of the names is refused, see `colors`."""
        return []

    def probes(self, count: int | None = None) -> Float64[ndarray, "n N"]:
        """Random mixes, intensities uniform in 0 to 2; by default 100."""
        return np.random.default_rng(0).uniform(0, 2, (100 if count is None else count, len(self.lights)))

    def shared(self, lights: Sequence[Light]) -> list[tuple[Float64[ndarray, "n N"], Float64[ndarray, "n 3"]]]:
        """Each light of the frame with its color."""
        chosen = np.array([self.index(light) for light in lights], np.int64)
        colors = np.array([light.color for light in lights], np.float64).reshape(-1, 3)
        return [(np.eye(len(self.lights))[chosen], colors)]

    def index(self, light: Light) -> int:
        """Where a light is in the list. InputError for a light that is not of the scene, naming those there are."""
        if not isinstance(light, NamedLight):
            kind = type(light).__name__.removesuffix("Light").lower()
            raise InputError(
                f"expected lights by name for an asset of named lights, found a {kind} light; its lights are {_listed(self.names)}"
            )
        number = self._numbers.get(light.name)
        if number is None:
            raise InputError(f"expected a light of the asset, found {light.name!r}; its lights are {_listed(self.names)}")
        return number

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.names)}


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(repr(name) for name in names[:SHOWN])
    return shown + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
