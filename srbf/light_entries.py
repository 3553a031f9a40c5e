"""Lights as FRAMES.json writes them: one JSON object a light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from srbf import schemas
from srbf.errors import InputError
from srbf.lights import (
    AreaLight,
    DirectionalLight,
    EnvironmentLight,
    Falloff,
    Light,
    NamedLight,
    PointLight,
    SphereLight,
    SpotLight,
    Triple,
)

KINDS: dict[str, Any] = {"directional": DirectionalLight, "point": PointLight, "spot": SpotLight, "sphere": SphereLight, "area": AreaLight}


def light_of(entry: dict[str, Any], falloff: Falloff = "linear") -> Light:
    """The light of an entry that keeps to frames.schema.json, of any kind but an environment, which has a file.

    `falloff`: of a point or spot light that does not say it. A `name` says which of the scene's lights it is and changes nothing, but of a
    named light. InputError on values out of range.
    """
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items() if key != "kind"}
    if entry["kind"] == "named":
        return named(**fields)
    fields.pop("name", None)
    if entry["kind"] in ("point", "spot"):
        fields.setdefault("falloff", falloff)
    return KINDS[entry["kind"]](**fields)


def entry_of(light: Light) -> dict[str, Any]:
    """The entry of a light; InputError for an environment, whose image is no entry's."""
    if isinstance(light, EnvironmentLight):
        raise InputError("expected lights that Blender has, found an environment")
    fields = {name: list(value) if isinstance(value, tuple) else value for name, value in vars(light).items()}
    kind = next((kind for kind, made in KINDS.items() if type(light) is made), "named")
    return {"kind": kind, **fields}


def lights_of(entries: Sequence[dict[str, Any]], where: str, falloff: Falloff = "inverse-square") -> list[Light]:
    """Lights of entries that are not checked yet, none of them an environment; ManifestError and InputError name `where`."""
    schemas.check({"frames": [{"lights": list(entries)}]}, "frames", where)
    if any(entry["kind"] == "environment" for entry in entries):
        raise InputError(f"expected lights without files in {where}, found an environment")
    return [light_of(entry, falloff) for entry in entries]


def named(name: str, intensity: float = 1.0, color: Triple = (1.0, 1.0, 1.0)) -> NamedLight:
    """One of the scene's lights at an intensity; InputError where that is negative."""
    if intensity < 0:
        raise InputError(f"expected an intensity of at least 0 for the light {name!r}, found {intensity:g}")
    red, green, blue = color
    return NamedLight(name, (intensity * red, intensity * green, intensity * blue))
