"""Relighting an asset: the function that the command `srbf relight` and Python users call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from numpy import ndarray

from srbf import methods
from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.lights import Light
from srbf.relighting.direct_light import Added, Direct, chosen
from srbf.relighting.relighter import Relighter


def relight(
    asset: Asset, lights: Sequence[Light], direct: Direct | None = None, renderer: Literal["numpy", "gl"] = "numpy"
) -> Float32[ndarray, "H W 3"]:
    """The picture of an asset under any number of lights of any kind at once: max(0, their sum) + ambient.

    Parameters
    ----------
    asset
        What `srbf.fit` made, or `Asset.open` read.
    lights
        Directional, point, spot and environment lights in Blender's world: z up, meters, linear Rec.709. None of them gives the ambient.
    direct
        How the direct light of an indirect asset is added: `ray`, `shadow-map`, `pca` (with `receiver_visibility`) or `none`. By default by
        rays where embreex is installed, else by a shadow map. A combined asset holds its direct light already.
    renderer
        `numpy`, the reference, or `gl`, the shaders.

    Returns
    -------
    ndarray
        (H, W, 3) float32, linear, row 0 at the top; of the asset's quantity (irradiance or radiance).

    Raises
    ------
    InputError
        On point and spot lights where the asset has no position map, and on `direct` light of a combined asset.
    MissingLibraryError
        Where the renderer, or the way of adding direct light, is not installed.

    Examples
    --------
    >>> sun = DirectionalLight((0.0, 0.0, 1.0), color=(1.0, 0.9, 0.8))
    >>> once, twice = relight(asset, [sun]), relight(asset, [sun, sun])
    >>> bool(np.allclose(twice, 2 * once, atol=1e-5))  # linear in the lights, up to the clamp
    True
    """
    with Added(asset, chosen(asset, direct)) as added:
        light = added.response(lights)
        if renderer == "numpy":
            return methods.relight(asset, lights, light)
        with Relighter(asset) as relighter:
            return relighter.relight(lights, direct=light)
