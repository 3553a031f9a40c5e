"""Lights inside a scene for scripts/test_godot_surfels.py: rooms whose surfels Godot lights with its own lights and shadow maps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from closed_forms import glb
from godot_lights import COLOR, RANGE, Z_UP, Lit, node
from made_rooms import Room, room_of_patches, room_of_surfels
from numpy import ndarray

from srbf.asset import Asset
from srbf.io.image import decode_srgb
from srbf.lights import EnvironmentLight, Light, NamedLight
from srbf.methods.light_cloud import LightCloud
from srbf.methods.surface_changes import with_albedo
from srbf.methods.transfer import Transfer

ROOM = Room.box((3.2, 2.4, 2.0), 0.2, 0.6, (1.6, 0.9, 1.7))  # two rooms and a doorway
HALL = Room.box((2.4, 2.0, 1.6), 0.4, 0.6)
WINDOW = ((0.3, 0.7), (1.3, 1.6))  # corners in x and z, of the wall at y = 0
PANORAMA = np.random.default_rng(5).random((8, 16, 3)).astype(np.float32) ** 4  # Godot's layout, which starts at x = 0, -z forward
ENERGY = 0.7
LINEAR = (0.3, 0.9, 0.5)  # a color as Godot's inspector shows it: sRGB


@dataclass(frozen=True)
class Shown:
    """What lights a picture: Godot's lights, the panorama, objects that emit (energy, color), and objects of other colors."""

    lights: list[Lit] = field(default_factory=list)
    has_panorama: bool = False
    emission: dict[str, tuple[float, tuple[float, float, float]]] = field(default_factory=dict)
    albedo: dict[str, tuple[float, float, float]] = field(default_factory=dict)

    def job(self) -> dict[str, Any]:
        """For godot_surfels.gd."""
        panorama = PANORAMA.ravel().tolist() if self.has_panorama else None
        nodes = [lit.node for lit in self.lights]
        return {"lights": nodes, "panorama": panorama, "energy": ENERGY, "emission": self.emission, "albedo": self.albedo}

    def meant(self, asset: Asset) -> tuple[Asset, list[Light]]:
        """The same for numpy."""
        lights: list[Light] = [lit.light() for lit in self.lights]
        if self.has_panorama:
            lights.append(EnvironmentLight(np.roll(PANORAMA, 4, axis=1), (ENERGY,) * 3))  # this layout starts a quarter turn later
        for name, (energy, color) in self.emission.items():
            lights.append(NamedLight(name, tuple((energy * decode_srgb(np.array(color))).tolist())))
        painted = {name: tuple(decode_srgb(np.array(color)).tolist()) for name, color in self.albedo.items()}
        return (with_albedo(asset, painted) if painted else asset), lights


def assets(folder: Path) -> Iterator[tuple[str, Asset, dict[str, Shown]]]:
    """(title, asset, what lights it by name); the rooms are solved in `folder`."""
    capture = room_of_surfels(folder / "surfels", ROOM, 1200, tested=1)
    transfer = Transfer(clusters=8, components=12, rank=96, surfels=600).encode(capture)
    inside = lights(np.array([0.7, 1.1, 1.3]), np.array([2.6, 0.6, 0.9]))
    by_lights = {name: Shown(own) for name, own in inside.items()}
    yield "transfer", transfer, by_lights
    yield "transfer, turned", moved(transfer), by_lights
    below = ROOM.corners[:, :, 2].min(axis=1) < 1.9
    yield "transfer, no ceiling", replace(transfer, scene=glb(ROOM.corners[below])), {"sun": Shown([sun(np.array([0.4, 0.3, 0.8]))])}
    open_room = room_of_surfels(folder / "window", with_window(ROOM), 1200, tested=1)
    editable = Transfer(clusters=8, components=12, rank=96, surfels=600, editable=True)
    changing = editable.encode(open_room)
    yield "window", changing, changes(inside["point"])
    yield "window, turned", moved(changing), {"environment": Shown(has_panorama=True)}
    counted = replace(open_room, manifest={**open_room.manifest, "surfels": {**open_room.manifest["surfels"], "bounces": 5}})
    yield (
        "window, few bounces",
        editable.encode(counted),
        {name: shown for name, shown in changes(inside["point"]).items() if name.startswith("paint")},
    )
    patches = room_of_patches(folder / "patches", HALL, 24, tested=1)
    of_hall = lights(np.array([0.8, 0.7, 0.9]), np.array([1.7, 1.4, 0.6]))
    yield "light-cloud", LightCloud(clusters=4, components=8).encode(patches), {name: Shown(own) for name, own in of_hall.items()}


