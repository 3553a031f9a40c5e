"""Finds light domains by the names that manifests use."""

from __future__ import annotations

from typing import Any

from srbf.capture import Capture
from srbf.captured_light import CapturedLight
from srbf.errors import InputError
from srbf.light_domain.cloud import Cloud
from srbf.light_domain.directions import Directions
from srbf.light_domain.named import Named
from srbf.light_domain.pool import PoolLights
from srbf.light_domain.protocol import LightDomain
from srbf.light_domain.surfels import SurfelLights
from srbf.lights import DirectionalLight, Light, NamedLight, PointLight

DOMAINS: tuple[type[LightDomain], ...] = (Directions, Named, Cloud, SurfelLights, PoolLights)


def domain_of_capture(capture: Capture, region: str = "auto") -> LightDomain:
    """The light domain that the lights of a capture are in; InputError where none has lights of their kind."""
    for domain in DOMAINS:
        if capture.kind in domain.captured_kinds:
            return domain.of_capture(capture, region)
    known = ", ".join(kind for domain in DOMAINS for kind in domain.captured_kinds)
    raise InputError(f"expected a capture under {known} lights, found {capture.kind} lights in {capture.folder}")


def domain_of_asset(manifest: dict[str, Any]) -> LightDomain:
    """The light domain that an asset.json names; `directions` where it names none."""
    kind = manifest.get("light_domain", Directions.kind)
    for domain in DOMAINS:
        if domain.kind == kind:
            return domain.of_manifest(manifest)
    raise InputError(f"expected a light domain of {', '.join(domain.kind for domain in DOMAINS)}, found {kind!r}")


def light_of(captured: CapturedLight) -> Light | None:
    """The light that a capture's image was made under; None for a patch, which is a part of the surfaces."""
    if captured.kind == "directional":
        return DirectionalLight(captured.direction)
    if captured.kind == "point":
        return PointLight(captured.position, falloff="inverse-square")
    return NamedLight(str(captured.name)) if captured.kind == "named" else None
