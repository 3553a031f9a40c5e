"""Specular lobes of receivers, and their factorization in classes of roughness, as captures and assets under a cubemap have them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.brdf_factors import ANGLES, BOUNCE_ORDER, BrdfFactors, factored, interpolated, of_bounces, turned, viewers_of_bounces
from srbf.compute.threads import each
from srbf.microfacets import albedo_terms, alpha_of, ends_of, parts_of

MOST_CLASSES = 16
DIGITS = 3  # of a roughness, and of a class's reflectance
LEAST = 1e-4  # specular reflectance that counts
USUAL = 0.04  # reflectance along the normal of a class that no receiver is in
GRAZING_SHARE = 1 / 21  # mean of Schlick's term over a hemisphere, by the cosine
BATCH = 1 << 17  # pairs of a receiver and a light at a time
AXIS_COS = -0.9999  # of a normal to +z, below which its frame is that of -z


@dataclass(frozen=True, eq=False)
class ReceiverGloss:
    """R receivers: unit normals, roughness, and reflectance along the normal and at grazing, the ends of a lobe's Fresnel term."""

    normals: Float64[ndarray, "R 3"]
    roughness: Float64[ndarray, " R"]
    along: Float64[ndarray, "R 3"]
    grazing: Float64[ndarray, "R 3"]

    @staticmethod
    def of(glossy: Float[ndarray, "R 3"], lobe: Float[ndarray, "R 3"], normals: Float[ndarray, "R 3"]) -> ReceiverGloss:
        """From channels of a capture: `glossy` as seen from above, `lobe` (roughness, share with a Fresnel term, 1 where there is any)."""
        color = np.where(lobe[:, 2:] > 0, np.asarray(glossy, np.float64), 0)
        roughness = np.clip(np.asarray(lobe[:, 0], np.float64), 0, 1)
        along, grazing = ends_of(color, lobe[:, 1], alpha_of(roughness))
        unit = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        return ReceiverGloss(np.asarray(unit, np.float64), roughness, along, grazing)

    @cached_property
    def alpha(self) -> Float64[ndarray, " R"]:
        return alpha_of(self.roughness)

    @cached_property
    def strength(self) -> Float64[ndarray, " R"]:
        """About the share of even light that a lobe reflects, the mean over colors."""
        return strength_of(self.along.mean(axis=1), self.grazing.mean(axis=1))

    @cached_property
    def _whole_from_above(self) -> Float64[ndarray, " R"]:
        return albedo_terms(np.ones(len(self.roughness)), self.alpha)[0]

    def from_above(self, rows: Int[ndarray, " n"], NoL: Float[ndarray, " n"]) -> Float64[ndarray, "n 3"]:
        """`reflected` toward a viewer straight above each of receivers `rows`, by the cosine of the light."""
        even, grazing = parts_of(NoL, np.ones(len(NoL)), NoL, self.alpha[rows], self._whole_from_above[rows])
        return even[:, None] * self.along[rows] + grazing[:, None] * self.grazing[rows]

    def reflected(self, rows: Int[ndarray, " n"], lights: Float[ndarray, "n 3"], viewers: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3"]:
        """BRDF times cosine of receivers `rows` at unit directions; viewers from below see what is seen from the horizon."""
        normals = self.normals[rows]
        NoL, NoV = (np.einsum("nc,nc->n", normals, other) for other in (lights, viewers))
        below = np.minimum(NoV, 0)[:, None] * normals
        flat = (viewers - below) / np.maximum(np.linalg.norm(viewers - below, axis=1, keepdims=True), 1e-12)
        even, grazing = parts_of(NoL, np.maximum(NoV, 0), np.einsum("nc,nc->n", lights, flat), self.alpha[rows])
        return even[:, None] * self.along[rows] + grazing[:, None] * self.grazing[rows]

    def of_bounces(self, viewers: Float[ndarray, "R 3"]) -> Float32[ndarray, "R K 3"]:
        """What of each harmonic of bounced light is reflected toward unit directions, roughness as of the nearest class."""
        classes = self.classes()
        local = np.einsum("nij,nj->ni", framed(self.normals), viewers)
        index, _ = _placed(self, classes)
        orders = np.concatenate([np.arange(-degree, degree + 1) for degree in range(BOUNCE_ORDER + 1)])
        found = np.zeros((len(viewers), len(orders), 3), np.float32)
        for k, (roughness, _, _) in enumerate(classes):
            own = np.flatnonzero((index == k) & (self.strength > LEAST))
            even, grazing = (turned(orders, local[own]) * interpolated(table, local[own, 2]) for table in viewers_of_bounces(roughness))
            ends = [end[own].astype(np.float32) for end in (self.along, self.grazing)]
            found[own] = even[:, :, None] * ends[0][:, None] + grazing[:, :, None] * ends[1][:, None]
        return found

    def classes(self) -> list[tuple[float, float, float]]:
        """(roughness, mean reflectance along the normal, at grazing) of at most MOST_CLASSES groups that all receivers are near to."""
        shown = self.strength > LEAST
        if not shown.any():
            return [(1.0, USUAL, 1.0)]
        rounded = np.round(self.roughness[shown], DIGITS)
        levels = np.unique(np.quantile(rounded, np.linspace(0, 1, MOST_CLASSES), method="nearest"))
        index = np.abs(rounded[:, None] - levels).argmin(axis=1)
        found: list[tuple[float, float, float]] = []
        for number, level in enumerate(levels.tolist()):
            own = np.flatnonzero(shown)[index == number]
            along, grazing = (max(round(float(end[own].mean()), DIGITS), 10.0**-DIGITS) for end in (self.along, self.grazing))
            found.append((float(level), along, grazing))
        return found


@dataclass(frozen=True, eq=False)
class FactoredGloss:
    """Terms of R receivers: `factors` of each class, `index` (R,) the class of every receiver.

    `relative` (R,): how strong its lobe is beside its class's; T_i = relative f_i V NoL, so that errors of all T_i count as those of
    radiance, and those of receivers without gloss do not.
    """

    gloss: ReceiverGloss
    factors: list[BrdfFactors]
    index: Int[ndarray, " R"]
    relative: Float64[ndarray, " R"]

    @staticmethod
    def of(gloss: ReceiverGloss, classes: list[tuple[float, float, float]], terms: int) -> FactoredGloss:
        """By `ReceiverGloss.classes`."""
        return FactoredGloss(gloss, [factored(*one, terms) for one in classes], *_placed(gloss, classes))

    @property
    def terms(self) -> int:
        return len(self.factors[0].orders)

    def of_lights(self, rows: Int[ndarray, " n"], lights: Float[ndarray, "n 3"]) -> Float32[ndarray, "n k"]:
        """T_i of pairs of a receiver and a unit direction that it sees."""
        found = np.empty((len(rows), self.terms), np.float32)
        starts = range(0, len(rows), BATCH)
        frames = framed(self.gloss.normals).astype(np.float32)

        def work(number: int) -> None:
            part = slice(starts[number], starts[number] + BATCH)
            own = rows[part]
            local = np.einsum("nij,nj->ni", frames[own], lights[part].astype(np.float32))
            for k in np.unique(self.index[own]):
                chosen = np.flatnonzero(self.index[own] == k)
                found[part.start + chosen] = self.factors[k].of_lights(local[chosen])
            found[part] *= self.relative[own, None].astype(np.float32)

        each(work, len(starts))
        return found

    def of_bounces(self) -> Float32[ndarray, "R n K"]:
        """What T_i have of each harmonic of bounced light."""
        found = np.stack([of_bounces(one) for one in self.factors])[self.index]
        return found * self.relative[:, None, None].astype(np.float32)

    def of_viewers(self, viewers: Float[ndarray, "R 3"]) -> Float32[ndarray, "R k 3"]:
        """g_i of the receivers toward unit directions, by color."""
        local = np.einsum("nij,nj->ni", framed(self.gloss.normals), viewers)
        found = np.zeros((len(viewers), self.terms, 3), np.float32)
        for k, factors in enumerate(self.factors):
            own = np.flatnonzero((self.index == k) & (self.relative > 0))
            even, grazing = factors.of_viewers(local[own])
            ends = [(end[own] / self.relative[own, None]).astype(np.float32) for end in (self.gloss.along, self.gloss.grazing)]
            found[own] = even[:, :, None] * ends[0][:, None] + grazing[:, :, None] * ends[1][:, None]
        return found

    def table(self) -> Float32[ndarray, "rows A"]:
        """`outgoing` of all classes, a row for each end of the Fresnel term and term of every class in turn."""
        return np.concatenate([one.outgoing.reshape(-1, len(ANGLES)) for one in self.factors]).astype(np.float32)


def viewer_side(
    gloss: ReceiverGloss, classes: list[tuple[float, float, float]], orders: list[list[int]], table: Float32[ndarray, "rows A"]
) -> FactoredGloss:
    """From what an asset keeps, see `FactoredGloss.table`: for viewers alone."""
    size = len(orders[0])
    outgoing = table.reshape(len(orders), 2, size, len(ANGLES)).astype(np.float64)
    nothing = np.zeros((size, len(ANGLES)))
    factors = [BrdfFactors(np.array(own, np.int64), nothing, part, 0.0) for own, part in zip(orders, outgoing, strict=True)]
    return FactoredGloss(gloss, factors, *_placed(gloss, classes))


def framed(normals: Float[ndarray, "n 3"]) -> Float64[ndarray, "n 3 3"]:
    """Rows x, y, z of frames whose z is the normal: the world's, turned the shortest way, so that they vary little on a surface."""
    x, y, z = np.moveaxis(np.asarray(normals, np.float64), -1, 0)
    down = z < AXIS_COS
    a = 1 / np.where(down, 1, 1 + z)
    b = -x * y * a
    first = np.where(down[..., None], [1.0, 0.0, 0.0], np.stack([1 - x * x * a, b, -x], axis=-1))
    second = np.where(down[..., None], [0.0, -1.0, 0.0], np.stack([b, 1 - y * y * a, -y], axis=-1))
    return np.stack([first, second, np.stack([x, y, z], axis=-1)], axis=-2)


def _placed(gloss: ReceiverGloss, classes: list[tuple[float, float, float]]) -> tuple[Int[ndarray, " R"], Float64[ndarray, " R"]]:
    """(the class of every receiver, by roughness; how strong its lobe is beside its class's)."""
    roughness, along, grazing = np.array(classes).T
    index = np.abs(gloss.roughness[:, None] - roughness).argmin(axis=1)
    return index, np.where(gloss.strength > LEAST, gloss.strength / strength_of(along, grazing)[index], 0.0)


def strength_of(along: Any, grazing: Any) -> Any:
    """About the share of even light that a lobe of these ends of its Fresnel term reflects."""
    return along + GRAZING_SHARE * grazing


def describe(factored_gloss: FactoredGloss, classes: list[tuple[float, float, float]]) -> dict[str, Any]:
    """JSON of an asset's manifest, beside `FactoredGloss.table`."""
    return {
        "terms": factored_gloss.terms,
        "classes": [
            {"roughness": roughness, "along": along, "grazing": grazing, "orders": own.orders.tolist(), "left_out": round(own.left_out, 6)}
            for (roughness, along, grazing), own in zip(classes, factored_gloss.factors, strict=True)
        ],
    }
