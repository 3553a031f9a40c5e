"""What lights inside a scene can show on its receivers, as a few shapes, and how direct light on surfels becomes their weights.

Indirect light is linear in the direct light on the surfaces, whatever gives it: E(p) = sum_f F_pf B_f, B = (1 - rho F)^-1 rho e. The
pictures of many lights span few dimensions; their leading axes on the receivers are the shapes, and a light's weights on them are one
matrix product with its direct irradiance e on the surfels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64, Int
from srbf.errors import InputError
from srbf.lights import PointLight, SpotLight
from srbf.solve.radiosity import Bounces, reciprocal, series_by_channel
from srbf.solve.row_sample import bright_rows
from srbf.solve.sparse_rows import product, transposed_product
from srbf.visibility.received import ReceivedLight
from srbf.visibility.transfer_operator import TransferOperator

if TYPE_CHECKING:
    from scipy.sparse import csr_array

PLACED, NEAR, SPOTS = 700, 250, 250  # lights that the shapes are made for, at least
SURFELS_PER_PLACE, MOST_PLACED = 2, 4000  # many surfels need more: shapes of few lights hold none among furniture
IN_EVERY_COLOR = 1800  # lights: of more, each is in red, green or blue, in turn
NEAR_RANGE = (0.03, 0.12)  # m from a surface
CONE = (0.25, 0.7)  # rad, half-angles
OVERSAMPLED = 0.5  # more mixtures than shapes, of these: faint rooms are in the last axes, which few mixtures find badly
POWER_STEPS = 1
RANK_ERROR = 0.015  # of the training lights' pictures, rms, that `auto` leaves out
MOST_RANK = 640
SUMS = 256  # random ones, by which norms are known to 4 %
SAMPLE_TEXELS = 1 << 14  # about, whose pictures the shapes are made for
JUDGES = 32  # random mixtures of lights by which the rank is chosen


@dataclass(frozen=True, eq=False)
class TransferBasis:
    """Shapes (P, r) of irradiance on receivers, whose rms is their share of the training lights' light, and maps to their weights.

    weights = `transfer` (r, S, 3) times irradiance on the surfels, all bounces included. Of changed albedo and emission: `gather` (r, S)
    takes radiosity of the surfels, `sent` (S, r) is what the shapes lay on them, `feedback` (r, r, 3) is gather rho sent.
    """

    shapes: Float32[ndarray, "P r"]
    transfer: Float32[ndarray, "r S 3"]
    gather: Float32[ndarray, "r S"]
    sent: Float32[ndarray, "S r"]
    feedback: Float64[ndarray, "r r 3"]

    @property
    def sizes(self) -> Float32[ndarray, " r"]:
        """The rms of each shape."""
        return np.sqrt(np.mean(self.shapes**2, axis=0))

    def at(self, chosen: ndarray) -> TransferBasis:
        """With the surfels of a mask or of indices."""
        return replace(self, transfer=self.transfer[:, chosen], gather=self.gather[:, chosen], sent=self.sent[chosen])

    def series(self, most_bounces: int | None) -> Float32[ndarray, "r r 3"]:
        """The sum over k of feedback^k: from weights of light that was reflected once to those of all, at most so often reflected."""
        return series_by_channel(self.feedback, most_bounces).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Emitted:
    """Radiosity of the surfels under each of M objects that emit by themselves, and how many lights each counts as."""

    radiosity: Float32[ndarray, "S M 3"]
    counts: Float64[ndarray, " M"]


def training_light(operator: TransferOperator, received: ReceivedLight, free: Float64[ndarray, "F 3"], seed: int = 0) -> ndarray:
    """(S, V) float32: irradiance on the surfels of points and spots in free space, points close to surfaces, and parts of environments.

    `received`: on cells of which the patches are the surfels. `free`: places, of which the first `placed_of` are taken.
    """
    rng = np.random.default_rng(seed)
    cells = operator.cells
    placed = free[: placed_of(len(cells.places))]
    chosen = rng.choice(len(cells.places), NEAR, p=cells.areas / cells.areas.sum())
    near = cells.places[chosen] + rng.uniform(*NEAR_RANGE, size=(NEAR, 1)) * cells.normals[chosen]
    lights: list[PointLight] = []
    for x, y, z in np.concatenate([placed, near]).tolist():
        lights.append(PointLight((x, y, z), falloff="inverse-square"))
    for x, y, z in free[rng.integers(len(free), size=SPOTS)].tolist():
        direction = rng.normal(size=3)
        dx, dy, dz = (direction / np.linalg.norm(direction)).tolist()
        outer = float(rng.uniform(*CONE))
        lights.append(SpotLight((x, y, z), falloff="inverse-square", direction=(dx, dy, dz), inner=0.9 * outer, outer=outer))
    inside = received.white_on_patches(lights)
    return inside if operator.environment is None else np.concatenate([inside, operator.environment.parts()], axis=1)


def placed_of(surfels: int) -> int:
    """At how many free places there are point lights that the shapes are made for."""
    return min(MOST_PLACED, max(PLACED, surfels // SURFELS_PER_PLACE))


Exchange = tuple[Float32[ndarray, "S S"], list[Bounces]]


def exchange_of(operator: TransferOperator, most_bounces: int | None = None) -> Exchange:
    """(reciprocal form factors between the surfels, bounces of each color); `most_bounces`: reflections at most, None: all of them."""
    exchange = reciprocal(operator.exchange.toarray(), operator.cells.areas)
    return exchange, [Bounces(exchange, operator.cells.albedo[:, c].astype(np.float64), most_bounces) for c in range(3)]


def transfer_basis(
    operator: TransferOperator,
    irradiance: Float32[ndarray, "S V"],
    exchanged: Exchange,
    rank: int | None = None,
    seed: int = 0,
    most_rank: int = MOST_RANK,
    emitted: Emitted | None = None,
    left_out: float = RANK_ERROR,
) -> TransferBasis:
    """At most `rank` shapes of the pictures of V lights, each picture of unit norm.

    rank None: as many as leave out `left_out`, or `most_rank`.
    `exchanged`: of `exchange_of`. `emitted`: what objects emit, each of which counts as so many lights. The pictures are never formed:
    their axes come from random mixtures of them [Halko2011], at some of the receivers. InputError where no light bounces onto a receiver.
    """
    rng = np.random.default_rng(seed)
    cells = operator.cells
    exchange, bounces = exchanged
    lit = np.flatnonzero(np.diff(operator.receivers.indptr))
    form_factors = operator.receivers[lit]
    sums = transposed_product(form_factors, random_signs(rng, len(lit), SUMS)).T  # (n, S)
    in_turn = irradiance.shape[1] > IN_EVERY_COLOR
    radiosity = []
    for channel, one in enumerate(bounces):
        own = _of_unit_norm(one.radiosity(irradiance[:, channel::3] if in_turn else irradiance), sums)
        if emitted is not None:
            first = np.ascontiguousarray(emitted.radiosity[:, :, channel])
            shining = _of_unit_norm(first + one.radiosity(np.asarray(exchange @ first, np.float32)), sums)
            counts = emitted.counts / (len(bounces) if in_turn else 1)  # as a light is in one color then
            own = np.concatenate([own, np.sqrt(counts).astype(np.float32) * shining], axis=1)
        radiosity.append(own)
    lights = np.concatenate(radiosity, axis=1)  # (S, 3 V)
    if not (sums @ lights[:, :: max(1, lights.shape[1] // JUDGES)]).any():
        raise InputError(
            "expected light that bounces onto the receivers, found none: no light reaches a surface that they see, or the scene has no "
            "diffuse bounces; choose other receivers or `light_bounds`, or raise the bounces"
        )
    sampled = len(lit) > SAMPLE_TEXELS
    if sampled:
        brightness = product(form_factors, lights @ random_signs(rng, lights.shape[1], SUMS))
        form_factors = _sample(form_factors, (brightness**2).sum(axis=1), rng)
    most = min(most_rank, most_rank if rank is None else rank, *lights.shape, max(1, form_factors.shape[0]))
    sketched = min(most + max(16, int(OVERSAMPLED * most)), form_factors.shape[0])
    mixed = lights @ rng.normal(size=(lights.shape[1], sketched)).astype(np.float32)
    found = np.linalg.qr(product(form_factors, mixed))[0]
    for _ in range(POWER_STEPS):
        found = np.linalg.qr(product(form_factors, lights @ (lights.T @ transposed_product(form_factors, found))))[0]
    projected = (transposed_product(form_factors, found).T @ lights).astype(np.float64)
    squares, left = np.linalg.eigh(projected @ projected.T)  # in ascending order
    values, axes = np.sqrt(np.maximum(squares[::-1], 0)).astype(np.float32), found @ left[:, ::-1].astype(np.float32)
    mixtures = form_factors @ (lights @ rng.normal(size=(lights.shape[1], JUDGES)))
    count = most if rank is not None else _enough(axes[:, :most], mixtures, left_out)
    values = np.maximum(values[:count], 1e-7 * max(float(values[0]), 1e-30))
    axes = axes[:, :count]
    share = np.float32(len(axes) / lights.shape[1])
    scale = values * np.sqrt(share)
    gather = transposed_product(form_factors, axes).T / scale[:, None]  # (r, S)
    transfer = np.stack([one.gathered(gather) for one in bounces], axis=2)
    mixture = share * (lights @ (lights.T @ gather.T))  # radiosity that makes each shape: shapes = F_p mixture
    sent = exchange @ mixture
    feedback = np.stack([gather.astype(np.float64) @ (cells.albedo[:, c, None] * sent) for c in range(3)], axis=2)
    shapes = np.zeros((operator.receivers.shape[0], count), np.float32)
    shapes[lit] = product(operator.receivers[lit], mixture.astype(np.float32)) if sampled else axes * scale
    return TransferBasis(shapes, transfer.astype(np.float32), gather.astype(np.float32), sent.astype(np.float32), feedback)


def _sample(rows: csr_array, brightness: Float32[ndarray, " P"], rng: np.random.Generator) -> csr_array:
    """About SAMPLE_TEXELS of the rows, by their `brightness`, scaled so that sums of squares are those of all rows."""
    chosen, probability = bright_rows(brightness, SAMPLE_TEXELS, rng)
    found = rows[chosen]
    scale = np.sqrt(SAMPLE_TEXELS / len(brightness) / probability).astype(np.float32)
    found.data *= np.repeat(scale, np.diff(found.indptr))
    return found


def _of_unit_norm(radiosity: Float32[ndarray, "S n"], sums: Float32[ndarray, "k S"]) -> Float32[ndarray, "S n"]:
    """Lights whose pictures have unit norm, by random sums of receivers; those that next to nothing arrives of stay dark."""
    norm = np.sqrt(((sums @ radiosity) ** 2).sum(axis=0))
    return radiosity / np.maximum(norm, 1e-6 * max(float(norm.max(initial=0)), 1e-30)).astype(np.float32)


def _enough(axes: Float32[ndarray, "P r"], pictures: ndarray, left_out: float) -> int:
    """How many of the axes leave no more than that share of the pictures, by norm."""
    energy = float((pictures.astype(np.float64) ** 2).sum())
    kept = np.cumsum(((axes.T @ pictures).astype(np.float64) ** 2).sum(axis=1))
    return min(len(kept), int(np.searchsorted(kept, (1 - left_out**2) * energy)) + 1)


def random_signs(rng: np.random.Generator, count: int, sums: int) -> Float32[ndarray, "n k"]:
    """Of random sums, whose mean square is the sum of squares."""
    return rng.choice(np.array([-1, 1], np.float32), (count, sums)) / np.float32(np.sqrt(sums))


def grouped(values: Float32[ndarray, "r S"], groups: Int[ndarray, " S"], count: int) -> Float32[ndarray, "r G"]:
    """Sums over the surfels of each group: light that is even over a group."""
    found = np.zeros((len(values), count), np.float32)
    for row, own in zip(found, values, strict=True):
        row += np.bincount(groups, own, count).astype(np.float32)
    return found
