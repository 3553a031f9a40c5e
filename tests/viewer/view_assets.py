"""A made view of a room whose camera is known, meshes of things in a scene, and a deep framebuffer of some."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from closed_forms import TURN, flat_normals
from made_rooms import Room
from web_assets import complete

from srbf.asset import Asset
from srbf.io.glb import Glb

EYE = np.array([0.3, -4.0, 1.2])
FORWARD = np.array([-0.05, 1.0, -0.15]) / np.linalg.norm([-0.05, 1.0, -0.15])
RIGHT = np.cross(FORWARD, [0, 0, 1]) / np.linalg.norm(np.cross(FORWARD, [0, 0, 1]))
ROTATION = np.stack([RIGHT, np.cross(FORWARD, RIGHT), FORWARD])
LENS = np.array([[0.9, 0, 0.5], [0, 1.2, 0.48], [0, 0, 1]])  # to u and v, 0 to 1
DEPTHS = (0.0, 3.0)  # meters: of the floor, and of the wall at the end of it


def seen_room(asset: Asset) -> Asset:
    """`asset` as a view of a floor and a wall, all of it covered."""
    u, v = np.meshgrid((np.arange(asset.width) + 0.5) / asset.width, (np.arange(asset.height) + 0.5) / asset.height)
    rays = np.linalg.solve(LENS, np.stack([u, v, np.ones_like(u)]).reshape(3, -1)).T @ ROTATION
    with np.errstate(divide="ignore"):
        floor, wall = (DEPTHS[0] - EYE[2]) / rays[:, 2], (DEPTHS[1] - EYE[1]) / rays[:, 1]
    reach = np.minimum(np.where(floor > 0, floor, np.inf), np.where(wall > 0, wall, np.inf))
    position = (EYE + reach[:, None] * rays).reshape(asset.height, asset.width, 3).astype(np.float32)
    covered = np.ones((asset.height, asset.width), np.float32)
    whole = complete(replace(asset, images={**asset.images, "position": position, "coverage": covered}))
    return complete(whole, source={"receiver": {"kind": "view", "camera": "Camera"}})


def project(place: np.ndarray) -> np.ndarray:
    """(u, v) of a place in the room."""
    seen = LENS @ (ROTATION @ (np.asarray(place) - EYE))
    return seen[:2] / seen[2]


def scene_glb(*things: tuple[str, np.ndarray, dict[str, Any]], uv: tuple[str, np.ndarray] | None = None) -> bytes:
    """A .glb of things (name, triangles (T, 3, 3) in Blender's world, glTF material), a node each; `uv`: of one thing, a corner each."""
    document = Glb({"asset": {"version": "2.0"}})
    nodes = []
    for name, corners, material in things:
        points = np.ascontiguousarray(corners.reshape(-1, 3), np.float32)
        attributes = {"POSITION": document.add_accessor(points, bounds=True)}
        attributes["NORMAL"] = document.add_accessor(np.ascontiguousarray(flat_normals(corners).reshape(-1, 3)))
        if uv and uv[0] == name:
            attributes["TEXCOORD_0"] = document.add_accessor(np.ascontiguousarray(uv[1], np.float32))
        mesh = document.add("meshes", {"primitives": [{"attributes": attributes, "material": document.add("materials", material)}]})
        nodes.append(document.add("nodes", {"name": name, "mesh": mesh}))
    root = document.add("nodes", {"rotation": TURN, "children": nodes})
    document.json.update(scenes=[{"nodes": [root]}], scene=0)
    return document.pack()


def with_objects(asset: Asset, room: Room, wall: float) -> Asset:
    """The asset, whose surfels and triangles are of the objects Gray, Red and Wall, at x = `wall` (m)."""

    def numbers(x: np.ndarray) -> np.ndarray:
        return np.where(np.abs(x - wall) < 1e-4, 2, np.where(x < 1e-4, 1, 0))

    names = ["Gray", "Red", "Wall"]
    pool = asset.tables["pool"].copy()
    pool[2, :, 3] = numbers(pool[0, :, 0])
    of = numbers(room.corners[:, :, 0].max(axis=1))
    scene = scene_glb(*((name, room.corners[of == number], {"doubleSided": True}) for number, name in enumerate(names)))
    manifest = {**asset.manifest, "gather": {**asset.manifest["gather"], "objects": names}}
    tables = asset.tables | {"pool": pool, "view_links": asset.tables["view_links"].copy()}  # what is made ready goes by this table
    return replace(asset, manifest=manifest, tables=tables, scene=scene)
