"""In-out factorization of a glossy BRDF: sums of products of a function of the light's direction and one of the viewer's."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.basis.exitant_harmonics import harmonics
from srbf.errors import InputError
from srbf.microfacets import albedo_terms, alpha_of, parts_of

MOST_TERMS = 64
STEPS, TURNS = 72, 128  # between the normal and the horizon; over half a turn
ORDERS = 40  # of turns about the normal
BOUNCE_ORDER = 3  # of the harmonics that bounced light is known by
LEAST_ROUGHNESS = 0.2  # sharper lobes are factored as one of this: their peaks are narrower than the steps


@dataclass(frozen=True, eq=False)
class BrdfFactors:
    """BRDF times cosine of isotropic lobes of one roughness as n terms: rho(l, v) NoL ~ sum_i f_i(l) g_i(v)     [Liu2004; Wang2004]

    f_i(l) = incoming[i](theta) h_i(phi) and g_i(v) = sum over both ends e of the Fresnel term c_e outgoing[e, i](theta) h_i(phi), in any
    frame whose z is the normal, h_i(phi) = cos(m phi), m = `orders`[i] >= 0, or sin(-m phi). Terms come with their other half, so that no
    picture depends on the frame's turn about the normal. Tables have a column per angle of `ANGLES`. g_i of the material they were made
    for have a mean square of 1/3 over viewers by their cosine, so that errors of all T_i are those of radiance, summed over colors.
    `left_out`: share of the mean square of rho NoL that the terms lack.
    """

    orders: Int[ndarray, " n"]
    incoming: Float64[ndarray, "n A"]
    outgoing: Float64[ndarray, "2 n A"]
    left_out: float

    def of_lights(self, local: Float[ndarray, "d 3"]) -> Float32[ndarray, "d n"]:
        """f_i of unit directions in the frame of the surface; 0 from below."""
        found = turned(self.orders, local) * interpolated(self.incoming, local[:, 2])
        found[local[:, 2] <= 0] = 0
        return found

    def of_viewers(self, local: Float[ndarray, "d 3"]) -> Float32[ndarray, "2 d n"]:
        """g_i of unit directions in the frame of the surface for either end of the Fresnel term; from below as from the horizon."""
        return turned(self.orders, local) * np.stack([interpolated(table, local[:, 2]) for table in self.outgoing])


ANGLES: Float64[ndarray, " A"] = np.concatenate([[0.0], (np.arange(STEPS) + 0.5) * (np.pi / 2 / STEPS), [np.pi / 2]])


def check_terms(terms: int) -> None:
    """InputError on a number of terms that no factorization has."""
    if not 1 <= terms <= MOST_TERMS:
        raise InputError(f"expected 1 to {MOST_TERMS} terms of gloss, found {terms}")


@lru_cache(maxsize=64)
def factored(roughness: float, along: float, grazing: float, terms: int) -> BrdfFactors:
    """The leading terms of lobes of reflectance `along` the normal and `grazing`, least squares over lights and viewers.

    Lights count by solid angle, viewers by that times their cosine, as in pictures. The BRDF is the sum over m of K_m(theta_v, theta_l)
    cos m (phi_v - phi_l); each K_m has singular vectors, and every one is a term for m = 0 and two for others. Terms are taken by what each
    adds; where one with two does not fit, the next of m = 0 is.
    """
    check_terms(terms)
    middles = ANGLES[1:-1]
    lights, viewers = np.sin(middles), np.sin(middles) * np.cos(middles)  # weights, up to the step
    ends = _by_order(max(roughness, LEAST_ROUGHNESS))  # (2, M, A, A)
    both = along * ends[0] + grazing * ends[1]
    left, values, right = np.linalg.svd(np.sqrt(viewers)[:, None] * both * np.sqrt(lights))
    order = np.arange(ORDERS)[:, None]
    energy = np.where(order > 0, 0.25, 1.0) * values**2  # mean square over turns of both, of one term
    chosen: list[tuple[int, int]] = []
    room = terms
    for place in np.argsort(-energy, axis=None, kind="stable"):
        m, k = np.divmod(int(place), energy.shape[1])
        if room >= (1 if m == 0 else 2):
            chosen += [(m, k)] if m == 0 else [(m, k), (-m, k)]
            room -= 1 if m == 0 else 2
        if not room:
            break
    whole = float((np.where(order > 0, 0.5, 1.0) * values**2).sum())
    kept = float(sum(energy[abs(m), k] for m, k in chosen))
    incoming = np.stack([right[abs(m), k] / np.sqrt(lights) for m, k in chosen])  # of norm 1
    outgoing = np.stack([[end[abs(m)] @ (lights * own) for (m, _), own in zip(chosen, incoming, strict=True)] for end in ends])
    shares = np.where(np.array([m for m, _ in chosen]) == 0, 1.0, 0.5)  # mean square of cos m phi
    toward = along * outgoing[0] + grazing * outgoing[1]
    scale = np.sqrt(np.maximum(3 * shares * (toward**2 @ viewers) / viewers.sum(), 1e-30))[:, None]
    orders = np.array([m for m, _ in chosen], np.int64)
    return BrdfFactors(orders, _ended(orders, incoming * scale), _ended(orders, outgoing / scale), max(0.0, 1 - kept / whole))


def of_bounces(factors: BrdfFactors) -> Float32[ndarray, "n K"]:
    """What each f_i makes of bounced light: the integral of f_i L is about the sum over k of these times that of y_k NoL L."""
    orders, profiles, inverse = _waves()
    middles = ANGLES[1:-1]
    overlaps = (factors.incoming[:, 1:-1] * np.sin(middles)) @ profiles.T
    return np.where(factors.orders[:, None] == orders, overlaps, 0).astype(np.float32) @ inverse.astype(np.float32)


@lru_cache(maxsize=64)
def viewers_of_bounces(roughness: float) -> Float32[ndarray, "2 K A"]:
    """The same of the whole BRDF toward viewers: by angle, times h of the order of y_k, for either end of the Fresnel term."""
    orders, profiles, inverse = _waves()
    of_order = _by_order(max(roughness, LEAST_ROUGHNESS))[:, np.abs(orders)]  # (2, K, A, A)
    overlaps = np.einsum("ekvl,kl->ekv", of_order, profiles * np.sin(ANGLES[1:-1]))
    return _ended(orders, np.einsum("jk,ekv->ejv", inverse, overlaps)).astype(np.float32)


@lru_cache(maxsize=1)
def _waves() -> tuple[Int[ndarray, " K"], Float64[ndarray, "K A"], Float64[ndarray, "K K"]]:
    """(m of harmonics as of terms, their values where h_m is 1, the inverse of their products by NoL over the hemisphere without turns)."""
    middles = ANGLES[1:-1]
    orders = np.concatenate([np.arange(-degree, degree + 1) for degree in range(BOUNCE_ORDER + 1)])
    profiles = np.empty((len(orders), STEPS))
    for k, m in enumerate(orders.tolist()):
        turn = 0 if m >= 0 else np.pi / (2 * -m)
        across = np.sin(middles)
        places = np.stack([across * np.cos(turn), across * np.sin(turn), np.cos(middles)], axis=1)
        profiles[k] = harmonics(places, BOUNCE_ORDER)[:, k]
    gram = (profiles * np.sin(middles) * np.cos(middles)) @ profiles.T
    return orders, profiles, np.linalg.inv(np.where(orders[:, None] == orders, gram, 0))


def turned(orders: Int[ndarray, " n"], local: Float[ndarray, "d 3"]) -> Float32[ndarray, "d n"]:
    """h_i(phi) of directions; along the normal, where there is no turn, 1 for m = 0 and else 0."""
    across = np.hypot(local[:, 0], local[:, 1])
    unit = ((local[:, 0] + 1j * local[:, 1]) / np.maximum(across, 1e-20)).astype(np.complex64)
    found = np.empty((len(local), len(orders)), np.float32)
    for i, m in enumerate(orders.tolist()):
        power = unit ** abs(m)
        found[:, i] = power.real if m >= 0 else power.imag
    return found


def interpolated(table: Float[ndarray, "n A"], cosines: Float[ndarray, " d"]) -> Float32[ndarray, "d n"]:
    """Rows of a table at angles from the normal, linear between columns."""
    place = np.arccos(np.clip(cosines, 0, 1)) * (STEPS / (np.pi / 2)) + 0.5  # in columns but at both ends, half a step from the next
    place = np.where(place < 1, 2 * place - 1, np.where(place > STEPS, 2 * place - STEPS, place))
    low = np.clip(place.astype(np.int64), 0, STEPS)
    part = (place - low).astype(np.float32)[:, None]
    columns = np.ascontiguousarray(table.T, np.float32)
    return columns[low] * (1 - part) + columns[low + 1] * part


@lru_cache(maxsize=64)
def _by_order(roughness: float) -> Float64[ndarray, "2 M A A"]:
    """K_m of either end of the Fresnel term, viewers in rows."""
    middles = ANGLES[1:-1]
    turn = (np.arange(TURNS) + 0.5) * (np.pi / TURNS)
    shape = (STEPS, STEPS, TURNS)
    viewer, light = (np.broadcast_to(values, shape).ravel() for values in (middles[:, None, None], middles[None, :, None]))
    NoV, NoL = np.cos(viewer), np.cos(light)
    VoL = NoV * NoL + np.sin(viewer) * np.sin(light) * np.broadcast_to(np.cos(turn), shape).ravel()
    alpha = float(alpha_of(np.array([roughness]))[0])
    whole = np.repeat(albedo_terms(np.cos(middles), np.full(STEPS, alpha))[0], STEPS * TURNS)
    found = np.stack(parts_of(NoL, NoV, VoL, np.full(len(NoV), alpha), whole)).reshape(2, *shape)
    waves = np.cos(np.arange(ORDERS)[:, None] * turn) * np.where(np.arange(ORDERS) > 0, 2.0, 1.0)[:, None] / TURNS
    return np.moveaxis(found @ waves.T, 3, 1)


def _ended(orders: Int[ndarray, " n"], table: Float64[ndarray, "*e n a"]) -> Float64[ndarray, "*e n A"]:
    """With columns at the normal, 0 where the function turns about it, and at the horizon."""
    first = np.where(orders[:, None] == 0, table[..., :1], 0)
    return np.concatenate([first, table, table[..., -1:]], axis=-1)
