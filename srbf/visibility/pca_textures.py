"""Compressed depths as the textures that `glsl/shadow/pca_depth.glsl` reads: four numbers per texel."""

from __future__ import annotations

import numpy as np
from numpy import ndarray

from srbf.arrays import Float32
from srbf.visibility.pca_visibility import PcaVisibility

WIDTH = 2048  # texels of the texture of coefficients, which every GPU has


def pca_textures(visibility: PcaVisibility) -> tuple[Float32[ndarray, "h w 4"], Float32[ndarray, "k D 4"], int]:
    """(coefficients, bases, groups: texels per point).

    A point's coefficients, after a 1 for the mean, follow those of the point before, in rows of WIDTH texels or fewer; the bases have a row
    per cluster and group, and a column per texel of the map.
    """
    own = visibility.decoded_coefficients
    bases = visibility.decoded_bases
    clusters, depths, numbers = bases.shape
    groups = -(-numbers // 4)
    padding = 4 * groups - numbers
    own = np.pad(own, ((0, 0), (0, padding))).reshape(-1, 4)
    width = min(WIDTH, len(own))
    rows = -(-len(own) // width)
    coefficients = np.pad(own, ((0, rows * width - len(own)), (0, 0))).reshape(rows, width, 4)
    stacked = np.pad(bases, ((0, 0), (0, 0), (0, padding))).reshape(clusters, depths, groups, 4).transpose(0, 2, 1, 3)
    return coefficients, np.ascontiguousarray(stacked.reshape(clusters * groups, depths, 4)), groups
