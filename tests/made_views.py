"""Captures of deep framebuffers without Blender: the cells of a made room are the pixels of its view."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from made_rooms import Room, divided, write_room

from srbf.asset import Asset
from srbf.bake.gather_set import FoundSurfaces, GatherSet
from srbf.capture import Capture
from srbf.channels import THROUGH
from srbf.io import files
from srbf.io.image import write_image
from srbf.methods.deep_framebuffer import GLOSSY_FILES, POINTS
from srbf.methods.mixed_clusters import BEHIND


def surfaces_of(room: Room, longest: float, bounces: int = 12) -> FoundSurfaces:
    """As a bake finds them."""
    corners = divided(room.corners, longest)
    red = corners[:, :, 0].max(axis=1) < 1e-6
    albedo = np.where(red[:, None], room.albedo[room.places[:, 0] < 1e-6][0], room.albedo[room.places[:, 0] > 1e-6][0])
    box = np.concatenate([room.corners.reshape(-1, 3).min(axis=0), room.corners.reshape(-1, 3).max(axis=0)]).astype(np.float64)
    return FoundSurfaces(
        corners,
        albedo.astype(np.float32),
        red.astype(np.int64),
        room.corners,
        room.free[-12:],
        room.free,
        box,
        np.array(bounces),
        names='["Gray", "Red"]',
    )


def without_near(asset: Asset) -> Asset:
    """The asset, whose light comes by links alone."""
    tables = {name: table for name, table in asset.tables.items() if name != POINTS}
    return replace(asset, tables=tables | {"view_links": asset.tables["view_links"].copy()})  # what is made ready goes by this table


def view_of_room(
    folder: Path,
    room: Room,
    pool: int,
    clusters: int | None = None,
    longest: float = 0.12,
    tested: int = 6,
    bounces: int = 64,
    gather: int | None = None,
) -> Capture:
    """The radiance of a view of all cells of a room, under point lights that are held out."""
    transport = room.transport()
    lights, images = [], []
    for place in room.free[-tested:] if tested else []:
        lights.append({"kind": "point", "position": place.tolist(), "role": "holdout"})
        images.append(np.einsum("ijc,j->ic", transport, room.direct(place)) * room.albedo / np.pi)
    light_set = GatherSet(pool, clusters, None, gather, surfaces_of(room, longest, bounces))
    keys = {"quantity": "radiance", "receiver": {"kind": "view"}, "albedo": "albedo.exr", **light_set.manifest()}
    capture = write_room(folder, room, lights, images, np.zeros(len(room.places), np.int64), **keys)
    albedo = np.zeros((capture.width * capture.height, 3), np.float32)
    albedo[: len(room.places)] = room.albedo
    write_image(folder / "albedo.exr", albedo.reshape(capture.height, capture.width, 3), "float")
    coverage = np.zeros(capture.width * capture.height, np.float32)
    coverage[: len(room.places)] = 1
    write_image(folder / "coverage.exr", coverage.reshape(capture.height, capture.width, 1), "float")
    manifest = {key: told for key, told in capture.manifest.items() if key != "patches"}
    files.write_json(folder / "capture.json", manifest)
    capture = Capture.open(folder)
    light_set.trace(capture, 7, lambda done, total, what: None)
    return Capture.open(folder)


def with_lobes(asset: Asset) -> Asset:
    """An asset of a view some of whose pixels are glossy, which gather along the links of its own clusters."""
    rng = np.random.default_rng(6)
    told = asset.manifest["gather"]
    neighbors = np.array(asset.stored[:4])
    neighbors[..., 2] = rng.integers(0, 2, neighbors.shape[:3]) * rng.integers(1, 256, neighbors.shape[:3])
    glossy = rng.uniform(0, 1, (asset.height, asset.width, 3)).astype(np.float32)
    gather = {**told, "lobes": told["clusters"], "gloss_rays": told["view_rays"] // 2}
    named = {name: {"file": file} for name, file in GLOSSY_FILES.items()}
    tables = {
        **asset.tables,
        "view_links": asset.tables["view_links"].copy(),  # what is kept of an asset is known by them
        "gloss_links": asset.tables["view_links"],
        "gloss_rows": asset.tables["view_rows"],
        "gloss_neighbors": neighbors.reshape(-1, asset.width, 3),
    }
    images = {**asset.images, "glossy": glossy, "lobe": np.full_like(glossy, 0.5)}
    manifest = {**asset.manifest, **named, "glossy": "glossy.exr", "lobe": "lobe.exr", "gather": gather}
    return replace(asset, manifest=manifest, tables=tables, images=images)


def with_specular_albedo(asset: Asset) -> Asset:
    """An asset of a view whose lobes see surfels reflect more than other surfels do."""
    found = with_lobes(asset)
    color = np.random.default_rng(8).uniform(0, 0.5, (1, found.tables["pool"].shape[1], 4)).astype(np.float32)
    tables = {**found.tables, "pool": np.concatenate([found.tables["pool"], color])}
    return replace(found, manifest={**found.manifest, "gather": {**found.manifest["gather"], "specular_albedo": True}}, tables=tables)


def with_backs(asset: Asset) -> Asset:
    """An asset of a view some of whose pixels let light through, whose backs are lit as clusters of its own are."""
    rng = np.random.default_rng(7)
    neighbors = np.array(asset.stored[::-1][:4])
    neighbors[..., 2] = rng.integers(0, 2, neighbors.shape[:3]) * rng.integers(1, 256, neighbors.shape[:3])
    transmission = rng.uniform(0, 1, (asset.height, asset.width, 3)).astype(np.float32)
    manifest = {**asset.manifest, BEHIND: {"file": f"{BEHIND}.png"}, THROUGH: f"{THROUGH}.exr"}
    tables = {**asset.tables, BEHIND: neighbors.reshape(-1, asset.width, 3)}
    return replace(asset, manifest=manifest, tables=tables, images={**asset.images, THROUGH: transmission})
