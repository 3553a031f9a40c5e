"""How far a probe sees around itself, by rays: mean and spread of the distance to surfaces in every direction."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float16, Int
from srbf.probe_grid import DEPTH_SIZE
from srbf.sphere import octahedral_decode
from srbf.visibility.embree import EmbreeTriangles

RAYS = 8  # per node of a tile
FARTHEST = 4.0  # spacings: beyond, no place mixes a probe in
PROBES = 256  # traced at a time


def depth_atlas(
    triangles: EmbreeTriangles, places: Float[ndarray, "N 3"], sources: Int[ndarray, " N"], spacing: float, seed: int = 0
) -> Float16[ndarray, "rows columns 2"]:
    """(mean, standard deviation) of the distances (m) around each node of every probe's octahedral tile.

    Tiles lie in rows as of `octahedral_table`. Probes with another's light, see `ProbeGrid`, have an empty one.
    """
    count = len(places)
    columns = int(np.ceil(np.sqrt(count)))
    rows = -(-count // columns)
    tiles = np.zeros((rows * columns, DEPTH_SIZE * DEPTH_SIZE, 2), np.float16)
    rng = np.random.default_rng(seed)
    line = np.linspace(-1, 1, DEPTH_SIZE)
    u, v = (part.ravel()[:, None] for part in np.meshgrid(line, line))
    valid = np.flatnonzero(sources == np.arange(count))
    for start in range(0, len(valid), PROBES):
        chosen = valid[start : start + PROBES]
        shift = (rng.random((2, len(u), RAYS)) - 0.5) * (2 / (DEPTH_SIZE - 1))
        way = octahedral_decode(np.clip(u + shift[0], -1, 1), np.clip(v + shift[1], -1, 1)).reshape(-1, 3)
        origin = np.repeat(np.asarray(places)[chosen], len(way), axis=0)
        _, distance, _ = triangles.first_hit(origin, np.tile(way, (len(chosen), 1)))
        distance = np.minimum(distance, FARTHEST * spacing).reshape(len(chosen), len(u), RAYS)
        tiles[chosen] = np.stack([distance.mean(axis=2), distance.std(axis=2)], axis=2)
    atlas = tiles.reshape(rows, columns, DEPTH_SIZE, DEPTH_SIZE, 2).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(atlas.reshape(rows * DEPTH_SIZE, columns * DEPTH_SIZE, 2))
