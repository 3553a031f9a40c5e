"""A made asset of probes in the room of `cloud_assets`, as it lies on disk."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from cloud_assets import HIGH, LOW, Room, room, with_table, with_transfer
from made_probes import grid_in

from srbf.probe_grid import ProbeGrid


def probes_of_room() -> tuple[Room, ProbeGrid]:
    """Random components over the facets of probes in a room with a partition; write it by `write_probes`."""
    walls = room()
    grid = grid_in(LOW, HIGH, walls.corners)
    width, height = grid.image_size
    made = with_table(with_transfer(room(components=3, clusters=2, height=height, width=width)))[0]
    return replace(made, manifest={**made.manifest, "receiver": grid.described()}), grid


def write_probes(made: Room, grid: ProbeGrid, folder: Path) -> None:
    """asset.json and its files."""
    made.write(folder)
    grid.write(folder)


def places_in(grid: ProbeGrid, count: int = 300, near: float = 0.03) -> tuple[np.ndarray, np.ndarray]:
    """(points, unit normals) all over the room; a third of them `near` (m) the partition and the walls, on either side."""
    rng = np.random.default_rng(61)
    points = rng.uniform(LOW, HIGH, (count, 3))
    third = count // 3
    points[:third, 0] = 0.5 + near * rng.choice([-1, 1], third)
    points[third : third + 20, 1] = LOW[1] + near
    points[third + 20 : third + 40, 2] = HIGH[2] + near  # outside
    normals = rng.normal(size=(count, 3))
    return points, normals / np.linalg.norm(normals, axis=1)[:, None]
