"""Lights as text: the command line's x,y,z flags and the frames of a FRAMES.json."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from srbf import schemas
from srbf.errors import InputError
from srbf.io import files
from srbf.light_entries import Profiles, light_of, named
from srbf.light_profile import Profile, read_ies_profile
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


def parse_directional(text: str) -> DirectionalLight:
    """`X,Y,Z[,R,G,B]`: towards the light, then its irradiance."""
    n = _numbers(text, (3, 6), "`directional` X,Y,Z[,R,G,B]")
    return DirectionalLight(_xyz(n, 0), **_color(n, 3))


def parse_point(text: str, a0: float, falloff: Falloff) -> PointLight:
    """`X,Y,Z[,R,G,B]`: position in meters, then irradiance at the distance a0."""
    n = _numbers(text, (3, 6), "`point` X,Y,Z[,R,G,B]")
    return PointLight(_xyz(n, 0), a0=a0, falloff=falloff, **_color(n, 3))


def parse_viewer(text: str) -> tuple[float, float, float]:
    """`X,Y,Z`: a place in the world, m."""
    return _xyz(_numbers(text, (3, 3), "`viewer` X,Y,Z"), 0)


def parse_spot(text: str, a0: float, falloff: Falloff) -> SpotLight:
    """`X,Y,Z,DX,DY,DZ,INNER,OUTER[,R,G,B]`: position, where it shines, half-angles in radians, color."""
    n = _numbers(text, (8, 11), "`spot` X,Y,Z,DX,DY,DZ,INNER,OUTER[,R,G,B]")
    return SpotLight(_xyz(n, 0), direction=_xyz(n, 3), inner=n[6], outer=n[7], a0=a0, falloff=falloff, **_color(n, 8))


def parse_sphere(text: str, a0: float, falloff: Falloff) -> SphereLight:
    """`X,Y,Z,SIZE[,R,G,B]`: center and radius in meters, irradiance at the distance a0."""
    n = _numbers(text, (4, 7), "`sphere` X,Y,Z,SIZE[,R,G,B]")
    return SphereLight(_xyz(n, 0), size=n[3], a0=a0, falloff=falloff, **_color(n, 4))


def parse_area(text: str, a0: float) -> AreaLight:
    """`X,Y,Z,UX,UY,UZ,VX,VY,VZ[,R,G,B]`: center and sides in meters, irradiance straight in front at the distance a0."""
    n = _numbers(text, (9, 12), "`area` X,Y,Z,UX,UY,UZ,VX,VY,VZ[,R,G,B]")
    return AreaLight(_xyz(n, 0), u=_xyz(n, 3), v=_xyz(n, 6), a0=a0, **_color(n, 9))


def parse_object(text: str, flag: str, most: float = np.inf) -> tuple[str, Triple]:
    """`OBJECT=R,G,B`: the name is all before the last `=`, the color linear, at least 0 and at `most`."""
    name, equals, rest = text.rpartition("=")
    usage = f"`{flag}` OBJECT=R,G,B of " + (f"0 to {most:g}" if np.isfinite(most) else "at least 0")
    if not (name and equals):
        raise InputError(f"expected {usage}, found {text!r}")
    color = _xyz(_numbers(rest, (3, 3), usage, text), 0)
    if min(color) < 0 or max(color) > most:
        raise InputError(f"expected {usage}, found {text!r}")
    return name, color


def parse_named(text: str) -> NamedLight:
    """`NAME=INTENSITY[,R,G,B]`: the name is all before the last `=`; intensity 1 is as the scene has the light set."""
    name, equals, rest = text.rpartition("=")
    usage = "`light` NAME=INTENSITY[,R,G,B], the intensity at least 0"
    if not (name and equals):
        raise InputError(f"expected {usage}, found {text!r}")
    n = _numbers(rest, (1, 4), usage, text)
    return named(name, n[0], _xyz(n, 1) if len(n) > 1 else (1.0, 1.0, 1.0))


def with_falloff(lights: Sequence[Light], falloff: Falloff) -> list[Light]:
    """The same, point and spot lights with this falloff; spheres keep theirs."""
    return [
        replace(light, falloff=falloff) if isinstance(light, PointLight) and not isinstance(light, SphereLight) else light
        for light in lights
    ]


def read_environment(path: Path, turn: float = 0.0) -> EnvironmentLight:
    """An equirectangular EXR or picture, its values taken as linear, turned about +z (rad). What is not plain is a warning."""
    return EnvironmentLight(_linear(path)).turned(turn)


def read_profile(path: Path) -> Profile:
    """A photometric file (.ies), or an image that a spot projects: EXR as it is, other formats as sRGB where they do not say.

    InputError and ImageError on a file that is not there or not read.
    """
    if path.suffix.lower() == ".ies":
        return read_ies_profile(path)
    pixels = _linear(path, "linear" if path.suffix.lower() in (".exr", ".hdr") else "srgb")
    if (pixels < 0).any():
        raise InputError(f"expected an image of at least 0 to project, found {pixels.min():g} in {path}")
    return Profile(pixels, projected=True, file=(path.name, path.read_bytes()))


def read_frames(path: Path, falloff: Falloff = "linear", known: Profiles | None = None) -> list[list[Light]]:
    """The lights of every frame of a FRAMES.json; files are found beside it. ManifestError, InputError on bad ones.

    `falloff`: of point and spot lights that do not say it; `known`: the profile of a name without a file there, of the scene's own lights.
    """
    document = files.read_json(path)
    schemas.check(document, "frames", str(path))
    frames = []

    @functools.cache
    def profile(name: str) -> Profile:
        own = path.parent / name
        return read_profile(own) if known is None or own.is_file() else known(name)

    for number, frame in enumerate(document["frames"]):
        try:
            frames.append([_light(entry, path.parent, falloff, profile) for entry in frame["lights"]])
        except InputError as error:
            raise InputError(f"{path}, frame {number}: {error}") from error
    return frames


def _light(entry: dict[str, Any], folder: Path, falloff: Falloff, profiles: Profiles) -> Light:
    if entry["kind"] != "environment":
        return light_of(entry, falloff, profiles)
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items() if key != "kind"}
    return replace(read_environment(folder / fields.pop("file"), fields.pop("turn", 0.0)), **fields)


def _linear(path: Path, transfer: Literal["linear", "srgb"] = "linear") -> np.ndarray:
    from srbf.importing.pictures import read_picture, said_once

    picture = read_picture(path, transfer)
    for line in said_once([(path.name, picture.notes)]):
        warnings.warn(line, stacklevel=2)
    return picture.pixels


def _numbers(text: str, counts: tuple[int, int], usage: str, whole: str | None = None) -> list[float]:
    """The numbers of a text of one of two lengths; InputError with the `whole` flag's text, by default this one."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not np.isfinite(numbers).all():
        raise InputError(f"expected {usage}, found {text if whole is None else whole!r}")
    return numbers


def _xyz(numbers: list[float], start: int) -> tuple[float, float, float]:
    return (numbers[start], numbers[start + 1], numbers[start + 2])


def _color(numbers: list[float], start: int) -> dict[str, Any]:
    return {"color": _xyz(numbers, start)} if len(numbers) > start else {}
