"""Lights as text: the command line's x,y,z flags and the frames of a FRAMES.json."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from srbf import schemas
from srbf.errors import InputError
from srbf.io import files
from srbf.lights import DirectionalLight, EnvironmentLight, Falloff, Light, PointLight, SpotLight


def parse_directional(text: str) -> DirectionalLight:
    """`X,Y,Z[,R,G,B]`: towards the light, then its irradiance."""
    n = _numbers(text, (3, 6), "`directional` X,Y,Z[,R,G,B]")
    return DirectionalLight(_xyz(n, 0), **_color(n, 3))


def parse_point(text: str, a0: float, falloff: Falloff) -> PointLight:
    """`X,Y,Z[,R,G,B]`: position in meters, then irradiance at the distance a0."""
    n = _numbers(text, (3, 6), "`point` X,Y,Z[,R,G,B]")
    return PointLight(_xyz(n, 0), a0=a0, falloff=falloff, **_color(n, 3))


def parse_spot(text: str, a0: float, falloff: Falloff) -> SpotLight:
    """`X,Y,Z,DX,DY,DZ,INNER,OUTER[,R,G,B]`: position, where it shines, half-angles in radians, color."""
    n = _numbers(text, (8, 11), "`spot` X,Y,Z,DX,DY,DZ,INNER,OUTER[,R,G,B]")
    return SpotLight(_xyz(n, 0), direction=_xyz(n, 3), inner=n[6], outer=n[7], a0=a0, falloff=falloff, **_color(n, 8))


def read_environment(path: Path) -> EnvironmentLight:
    """An equirectangular EXR or picture, its values taken as linear. What was done that is not plain is a warning."""
    return EnvironmentLight(_environment(path))


def read_frames(path: Path) -> list[list[Light]]:
    """The lights of every frame of a FRAMES.json; environment files are found beside it. ManifestError, InputError on bad ones."""
    document = files.read_json(path)
    schemas.check(document, "frames", str(path))
    frames = []
    for number, frame in enumerate(document["frames"]):
        try:
            frames.append([_light(entry, path.parent) for entry in frame["lights"]])
        except InputError as error:
            raise InputError(f"{path}, frame {number}: {error}") from error
    return frames


def _light(entry: dict[str, Any], folder: Path) -> Light:
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items() if key != "kind"}
    if entry["kind"] == "environment":
        return EnvironmentLight(_environment(folder / fields.pop("file")), **fields)
    kinds: dict[str, Any] = {"directional": DirectionalLight, "point": PointLight, "spot": SpotLight}
    return kinds[entry["kind"]](**fields)


def _environment(path: Path) -> np.ndarray:
    from srbf.importing.pictures import read_picture, said_once

    picture = read_picture(path, "linear")
    for line in said_once([(path.name, picture.notes)]):
        warnings.warn(line, stacklevel=2)
    return picture.pixels


def _numbers(text: str, counts: tuple[int, int], usage: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not np.isfinite(numbers).all():
        raise InputError(f"expected {usage}, found {text!r}")
    return numbers


def _xyz(numbers: list[float], start: int) -> tuple[float, float, float]:
    return (numbers[start], numbers[start + 1], numbers[start + 2])


def _color(numbers: list[float], start: int) -> dict[str, Any]:
    return {"color": _xyz(numbers, start)} if len(numbers) > start else {}
