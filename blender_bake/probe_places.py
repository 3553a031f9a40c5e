# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the probes of a grid are: at its nodes in free space, moved off surfaces that are near."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from blender_bake.free_places import FreeSpace, even_directions
from blender_bake.ipc import WorkerError

PROBES = 2500  # in free space, about, unless a spacing is given
MOST_PROBES = 20_000  # nodes of the grid
CLEARANCES = (0.2, 0.05)  # of the spacing, off all surfaces: the first where there is room for it
STEPS = (0.2, 0.35, 0.5)  # of the spacing: how far a probe may move
WAYS = 26
SURVEYED = 4  # stream of random numbers, one that free places do not use


def places(scene: bpy.types.Scene, asked: dict[str, Any]) -> dict[str, Any]:
    """{origin, spacing, counts, places (N, 3), valid (N,), moved}: the nodes of a grid over all that renders, x running fastest.

    asked: `spacing` (m), or null for about 2500 nodes in free space; `seed`. The grid is centered in the box of all that renders. A
    node that is not free, or too close to a surface, is moved by half a spacing at most; one for which that does not help is not valid.
    WorkerError where no node is, and for more than 20000 nodes.
    """
    space = FreeSpace(scene, None, asked["seed"])
    size = space.high - space.low
    spacing = asked["spacing"]
    if spacing is None:
        space.random(SURVEYED, 1, 0.0)
        share = max(space.free, 1) / max(space.tried, 1)
        spacing = _rounded((space.volume * share / PROBES) ** (1 / 3) or float(size.max()) / PROBES ** (1 / 2))
    counts = np.floor(size / spacing + 1e-6) + 1
    if counts.prod() > MOST_PROBES:
        more = _rounded(1.05 * spacing * (counts.prod() / MOST_PROBES) ** (1 / 3))
        raise WorkerError(
            f"expected at most {MOST_PROBES} probes, found {counts.prod():.0f} at a spacing of {spacing:g} m in a scene of "
            f"{size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} m; use a larger one, such as probes:{more:g}"
        )
    origin = (space.low + space.high) / 2 - (counts - 1) / 2 * spacing
    z, y, x = np.meshgrid(*(np.arange(count) for count in counts[::-1]), indexing="ij")
    nodes = origin + spacing * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    where, valid = nodes.copy(), space.are_free(nodes, CLEARANCES[0] * spacing)
    moved = 0
    for i in np.flatnonzero(~valid):
        found = _moved(space, nodes[i], spacing)
        if found is not None:
            where[i], valid[i] = found, True
            moved += 1
    if not valid.any():
        raise WorkerError(
            f"expected room for probes {spacing:g} m apart, found all {len(nodes)} in or near geometry, or outside of the building; "
            "use a smaller spacing, or turn the normals of a closed room inwards"
        )
    return {
        "origin": origin.tolist(),
        "spacing": float(spacing),
        "counts": counts.astype(int).tolist(),
        "places": where.astype(np.float32),
        "valid": valid,
        "moved": moved,
    }


def _moved(space: FreeSpace, node: np.ndarray, spacing: float) -> np.ndarray | None:
    """The first free place around a node, nearest first, on the way off the nearest surface before others; None without one."""
    near = space.nearest(node, STEPS[-1] * spacing)
    if near is None:  # all that is within reach is as the node is
        return None
    off = node - near
    length = float(np.linalg.norm(off))
    ways = [] if length < 1e-9 else [off / length, -off / length]
    ways += [np.array(way) for way in even_directions(WAYS)]
    for clearance in CLEARANCES:
        if space.are_free(node[None], clearance * spacing)[0]:
            return node
        for step in STEPS:
            around = node + step * spacing * np.array(ways)
            free = space.are_free(around, clearance * spacing)
            if free.any():
                return around[free.argmax()]
    return None


def _rounded(value: float) -> float:
    """To two digits."""
    return float(f"{value:.2g}") if math.isfinite(value) and value > 0 else 1.0
