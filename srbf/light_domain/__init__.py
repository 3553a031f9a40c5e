"""Light domains: what a light's coordinates are, one domain a module.

A method fits responses as functions on a light domain, and is asked for lights by their coordinates in it. What it must know of lights
(spacing, weights of an integral, centers, probes, which lights are outside) it asks of the domain, never of directions themselves.
"""

from srbf.light_domain.cloud import Cloud
from srbf.light_domain.directions import Directions
from srbf.light_domain.named import Named
from srbf.light_domain.protocol import LightDomain
from srbf.light_domain.registry import domain_of_asset, domain_of_capture, light_of

__all__ = ["Cloud", "Directions", "LightDomain", "Named", "domain_of_asset", "domain_of_capture", "light_of"]
