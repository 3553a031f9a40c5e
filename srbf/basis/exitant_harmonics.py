"""Light that leaves a glossy surface, as spherical harmonics of the viewer's direction: a fit per normal [Sloan2003, Kristensen2005]."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float64
from srbf.errors import InputError

MAX_ORDER = 4
RIDGE = 1e-4  # of the fit: see `projection`
LEAST_COSINE = 0.2  # of a viewer: see `lifted`


def harmonics(directions: Float[ndarray, "*n 3"], order: int) -> Float64[ndarray, "*n K"]:
    """The K = (order + 1)^2 functions at unit directions as polynomials of x, y, z; order 0 to 4.

    Degree by degree, m from -l to l, orthonormal on the sphere, without the Condon-Shortley phase:
    `srbf.basis.harmonics.SphericalHarmonics` in closed form.
    """
    if order not in range(MAX_ORDER + 1):
        raise InputError(f"expected an order of spherical harmonics from 0 to {MAX_ORDER}, found {order}")
    x, y, z = np.moveaxis(np.asarray(directions, np.float64), -1, 0)
    xx, yy, zz = x * x, y * y, z * z
    terms = [np.full_like(x, sqrt(1 / (4 * pi)))]
    if order > 0:
        terms += [sqrt(3 / (4 * pi)) * value for value in (y, z, x)]
    if order > 1:
        a = sqrt(15 / (4 * pi))
        terms += [a * x * y, a * y * z, sqrt(5 / (16 * pi)) * (3 * zz - 1), a * x * z, a / 2 * (xx - yy)]
    if order > 2:
        a, b, c = sqrt(35 / (32 * pi)), sqrt(105 / (4 * pi)), sqrt(21 / (32 * pi))
        terms += [a * y * (3 * xx - yy), b * x * y * z, c * y * (5 * zz - 1), sqrt(7 / (16 * pi)) * z * (5 * zz - 3)]
        terms += [c * x * (5 * zz - 1), b / 2 * z * (xx - yy), a * x * (xx - 3 * yy)]
    if order > 3:
        a, b, c, d = sqrt(315 / (16 * pi)), sqrt(315 / (32 * pi)), sqrt(45 / (16 * pi)), sqrt(45 / (32 * pi))
        terms += [a * x * y * (xx - yy), b * y * z * (3 * xx - yy), c * x * y * (7 * zz - 1), d * y * z * (7 * zz - 3)]
        terms += [sqrt(9 / (256 * pi)) * (35 * zz * zz - 30 * zz + 3), d * x * z * (7 * zz - 3), c / 2 * (xx - yy) * (7 * zz - 1)]
        terms += [b * x * z * (xx - 3 * yy), a / 4 * (xx * (xx - 3 * yy) - yy * (3 * xx - yy))]
    return np.stack(terms, axis=-1)


def projection(
    directions: Float[ndarray, "S 3"],
    normals: Float[ndarray, "P 3"] | None,
    order: int,
    weights: Float[ndarray, " S"] | None = None,
    ridge: float = RIDGE,
) -> Float64[ndarray, "P K S"]:
    """Matrices that turn radiance toward S viewers into coefficients: least squares on the hemisphere about each normal.

        min over a of  sum_s w_s (f_s - y(v_s) . a)^2 + ridge |a|^2,     w_s = 0 for v_s . n <= 0      [Sloan2003]

    The functions are free below the horizon, where no viewer sees them; so a clamped cosine, which needs infinitely many terms on the
    sphere, is one term. On a hemisphere they are nearly dependent (condition of the normal equations: 250 at order 2, 6e3 at 3, 1.5e5
    at 4): `ridge` is the weight of the energy on the whole sphere, which keeps coefficients of neighboring normals close, and tells what
    to do where fewer than K viewers are above the horizon. `weights` are solid angles (sr); by default all share 4 pi. With `normals`
    None the whole sphere counts, and P is 1.
    """
    seen = harmonics(directions, order)  # (S, K)
    angles = np.full(len(seen), 4 * pi / max(len(seen), 1)) if weights is None else np.asarray(weights, np.float64)
    above = np.ones((1, len(seen)), bool) if normals is None else np.asarray(normals, np.float64) @ np.asarray(directions, np.float64).T > 0
    used = above * angles  # (P, S)
    gram = np.einsum("ps,sk,sj->pkj", used, seen, seen, optimize=True) + ridge * np.eye(seen.shape[1])
    return np.linalg.solve(gram, np.einsum("ps,sk->pks", used, seen))


def lifted(viewers: Float[ndarray, "*n 3"], normals: Float[ndarray, "*n 3"]) -> Float64[ndarray, "*n 3"]:
    """The viewers (unit directions) that a surface is seen from in place of those below: at least LEAST_COSINE above its plane.

    What Blender's bake does when it looks from a camera (`integrator_init_from_bake` in Cycles): a viewer lower than LEAST_COSINE is
    raised to about that, one behind the surface is turned towards its normal. Directions above stay as they are.
    """
    viewers, normals = np.asarray(viewers, np.float64), np.asarray(normals, np.float64)
    cosine = (viewers * normals).sum(axis=-1, keepdims=True)
    raised = viewers - normals * np.minimum(cosine - LEAST_COSINE, 0)
    raised = raised / np.maximum(np.linalg.norm(raised, axis=-1, keepdims=True), 1e-12)
    behind = np.maximum(-cosine, 0)
    turned = raised + behind * (normals - raised)
    return turned / np.maximum(np.linalg.norm(turned, axis=-1, keepdims=True), 1e-12)


def projection_of_each(directions: Float[ndarray, "P S 3"], order: int, ridge: float = RIDGE) -> Float64[ndarray, "P K S"]:
    """`projection` where each receiver was seen from S directions of its own, all above it and of equal weight, with noise.

    The ridge of a function of degree l is l times `ridge`: what looks the same from everywhere stays as it is.
    """
    seen = harmonics(directions, order)  # (P, S, K)
    share = 4 * pi / max(seen.shape[1], 1)
    degrees = np.repeat(np.arange(order + 1), 2 * np.arange(order + 1) + 1)
    gram = share * np.swapaxes(seen, 1, 2) @ seen + ridge * np.diag(np.maximum(degrees, RIDGE))
    return np.linalg.solve(gram, share * np.swapaxes(seen, 1, 2))


def radiance(coefficients: Float[ndarray, "P K ..."], viewers: Float[ndarray, "P 3"], order: int) -> Float64[ndarray, "P ..."]:
    """Light toward the unit directions of the viewers; slightly negative beside sharp highlights."""
    return np.einsum("pk,pk...->p...", harmonics(viewers, order), np.asarray(coefficients, np.float64))
