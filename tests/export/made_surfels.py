"""A transfer asset of random tables in two rooms with a door between them, and lights for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from closed_forms import glb
from made_assets import build_planes
from made_rooms import Room
from made_tables import in_a_room

from srbf.asset import Asset
from srbf.light_geometry import environment_samples
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight
from srbf.methods import method_of
from srbf.methods.surface_changes import Surfaces
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells

ROOMS = Room.box((4, 3, 2.5), 0.5, 0.6, (2.0, 1.0, 3.0))
WALL, DOOR = 1.0, (0.2, 2.2)  # x of the wall; y where it ends, and of the room's, as shifted
SHIFT = np.array([-1.0, -0.8, 0.0], np.float32)  # of `in_a_room`
RANK, PATCHES = 17, 90
RADIUS = 0.9  # spectral, of the exchange of light: a bright room, of whose series 64 terms leave out 0.1 %
SIDE = 6  # cells of an environment
_TEXELS = environment_samples(np.zeros((96, 192, 3), np.float32), "sphere", np.eye(3))[0]
PANORAMA = np.exp(_TEXELS @ np.random.default_rng(19).normal(size=(3, 3))).astype(np.float32)  # another in every direction
LIGHTS: dict[str, Light] = {
    "point": PointLight((-0.29, -0.12, 1.33), (1.0, 0.5, 2.0), falloff="inverse-square"),
    "close": PointLight((-0.87, 1.25, 0.85), (0.5, 1.0, 0.7), a0=0.6),
    "spot": SpotLight(
        (-0.4, 0.3, 1.4), (2.0, 1.5, 1.0), falloff="inverse-square", direction=(0.8, -0.36, -0.48), inner=0.3, outer=0.8
    ),
    "directional": DirectionalLight((-0.48, 0.36, 0.8), (1.0, 0.8, 0.6)),
}  # fmt: skip


def made_asset(bounces: int | None = None) -> Asset:
    """The ceiling casts no shadow, so that directional lights get in; `bounces` of surfaces that change."""
    rng = np.random.default_rng(11)
    base = build_planes(6, 5, "half", 9, 14, ambient=True, patches=True)
    dropped = ("basis", "domain", "light_basis", "w_table")
    manifest = {key: value for key, value in base.manifest.items() if key not in dropped} | {"method": "transfer"}
    bare = replace(base, manifest=manifest, tables={"cluster_index": base.tables["cluster_index"]})
    asset = in_a_room(bare, rng, ROOMS, PATCHES)
    count = Cells.of_image(asset.tables["cells"]).patch_count
    functions = len(asset.tables["light_values"])
    asset.manifest |= {"light_domain": "surfels", "interpolation": {"kind": "surfels"}}
    asset.tables["light_values"] = rng.normal(size=(functions, RANK, 1)).astype(np.float16)
    asset.manifest["light_values"] = {"file": "light_values.exr", "lights": RANK, "scale": 0.5, "channels": 1}
    asset.tables["surfel_transfer"] = rng.normal(size=(RANK, count, 3)).astype(np.float16)
    asset.manifest["surfel_transfer"] = {"file": "transfer.exr", "rank": RANK, "surfels": count, "scale": 0.125}
    gather, sent = rng.normal(size=(2, RANK, count)).astype(np.float32) * np.array([[[0.1]], [[1 / count]]], np.float32)
    shares = np.stack([np.arange(count) % 2, 1 - np.arange(count) % 2]).astype(np.float32)
    feedback = np.stack([_of_radius(rng.normal(size=(RANK, RANK))) for _ in range(3)], axis=2)
    albedo, emission = np.full((count, 3), 0.5, np.float32), np.repeat((np.float32(np.pi) * gather @ shares.T)[:, :, None], 3, axis=2)
    Surfaces(gather, sent, feedback, shares, albedo, ("Walls", "Screen"), bounces, emission).add_to(asset)
    cells = np.flatnonzero(rng.random(SIDE**2) < 0.3)
    asset.tables["environment_transfer"] = rng.normal(size=(RANK, len(cells), 3)).astype(np.float16)
    entry = {"file": "environment_transfer.exr", "rank": RANK, "side": SIDE, "cells": cells.tolist(), "scale": 0.5}
    asset.manifest["environment_transfer"] = entry
    low = (ROOMS.corners[:, :, 2] < 2.4).any(axis=1)
    assert (~low).sum() == 2
    return replace(asset, scene=glb(ROOMS.corners[low] + SHIFT))


def table_of(asset: Asset) -> np.ndarray:
    """(r, S, 3): from irradiance on surfels to weights of shapes."""
    return asset.tables["surfel_transfer"].astype(np.float64) * asset.manifest["surfel_transfer"]["scale"]


def recolored(asset: Asset, albedo: Mapping[str, tuple[float, float, float]]) -> np.ndarray:
    """(S, 2, 3): the albedo of surfels now, and that of the bake."""
    surfaces = Surfaces.of(asset)
    return np.stack([surfaces.repainted(albedo)[0].albedo, surfaces.albedo], axis=1)


def residual(exchange: np.ndarray, series: np.ndarray) -> np.ndarray:
    """(3, r, r): (1 - F) S - 1 of drawn images, which is -F^n where S is the sum of n powers of F."""
    f, s = (np.moveaxis(image[..., :3].astype(np.float64), 2, 0) for image in (exchange, series))
    return s - f @ s - np.eye(RANK)


def _of_radius(matrix: np.ndarray) -> np.ndarray:
    return (RADIUS / np.abs(np.linalg.eigvals(matrix)).max() * matrix).astype(np.float32)


def irradiance_of(asset: Asset, light: Light) -> np.ndarray:
    """(N, 3) on the cells, by rays."""
    cells = Cells.of_image(asset.tables["cells"])
    return ReceivedLight(cells, CloudLights.of_asset(asset).occluders).irradiance(light)


def weights_of(asset: Asset, lights: list[Light]) -> np.ndarray:
    """(C, S + 1, 3)."""
    return method_of(asset).projected_weights(asset, lights).reshape(asset.clusters, asset.components + 1, 3)
