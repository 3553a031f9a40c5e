"""Lights that are edited one at a time: what each lays on an asset is kept, so that a change of one costs one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import TracebackType
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.asset import Asset
from srbf.errors import InputError
from srbf.lights import WHITE, EnvironmentLight, Light, NamedLight
from srbf.methods import finish, method_of, projected_weights
from srbf.relighting.direct_light import Added, Direct, chosen


class LightRig:
    """Relights an asset whose lights are weights of its functions, such as a deep framebuffer, from frame to frame; a context manager.

    Lights of the frame before are known again by their values: a color or an intensity that changes costs a sum, a light that moves one
    light.

    Parameters
    ----------
    asset
        Of lights inside a scene.
    direct
        As of `srbf.relight`.

    Raises
    ------
    InputError
        On an asset whose receivers see each light at coordinates of their own.

    Examples
    --------
    >>> from srbf.relighting.light_rig import LightRig
    >>> with LightRig(asset) as rig:
    ...     rig.picture(lights)
    Traceback (most recent call last):
    srbf.errors.InputError: expected an asset of lights inside a scene, found a relighting-map one
    """

    def __init__(self, asset: Asset, direct: Direct | None = None) -> None:
        self._shown: Any = method_of(asset)
        if not hasattr(self._shown, "weighted") or asset.manifest.get("light_domain", "directions") == "directions":
            raise InputError(f"expected an asset of lights inside a scene, found a {asset.method} one")
        self._asset = asset
        self._added = Added(asset, chosen(asset, direct))
        self._weights: dict[Light, ndarray] = {}
        self._direct: dict[Light, ndarray | None] = {}
        self.computed = 0  # lights, so far

    def __enter__(self) -> LightRig:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._added.__exit__(kind, error, trace)

    def picture(self, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
        """As `srbf.relight`.

        Parameters
        ----------
        lights
            Of the world.

        Returns
        -------
        ndarray
            (H, W, 3) float32.

        Raises
        ------
        InputError
            On a light that the asset does not know.

        Examples
        --------
        >>> rig.picture([PointLight((0.0, 0.0, 1.0))])  # doctest: +SKIP
        """
        pairs = [_white(light) for light in lights]
        used = [white for white, _ in pairs]
        for white in used:
            if white not in self._weights:
                self._weights[white] = projected_weights(self._asset, [white])
                self._direct[white] = self._added.response([white])
                self.computed += 1
        for gone in set(self._weights) - set(used):
            del self._weights[gone], self._direct[gone]
        if not pairs:
            return finish(self._asset, np.zeros((self._asset.height, self._asset.width, 3), np.float32))
        weights = np.sum([self._weights[white] * color for white, color in pairs], axis=0)
        total = self._shown.weighted(self._asset, weights[None])[0]
        for white, color in pairs:
            if (own := self._direct[white]) is not None:
                total = total + own * color.astype(np.float32)
        return finish(self._asset, total)


def _white(light: Light) -> tuple[Light, ndarray]:
    """(the light in white, its color); environments and named lights as they are."""
    if isinstance(light, (EnvironmentLight, NamedLight)):
        return light, np.ones(3)
    return replace(light, color=WHITE), np.array(light.color, np.float64)
