"""The light of an asset's probes: as spherical harmonics, and on what moves between them."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32
from srbf.asset import Asset
from srbf.basis.irradiance_harmonics import irradiance_at, radiance_harmonics
from srbf.errors import InputError
from srbf.probe_grid import ProbeGrid


def harmonics(asset: Asset, irradiance: Float32[ndarray, "H W 3"]) -> Float32[ndarray, "N 9 3"]:
    """Spherical harmonics (l <= 2) of the radiance that arrives at each probe, of a relit picture of an asset of probes.

    Parameters
    ----------
    asset
        Whose receivers are probes.
    irradiance
        (H, W, 3) float32: what `srbf.relight` gives of it.

    Returns
    -------
    ndarray
        (N, 9, 3) float32, degree by degree, m from -l to l, without the Condon-Shortley phase, as three.js has them; nodes without a probe
        of their own have the light of their nearest one.

    Raises
    ------
    InputError
        On an asset of other receivers.

    Examples
    --------
    >>> from srbf.relighting.probe_light import harmonics
    >>> harmonics(asset, relight(asset, []))
    Traceback (most recent call last):
    srbf.errors.InputError: expected an asset of probes, found one of a view
    """
    grid = grid_of(asset)
    return radiance_harmonics(grid.values(irradiance)[grid.sources]).astype(np.float32)


def light_at(
    asset: Asset, radiance: Float[ndarray, "N 9 3"], points: Float[ndarray, "n 3"], normals: Float[ndarray, "n 3"]
) -> Float32[ndarray, "n 3"]:
    """Irradiance at places between the probes, on surfaces that face `normals`.

    Parameters
    ----------
    asset
        Whose receivers are probes.
    radiance
        (N, 9, 3): of `harmonics`.
    points
        (n, 3), m, in the world.
    normals
        (n, 3), unit vectors, in the world.

    Returns
    -------
    ndarray
        (n, 3) float32, not negative.

    Raises
    ------
    InputError
        On an asset of other receivers.

    Examples
    --------
    >>> light_at(asset, harmonics(asset, picture), points, normals).shape  # doctest: +SKIP
    (50, 3)
    """
    turn, shift = asset.asset_from_world[:3, :3], asset.asset_from_world[:3, 3]
    probe, weight = grid_of(asset).weights(points @ turn.T + shift)
    mixed = np.einsum("ne,nekc->nkc", weight, np.asarray(radiance, np.float64)[probe])
    return irradiance_at(mixed, normals @ turn.T).astype(np.float32)


def grid_of(asset: Asset) -> ProbeGrid:
    """The asset's probes; InputError where its receivers are others."""
    if asset.probes is None:
        raise InputError(f"expected an asset of probes, found one of a {asset.receiver_kind}")
    return asset.probes
