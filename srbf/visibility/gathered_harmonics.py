"""Bounced light that arrives at receivers as harmonics of where it comes from, for surfaces that reflect it with gloss."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.basis.exitant_harmonics import harmonics
from srbf.brdf_factors import BOUNCE_ORDER
from srbf.compute.threads import each
from srbf.receiver_gloss import framed
from srbf.visibility.form_factors import RAYS, RayOrigins
from srbf.visibility.hemisphere import cosine_directions
from srbf.visibility.surface_cells import OFFSET
from srbf.visibility.surfels import Surfels


def gathered_harmonics(
    surfels: Surfels, origins: RayOrigins, rays: int, mixture: Float32[ndarray, "S r"], seed: int = 0
) -> Float32[ndarray, "K n r"]:
    """sum over surfels of F_k times `mixture`, F_k the form factors of receivers with one point each, by the rays of `form_factors`.

        F_k(p, s) = 1 / pi times the integral of y_k(l) NoL over the directions l in which p sees s

    y_k: the harmonics of `srbf.basis.exitant_harmonics` to BOUNCE_ORDER in the frame of the normal, so that F_0 are the form factors
    times y_0.
    """
    count = len(origins.weights)
    size = float(np.ptp(surfels.cells.places, axis=0).max(initial=0))
    batch = max(1, RAYS // rays)
    starts = range(0, count, batch)
    found = np.empty(((BOUNCE_ORDER + 1) ** 2, count, mixture.shape[1]), np.float32)
    known = np.concatenate([mixture, np.zeros((1, mixture.shape[1]), np.float32)])  # of rays that meet nothing

    def trace(number: int) -> None:
        part = slice(starts[number], starts[number] + batch)
        normals = np.asarray(origins.normals[part], np.float64)  # (n, 1, 3)
        places = origins.points[part] + OFFSET * size * normals
        directions = cosine_directions(normals, rays, np.random.default_rng([seed, number]))[:, 0]  # (n, c, 3)
        surfel, _ = surfels.met_along(np.repeat(places.reshape(-1, 3), rays, axis=0), directions.reshape(-1, 3))
        local = np.einsum("nij,ncj->nci", framed(normals[:, 0]), directions)
        waves = (harmonics(local, BOUNCE_ORDER) / rays).astype(np.float32)  # (n, c, K)
        sent = known[surfel].reshape(len(normals), rays, -1)
        found[:, part] = (waves.transpose(0, 2, 1) @ sent).transpose(1, 0, 2)

    each(trace, len(starts))
    return found
