"""Error of glossy surfaces toward viewers: the asset's radiance against that of its capture's harmonics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from srbf.asset import Asset
from srbf.basis.exitant_harmonics import harmonics, lifted
from srbf.capture import COVERED, Capture
from srbf.captured_light import Role
from srbf.errors import InputError
from srbf.light_domain import light_of
from srbf.methods import in_asset_frame, method_of
from srbf.methods.glossy_cloud import GlossyCloud
from srbf.sphere import random_directions

VIEWERS = 32  # random directions, of which a surface sees half


def viewer_errors(
    asset: Asset, capture: Capture, roles: Sequence[Role] = ("validation", "holdout"), viewers: int = VIEWERS, seed: int = 0
) -> dict[str, Any]:
    """Relative RMSE of the radiance toward random far viewers that lie above each receiver, by role.

    The references are a capture's harmonics, which hold what the bake's viewers saw: what their order leaves out is in neither.

    Parameters
    ----------
    asset
        Of the method glossy-cloud.
    capture
        With harmonics of the same order, of the asset's size.
    roles
        Of the lights.
    viewers
        How many directions, uniform on the sphere.
    seed
        Of the directions.

    Returns
    -------
    dict
        By role `relative_rmse` of all lights together, `mean` over lights and the `worst` light's; roles without lights are left out.

    Raises
    ------
    InputError
        Where asset or capture know one viewer alone, or differ in order or size.

    Examples
    --------
    >>> viewer_errors(asset, capture)["holdout"]["mean"]  # doctest: +SKIP
    0.12
    """
    order = capture.gloss
    if asset.method != GlossyCloud.name or order is None or order != asset.manifest["harmonics"]["order"]:
        raise InputError("expected an asset and a capture of harmonics of one order, found others; bake with `gloss` and fit that")
    normals = capture.geometry("normal")
    if normals is None or (asset.width, asset.height) != (capture.width, capture.height):
        raise InputError(f"expected normals and the asset's {asset.width}x{asset.height} texels in {capture.folder}, found others")
    covered = capture.coverage() >= COVERED
    facing = normals[covered].astype(np.float64)
    toward = random_directions(viewers, "sphere", np.random.default_rng(seed))
    terms = [harmonics(lifted(np.broadcast_to(one, facing.shape), facing), order).astype(np.float32) for one in toward]
    seen = [np.flatnonzero(facing @ one > 0) for one in toward]
    result: dict[str, Any] = {}
    for role in roles:
        squares, powers = [], []
        for index in capture.indices(role):
            light = light_of(capture.lights[index])
            assert light is not None
            true = capture.harmonics(index)[:, covered]  # (K, n, 3)
            weights = method_of(asset).projected_weights(asset, in_asset_frame(asset, [light]))
            missed = GlossyCloud.harmonics_of(asset, weights)[:, covered] - true
            sums = np.zeros(2)
            for term, rows in zip(terms, seen, strict=True):
                for i, part in enumerate((missed, true)):
                    sums[i] += float((np.einsum("nk,knc->nc", term[rows], part[:, rows]).astype(np.float64) ** 2).sum())
            squares.append(sums[0])
            powers.append(max(sums[1], 1e-30))
        if squares:
            each = np.sqrt(np.array(squares) / np.array(powers))
            result[role] = {
                "relative_rmse": float(np.sqrt(sum(squares) / sum(powers))),
                "mean": float(each.mean()),
                "worst": float(each.max()),
            }
    return result


def viewer_line(error: dict[str, Any]) -> str:
    """The errors of one role in words."""
    alone = f"; of the factorization alone {error['factorization']:.4f}" if "factorization" in error else ""
    return f"relative RMSE {error['relative_rmse']:.4f}, mean over lights {error['mean']:.4f}, worst light {error['worst']:.4f}{alone}"
