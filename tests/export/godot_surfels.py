"""Lights inside a scene for scripts/test_godot.py: rooms whose surfels Godot lights with its own lights and shadow maps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from closed_forms import glb
from godot_lights import COLOR, RANGE, Z_UP, Lit, node
from made_rooms import Room, room_of_patches, room_of_surfels
from numpy import ndarray

from srbf.asset import Asset
from srbf.methods.light_cloud import LightCloud
from srbf.methods.transfer import Transfer

ROOM = Room.box((3.2, 2.4, 2.0), 0.2, 0.6, (1.6, 0.9, 1.7))  # two rooms and a doorway
HALL = Room.box((2.4, 2.0, 1.6), 0.4, 0.6)
LINEAR = (0.3, 0.9, 0.5)  # a color as Godot's inspector shows it: sRGB


def assets(folder: Path) -> Iterator[tuple[str, Asset, dict[str, list[Lit]]]]:
    """(title, asset, lights by name); the rooms are solved in `folder`."""
    capture = room_of_surfels(folder / "surfels", ROOM, 1200, tested=1)
    transfer = Transfer(clusters=8, components=12, rank=96, surfels=600).encode(capture)
    inside = lights(np.array([0.7, 1.1, 1.3]), np.array([2.6, 0.6, 0.9]))
    yield "transfer", transfer, inside
    yield "transfer, turned", moved(transfer), inside
    below = ROOM.corners[:, :, 2].min(axis=1) < 1.9
    yield "transfer, no ceiling", replace(transfer, scene=glb(ROOM.corners[below])), {"sun": [sun(np.array([0.4, 0.3, 0.8]))]}
    patches = room_of_patches(folder / "patches", HALL, 24, tested=1)
    yield "light-cloud", LightCloud(clusters=4, components=8).encode(patches), lights(np.array([0.8, 0.7, 0.9]), np.array([1.7, 1.4, 0.6]))


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
