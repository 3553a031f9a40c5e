"""Points at which shadow maps are looked up, on the GPU: one of each texel, or many of each of a few pixels, whose mean these are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.lights import AreaLight, PointLight
from srbf.unshadowed import irradiance_from
from srbf.visibility.gl_resources import Resources, Target
from srbf.visibility.light_rays import MIN_IMPORTANCE
from srbf.visibility.lightmap_points import Points
from srbf.visibility.linked_triangles import lit_at
from srbf.visibility.rays import Samples
from srbf.visibility.texel_sums import TexelSums

if TYPE_CHECKING:
    import moderngl

ROW = 1024  # points of pixels in a row of a texture


@dataclass(frozen=True, eq=False)
class Lookups:
    """Points on the GPU, to whose target their light is added; `place` (from the maps' center, m), `normal` and `weight` of each."""

    textures: list[moderngl.Texture]
    target: Target
    place: ndarray
    normal: ndarray
    weight: ndarray

    @staticmethod
    def of(resources: Resources, points: Points | Samples, center: Float64[ndarray, " 3"], target: Target) -> Lookups:
        """Of points in the order of the texels of `target`, of which the last may be left over."""
        place = points.point - center
        height = np.einsum("nc,nc->n", points.lift, points.normal)
        images = (np.column_stack([place, points.weight]), np.column_stack([points.normal, height]), points.face)
        width, rows = target[0].size
        padding = ((0, rows * width - len(place)), (0, 0))
        textures = [resources.texture(np.pad(image.astype(np.float32), padding).reshape(rows, width, -1)) for image in images]
        return Lookups(textures, target, place, points.normal, points.weight)

    def read(self) -> Float32[ndarray, "n 4"]:
        """What was added: irradiance, and in the last column without shadows, of the points, in the order of the target's texels."""
        return np.frombuffer(self.target[1].read(components=4, dtype="f4"), np.float32).reshape(-1, 4)[: len(self.place)]


@dataclass(frozen=True, eq=False)
class PixelLookups:
    """Pixels (E,), flat indices in order, and their points in several parts."""

    pixels: Int[ndarray, " E"]
    samples: Sequence[Samples]
    parts: Sequence[Lookups]

    @staticmethod
    def of(resources: Resources, pixels: Int[ndarray, " E"], samples: Sequence[Samples], center: Float64[ndarray, " 3"]) -> PixelLookups:
        """With targets of their own."""
        parts = []
        for part in samples:
            target = resources.target((ROW, max(1, -(-len(part.texel) // ROW))), 4, "f4")
            target[1].clear()
            parts.append(Lookups.of(resources, part, center, target))
        return PixelLookups(pixels, samples, parts)

    def mean(self, sized: PointLight | AreaLight | None = None, lit: Bool[ndarray, " T"] | None = None) -> Float32[ndarray, "E 3"]:
        """The irradiance of the pixels by what was added, in which each point counts by its share.

        `sized`: the light, where it has a size; its exact irradiance counts, times the part of it that is visible. `lit`: on which
        triangles the light shines, None: on all.
        """
        sums, pixels = TexelSums.empty(1, len(self.pixels), np.ones(len(self.pixels)), sized is not None), np.arange(len(self.pixels))
        for part, samples in zip(self.parts, self.samples, strict=True):
            found = part.read()
            shown = lit_at(lit, samples.triangle)[:, None].astype(np.float32)
            if sized is None:
                ones = np.ones(len(found))
                sums.add(pixels, samples.share, ones, found[:, :3] * shown, ones)
                continue
            exact, whole = irradiance_from(sized, part.place, part.normal), found[:, 3].astype(np.float64)
            importance = np.where(exact > 0, np.maximum(whole / np.where(exact > 0, exact, 1), MIN_IMPORTANCE), 1)
            visible = visible_part(found) * shown
            if isinstance(sized, PointLight):
                visible = visible * sized.factors(part.place - np.array(sized.position)).astype(np.float32)
            sums.add(pixels, samples.share, importance, visible, exact)
        return sums.mean().astype(np.float32)


def visible_part(found: Float32[ndarray, "*n 4"]) -> Float32[ndarray, "*n 3"]:
    """Irradiance over that without shadows; 1 where there is none."""
    whole = found[..., 3:]
    return np.where(whole > 0, found[..., :3] / np.where(whole > 0, whole, 1), np.float32(1))
