"""How far a probe sees around itself, by rays."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float16, Int
from srbf.probe_grid import TILE
from srbf.sphere import octahedral_decode
from srbf.visibility.embree import EmbreeTriangles

RAYS = 8  # per node of a tile
PROBES = 256  # traced at a time
NEAREST = 1e-4  # m


def nearness_atlas(
    triangles: EmbreeTriangles, places: Float[ndarray, "N 3"], sources: Int[ndarray, " N"], seed: int = 0
) -> Float16[ndarray, "rows columns 1"]:
    """Means of 1 / distance (1/m) to surfaces around each node of every probe's octahedral tile; 0 where there are none.

    Tiles lie in rows as of `octahedral_table`. Probes with another's light, see `ProbeGrid`, have an empty one.
    """
    count = len(places)
    columns = int(np.ceil(np.sqrt(count)))
    rows = -(-count // columns)
    tiles = np.zeros((rows * columns, TILE * TILE), np.float16)
    rng = np.random.default_rng(seed)
    line = np.linspace(-1, 1, TILE)
    u, v = (part.ravel()[:, None] for part in np.meshgrid(line, line))
    valid = np.flatnonzero(sources == np.arange(count))
    for start in range(0, len(valid), PROBES):
        chosen = valid[start : start + PROBES]
        shift = (rng.random((2, len(u), RAYS)) - 0.5) * (2 / (TILE - 1))
        way = octahedral_decode(np.clip(u + shift[0], -1, 1), np.clip(v + shift[1], -1, 1)).reshape(-1, 3)
        origin = np.repeat(np.asarray(places)[chosen], len(way), axis=0)
        hit, distance, _ = triangles.first_hit(origin, np.tile(way, (len(chosen), 1)))
        nearness = np.where(hit >= 0, 1 / np.maximum(distance, NEAREST), 0)
        tiles[chosen] = nearness.reshape(len(chosen), len(u), RAYS).mean(axis=2)
    atlas = tiles.reshape(rows, columns, TILE, TILE, 1).transpose(0, 2, 1, 3, 4)
    return np.ascontiguousarray(atlas.reshape(rows * TILE, columns * TILE, 1))
