"""A made asset of lights inside a room with a partition, as it lies on disk; what its patches receive, by rays against every triangle."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from closed_forms import quad
from view_assets import scene_glb

from srbf.encode.quantization import quantize
from srbf.io.image import write_image
from srbf.stored_layers import layer_entries

LOW, HIGH = np.array([-2.0, -1.5, 0.0]), np.array([2.0, 1.5, 2.5])  # of the room, m
CELLS = 6  # per side of a wall
PATCHES = 24
GRID = 4  # points per side of an area light
OFFSET = 1e-4
PLACES = [(-1.2, 0.1, 1.2), (-0.8, -0.9, 0.7), (0.2, 0.0, 1.3), (1.1, 0.7, 1.6), (1.5, -1.0, 0.5)]


@dataclass(frozen=True, eq=False)
class Room:
    """`corners` (T, 3, 3) of what blocks light; cells (N); `values` (F, K, 3)."""

    manifest: dict[str, Any]
    files: dict[str, tuple[np.ndarray, str]]
    scene: bytes
    corners: np.ndarray
    cells: np.ndarray
    values: np.ndarray

    def write(self, folder: Path) -> None:
        """asset.json and its files."""
        folder.mkdir(parents=True)
        for name, (image, encoding) in self.files.items():
            write_image(folder / name, image, encoding)  # type: ignore[arg-type]
        (folder / "scene.glb").write_bytes(self.scene)
        (folder / "asset.json").write_text(json.dumps(self.manifest))

    def response(self, weights: np.ndarray) -> np.ndarray:
        """(H, W, 3), signed, of function weights (F, 3)."""
        scale, bias = (np.array([entry[key] for entry in self.manifest["planes"]], np.float32) for key in ("scale", "bias"))
        stored = np.stack([self.files[entry["file"]][0] for entry in self.manifest["planes"]]).astype(np.float32)
        layers = stored * scale[:, None, None] + bias[:, None, None]
        count = self.manifest["scalars"]
        components = layers.transpose(0, 3, 1, 2).reshape(-1, *layers.shape[1:3])[:count]
        factors = np.concatenate([np.ones((1, *components.shape[1:])), components])
        index = self.files["cluster_index.png"][0][..., 0]
        return np.einsum("jhw,hwjc->hwc", factors, weights.reshape(-1, count + 1, 3)[index])

    def weights(self, received: np.ndarray) -> np.ndarray:
        """(F, 3) under lights that lay irradiance (K, 3) on the patches."""
        return np.einsum("fkc,kc->fc", self.values, received)

    def irradiance(self, place: np.ndarray, strength: Any) -> np.ndarray:
        """(K,) patch means of cos times `strength(squared, unit vectors, least square of the distance)` where nothing stands between."""
        points, areas = self.cells[0, :, :3].astype(float), self.cells[0, :, 3].astype(float)
        normals, owners = self.cells[1, :, :3].astype(float), self.cells[1, :, 3].astype(int)
        lift = OFFSET * np.ptp(points, axis=0).max()
        amount = np.array([self._of_cell(np.asarray(place, float), *cell, strength) for cell in zip(points, normals, areas, strict=True)])
        amount[self.blocked(points + lift * normals, np.asarray(place))] = 0
        return np.bincount(owners, areas * amount, PATCHES) / np.bincount(owners, areas, PATCHES)

    @staticmethod
    def _of_cell(place: np.ndarray, point: np.ndarray, normal: np.ndarray, area: float, strength: Any) -> float:
        """The mean over a square, of its middle alone where that is more than eight sides away."""
        count = 4 if ((place - point) ** 2).sum() < 64 * area else 1
        across = np.linalg.svd(normal[None])[2][1:] if np.abs(normal).max() < 1 else np.eye(3)[normal == 0]
        steps = ((np.arange(count) + 0.5) / count - 0.5) * np.sqrt(area)
        vector = place - np.array([point + s * across[0] + t * across[1] for s in steps for t in steps])
        squared = (vector**2).sum(axis=1)
        unit = vector / np.sqrt(squared)[:, None]
        return float((np.maximum(unit @ normal, 0) * strength(squared, unit, area / count**2 / (2 * np.pi))).mean())

    def blocked(self, starts: np.ndarray, place: np.ndarray) -> np.ndarray:
        a, b, c = self.corners.astype(float).transpose(1, 0, 2)
        toward = (place - starts)[:, None]  # (N, 1, 3)
        edges = np.stack(
            [np.broadcast_to(-toward, (len(starts), *a.shape)), *(np.broadcast_to(x, (len(starts), *a.shape)) for x in (b - a, c - a))], -1
        )
        with np.errstate(all="ignore"):
            found = np.abs(np.linalg.det(edges)) > 1e-12
            edges[~found] = np.eye(3)
            t, u, v = np.linalg.solve(edges, (starts[:, None] - a)[..., None])[..., 0].transpose(2, 0, 1)
        return (found & (t >= 0) & (t <= 1) & (u >= 0) & (v >= 0) & (u + v <= 1)).any(axis=1)


def room(components: int = 6, clusters: int = 5, height: int = 9, width: int = 14, encoding: str = "half") -> Room:
    """Random components over the floor; an opaque partition with a gap, and a glass pane that hides nothing."""
    rng = np.random.default_rng(11)
    layers = rng.normal(size=(-(-components // 4), height, width, 4)).astype(np.float32)
    stored, scale, bias = quantize(layers, encoding)  # type: ignore[arg-type]
    scale[-1, components % 4 or 4 :], bias[-1, components % 4 or 4 :] = 0, 0
    values = rng.normal(size=(clusters * (components + 1), PATCHES, 3)).astype(np.float16).astype(np.float32)
    walls = np.concatenate([_wall(axis, side) for axis in range(3) for side in (0, 1)])
    partition = quad([0.5, -1.5, 0], [0.5, 0.4, 0], [0.5, 0.4, 2.5], [0.5, -1.5, 2.5])
    pane = quad([-0.5, -1.5, 0], [-0.5, 1.5, 0], [-0.5, 1.5, 2.5], [-0.5, -1.5, 2.5])
    plain: dict[str, Any] = {"doubleSided": True}
    glass = {**plain, "extras": {"tint_by_cosine": np.full((8, 3), 0.8).tolist()}}
    scene = scene_glb(("Walls", walls, plain), ("Partition", partition, plain), ("Pane", pane, glass))
    cells = _cells(rng)
    a, b, _ = HIGH
    position = np.zeros((height, width, 3), np.float32)
    position[..., 0] = a * (2 * (np.arange(width) + 0.5) / width - 1)
    position[..., 1] = b * (1 - 2 * (np.arange(height) + 0.5) / height)[:, None]
    normal = np.zeros_like(position)
    normal[..., 2] = 1
    manifest = {
        **{"format": "srbf-asset", "version": 1, "method": "light-cloud", "quantity": "irradiance", "transport": "indirect"},
        **{"width": width, "height": height, "row_origin": "top", "axes": "z-up-right-handed", "asset_from_world": np.eye(4).tolist()},
        **{"light_domain": "cloud", "free_places": PLACES, "scene": "scene.glb", "direct": {"sun_angle": 0.0, "footprint": 1.0}},
        **{
            "position": "position.exr",
            "normal": "normal.exr",
            "coverage": "coverage.exr",
            "scalars": components,
            "clusters": clusters,
            "cluster_zone": [0] * clusters,
        },
        **{"cluster_index": {"file": "cluster_index.png"}, "cells": {"file": "cells.exr"}, "interpolation": {"kind": "patches"}},
        **{
            "light_values": {"file": "light_values.exr", "lights": PATCHES, "scale": 1.0},
            "receiver": {"kind": "lightmap", "object": "Floor"},
        },
        "planes": layer_entries("plane", encoding, scale, bias),  # type: ignore[arg-type]
    }
    files = {
        "light_values.exr": (values, "half"),
        "cells.exr": (cells, "float"),
        "cluster_index.png": (rng.integers(0, clusters, (height, width, 1)).astype(np.uint8), "uint8"),
        "position.exr": (position, "float"),
        "normal.exr": (normal, "float"),
        "coverage.exr": (np.ones((height, width, 1), np.float32), "float"),
        **{f"plane_{i:02d}.{'png' if encoding == 'uint8' else 'exr'}": (layer, encoding) for i, layer in enumerate(stored)},
    }
    return Room(manifest, files, scene, np.concatenate([walls, partition]), cells, values)


def with_transfer(made: Room, rank: int = 4) -> Room:
    """The room as an asset of the method transfer: its table over `rank` shapes, and their weights from the light on the patches."""
    rng = np.random.default_rng(12)
    matrix = rng.normal(size=(rank, PATCHES, 3)).astype(np.float16).astype(np.float32)
    values = rng.normal(size=(len(made.values), rank, 3)).astype(np.float16).astype(np.float32)
    files = {**made.files, "light_values.exr": (values[..., :1], "half"), "transfer.exr": (matrix, "half")}
    manifest = {
        **made.manifest,
        "method": "transfer",
        "light_domain": "surfels",
        "interpolation": {"kind": "surfels"},
        "light_values": {"file": "light_values.exr", "lights": rank, "scale": 1.0},
        "surfel_transfer": {"file": "transfer.exr", "rank": rank, "surfels": PATCHES, "scale": 2.0},
    }
    return replace(made, manifest=manifest, files=files, values=2 * np.einsum("fr,rkc->fkc", values[..., 0], matrix))


@dataclass(frozen=True, eq=False)
class Table:
    """A made position table: `nodes` (nz, ny, nx, R), `basis` (R, F, 3), `seen` (fz, fy, fx, 8) bytes."""

    origin: np.ndarray
    spacing: float
    fine: int
    nodes: np.ndarray
    basis: np.ndarray
    seen: np.ndarray

    def weights(self, place: np.ndarray) -> np.ndarray:
        """(F, 3) of a white light at `place` (m) of irradiance 1 at 1 m."""
        counts = np.array(self.nodes.shape[2::-1])
        at = np.clip((np.asarray(place) - self.origin) / self.spacing, 0, counts - 1)
        cell = np.minimum(np.floor(at).astype(int), counts - 2)
        fine = np.clip(at * self.fine - 0.5, self.fine * cell, self.fine * (cell + 1) - 1)
        visible = np.zeros(8)
        for shift in np.ndindex(2, 2, 2):
            low = np.floor(fine).astype(int)
            spot = np.minimum(low + shift, self.fine * (cell + 1) - 1)
            share = np.prod(np.where(shift, fine - low, 1 - (fine - low)))
            visible += share * self.seen[spot[2], spot[1], spot[0]] / 255
        part = at - cell
        corners = [(c & 1, c >> 1 & 1, c >> 2) for c in range(8)]
        shares = np.array([np.prod(np.where(corner, part, 1 - part)) for corner in corners])
        total = (shares * visible).sum()
        shares = shares * visible / total if total >= 1e-4 else shares
        mixed = sum(share * self.nodes[tuple((cell + corner)[::-1])] for share, corner in zip(shares, corners, strict=True))
        return np.einsum("r,rfc->fc", mixed, self.basis)


def with_table(made: Room, rays: bool = True) -> tuple[Room, Table]:
    """The same room with a random position table; without cells and scene unless `rays`."""
    rng = np.random.default_rng(5)
    counts, rank, fine = (4, 3, 5), 7, 2
    basis = rng.normal(size=(rank, len(made.values), 3)).astype(np.float16)
    cells = [fine * (n - 1) for n in counts]
    seen = (255 * rng.random((cells[2], cells[1], cells[0], 8)) * (rng.random((cells[2], cells[1], cells[0], 8)) > 0.3)).astype(np.uint8)
    seen[:fine, :fine, :fine] = 0  # of a cell from which no corner is seen
    table = Table(LOW + 0.1, 0.9, fine, rng.normal(size=(*counts[::-1], rank)).astype(np.float32), basis.astype(np.float32), seen)
    entry = {"origin": table.origin.tolist(), "spacing": 0.9, "nodes": counts, "fine": fine, "rank": rank, "error": 0.0}
    manifest = {**made.manifest, "position_table": entry}
    manifest |= {f"position_{name}": {"file": f"position_{name}.exr"} for name in ("nodes", "basis")}
    manifest["position_visibility"] = {"file": "position_visibility.png"}
    if not rays:
        del manifest["cells"], manifest["scene"]
    files = {
        **made.files,
        "position_nodes.exr": (table.nodes.reshape(-1, rank, 1), "float"),
        "position_basis.exr": (basis, "half"),
        "position_visibility.png": (seen.reshape(cells[2] * cells[1], cells[0] * 8, 1), "uint8"),
    }
    return Room(manifest, files, made.scene, made.corners, made.cells, made.values), table


def _wall(axis: int, side: int) -> np.ndarray:
    """Two triangles of the room's box."""
    at = (LOW, HIGH)[side][axis]
    b, c = [other for other in range(3) if other != axis]
    corners = np.zeros((4, 3))
    corners[:, axis] = at
    corners[:, b] = [LOW[b], HIGH[b], HIGH[b], LOW[b]]
    corners[:, c] = [LOW[c], LOW[c], HIGH[c], HIGH[c]]
    return quad(*corners.tolist())


