"""Relighting an asset by the method that it names; lights are of the world, and come into the asset's frame here."""

from __future__ import annotations

from collections.abc import Sequence

from numpy import ndarray

from srbf.arrays import Float32, Float64
from srbf.asset import Asset
from srbf.light_domain import domain_of_asset
from srbf.lights import Light, moved
from srbf.methods.over_lights import finish
from srbf.methods.protocol import FitRun, Method
from srbf.registry import method_named

__all__ = [
    "FitRun",
    "Method",
    "in_asset_frame",
    "linear_response",
    "method_of",
    "outside_domain",
    "projected_weights",
    "relight",
    "responses",
]


def method_of(asset: Asset) -> type[Method]:
    """The class of the asset's method."""
    return method_named(asset.method)


def in_asset_frame(asset: Asset, lights: Sequence[Light]) -> list[Light]:
    """Lights of the world in the frame that the asset was captured in."""
    return [moved(light, asset.asset_from_world) for light in lights]


def relight(asset: Asset, lights: Sequence[Light], direct: Float32[ndarray, "H W 3"] | None = None) -> Float32[ndarray, "H W 3"]:
    """max(0, sum over lights + direct) + ambient, for any number of lights of any kind at once.

    `direct` is the direct light that an indirect asset leaves out, as `srbf.relighting.direct_light` gives it. InputError on lights that
    the asset cannot have: point and spot lights without a position map.
    """
    total = linear_response(asset, lights)
    return finish(asset, total if direct is None else total + direct)


def linear_response(asset: Asset, lights: Sequence[Light]) -> Float32[ndarray, "H W 3"]:
    """The sum over lights before the clamp and without ambient: linear in every light's color."""
    return method_of(asset).linear_response(asset, in_asset_frame(asset, lights))


def responses(asset: Asset, coordinates: Float64[ndarray, "b d"]) -> Float32[ndarray, "b H W 3"]:
    """Responses to a white light at each of many coordinates of the asset's light domain, in the world; unclamped, without ambient.

    Coordinates of the domain `directions` are unit vectors from the surface to the light.
    """
    domain = domain_of_asset(asset.manifest)
    return method_of(asset).responses(asset, domain.moved(coordinates, asset.asset_from_world))


def projected_weights(asset: Asset, lights: Sequence[Light]) -> Float64[ndarray, "F 3"]:
    """One weight per map or light function, and color, of all directional and environment lights together."""
    return method_of(asset).projected_weights(asset, in_asset_frame(asset, lights))


def outside_domain(asset: Asset, lights: Sequence[Light]) -> list[str]:
    """A line for each light that shines from where nothing was captured; such lights evaluate unchanged."""
    positions = asset.images.get("position")
    covered = None if positions is None else positions[asset.covered]
    fit = asset.manifest.get("source", {}).get("fit", {})
    return domain_of_asset(asset.manifest).outside(in_asset_frame(asset, lights), covered, fit)
