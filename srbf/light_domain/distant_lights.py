"""Light from infinity as few directions and colors, for what is evaluated per light: suns, and nodes that environments shine from."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float64
from srbf.light_domain.registry import domain_of_asset
from srbf.lights import DirectionalLight, Light, refuse_named
from srbf.sphere import Domain, point_set

NODES = 256  # directions that an environment is seen from


def distant_lights(manifest: dict[str, Any], lights: Sequence[Light]) -> tuple[Float64[ndarray, "n 3"], Float64[ndarray, "n 3"]]:
    """(unit directions, colors) of everything at infinity that shines: the directional lights, and the nodes of environments.

    `manifest`: of the asset that is lit.
    """
    refuse_named(lights, manifest["method"])
    suns = domain_of_asset(manifest).shared([light for light in lights if isinstance(light, DirectionalLight)])
    others = node_light(manifest, [light for light in lights if not isinstance(light, DirectionalLight)])
    pieces = [*suns, (nodes_of(manifest), others)]
    directions, colors = (np.concatenate(own) for own in zip(*pieces, strict=True))
    shining = colors.any(axis=1)
    return directions[shining], colors[shining]


def nodes_of(manifest: dict[str, Any]) -> Float64[ndarray, "NODES 3"]:
    """Directions over an asset's domain, each for an equal part of it."""
    return _nodes(manifest["domain"])


@cache
def _nodes(domain: Domain) -> Float64[ndarray, "NODES 3"]:
    return point_set("fibonacci", NODES, domain)


def node_light(manifest: dict[str, Any], lights: Sequence[Light]) -> Float64[ndarray, "NODES 3"]:
    """Light of environments by node: each of their texels shines from the node nearest to it."""
    shone = np.zeros((NODES, 3))
    nodes = nodes_of(manifest)
    for directions, colors in domain_of_asset(manifest).shared(lights):
        np.add.at(shone, np.argmax(directions @ nodes.T, axis=1), colors)
    return shone
