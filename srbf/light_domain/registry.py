"""Finds light domains by the names that manifests use."""

from __future__ import annotations

from typing import Any

from srbf.capture import Capture
from srbf.errors import InputError
from srbf.light_domain.directions import Directions
from srbf.light_domain.protocol import LightDomain

DOMAINS: tuple[type[LightDomain], ...] = (Directions,)


def domain_of_capture(capture: Capture, region: str = "auto") -> LightDomain:
    """The light domain that the lights of a capture are in; InputError where none has lights of their kind."""
    for domain in DOMAINS:
        if domain.captured_kind == capture.kind:
            return domain.of_capture(capture, region)
    known = ", ".join(domain.captured_kind for domain in DOMAINS)
    raise InputError(f"expected a capture under {known} lights, found {capture.kind} lights in {capture.folder}")


def domain_of_asset(manifest: dict[str, Any]) -> LightDomain:
    """The light domain that an asset.json names; `directions` where it names none."""
    kind = manifest.get("light_domain", Directions.kind)
    for domain in DOMAINS:
        if domain.kind == kind:
            return domain.of_manifest(manifest)
    raise InputError(f"expected a light domain of {', '.join(domain.kind for domain in DOMAINS)}, found {kind!r}")