def _cells(rng: np.random.Generator) -> np.ndarray:
    """(2, N, 4): a jittered grid on every wall, inward normals, patches at random."""
    places, normals, areas = [], [], []
    for axis in range(3):
        b, c = [other for other in range(3) if other != axis]
        for side in (0, 1):
            u, v = np.meshgrid(np.arange(CELLS), np.arange(CELLS))
            share = (np.stack([u, v], -1).reshape(-1, 2) + rng.uniform(0.3, 0.7, (CELLS**2, 2))) / CELLS
            point = np.zeros((CELLS**2, 3))
            point[:, axis] = (LOW, HIGH)[side][axis]
            point[:, [b, c]] = LOW[[b, c]] + share * (HIGH - LOW)[[b, c]]
            normal = np.zeros((CELLS**2, 3))
            normal[:, axis] = 1 - 2 * side
            places.append(point)
            normals.append(normal)
            areas.append(np.full(CELLS**2, np.prod((HIGH - LOW)[[b, c]]) / CELLS**2))
    owners = np.concatenate([np.arange(PATCHES), rng.integers(0, PATCHES, 6 * CELLS**2 - PATCHES)])
    first = np.concatenate([np.concatenate(places), np.concatenate(areas)[:, None]], axis=1)
    second = np.concatenate([np.concatenate(normals), owners[:, None]], axis=1)
    return np.stack([first, second]).astype(np.float32)
