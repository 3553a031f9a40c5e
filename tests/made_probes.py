"""Probes in a made room, a thin wall between some of them, and nodes that have no probe of their own; and their light for shaders."""

from __future__ import annotations

import numpy as np
import pytest

from srbf.probe_grid import ProbeGrid
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.probe_nearness import nearness_atlas

LOST = 0.1  # of the nodes have no probe


def grid_in(low: np.ndarray, high: np.ndarray, corners: np.ndarray, spacing: float = 0.8, off: float = 0.1) -> ProbeGrid:
    """Nodes from `off` (m) inside the box on, moved a little, among opaque triangles (T, 3, 3)."""
    pytest.importorskip("embreex")
    rng = np.random.default_rng(51)
    counts = np.ceil((high - low - 2 * off) / spacing).astype(int) + 1
    z, y, x = np.meshgrid(*(np.arange(count) for count in counts[::-1]), indexing="ij")
    nodes = low + off + spacing * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    places = np.clip(nodes + rng.uniform(-0.05, 0.05, nodes.shape), low + 0.06, high - 0.06).astype(np.float32)
    valid = rng.random(len(nodes)) > LOST
    apart = np.linalg.norm(nodes[:, None] - nodes[valid], axis=2)
    sources = np.flatnonzero(valid)[apart.argmin(axis=1)]
    nearness = nearness_atlas(EmbreeTriangles(corners.astype(np.float32)), places, sources)
    x0, y0, z0 = (float(value) for value in low + off)
    return ProbeGrid((x0, y0, z0), spacing, (int(counts[0]), int(counts[1]), int(counts[2])), places[sources], sources, nearness)


def packed(grid: ProbeGrid, radiance: np.ndarray) -> np.ndarray:
    """(YZ, 7 X, 4): nine RGB harmonics (N, 9, 3) of every node in seven texels."""
    return grid.image(np.pad(radiance.reshape(grid.count, 27), ((0, 0), (0, 1))).reshape(grid.count, 7, 4))
