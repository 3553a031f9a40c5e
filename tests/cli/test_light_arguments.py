"""Lights as text: flags and the frames of a FRAMES.json."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from made_profiles import UNEVEN, uneven

from srbf.cli.light_arguments import parse_area, parse_named, parse_sphere, read_frames, with_falloff
from srbf.errors import InputError, ManifestError
from srbf.light_profile import Profile
from srbf.lights import AreaLight, DirectionalLight, Light, NamedLight, PointLight, SphereLight, SpotLight


def test_spheres_and_areas() -> None:
    sphere = parse_sphere("1,2,3,0.25,1,0.5,0", 2.0, "inverse-square")
    assert sphere == SphereLight((1, 2, 3), (1, 0.5, 0), a0=2, size=0.25)
    assert parse_area("0,0,3,1,0,0,0,-2,0", 2.0) == AreaLight((0, 0, 3), u=(1, 0, 0), v=(0, -2, 0), a0=2)
    assert parse_area("0,0,3,1,0,0,0,-2,0,1,2,3", 1.0).color == (1, 2, 3)


@pytest.mark.parametrize(
    ("text", "name", "color"),
    [
        ("Window=2", "Window", (2, 2, 2)),
        ("Window=2,1.0,0.9,0.8", "Window", (2, 1.8, 1.6)),
        ("TV=0", "TV", (0, 0, 0)),
        ("Key=left, 1=0.5", "Key=left, 1", (0.5, 0.5, 0.5)),
        (" =1", " ", (1, 1, 1)),
    ],
)
def test_names_hold_anything_before_the_last_equals_sign(text: str, name: str, color: tuple[float, ...]) -> None:
    light = parse_named(text)
    assert light.name == name and light.color == pytest.approx(color)


@pytest.mark.parametrize("text", ["Window", "=1", "Window=", "Window=much", "Window=1,2", "Window=nan", "Window=1,2,3,4,5"])
def test_what_is_no_name_and_intensity_is_shown_whole(text: str) -> None:
    with pytest.raises(InputError, match="expected `light` NAME=INTENSITY") as caught:
        parse_named(text)
    assert repr(text) in str(caught.value)


@pytest.mark.parametrize(
    ("parse", "message"),
    [
        (lambda: parse_named("Window=-1"), "intensity of at least 0"),
        (lambda: parse_sphere("0,0,1", 1.0, "linear"), "expected `sphere` X,Y,Z,SIZE"),
        (lambda: parse_sphere("0,0,1,0", 1.0, "linear"), "expected size above 0, found 0"),
        (lambda: parse_area("0,0,1,1,0,0,0,1", 1.0), "expected `area` X,Y,Z,UX"),
        (lambda: parse_area("0,0,1,1,0,0,2,0,0", 1.0), "not parallel"),
    ],
)
def test_bad_lights_are_refused_in_one_line(parse: Callable[[], Light], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        parse()
    assert "\n" not in str(caught.value)


def frames_of(folder: Path, *lights: dict[str, Any]) -> Path:
    path = folder / "frames.json"
    path.write_text(json.dumps({"frames": [{"lights": list(lights)}]}))
    return path


def test_frames_hold_lights_of_every_kind(tmp_path: Path) -> None:
    path = frames_of(
        tmp_path,
        {"kind": "sphere", "position": [1, 2, 3], "size": 0.5, "a0": 2},
        {"kind": "area", "position": [0, 0, 3], "u": [1, 0, 0], "v": [0, -1, 0], "color": [1, 2, 3]},
        {"kind": "named", "name": "Window", "intensity": 0.5, "color": [1, 0, 2]},
        {"kind": "named", "name": "TV"},
    )
    (lights,) = read_frames(path)
    assert lights == [
        SphereLight((1, 2, 3), size=0.5, a0=2),
        AreaLight((0, 0, 3), (1, 0, 0), (0, -1, 0), (1, 2, 3)),
        NamedLight("Window", (0.5, 0, 1)),
        NamedLight("TV"),
    ]


def test_the_falloff_that_is_not_said(tmp_path: Path) -> None:
    """Of points and spots it is the asset's; spheres keep theirs, and what is said stays."""
    spot = {"kind": "spot", "position": [0, 0, 1], "direction": [0, 0, -1], "inner": 0.1, "outer": 0.2}
    path = frames_of(tmp_path, {"kind": "point", "position": [0, 0, 1]}, spot, {**spot, "falloff": "linear"})
    assert [light.falloff for light in read_frames(path)[0]] == ["linear"] * 3  # type: ignore[union-attr]
    assert [light.falloff for light in read_frames(path, "inverse-square")[0]] == ["inverse-square", "inverse-square", "linear"]  # type: ignore[union-attr]
    placed: list[Light] = [
        PointLight((0, 0, 1)),
        SpotLight((0, 0, 1), direction=(0, 0, -1), inner=0.1, outer=0.2),
        DirectionalLight((0, 0, 1)),
    ]
    placed.append(SphereLight((0, 0, 1), size=0.1, falloff="linear"))
    settled = with_falloff(placed, "inverse-square")
    assert [getattr(light, "falloff", None) for light in settled] == ["inverse-square", "inverse-square", None, "linear"]
    assert isinstance(settled[1], SpotLight) and settled[2] is placed[2]


@pytest.mark.parametrize(
    "light",
    [
        {"kind": "sphere", "position": [0, 0, 1]},
        {"kind": "area", "position": [0, 0, 1], "u": [1, 0, 0]},
        {"kind": "named", "name": ""},
        {"kind": "named", "name": "Window", "intensity": -1},
        {"kind": "named", "name": "Window", "position": [0, 0, 1]},
    ],
)
def test_bad_frames_are_refused(tmp_path: Path, light: dict[str, Any]) -> None:
    with pytest.raises(ManifestError, match=r"frames\.json"):
        read_frames(frames_of(tmp_path, light))


def test_frames_name_the_frame_of_a_bad_light(tmp_path: Path) -> None:
    path = frames_of(tmp_path, {"kind": "area", "position": [0, 0, 1], "u": [1, 0, 0], "v": [1, 0, 0]})
    with pytest.raises(InputError, match="frame 0: expected an area light's sides"):
        read_frames(path)


def test_a_profile_is_the_file_beside_the_frames_or_one_that_is_known(tmp_path: Path) -> None:
    path = frames_of(tmp_path, {"kind": "point", "position": [0, 0, 1], "profile": "one.ies"})
    asked = []

    def known(name: str) -> Profile:
        asked.append(name)
        return uneven

    with pytest.raises(InputError, match="expected an IES file"):
        read_frames(path)
    (light,) = read_frames(path, known=known)[0]
    assert isinstance(light, PointLight) and light.profile == uneven and asked == ["one.ies"]
    (tmp_path / "one.ies").write_text(UNEVEN.replace("1 1000 1 ", "1 1000 2 "))
    (light,) = read_frames(path, known=known)[0]
    assert isinstance(light, PointLight) and light.profile != uneven and asked == ["one.ies"]
