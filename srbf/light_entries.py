"""Lights as FRAMES.json writes them: one JSON object a light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from srbf import schemas
from srbf.errors import InputError
from srbf.light_linking import LINKS, Objects, choices_of
from srbf.light_profile import Profile
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
OF_PROFILES = ("direction", "roll", "profile")
UNSAID: dict[str, Any] = {"angle": None, "size": 0.0, **dict.fromkeys(LINKS)}  # what an entry leaves out where it has this value
Profiles = Callable[[str], Profile]


def light_of(entry: dict[str, Any], falloff: Falloff = "linear", profiles: Profiles | None = None) -> Light:
    """The light of an entry that keeps to frames.schema.json, of any kind but an environment, which has a file.

    `falloff`: of a point or spot light that does not say it. A `name` says which of the scene's lights it is and changes nothing, but of a
    named light. `profiles`: the profile of a file's name. InputError on values out of range, and on a profile without `profiles`.
    """
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items() if key != "kind"}
    if entry["kind"] == "named":
        return named(**fields)
    fields.pop("name", None)
    fields |= {link: Objects.of_entry(entry[link]) for link in LINKS if link in entry}
    if entry["kind"] in ("point", "spot"):
        fields.setdefault("falloff", falloff)
    if "profile" in fields:
        if profiles is None:
            raise InputError(f"expected lights without files, found the profile {fields['profile']!r}")
        fields["profile"] = profiles(fields["profile"])
    return KINDS[entry["kind"]](**fields)


def entry_of(light: Light) -> dict[str, Any]:
    """The entry of a light, its profile by the name of the profile's file; InputError for an environment, whose image is no entry's, and
    for a profile without a file."""
    if isinstance(light, EnvironmentLight):
        raise InputError("expected lights that Blender has, found an environment")
    fields = {name: list(value) if isinstance(value, tuple) else value for name, value in vars(light).items()}
    for name, usual in UNSAID.items():
        if name in fields and fields[name] == usual:
            del fields[name]
    if isinstance(light, PointLight):
        if light.profile is None:
            fields = {name: value for name, value in fields.items() if name not in OF_PROFILES or "inner" in fields and name == "direction"}
        else:
            fields["profile"] = light.profile.name
    fields |= {link: choice.entry() for link, choice in choices_of(light).items()}
    kind = next((kind for kind, made in KINDS.items() if type(light) is made), "named")
    return {"kind": kind, **fields}


def entry_with_file(light: Light, folder: Path, stem: str) -> dict[str, Any]:
    """`entry_of` a light; the file of its profile is written into a folder, as `stem` and its own suffix."""
    entry = entry_of(light)
    if isinstance(light, PointLight) and light.profile is not None and light.profile.file is not None:
        name, content = light.profile.file
        entry["profile"] = f"{stem}{Path(name).suffix}"
        (folder / entry["profile"]).write_bytes(content)
    return entry


def lights_of(
    entries: Sequence[dict[str, Any]], where: str, falloff: Falloff = "inverse-square", profiles: Profiles | None = None
) -> list[Light]:
    """Lights of entries that are not checked yet, none of them an environment; ManifestError and InputError name `where`."""
    schemas.check({"frames": [{"lights": list(entries)}]}, "frames", where)
    if any(entry["kind"] == "environment" for entry in entries):
        raise InputError(f"expected lights without files in {where}, found an environment")
    try:
        return [light_of(entry, falloff, profiles) for entry in entries]
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def named(name: str, intensity: float = 1.0, color: Triple = (1.0, 1.0, 1.0)) -> NamedLight:
    """One of the scene's lights at an intensity; InputError where that is negative."""
    if intensity < 0:
        raise InputError(f"expected an intensity of at least 0 for the light {name!r}, found {intensity:g}")
    red, green, blue = color
    return NamedLight(name, (intensity * red, intensity * green, intensity * blue))
