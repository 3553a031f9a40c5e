"""Transport of glossy receivers under a cubemap in view-independent terms, T_0 diffuse and T_i of an in-out factorization, as a capture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.capture import Capture
from srbf.captured_light import CapturedLight
from srbf.cubemap_capture import CubemapCapture
from srbf.errors import InputError
from srbf.receiver_gloss import FactoredGloss

COLORS = 3


@dataclass(frozen=True, eq=False)
class GlossyTerms(CubemapCapture):
    """A capture whose train lights are those of another, light by light `groups` of each, and whose colors are terms.

    The first image of a light is the radiance of diffuse reflection, the next are T_1 T_2 T_3, T_4 T_5 T_6, ...; terms past the last are 0.
    B(p, v) = T_0(p, l) + sum_i g_i(p, v) T_i(p, l) is the radiance toward v [Huang2010, eq. 3]. No ray is traced for any term: the
    capture has visibility, harmonics of bounced light, of which terms take the mean over colors, and f_i is known.
    """

    factors: FactoredGloss

    @staticmethod
    def of(capture: Capture, factors: FactoredGloss) -> GlossyTerms:
        """`factors`: of the capture's receivers. InputError for a capture without gloss."""
        if not isinstance(capture, CubemapCapture) or capture.gloss_terms is None:
            raise InputError(f"expected the gloss of receivers under a cubemap in {capture.folder}, found none; bake with `gloss=4`")
        groups = groups_of(factors.terms)
        lights = [
            replace(light, column=light.column * groups + group, file=f"{light.file}-{group}")
            for light in capture.lights
            if light.column is not None
            for group in range(groups)
        ]
        manifest = {**capture.manifest, "lights": []}
        return GlossyTerms(capture.folder, manifest, tuple(lights), factors=factors)

    @property
    def gloss_terms(self) -> None:
        """Its images are terms, to which no gloss as seen from above is to be added."""
        return None

    @property
    def groups(self) -> int:
        """Images of a light."""
        return groups_of(self.factors.terms)

    @cached_property
    def _bounces(self) -> Float32[ndarray, "R n r"]:
        """Shapes of what T_i have of bounces."""
        transport = self._transport
        if transport.harmonics is None:
            return np.zeros((len(transport.receivers), self.factors.terms, transport.shapes.shape[1]), np.float32)
        return np.einsum("krj,rnk->rnj", transport.harmonics, self.factors.of_bounces(), optimize=True)

    @property
    def angles(self) -> Float64[ndarray, " L"]:
        """Solid angles of its lights, 1 in the mean."""
        own = self._transport.cubemap.solid_angles[[light.column // self.groups for light in self.lights if light.column is not None]]
        return own / own.mean()

    def coarse(self) -> GlossyTerms:
        """Every other row and column of the cubemap alone: a quarter of its directions."""
        kept = self._transport.cubemap.coarse
        chosen: list[CapturedLight] = [light for light in self.lights if light.column is not None and kept[light.column // self.groups]]
        return replace(self, lights=tuple(chosen))

    def sample(self, indices: Sequence[int], texels: Int[ndarray, " n"]) -> Float32[ndarray, "n L 3"]:
        rows, real = self._rows_of_texels(texels)
        found = np.zeros((len(texels), len(indices), COLORS), np.float32)
        found[real] = self._of_rows(rows[real], self._columns(indices))
        return found

    def _images(self, indices: Sequence[int]) -> Float32[ndarray, "b P 3"]:
        receivers = self._transport.receivers
        found = np.zeros((len(indices), self.width * self.height, COLORS), np.float32)
        found[:, receivers] = self._of_rows(np.arange(len(receivers)), self._columns(indices)).transpose(1, 0, 2)
        return found

    def _columns(self, indices: Sequence[int]) -> Int[ndarray, " b"]:
        return np.array([self.lights[i].column for i in indices], np.int64)

    def _of_rows(self, rows: Int[ndarray, " n"], columns: Int[ndarray, " b"]) -> Float32[ndarray, "n b 3"]:
        """Of receivers by number."""
        found = np.zeros((len(rows), len(columns), COLORS), np.float32)
        light, group = np.divmod(columns, self.groups)
        diffuse = np.flatnonzero(group == 0)
        if len(diffuse):
            factor = self._reflectance
            assert factor is not None
            texels = self._transport.receivers[rows]
            found[:, diffuse] = self._transport.rows(texels, light[diffuse]) * factor[texels, None]
        lights, back = np.unique(light[group > 0], return_inverse=True)
        if len(lights):
            seen = self._transport.cosines(rows, lights) > 0
            seen &= self.factors.relative[rows, None] > 0
            row, column = np.nonzero(seen)
            terms = np.zeros((len(rows), len(lights), COLORS * (self.groups - 1)), np.float32)
            directions = self._transport.cubemap.directions
            terms[row, column, : self.factors.terms] = self.factors.of_lights(rows[row], directions[lights[column]])
            bounced = self._bounces[rows]
            terms[:, :, : self.factors.terms] += (bounced @ self._transport.weights[:, lights].mean(axis=2)).transpose(0, 2, 1)
            own = terms.reshape(len(rows), len(lights), self.groups - 1, COLORS)
            found[:, np.flatnonzero(group > 0)] = own[:, back, group[group > 0] - 1]
        return found


def groups_of(terms: int) -> int:
    """How many images of three colors diffuse reflection and `terms` take."""
    return 1 + -(-terms // COLORS)
