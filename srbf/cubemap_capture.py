"""A capture under every direction of a cubemap: images of lights are made on request from bits of visibility and a few shapes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Int
from srbf.capture import Capture
from srbf.captured_light import ROLES, CapturedLight, Role
from srbf.cubemap import Cubemap
from srbf.cubemap_transport import CubemapTransport, read_transport
from srbf.light_images import OnImage
from srbf.receiver_images import Rows

BLOCK = 64  # images made at a time


def train_lights(told: dict[str, Any]) -> list[CapturedLight]:
    """The lights that the key `cubemap` of a manifest stands for: a directional one of each texel, in order."""
    directions = Cubemap(int(told["side"])).directions.tolist()
    return [CapturedLight((x, y, z), "train", f"{told['visibility']}#{i}", column=i) for i, (x, y, z) in enumerate(directions)]


class CubemapCapture(Capture):
    """A capture whose train lights have no image files; those that test it have."""

    def image(self, index: int) -> Float32[ndarray, "H W 3"]:
        return self._stored(index).astype(np.float32).reshape(self.height, self.width, 3)

    def partial_image(self, index: int) -> tuple[Float32[ndarray, "H W 3"], Bool[ndarray, "H W"]]:
        return self.image(index), np.ones((self.height, self.width), bool)

    def _stored_type(self, indices: Sequence[int]) -> np.dtype:
        return np.dtype(np.float32)

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        columns = np.array([-1 if self.lights[i].column is None else self.lights[i].column for i in indices], np.int64)
        responses = np.empty((len(texels), len(indices), 3), np.float32)
        made = columns >= 0
        responses[:, made] = self._transport.rows(texels, columns[made], self._with_direct)
        factor = self._reflectance
        if factor is not None:
            responses[:, made] *= factor[texels, None]
        for place in np.flatnonzero(~made):
            responses[:, place] = self._stored(indices[place])[texels]
        return responses

    def has_direct_of(self, roles: Sequence[Role]) -> bool:
        return all(light.column is not None or light.direct is not None for light in self.lights if light.role in roles)

    def combined(self, roles: Sequence[Role] = ROLES) -> Capture:
        if self.transport == "combined":
            return self
        return replace(self, manifest={**self.manifest, "transport": "combined"})

    @property
    def _with_direct(self) -> bool:
        return self.transport == "combined"

    @property
    def _transport(self) -> CubemapTransport:
        return read_transport(self.folder, self.manifest["cubemap"], self.width * self.height)

    @property
    def _reflectance(self) -> Float32[ndarray, "P 3"] | None:
        """From irradiance to the capture's quantity; None where it is irradiance."""
        if self.quantity == "irradiance":
            return None
        albedo = self.geometry("albedo")
        assert albedo is not None
        return albedo.reshape(-1, 3) / np.float32(np.pi)

    def _blocks(
        self, indices: Sequence[int], size: int, stored: np.dtype, buffers: int, on_image: OnImage | None = None, rows: Rows = None
    ) -> Iterator[tuple[int, np.ndarray]]:
        chosen = None if rows is None else np.concatenate([np.arange(a * self.width, b * self.width) for a, b in rows])
        for first in range(0, len(indices), min(size, BLOCK)):
            block = self._images(indices[first : first + min(size, BLOCK)])
            block = block if chosen is None else block[:, chosen]
            if on_image is not None:
                for row, image in enumerate(block):
                    on_image(first + row, image)
            yield first, block

    def _stored(self, index: int, rows: Rows = None) -> Float[ndarray, "n 3"]:
        image = self._images([index])[0]
        return image if rows is None else np.concatenate([image[a * self.width : b * self.width] for a, b in rows])

    def _images(self, indices: Sequence[int]) -> Float32[ndarray, "b P 3"]:
        found = np.empty((len(indices), self.width * self.height, 3), np.float32)
        made = [place for place, i in enumerate(indices) if self.lights[i].column is not None]
        if made:
            found[made] = self._transport.images(np.array([self.lights[indices[place]].column for place in made]), self._with_direct)
            factor = self._reflectance
            if factor is not None:
                found[made] *= factor
        for place, i in enumerate(indices):
            light = self.lights[i]
            if light.column is None:
                found[place] = self._read_rows(light.file, None)
                if self._with_direct and light.direct is not None:
                    found[place] += self._read_rows(light.direct, None)
        return found
