"""A capture under every direction of a cubemap: images of lights are made on request from bits of visibility and a few shapes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float, Float32, Int
from srbf.capture import Capture
from srbf.captured_light import ROLES, CapturedLight, Role
from srbf.compute.full_precision import channel_products
from srbf.cubemap import Cubemap
from srbf.cubemap_transport import CubemapTransport, TestedTransport, read_tested, read_transport
from srbf.errors import ManifestError
from srbf.light_images import OnImage
from srbf.receiver_gloss import ReceiverGloss
from srbf.receiver_images import Rows

BLOCK = 64  # images made at a time


def train_lights(told: dict[str, Any]) -> list[CapturedLight]:
    """The lights that the key `cubemap` of a manifest stands for: a directional one of each texel, in order."""
    directions = Cubemap(int(told["side"])).directions.tolist()
    return [CapturedLight((x, y, z), "train", f"{told['visibility']}#{i}", column=i) for i, (x, y, z) in enumerate(directions)]


class CubemapCapture(Capture):
    """A capture whose train lights have no image files; those that test it have.

    Where it knows its receivers' gloss, images show it as seen from straight above each of them.
    """

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
        if self.gloss_terms is not None and made.any():
            rows, real = self._rows_of_texels(texels)
            shown = np.zeros((len(texels), int(made.sum()), 3), np.float32)
            shown[real] = self._from_above(rows[real], columns[made])
            responses[:, made] += shown
        for place in np.flatnonzero(~made):
            responses[:, place] = self._stored(indices[place])[texels]
        return responses

    def has_direct_of(self, roles: Sequence[Role]) -> bool:
        return all(light.column is not None or light.direct is not None for light in self.lights if light.role in roles)

    def combined(self, roles: Sequence[Role] = ROLES) -> Capture:
        if self.transport == "combined":
            return self
        return replace(self, manifest={**self.manifest, "transport": "combined"})

    @cached_property
    def receiver_gloss(self) -> ReceiverGloss:
        """Of the receivers in order. ManifestError where a channel is missing."""
        found = [self.channel(name) for name in ("glossy", "lobe")]
        if any(image is None for image in found):
            raise ManifestError(f"expected the channels glossy and lobe in {self.folder}, found none; bake again with `gloss`")
        transport = self._transport
        glossy, lobe = (image.reshape(-1, 3)[transport.receivers] for image in found if image is not None)
        return ReceiverGloss.of(glossy, lobe, transport.normals)

    @property
    def receivers(self) -> Int[ndarray, " R"]:
        """Flat indices of the texels that hold receivers, in order."""
        return self._transport.receivers

    def toward(self, index: int, viewers: Float[ndarray, "H W 3"]) -> Float32[ndarray, "H W 3"]:
        """Radiance of a light toward unit directions at every texel, by the whole BRDF and visibility as it was traced.

        Of a train light visibility is that of the capture's sampling. Gloss reflects bounced light as far as harmonics tell where it comes
        from. 0 where there is no receiver.
        """
        lit, diffuse, waves = self.received(index)
        texels = self.receivers[lit]
        found = np.zeros((self.height * self.width, 3), np.float32)
        found[self.receivers] = diffuse
        if len(waves):
            seen = self.receiver_gloss.of_bounces(viewers.reshape(-1, 3)[self.receivers])
            found[self.receivers] += np.einsum("krc,rkc->rc", waves, seen)
        direction = np.broadcast_to(np.array(self.lights[index].direction), (len(lit), 3))
        found[texels] += self.receiver_gloss.reflected(lit, direction, viewers.reshape(-1, 3)[texels])
        return found.reshape(self.height, self.width, 3)

    def received(self, index: int) -> tuple[Int[ndarray, " n"], Float32[ndarray, "R 3"], Float32[ndarray, "K R 3"]]:
        """(receivers that a light shines on, radiance of what all of them reflect diffusely, harmonics of what bounces bring)."""
        transport, light = self._transport, self.lights[index]
        rows = np.arange(len(transport.receivers))
        if light.column is None:
            own = [entry["file"] for entry in self.manifest["lights"]].index(light.file)
            seen, weights = self._tested.seen(own), self._tested.weights[own]
        else:
            seen, weights = transport.seen(rows, np.array([light.column]))[:, 0], transport.weights[:, light.column]
        irradiance = transport.shapes @ weights
        cosine = transport.normals @ np.array(light.direction, np.float32)
        lit = np.flatnonzero(seen & (cosine > 0))
        irradiance[lit] += cosine[lit, None]
        factor = self._reflectance
        assert factor is not None
        waves = np.zeros((0, len(rows), 3), np.float32) if transport.harmonics is None else transport.harmonics @ weights
        return lit, irradiance * factor[transport.receivers], waves

    @cached_property
    def _tested(self) -> TestedTransport:
        lights = len(self.manifest["lights"])
        return read_tested(self.folder, self.manifest["cubemap"], lights, len(self._transport.receivers), len(self._transport.weights))

    def _rows_of_texels(self, texels: Int[ndarray, " n"]) -> tuple[Int[ndarray, " n"], Bool[ndarray, " n"]]:
        """(the receiver of each texel, whether it has one)."""
        receivers = self._transport.receivers
        place = np.minimum(np.searchsorted(receivers, texels), max(0, len(receivers) - 1))
        return place, receivers[place] == texels

    @cached_property
    def _bounces_from_above(self) -> Float32[ndarray, "R r 3"]:
        """Shapes of what gloss reflects of bounces straight up, by color."""
        transport = self._transport
        if transport.harmonics is None:
            return np.zeros((*transport.shapes.shape, 3), np.float32)
        seen = self.receiver_gloss.of_bounces(transport.normals)
        return np.einsum("krj,rkc->rjc", transport.harmonics, seen, optimize=True)

    def _from_above(self, rows: Int[ndarray, " n"], columns: Int[ndarray, " b"]) -> Float32[ndarray, "n b 3"]:
        """What gloss reflects of single directions straight up."""
        cosines = self._transport.cosines(rows, columns)
        shapes, weights = self._bounces_from_above[rows], self._transport.weights[:, columns]
        found = channel_products(shapes, weights)
        row, column = np.nonzero(cosines)
        found[row, column] += self.receiver_gloss.from_above(rows[row], cosines[row, column].astype(np.float64))
        return found

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
            if self.gloss_terms is not None:
                columns = np.array([self.lights[indices[place]].column for place in made])
                receivers = self._transport.receivers
                found[np.ix_(np.array(made), receivers)] += self._from_above(np.arange(len(receivers)), columns).transpose(1, 0, 2)
        for place, i in enumerate(indices):
            light = self.lights[i]
            if light.column is None:
                found[place] = self._read_rows(light.file, None)
                if self._with_direct and light.direct is not None:
                    found[place] += self._read_rows(light.direct, None)
        return found