def changes(point: list[Lit]) -> dict[str, Shown]:
    """What enters without light on surfels, alone and together, and other albedo under all that it goes with."""
    shining = {"Red wall": (2.0, (0.4, 0.9, 0.6))}
    blue = {"Red wall": (0.1, 0.3, 0.95)}
    return {
        "environment": Shown(has_panorama=True),
        "emission": Shown(emission=shining),
        "all": Shown(point, True, {"Walls": (0.1, (1.0, 0.8, 0.6)), **shining}),
        "paint": Shown(point, albedo=blue),
        "paint all": Shown(point, albedo={**blue, "Walls": (0.95, 0.9, 0.5)}, emission=shining),
    }


def with_window(room: Room) -> Room:
    """The room with an opening to the outside in its wall at y = 0."""
    (left, low), (right, high) = WINDOW
    length, top = room.corners[:, :, 0].max(), room.corners[:, :, 2].max()
    wall = (room.corners[:, :, 1] == 0).all(axis=1)
    frame = [(0, 0, length, low), (0, high, length, top), (0, low, left, high), (right, low, length, high)]
    made = [[[x, 0, z] for x, z in corners] for a, b, c, d in frame for corners in (((a, b), (c, b), (c, d)), ((a, b), (c, d), (a, d)))]
    x, y, z = room.places.T
    kept = ~((y == 0) & (x > left) & (x < right) & (z > low) & (z < high))
    parts = {name: getattr(room, name)[kept] for name in ("places", "normals", "areas", "albedo")}
    return replace(room, **parts, corners=np.concatenate([room.corners[~wall], np.array(made, np.float32)]), closed=False)


def moved(asset: Asset) -> Asset:
    """The asset in another frame than the world's: turned, half as large, shifted."""
    frame = [[0.0, 0.5, 0.0, 0.3], [-0.5, 0.0, 0.0, 0.2], [0.0, 0.0, 0.5, -0.1], [0.0, 0.0, 0.0, 1.0]]
    turn, shift = np.array(frame)[:3, :3], np.array(frame)[:3, 3]
    cells = asset.tables["cells"].copy()
    cells[0, :, :3] = cells[0, :, :3] @ turn.T + shift
    cells[0, :, 3] *= 0.25
    cells[1, :, :3] = 2 * cells[1, :, :3] @ turn.T
    corners = ROOM.corners @ turn.T.astype(np.float32) + shift.astype(np.float32)
    return replace(
        asset, manifest={**asset.manifest, "asset_from_world": frame}, tables={**asset.tables, "cells": cells}, scene=glb(corners)
    )


def lights(first: ndarray, second: ndarray) -> dict[str, list[Lit]]:
    """Places in the room, z up."""
    return {
        "point": [omni(first, 1.0)],
        "spot": [spot(first, np.array([0.5, 0.1, -0.9]), 0.6)],
        "two colors": [omni(first, 1.0, LINEAR), omni(second, 2.0)],
    }


def omni(place: ndarray, energy: float, color: tuple[float, float, float] | None = None) -> Lit:
    own: dict[str, Any] = {} if color is None else {"color": color}
    place = Z_UP[:3, :3].T @ place
    shown = node("OmniLight3D", energy, place, omni_range=RANGE, omni_attenuation=2, shadow_enabled=1, **own)
    return Lit(shown, np.array([0.0, 1.0, 0.0]), place, energy, 2.0, **own)


def spot(place: ndarray, ahead: ndarray, edge: float) -> Lit:
    place, towards = Z_UP[:3, :3].T @ place, -Z_UP[:3, :3].T @ ahead / np.linalg.norm(ahead)
    cone = {"spot_angle": 50, "spot_angle_attenuation": edge}
    shown = node("SpotLight3D", 2.0, place, towards, COLOR, spot_range=RANGE, spot_attenuation=2, shadow_enabled=1, **cone)
    return Lit(shown, towards, place, 2.0, 2.0, (np.radians(50), edge))


def sun(towards: ndarray) -> Lit:
    towards = Z_UP[:3, :3].T @ towards / np.linalg.norm(towards)
    return Lit(node("DirectionalLight3D", 1.0, towards=towards, shadow_enabled=1), towards, np.zeros(3), 1.0)
