"""Light of distant lights that surfels reflect to receivers, all bounces of all directions at once, as a few shapes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.brdf_factors import BOUNCE_ORDER
from srbf.cubemap import Cubemap
from srbf.solve.radiosity import SERIES, Bounces, reciprocal
from srbf.solve.sparse_rows import product
from srbf.visibility.element_tracer import ElementTracer
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.form_factors import RayOrigins, form_factors
from srbf.visibility.gathered_harmonics import gathered_harmonics
from srbf.visibility.received import starts_of
from srbf.visibility.surfels import Surfels
from srbf.visibility.transfer_operator import POINTS, SURFEL_RAYS, leave_gaps_out, rays_of_each

LEFT_OUT = 0.01  # of the receivers' bounces under all directions, rms, that the shapes leave out
MOST_RANK = 256
JUDGING = 1024  # rays from each of the receivers that the shapes are made for
SPARSE = 0.1  # share of the surfels that exchange light, below which products leave out the others
BLOCK = 1 << 14  # receivers between two reports of progress


@dataclass(frozen=True)
class Effort:
    """Rays from each receiver and from each surfel, whether every direction of the cubemap is traced, or one of half its side, and for
    how many receivers at most the shapes are made."""

    receiver_rays: int
    surfel_rays: int
    every_direction: bool
    judges: int

    @staticmethod
    def full(receivers: int) -> Effort:
        """As a bake of surfels has them."""
        return Effort(rays_of_each(receivers), SURFEL_RAYS, True, 1024)

    @staticmethod
    def sparse() -> Effort:
        """A quarter of the directions, since bounces are smooth [Huang2010, section 4.2], and a few rays to each receiver."""
        return Effort(256, 512, False, 512)


@dataclass(frozen=True, eq=False)
class DistantBounces:
    """Irradiance that surfels reflect to R receivers under a light of unit irradiance from each of N directions: shapes times weights.

    E(p, l) = sum_j shapes[p, j] weights[j, l], by color. `rays`: traced to know it. `harmonics`, for gloss: the same of what arrives times
    each of K harmonics of where it comes from, see `gathered_harmonics`.
    """

    shapes: Float32[ndarray, "R r"]
    weights: Float32[ndarray, "r N 3"]
    rays: int
    harmonics: Float32[ndarray, "K R r"] | None = None

    @staticmethod
    def none(receivers: int, directions: int) -> DistantBounces:
        """Where nothing reflects."""
        return DistantBounces(np.zeros((receivers, 0), np.float32), np.zeros((0, directions, 3), np.float32), 0)


@dataclass(frozen=True, eq=False)
class Mixture:
    """The map (r, S, 3) from a white light's irradiance on surfels to its weights of the shapes: of lights between the cubemap's."""

    transfer: Float32[ndarray, "r S 3"]

    @staticmethod
    def none(surfels: int) -> Mixture:
        """Where nothing reflects."""
        return Mixture(np.zeros((0, surfels, 3), np.float32))


def light_on_surfels(surfels: Surfels, directions: Float64[ndarray, "n 3"], occluders: EmbreeTriangles) -> tuple[ndarray, int]:
    """(irradiance (S, n) float32 on the middles of the surfels of white lights of unit irradiance from n directions, rays traced)."""
    cells = surfels.cells
    normals = cells.normals.astype(np.float32)
    tracer = ElementTracer(starts_of(cells.places, cells.normals), normals, directions.astype(np.float32), occluders)
    seen = np.unpackbits(tracer.all_seen(), axis=1, count=len(directions))
    return np.maximum(normals @ tracer.directions.T, 0) * seen, tracer.rays


def traced(
    surfels: Surfels,
    origins: RayOrigins,
    cubemap: Cubemap,
    occluders: EmbreeTriangles,
    most_bounces: int | None,
    effort: Effort,
    seed: int = 0,
    progress: Callable[[int, int], None] = lambda done, total: None,
    gloss: bool = False,
) -> tuple[DistantBounces, Mixture]:
    """Bounces at the receivers whose rays start at `origins`; `most_bounces`: reflections at most, None: all of them; `gloss`: with
    `harmonics`, by the same rays.

    The shapes are the leading axes of what some receivers, the judges, get from all directions: T = G K e, G their form factors, K the
    bounces, e the direct light on the surfels. With V (N, r) the right singular vectors, shapes = G K e V and weights = V^T, so that no
    product has S N S terms.
    """
    from scipy.sparse import csr_array

    count = len(origins.weights)
    spread = RayOrigins.even(*surfels.spread(POINTS, seed))
    exchange = form_factors(surfels, spread, effort.surfel_rays // POINTS, seed + 1)
    leave_gaps_out(exchange, surfels)
    rays = surfels.count * POINTS * (effort.surfel_rays // POINTS)
    flux = reciprocal(exchange.toarray(), surfels.cells.areas)
    if most_bounces is not None and most_bounces < SERIES and np.count_nonzero(flux) < SPARSE * flux.size:
        flux = csr_array(flux)
    bounces = [Bounces(flux, surfels.cells.albedo[:, c].astype(np.float64), most_bounces) for c in range(3)]
    known = cubemap if effort.every_direction or cubemap.side < 4 else Cubemap(cubemap.side // 2)
    lit, more = light_on_surfels(surfels, known.directions, occluders)
    rays += more
    judges = np.random.default_rng(seed).permutation(count)[: effort.judges]
    of_each = origins.weights.shape[1]
    per_point = max(1, effort.receiver_rays // of_each)
    judged = form_factors(surfels, _at(origins, judges), JUDGING, seed + 2).toarray()
    rays += len(judges) * of_each * JUDGING
    gathered = [np.asarray(one.gathered(judged), np.float32) for one in bounces]  # (J, S) of each color
    pictures = [own @ lit for own in gathered]  # (J, N)
    right = _leading(pictures)
    if not right[0].shape[1]:
        return DistantBounces.none(count, cubemap.count), Mixture.none(surfels.count)
    mixture = np.sum([one.radiosity(np.asarray(lit @ v, np.float32)) for one, v in zip(bounces, right, strict=True)], axis=0)
    shapes = np.zeros((count, mixture.shape[1]), np.float32)
    waves = np.zeros(((BOUNCE_ORDER + 1) ** 2, count, mixture.shape[1]), np.float32) if gloss else None
    for start in range(0, count, BLOCK):
        rows = np.arange(start, min(start + BLOCK, count))
        if waves is None:
            shapes[rows] = product(form_factors(surfels, _at(origins, rows), per_point, seed + 3 + start), mixture)
        else:
            waves[:, rows] = gathered_harmonics(surfels, _at(origins, rows), per_point, mixture.astype(np.float32), seed + 3 + start)
            shapes[rows] = waves[0, rows] * np.float32(np.sqrt(4 * np.pi))
        progress(start + len(rows), count)
    rays += count * of_each * per_point
    weights = np.stack([v.T for v in right], axis=2)
    scale = np.float32(np.sqrt(known.count))  # weights of a mean square of 1 over directions and colors together, as half floats hold them
    if known is not cubemap:
        texels, shares = known.bilinear(cubemap.directions)
        weights = np.einsum("rnkc,nk->rnc", weights[:, texels], shares, optimize=True)
    # Least squares of the judges' bounces on their shapes: what any other light on the surfels makes of the shapes.
    of_judges = judged @ mixture
    inverse = np.linalg.pinv(of_judges.astype(np.float64), rcond=1e-4).astype(np.float32)
    transfer = np.stack([inverse @ own for own in gathered], axis=2)
    waves = None if waves is None else waves / scale
    return DistantBounces(shapes / scale, (scale * weights).astype(np.float32), rays, waves), Mixture((scale * transfer).astype(np.float32))


def _leading(pictures: list[Float32[ndarray, "J N"]]) -> list[Float32[ndarray, "N r"]]:
    """The right singular vectors, by color, that leave LEFT_OUT of the pictures out; none where all are black."""
    gram = np.sum([own @ own.T for own in pictures], axis=0).astype(np.float64)
    values, left = np.linalg.eigh(gram)
    values, left = np.maximum(values[::-1], 0), left[:, ::-1]
    if not values.sum() > 0:
        return [np.zeros((own.shape[1], 0), np.float32) for own in pictures]
    kept = np.cumsum(values) / values.sum()
    count = min(MOST_RANK, int(np.searchsorted(kept, 1 - LEFT_OUT**2)) + 1, int((values > 1e-10 * values[0]).sum()))
    scaled = (left[:, :count] / np.sqrt(values[:count])).astype(np.float32)
    return [own.T @ scaled for own in pictures]


def _at(origins: RayOrigins, rows: Int[ndarray, " n"]) -> RayOrigins:
    return RayOrigins(origins.points[rows], origins.normals[rows], origins.weights[rows])
