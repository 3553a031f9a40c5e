"""What every light domain offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.errors import InputError
from srbf.lights import Falloff, Light, PointLight

if TYPE_CHECKING:
    from srbf.capture import Capture


class LightDomain(ABC):
    """A set of lights with coordinates (d numbers each): the set that responses are functions on.

    Coordinates and lights are in the asset's frame; `srbf.lights.moved` brings lights of the world there. What a domain has no meaning for
    (the centers of functions on a list of names) raises InputError.
    """

    kind: ClassVar[str]  # of `light_domain` in asset.json
    captured_kinds: ClassVar[tuple[str, ...]]  # of the train lights of a capture in this domain
    falloff: ClassVar[Falloff]  # of a point light that does not say
    is_inside: ClassVar[bool] = False  # whether lights have places in the scene
    is_traced: ClassVar[bool] = False  # whether rays measure any light: then none is extrapolated

    @classmethod
    @abstractmethod
    def of_capture(cls, capture: Capture, region: str = "auto") -> LightDomain:
        """The domain of a capture's train lights; `region` restricts it where a domain has parts."""

    @classmethod
    @abstractmethod
    def of_manifest(cls, manifest: dict[str, Any]) -> LightDomain:
        """The domain that an asset.json names."""

    @abstractmethod
    def manifest(self) -> dict[str, Any]:
        """Its keys of asset.json."""

    @staticmethod
    @abstractmethod
    def captured(capture: Capture, lights: Sequence[int] | None = None) -> Float64[ndarray, "L d"]:
        """Coordinates of a capture's lights."""

    @abstractmethod
    def light(self, coordinates: Float64[ndarray, " d"]) -> Light:
        """The white light at these coordinates, of the strength that captures have."""

    @staticmethod
    @abstractmethod
    def moved(coordinates: Float64[ndarray, "n d"], matrix: Float64[ndarray, "4 4"]) -> Float64[ndarray, "n d"]:
        """Coordinates carried by a 4 x 4 rigid motion and uniform scale."""

    @abstractmethod
    def outside(self, lights: Sequence[Light], positions: Float32[ndarray, "n 3"] | None, fit: dict[str, Any]) -> list[str]:
        """A line for each light that is outside the captured domain; `fit` is the manifest's `source.fit`."""

    @abstractmethod
    def probes(self, count: int | None = None) -> Float64[ndarray, "n d"]:
        """Coordinates spread evenly over the domain, by which an error over all of it is measured."""

    def shared(self, lights: Sequence[Light]) -> list[tuple[Float64[ndarray, "n d"], Float64[ndarray, "n 3"]]]:
        """(coordinates, colors) of the lights that all receivers see at the same coordinates, in pieces of bounded size."""
        raise self._lacks("coordinates that all receivers share")

    def toward(self, light: PointLight, positions: Float32[ndarray, "*p 3"]) -> tuple[Float64[ndarray, "*p d"], Float64[ndarray, "*p"]]:
        """(coordinates, strength) of a point or spot light as each receiver at `positions` (m) sees it."""
        raise self._lacks("a point light seen from each receiver")

    @staticmethod
    def extent(coordinates: Float64[ndarray, "L d"]) -> dict[str, Any]:
        """What `source.fit` says of where the train lights are, for `outside`."""
        return {}

    def spacing(self, coordinates: Float64[ndarray, "L d"]) -> float:
        """Mean distance between neighboring lights."""
        raise self._lacks("a spacing")

    def quadrature(self, coordinates: Float64[ndarray, "L d"]) -> Float64[ndarray, " L"]:
        """Weight of each light in an integral over the domain, 1 in the mean."""
        return np.ones(len(coordinates))

    def left_out_groups(self, coordinates: Float64[ndarray, "L d"]) -> list[Int[ndarray, "_ _"]]:
        """Groups of lights to leave out together in cross-validation, each led by the light that is then predicted."""
        raise self._lacks("neighbors of a light")

    def centers(self, count: int, point_set: str) -> Float64[ndarray, "k d"]:
        """Exactly `count` centers of basis functions, evenly spread."""
        raise self._lacks("centers of functions")

    def dense_centers(self, coordinates: Float64[ndarray, "L d"], least: int = 1) -> Float64[ndarray, "B d"]:
        """At least `least` centers of functions that may follow every light."""
        raise self._lacks("centers of functions")

    def nearest(self, coordinates: Float64[ndarray, "n d"], among: Float64[ndarray, "L d"]) -> Int[ndarray, " n"]:
        """Which of `among` is closest to each."""
        return np.linalg.norm(coordinates[:, None] - among[None], axis=2).argmin(axis=1)

    def paths(self, frames: int) -> Iterator[tuple[str, Float64[ndarray, "f d"]]]:
        """Named paths of a moving light, `frames` steps in all."""
        raise self._lacks("paths of a moving light")

    def _lacks(self, what: str) -> InputError:
        return InputError(f"expected lights with {what}, found those of the light domain {self.kind}, which has none; use another method")
