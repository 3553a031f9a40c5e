"""Relighting an asset by the method that it names; lights are of the world, and come into the asset's frame here."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.capture import Capture
from srbf.errors import InputError
from srbf.light_domain import domain_of_asset
from srbf.light_linking import refuse_linked
from srbf.lights import Light, PointLight, moved
from srbf.methods.linked_objects import require_objects
from srbf.methods.over_lights import finish
from srbf.methods.protocol import FitRun, Method, Moving
from srbf.registry import method_named
from srbf.visibility.embree import has_embree

__all__ = [
    "FitRun",
    "Method",
    "Moving",
    "captured_responses",
    "faded",
    "finish",
    "in_asset_frame",
    "linear_response",
    "method_of",
    "outside_domain",
    "projected_weights",
    "radiance_to",
    "relight",
    "responses",
]


def method_of(asset: Asset) -> type[Method]:
    """The class of the asset's method.

    Parameters
    ----------
    asset
        Of any method.

    Returns
    -------
    type
        `RelightingMap`, `EigenMap`, `ClusteredEigenMap` or another registered method.

    Raises
    ------
    InputError
        On a method that is not registered.

    Examples
    --------
    >>> from srbf.methods import method_of
    >>> method_of(asset) is RelightingMap
    True
    """
    return method_named(asset.method)


def in_asset_frame(asset: Asset, lights: Sequence[Light]) -> list[Light]:
    """Lights of the world in the frame that the asset was captured in.

    Parameters
    ----------
    asset
        Whose `asset_from_world` moves them.
    lights
        Of any kind.

    Returns
    -------
    list
        Of lights, in order.

    Raises
    ------
    InputError
        On a light with a profile or with chosen objects, where the asset's method takes none, and on objects that its scene lacks.

    Examples
    --------
    >>> from srbf.methods import in_asset_frame
    >>> sun = DirectionalLight((0.0, 0.0, 1.0))
    >>> in_asset_frame(asset, [sun]) == [sun]
    True
    """
    if not method_of(asset).takes_profiles:
        _refuse_profiles(lights, asset.method)
    if method_of(asset).takes_links:
        require_objects(asset, lights)
    else:
        refuse_linked(lights, asset.method)
    return [moved(light, asset.asset_from_world) for light in lights]


def relight(
    asset: Asset,
    lights: Sequence[Light],
    direct: Float32[ndarray, "H W 3"] | None = None,
    viewer: tuple[float, float, float] | None = None,
) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights + direct) + ambient, for any number of lights of any kind at once.

    Parameters
    ----------
    asset
        Of any method.
    lights
        Of the world.
    direct
        (H, W, 3) float32: the direct light that an indirect asset leaves out, as `srbf.relighting.direct_light` gives it.
    viewer
        Where glossy surfaces are seen from in the world, m; None: each from straight above itself.

    Returns
    -------
    ndarray
        (H, W, 3) float32, linear, row 0 at the top; of the asset's quantity.

    Raises
    ------
    InputError
        On point and spot lights where the asset has no position map.

    Examples
    --------
    >>> from srbf.methods import linear_response, relight
    >>> sun = DirectionalLight((0.3, 0.0, 1.0))
    >>> bool((relight(asset, [sun]) == np.maximum(linear_response(asset, [sun]), 0)).all())  # of an asset without ambient
    True
    """
    total = linear_response(asset, lights) if viewer is None else radiance_to(asset, lights, viewer)
    return finish(asset, total if direct is None else total + direct)


