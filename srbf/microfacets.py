"""Specular reflection by microfacets of the GGX distribution, isotropic, as Cycles' glossy lobes."""

from __future__ import annotations

import functools

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64

LEAST_ALPHA = 1e-3
TABLE, TABLE_SAMPLES = 33, 4096  # of the lobe's own albedo, per side and sample
GRAZING = 0.02  # least cosine of the table


def alpha_of(roughness: Float[ndarray, " n"]) -> Float64[ndarray, " n"]:
    """The width of the distribution of a roughness as in Blender and glTF, its square."""
    return np.maximum(np.asarray(roughness, np.float64) ** 2, LEAST_ALPHA)


def lobe(
    NoL: Float[ndarray, " n"], NoV: Float[ndarray, " n"], NoH: Float[ndarray, " n"], alpha: Float[ndarray, " n"]
) -> Float64[ndarray, " n"]:
    """f NoL of a lobe whose Fresnel term is 1: D G2 / (4 NoV), G2 height-correlated Smith [Walter2007, Heitz2018]; 0 from below."""
    squared = alpha**2
    density = squared / (np.pi * (NoH**2 * (squared - 1) + 1) ** 2)
    shadowing = 1 / (1 + _masking(NoL, squared) + _masking(NoV, squared))
    return np.where((NoL > 0) & (NoV > 0), density * shadowing / (4 * np.maximum(NoV, 1e-6)), 0.0)


def sampled(
    view: Float64[ndarray, "n c 3"], alpha: Float64[ndarray, " n"], square: Float64[ndarray, "n d 2"]
) -> tuple[Float64[ndarray, "n d 3"], Float64[ndarray, "n d"], Float64[ndarray, "n d"]]:
    """(directions of light, VoH, weights) by the distribution of visible normals [Heitz2018]; frames have the normal as z.

    The mean of F(VoH) times the weight, G2 / G1, is the albedo of a lobe of Fresnel term F; the weight is 0 below the surface.
    view: unit vectors to the eye, c = d or 1 for all; square: points of the unit square.
    """
    width = alpha[:, None, None]
    stretched = view * np.concatenate([width, width, np.ones_like(width)], axis=2)
    stretched /= np.linalg.norm(stretched, axis=2, keepdims=True)
    angle, z = 2 * np.pi * square[:, :, 0], (1 - square[:, :, 1]) * (1 + stretched[:, :, 2]) - stretched[:, :, 2]
    radius = np.sqrt(np.clip(1 - z * z, 0, 1))  # of a spherical cap [Dupuy2023], the same density
    half = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=2) + stretched
    half *= np.concatenate([width, width, np.ones_like(width)], axis=2)
    half[:, :, 2] = np.maximum(half[:, :, 2], 0)
    half /= np.maximum(np.linalg.norm(half, axis=2, keepdims=True), 1e-30)
    VoH = np.einsum("nck,nck->nc", view, half)
    light = 2 * VoH[:, :, None] * half - view
    squared = alpha[:, None] ** 2
    seen, lit = _masking(view[:, :, 2], squared), _masking(light[:, :, 2], squared)
    return light, VoH, np.where(light[:, :, 2] > 0, (1 + seen) / (1 + seen + lit), 0.0)


def schlick(VoH: Float[ndarray, ...]) -> Float64[ndarray, ...]:
    """How far the Fresnel term is from its value along the normal to 1 [Schlick1994]."""
    return (1 - np.clip(VoH, 0, 1)) ** 5


def albedo_terms(NoV: Float[ndarray, " n"], alpha: Float64[ndarray, " n"]) -> tuple[Float64[ndarray, " n"], Float64[ndarray, " n"]]:
    """(albedo of a lobe whose Fresnel term is 1, what share of it Schlick's term is), from a table."""
    from scipy.interpolate import RegularGridInterpolator

    axes, values = _table()
    found = RegularGridInterpolator(axes, values)(np.stack([np.clip(NoV, GRAZING, 1), np.clip(np.sqrt(alpha), 0, 1)], axis=1))
    return found[:, 0], found[:, 1]


def fresnel(
    VoH: Float[ndarray, " n"], color: Float[ndarray, "n 3"], share: Float[ndarray, " n"], grazing: Float64[ndarray, " n"]
) -> Float64[ndarray, "n 3"]:
    """The Fresnel term, over the lobe's own albedo, of lobes whose whole albedo is `color`.

    A `share` of the lobe follows Schlick's term, the rest is even. `grazing`: the second of `albedo_terms`. Where a lobe is darker than
    any that follows Schlick's term, it keeps that term's shape and `color`.
    """
    whole, share, part = np.asarray(color, np.float64), share[:, None], grazing[:, None]
    normal = np.clip((whole - part) / np.maximum(1 - part, 1e-6), 0, 1)
    term = (normal + (1 - normal) * schlick(VoH)[:, None]) / np.maximum(normal * (1 - part) + part, 1e-9)
    return whole * (1 - share + share * term)


