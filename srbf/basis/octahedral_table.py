"""Light functions as small octahedral tables, for point lights, whose direction differs per receiver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float16, Float32, Float64, Int
from srbf.basis.light_functions import LightFunctions
from srbf.sphere import Domain, all_around, octahedral_decode, octahedral_encode

SIZES = (17, 33, 65, 129)
TABLE_ERROR = 2.0**-5  # rms of the interpolation error over the rms of the functions: 30 dB, where captures reach 20 to 35
TABLE_BYTES = 32 << 20  # largest size of a table, as RGBA halves
PROBES, PROBED = 4096, 64  # directions, and functions, used to measure the error
NODE_BATCH = 512


def table_directions(size: int) -> Float64[ndarray, "n n 3"]:
    """The unit direction of every node: row i, column j at octahedral coordinates -1 + 2 j / (n - 1), -1 + 2 i / (n - 1).

    Border nodes across a fold share their direction, so interpolation needs no neighbor outside the tile.
    """
    line = np.linspace(-1, 1, size)
    return octahedral_decode(*np.meshgrid(line, line))


@dataclass(frozen=True, eq=False)
class OctahedralTable:
    """F functions in one atlas: tile f, size x size nodes, has its top-left texel at row (f div columns) size, column (f mod columns) size.

    `error`: rms of the interpolated table minus the functions, over the rms of the functions.
    """

    atlas: Float16[ndarray, "rows columns 3"]
    size: int
    columns: int
    error: float


def octahedral_table(functions: LightFunctions, domain: Domain, sizes: tuple[int, ...] = SIZES) -> OctahedralTable:
    """The smallest of `sizes` whose interpolated table is within TABLE_ERROR of the functions over the domain, or the largest within
    TABLE_BYTES."""
    count = len(functions.spreads)
    some = np.unique(np.linspace(0, count - 1, min(PROBED, count)).astype(np.int64))
    probed = LightFunctions(functions.centers, functions.spreads[some], functions.coefficients[some])
    probes = all_around(domain, PROBES)
    exact = probed.evaluate(probes)
    scale = max(float(np.sqrt((exact**2).mean())), 1e-30)
    fitting = [size for size in sizes if count * size * size * 8 <= TABLE_BYTES] or [sizes[0]]
    for size in fitting:
        atlas, columns = _atlas(probed, size)
        mixed = np.stack([lookup(atlas, size, columns, np.full(len(probes), f), probes) for f in range(len(some))], axis=1)
        error = float(np.sqrt(((mixed - exact) ** 2).mean())) / scale
        if error <= TABLE_ERROR:
            break
    atlas, columns = _atlas(functions, size)
    return OctahedralTable(atlas, size, columns, error)


def lookup(
    atlas: Float[ndarray, "rows columns C"], size: int, columns: int, function: Int[ndarray, "*p"], directions: Float[ndarray, "*p 3"]
) -> Float32[ndarray, "*p C"]:
    """Function `function` at unit directions by four fetches and a mix, as in the shaders."""
    u, v = octahedral_encode(directions)
    x, y = (u + 1) * (0.5 * (size - 1)), (v + 1) * (0.5 * (size - 1))
    j, i = (np.clip(t.astype(np.int64), 0, size - 2) for t in (x, y))
    s, t = (x - j).astype(np.float32)[..., None], (y - i).astype(np.float32)[..., None]
    node = (function // columns * size + i) * atlas.shape[1] + function % columns * size + j
    flat = atlas.reshape(-1, atlas.shape[2])
    top = flat[node] * (1 - s) + flat[node + 1] * s
    bottom = flat[node + atlas.shape[1]] * (1 - s) + flat[node + atlas.shape[1] + 1] * s
    return top * (1 - t) + bottom * t


def _atlas(functions: LightFunctions, size: int) -> tuple[np.ndarray, int]:
    count = len(functions.spreads)
    columns = int(np.ceil(np.sqrt(count)))
    rows = -(-count // columns)
    nodes = table_directions(size).reshape(-1, 3)
    tiles = np.zeros((rows * columns, size * size, 3), np.float16)
    for start in range(0, len(nodes), NODE_BATCH):
        part = slice(start, start + NODE_BATCH)
        tiles[:count, part] = functions.evaluate(nodes[part]).transpose(1, 0, 2)
    atlas = tiles.reshape(rows, columns, size, size, 3).transpose(0, 2, 1, 3, 4).reshape(rows * size, columns * size, 3)
    return np.ascontiguousarray(atlas), columns