def linear_response(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """The sum over lights before the clamp and without ambient: linear in every light's color.

    Parameters
    ----------
    asset
        Of any method.
    lights
        Of the world, of any kind and number.

    Returns
    -------
    ndarray
        (H, W, 3) float32, which may be negative.

    Raises
    ------
    InputError
        On point and spot lights where the asset has no position map.

    Examples
    --------
    >>> from srbf.methods import linear_response
    >>> red, green = (DirectionalLight((0.0, 0.0, 1.0), color) for color in ((1, 0, 0), (0, 1, 0)))
    >>> both = linear_response(asset, [red, green])
    >>> bool(np.allclose(both, linear_response(asset, [red]) + linear_response(asset, [green]), atol=1e-6))
    True
    """
    return method_of(asset).linear_response(asset, in_asset_frame(asset, lights))


def faded(asset: Asset, seconds: float) -> Moving:
    """`relight` for moving lights of a light cloud: captured lights that one begins or ceases to see come and go over time.

    Parameters
    ----------
    asset
        Of the method light-cloud with `interpolation=kernel`.
    seconds
        That a captured light takes to come or go, 0 or more.

    Returns
    -------
    Callable
        Called with the lights of a frame and the seconds since the last one: `linear_response`. A light is known by its place in the list.

    Raises
    ------
    InputError
        On an asset of another kind, whose light is continuous without.

    Examples
    --------
    >>> from srbf.methods import faded
    >>> faded(asset, 0.25)
    Traceback (most recent call last):
    srbf.errors.InputError: expected an asset of captured point lights for `fade`, found relighting-map, ...
    """
    respond = method_of(asset).faded(asset, seconds)
    return lambda lights, dt: respond(in_asset_frame(asset, lights), dt)


def radiance_to(asset: Asset, lights: Sequence[Light], viewer: tuple[float, float, float]) -> Float32[ndarray, "H W 3"]:
    """`linear_response` of glossy surfaces as seen from a place.

    Parameters
    ----------
    asset
        Of the method glossy-cloud.
    lights
        Of the world.
    viewer
        Where it is seen from in the world, m.

    Returns
    -------
    ndarray
        (H, W, 3) float32, which may be negative.

    Raises
    ------
    InputError
        On an asset that looks the same from everywhere.

    Examples
    --------
    >>> from srbf.methods import radiance_to
    >>> radiance_to(asset, [], (0.0, -2.0, 1.0))
    Traceback (most recent call last):
    srbf.errors.InputError: expected an asset of glossy surfaces for `viewer`, found a relighting-map one, ...
    """
    matrix = np.asarray(asset.asset_from_world, np.float64)
    x, y, z = (matrix[:3, :3] @ np.asarray(viewer, np.float64) + matrix[:3, 3]).tolist()
    return method_of(asset).radiance_to(asset, in_asset_frame(asset, lights), (x, y, z))


def responses(asset: Asset, coordinates: Float64[ndarray, "b d"]) -> Float32[ndarray, "b H W 3"]:
    """Responses to a white light at each of many coordinates of the asset's light domain; unclamped, without ambient.

    Parameters
    ----------
    asset
        Of any method.
    coordinates
        (b, d) float64 in the world. Of the domain `directions` they are unit vectors from the surface to the light, d = 3.

    Returns
    -------
    ndarray
        (b, H, W, 3) float32.

    Examples
    --------
    >>> from srbf.methods import responses
    >>> responses(asset, capture.directions(capture.indices("holdout"))).shape
    (8, 6, 8, 3)
    """
    domain = domain_of_asset(asset.manifest)
    return method_of(asset).responses(asset, domain.moved(coordinates, asset.asset_from_world))


def captured_responses(asset: Asset, capture: Capture, lights: Sequence[int]) -> Float32[ndarray, "b H W 3"]:
    """Responses to lights of a capture, as it has them, unclamped and without ambient: what its images are compared with.

    Parameters
    ----------
    asset
        Of any method.
    capture
        With lights that the asset's method knows.
    lights
        Indices of the capture's lights.

    Returns
    -------
    ndarray
        (b, H, W, 3) float32.

    Examples
    --------
    >>> from srbf.methods import captured_responses
    >>> captured_responses(asset, capture, capture.indices("holdout")[:2]).shape
    (2, 6, 8, 3)
    """
    return method_of(asset).captured_responses(asset, capture, lights)


def projected_weights(asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
    """One weight per map or light function, and color, of all directional and environment lights together: once per frame.

    Parameters
    ----------
    asset
        Of any method.
    lights
        Of the world; point and spot lights have no such weight and are left out.

    Returns
    -------
    ndarray
        (F, 3) float64: F = K of relighting maps; per cluster of eigen maps the components and 1 for the mean.

    Examples
    --------
    >>> from srbf.methods import projected_weights
    >>> weights = projected_weights(asset, [DirectionalLight((0.0, 0.0, 1.0), color=(2.0, 1.0, 1.0))])
    >>> weights.shape, bool(np.allclose(weights[:, 0], 2 * weights[:, 1]))
    ((9, 3), True)
    """
    return method_of(asset).projected_weights(asset, in_asset_frame(asset, lights))


def outside_domain(asset: Asset, lights: Sequence[Light]) -> list[str]:
    """A line for each light that shines from where nothing was captured; such lights evaluate unchanged.

    Parameters
    ----------
    asset
        Of any method.
    lights
        Of the world.

    Returns
    -------
    list
        Of strings, one per light outside; empty where all are inside, or are traced wherever they are.

    Examples
    --------
    >>> from srbf.methods import outside_domain
    >>> outside_domain(asset, [DirectionalLight((0.0, 0.0, -1.0))])
    ['light 0 comes from below the captured hemisphere (z = -1): its response is extrapolated']
    """
    domain = domain_of_asset(asset.manifest)
    if domain.is_traced and (has_embree() or "surfel_visibility" in asset.manifest):
        return []
    positions = asset.images.get("position")
    covered = None if positions is None else positions[asset.covered]
    fit = asset.manifest.get("source", {}).get("fit", {})
    return domain.outside(in_asset_frame(asset, lights), covered, fit)


def _refuse_profiles(lights: Sequence[Light], method: str) -> None:
    """InputError where one of the lights has a profile, of an asset whose method takes none."""
    if any(isinstance(light, PointLight) and light.profile is not None for light in lights):
        raise InputError(
            f"expected lights without a profile for a {method} asset, found one; capture the scene with `light_set=surfels` or `gather`"
        )