def reflected(
    normals: Float[ndarray, "n 3"],
    view: Float[ndarray, "n 3"],
    directions: Float[ndarray, "n 3"],
    color: Float[ndarray, "n 3"],
    alpha: Float64[ndarray, " n"],
    share: Float[ndarray, " n"],
    spread: float = 0.0,
) -> Float64[ndarray, "n 3"]:
    """f NoL of lobes of whole albedo `color`, a `share` of which follows Schlick's term, toward unit `view` of light from `directions`.

    `spread`: half the angle (rad) that the light fills, which widens a lobe by as much as the half vector turns.
    """
    normals, view = np.asarray(normals, np.float64), np.asarray(view, np.float64)
    half = view + directions
    half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-30)
    NoV, NoL, NoH = (np.einsum("nc,nc->n", normals, other) for other in (view, directions, half))
    NoV, VoH = np.maximum(NoV, 1e-3), np.einsum("nc,nc->n", view, half)
    whole, grazing = albedo_terms(NoV, alpha)
    return (lobe(NoL, NoV, NoH, np.hypot(alpha, spread / 2)) / whole)[:, None] * fresnel(VoH, color, share, grazing)


def ends_of(
    color: Float[ndarray, "n 3"], share: Float[ndarray, " n"], alpha: Float64[ndarray, " n"]
) -> tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]:
    """(reflectance along the normal, at grazing) that lobes of whole albedo `color` toward a viewer above them have by `fresnel`."""
    _, part = albedo_terms(np.ones(len(alpha)), alpha)
    whole, share, part = np.asarray(color, np.float64), np.asarray(share, np.float64)[:, None], part[:, None]
    normal = np.clip((whole - part) / np.maximum(1 - part, 1e-6), 0, 1)
    scale = whole * share / np.maximum(normal * (1 - part) + part, 1e-9)
    return whole * (1 - share) + normal * scale, whole * (1 - share) + scale


def parts_of(
    NoL: Float[ndarray, " n"],
    NoV: Float[ndarray, " n"],
    VoL: Float[ndarray, " n"],
    alpha: Float64[ndarray, " n"],
    whole: Float64[ndarray, " n"] | None = None,
) -> tuple[Float64[ndarray, " n"], Float64[ndarray, " n"]]:
    """f NoL of lobes by the cosines between normal, light and viewer, per unit of the two reflectances of `ends_of`: (along, grazing).

    `whole`: the first of `albedo_terms`, where it is known.
    """
    NoV = np.maximum(NoV, 1e-3)
    length = np.sqrt(np.maximum(2 + 2 * VoL, 1e-12))
    whole = albedo_terms(NoV, alpha)[0] if whole is None else whole
    even = lobe(NoL, NoV, np.minimum((NoL + NoV) / length, 1), alpha) / whole
    grazing = even * schlick(np.minimum((1 + VoL) / length, 1))
    return even - grazing, grazing


def albedo_table() -> Float32[ndarray, "T T 2"]:
    """The table of `albedo_terms`, for `glsl/gloss/lobe_albedo.glsl`: rows by cosine, columns by roughness, the two terms."""
    return _table()[1].astype(np.float32)


def _masking(cosine: ndarray, squared: ndarray) -> ndarray:
    """Smith's lambda."""
    square = np.maximum(cosine * cosine, 1e-12)
    return (np.sqrt(1 + squared * (1 - np.minimum(square, 1)) / square) - 1) / 2


@functools.lru_cache(maxsize=1)
def _table() -> tuple[tuple[ndarray, ndarray], Float64[ndarray, "T T 2"]]:
    from scipy.stats import qmc

    cosines, roughness = np.linspace(GRAZING, 1, TABLE), np.linspace(0, 1, TABLE)
    square = qmc.Sobol(2, scramble=False).random(TABLE_SAMPLES)[None]
    values = np.empty((TABLE, TABLE, 2))
    for i, cosine in enumerate(cosines):
        view = np.broadcast_to([np.sqrt(1 - cosine**2), 0.0, cosine], (TABLE, 1, 3))
        _, VoH, weight = sampled(view, alpha_of(roughness), np.broadcast_to(square, (TABLE, *square.shape[1:])))
        values[i, :, 0] = weight.mean(axis=1)
        values[i, :, 1] = (weight * schlick(VoH)).mean(axis=1) / values[i, :, 0]
    return (cosines, roughness), values
