"""The reference images of a capture for the page: its lights, and an image per light."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Lock
from typing import Any

from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.io.image import float_exr
from srbf.light_domain import domain_of_asset, domain_of_capture

CACHED_IMAGES = 32
COMPARED = {
    "directions": "directional",
    "cloud": "point",
    "surfels": "point",
    "pool": "point",
}  # by light domain: lights that the page can place


@dataclass(eq=False)
class References:
    """Images as float EXRs, for captures of any format, encoded on request."""

    capture: Capture
    _made: dict[int, bytes] = field(default_factory=dict)
    _lock: Lock = field(default_factory=Lock)

    def check(self, asset: Asset) -> None:
        """InputError if the capture and the asset are not comparable."""
        captured, fitted = domain_of_capture(self.capture).kind, domain_of_asset(asset.manifest).kind
        if captured != fitted:
            raise InputError(f"expected a capture in the asset's light domain, {fitted}, found {captured}; leave it out")
        ours = (asset.width, asset.height, asset.quantity, asset.transport)
        theirs = (self.capture.width, self.capture.height, self.capture.quantity, self.capture.transport)
        if ours != theirs:
            raise InputError(
                f"expected the capture that the asset was fitted from ({_described(ours)}), found one of {_described(theirs)}; "
                "leave it out, or give the right one"
            )

    @property
    def compared(self) -> list[int]:
        """Indices of the lights that the page compares with: those that it can place, by direction or position."""
        return compared_lights(self.capture)

    def lights(self) -> dict[str, Any]:
        """lights.json: of each compared light its place, its role, and the number of its image."""
        key = "direction" if domain_of_capture(self.capture).kind == "directions" else "position"
        lights = self.capture.lights
        return {"lights": [{key: list(lights[i].place), "role": lights[i].role, "image": i} for i in self.compared]}

    def image(self, index: int) -> bytes:
        """The EXR of light `index`; IndexError if there is none."""
        if not 0 <= index < len(self.capture.lights):
            raise IndexError(index)
        with self._lock:
            if index not in self._made:
                self._made[index] = float_exr(self.capture.image(index))
                while len(self._made) > CACHED_IMAGES:
                    self._made.pop(next(iter(self._made)))
            return self._made[index]


def compared_lights(capture: Capture) -> list[int]:
    """Indices of the lights of a capture that are of a kind that the page can place."""
    kind = COMPARED.get(domain_of_capture(capture).kind)
    return [i for i, light in enumerate(capture.lights) if light.kind == kind]


def _described(facts: tuple[object, ...]) -> str:
    width, height, quantity, transport = facts
    return f"{width} x {height}, {quantity}, {transport}"
