"""Error of glossy receivers under distant lights toward viewers: against the whole BRDF, and what of it the factorization makes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.capture import COVERED, Capture
from srbf.captured_light import Role
from srbf.cubemap_capture import CubemapCapture
from srbf.errors import InputError
from srbf.light_domain import light_of
from srbf.methods import in_asset_frame, projected_weights
from srbf.methods.glossy_eigen_map import GlossyEigenMap
from srbf.receiver_gloss import FactoredGloss
from srbf.sphere import random_directions

VIEWERS = 32  # random directions, of which a surface sees half


def glossy_errors(
    asset: Asset, capture: Capture, roles: Sequence[Role] = ("validation", "holdout"), viewers: int = VIEWERS, seed: int = 0
) -> dict[str, Any]:
    """Relative RMSE of the radiance toward random far viewers that lie above each receiver, by role.

    A receiver counts by the cosine of its viewer, as its surface fills pictures. The references have the whole BRDF, and a ray from every
    receiver to every light: the error is of factorization, sampling and fit together.

    Parameters
    ----------
    asset
        Of the method glossy-eigen-map.
    capture
        Under a cubemap, with gloss, of the asset's size.
    roles
        Of the lights.
    viewers
        How many directions, uniform on the sphere.
    seed
        Of the directions.

    Returns
    -------
    dict
        By role `relative_rmse` of all lights together, `mean` over lights and the `worst` light's, and `factorization`, that of the same
        terms without sampling and fit; roles without lights are left out. Lights that reach no receiver are in neither mean nor worst.

    Raises
    ------
    InputError
        Where asset or capture know no gloss, or differ in size.

    Examples
    --------
    >>> glossy_errors(asset, figure)["holdout"]["factorization"]  # doctest: +SKIP
    0.21
    """
    if asset.method != GlossyEigenMap.name or not isinstance(capture, CubemapCapture) or capture.gloss_terms is None:
        raise InputError("expected an asset and a capture under a cubemap with gloss, found others; bake with `gloss` and fit that")
    if (asset.width, asset.height) != (capture.width, capture.height):
        raise InputError(f"expected the asset's {asset.width}x{asset.height} texels in {capture.folder}, found others")
    gloss, texels = capture.receiver_gloss, capture.receivers
    rows = np.flatnonzero(capture.coverage().ravel()[texels] >= COVERED)
    factors = FactoredGloss.of(gloss, GlossyEigenMap.classes(asset), int(asset.manifest["gloss"]["terms"]))
    toward = random_directions(viewers, "sphere", np.random.default_rng(seed))
    seen = [np.intersect1d(rows, np.flatnonzero(gloss.normals @ one > 0)) for one in toward]
    whole = [np.broadcast_to(one, (asset.height, asset.width, 3)) for one in toward]
    of_asset = [GlossyEigenMap.viewer_factors(asset, one).reshape(-1, asset.height * asset.width, 3)[:, texels] for one in whole]
    exact = [factors.of_viewers(np.broadcast_to(one, gloss.normals.shape)) for one in toward]
    result: dict[str, Any] = {}
    for role in roles:
        sums = []  # of squares: missed by the asset, by the factorization alone, of the references
        for index in capture.indices(role):
            light = light_of(capture.lights[index])
            assert light is not None
            weights = projected_weights(asset, in_asset_frame(asset, [light]))
            terms = GlossyEigenMap.terms_of(asset, weights).reshape(-1, asset.height * asset.width, 3)[:, texels]
            factored = _factored(capture, factors, index)
            own = np.zeros(3)
            for k, chosen in enumerate(seen):
                true = capture.toward(index, whole[k]).reshape(-1, 3)[texels[chosen]]
                found = np.einsum("krc,krc->rc", of_asset[k][:, chosen], terms[:, chosen])
                alone = factored[0][chosen] + np.einsum("rkc,rk->rc", exact[k][chosen], factored[1][chosen])
                cosine = gloss.normals[chosen] @ toward[k]
                own += [
                    cosine @ np.square(values).sum(axis=1) for values in (np.maximum(found, 0) - true, np.maximum(alone, 0) - true, true)
                ]
            sums.append(own)
        if sums:
            missed, alone, power = np.array(sums).T
            each = np.sqrt(missed[power > 0] / power[power > 0])
            whole_power = max(float(power.sum()), 1e-30)
            result[role] = {
                "relative_rmse": float(np.sqrt(missed.sum() / whole_power)),
                "mean": float(each.mean()) if len(each) else 0.0,
                "worst": float(each.max(initial=0)),
                "factorization": float(np.sqrt(alone.sum() / whole_power)),
            }
    return result


def _factored(capture: CubemapCapture, factors: FactoredGloss, index: int) -> tuple[Float32[ndarray, "R 3"], Float32[ndarray, "R k"]]:
    """(diffuse radiance, T_i) of all receivers under a light, as traced."""
    lit, diffuse, waves = capture.received(index)
    terms = np.zeros((len(diffuse), factors.terms), np.float32)
    if len(waves):
        terms += np.einsum("krc,rnk->rn", waves / 3, factors.of_bounces(), optimize=True)
    terms[lit] += factors.of_lights(lit, np.broadcast_to(np.array(capture.lights[index].direction), (len(lit), 3)))
    return diffuse, terms
