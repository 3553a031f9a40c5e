"""Small assets of named lights and of a light cloud, made in memory, and the weights that engines make without rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from closed_forms import glb
from made_assets import build_asset, build_planes
from made_rooms import Room

from srbf.asset import Asset
from srbf.encode.position_table import FINE, PositionTable
from srbf.lights import NamedLight, PointLight, SpotLight
from srbf.methods import method_of
from srbf.visibility.surface_cells import Cells

NAMES = ("Desk", "Window", "TV", 'L\'été, "x"')
MIX = [NamedLight(NAMES[0], (0.5, 0.4, 0.3)), NamedLight(NAMES[2], (0.0, 2.0, 1.5)), NamedLight(NAMES[3])]
KINDS = ("named-maps", "light-mix", "light-mix, one cluster", "light-cloud", "light-cloud, one cluster")
INSIDE = [
    PointLight((0.42, 0.21, 1.31), (1.0, 0.5, 2.0), falloff="inverse-square"),
    PointLight((-0.4, -0.55, 0.13), (0.7, 0.9, 0.3), a0=0.8, falloff="inverse-square"),
    SpotLight(
        (0.1, 0.3, 0.9), (0.5, 1.0, 2.0), a0=1.2, falloff="inverse-square", direction=(0.1, 0.2, -1.0), inner=0.4, outer=0.7
    ),
]  # fmt: skip


def made(kind: str, encoding: Any = "half", *, ambient: bool = True, height: int = 9, width: int = 14) -> Asset:
    """An asset of one of KINDS; nothing in it is symmetric."""
    rng = np.random.default_rng(len(kind))
    method = kind.split(",")[0]
    if method == "named-maps":
        base = build_asset(len(NAMES), encoding, height, width, ambient=ambient)
    else:
        base = build_planes(6, None if "one" in kind else 5, encoding, height, width, ambient=ambient, patches=True)
    dropped = ("basis", "domain", "light_basis", "w_table")
    manifest = {key: value for key, value in base.manifest.items() if key not in dropped} | {"method": method}
    tables = {key: table for key, table in base.tables.items() if key == "cluster_index"}
    if method == "light-cloud":
        return in_a_room(replace(base, manifest=manifest, tables=tables), rng)
    manifest |= {"light_domain": "named", "lights": [{"name": name, "objects": [name]} for name in NAMES]}
    if method == "light-mix":
        manifest |= {"cluster_zone": [0] * base.clusters}
        _add_values(manifest, tables, base, len(NAMES), rng)
    return replace(base, manifest=manifest, tables=tables)


def _add_values(manifest: dict[str, Any], tables: dict[str, np.ndarray], base: Asset, lights: int, rng: np.random.Generator) -> None:
    tables["light_values"] = rng.normal(size=(base.clusters * (base.components + 1), lights, 3)).astype(np.float16)
    manifest["light_values"] = {"file": "light_values.exr", "lights": lights, "scale": 0.5}


SMALL = Room.box((2.2, 1.6, 1.5), 0.5)


def in_a_room(base: Asset, rng: np.random.Generator, room: Room = SMALL, patches: int = 6) -> Asset:
    """A light cloud of random tables, its cells those of a room."""
    shift = np.array([-1.0, -0.8, 0.0])
    labels = room.patches(patches)
    cells = Cells(
        (room.places + shift).astype(np.float32), room.normals.astype(np.float32), room.areas.astype(np.float32),
        room.albedo.astype(np.float32), labels,
    )  # fmt: skip
    tables = {**base.tables, "cells": cells.image()}
    manifest = base.manifest | {
        "light_domain": "cloud",
        "free_places": (room.free[:40] + shift).tolist(),
        "interpolation": {"kind": "patches"},
        "cluster_zone": [0] * base.clusters,
        "transport": "indirect",
        "cells": {"file": "cells.exr"},
    }
    _add_values(manifest, tables, base, int(labels.max()) + 1, rng)
    counts, rank, functions = (4, 3, 3), 7, len(tables["light_values"])
    seen = np.where(rng.random((FINE * 2 * FINE * 2, 8 * FINE * 3)) < 0.3, 0, 255).astype(np.uint8)
    places = PositionTable(
        np.array([-0.9, -0.7, 0.1]), 0.62, counts, rng.normal(size=(36, rank)).astype(np.float32),
        (rng.normal(size=(rank, functions, 3)) / rank).astype(np.float16), seen,
    )  # fmt: skip
    manifest |= places.manifest()
    return replace(base, manifest=manifest, tables=tables | places.tables(), scene=glb(room.corners + shift.astype(np.float32)))


def share_of(light: PointLight) -> float:
    """The share of a point light's flux that a spot sends out: 1, or that inside its cone, whose smooth step lets half through."""
    if not isinstance(light, SpotLight):
        return 1.0
    return float((1 - np.cos(light.inner)) + (1 - np.cos(light.outer))) / 4


def by_places(asset: Asset, lights: Sequence[PointLight]) -> np.ndarray:
    """(F, 3) weights by the table of places alone; lights of the asset's frame."""
    table = PositionTable.of(asset.manifest, asset.tables)
    found = [table.evaluate(np.array(light.position)) * (np.array(light.color) * light.a0**2 * share_of(light)) for light in lights]
    return np.sum(found, axis=0)


def linear(asset: Asset, weights: np.ndarray) -> np.ndarray:
    """(H, W, 3) before the clamp and ambient light."""
    if asset.method == "named-maps":
        return np.einsum("nhwc,nc->hwc", asset.coefficients(), weights)
    return method_of(asset).weighted(asset, weights[None])[0]  # type: ignore[attr-defined]


def size_of_terms(asset: Asset, weights: np.ndarray) -> np.ndarray:
    """(H, W, 3) sum of the terms' magnitudes, decoding included: what the tolerance is relative to."""
    bias = np.abs(asset.bias[:, None, None])
    layers = np.abs(asset.coefficients()) + 2 * bias
    bounded = replace(asset, stored=layers.astype(np.float32), scale=np.ones_like(asset.scale), bias=np.zeros_like(asset.bias))
    return linear(bounded, np.abs(weights))
