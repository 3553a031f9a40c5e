# SPDX-License-Identifier: GPL-3.0-or-later
"""World normals of objects whose transform scales unevenly, shears, mirrors or flattens them."""

from __future__ import annotations

import bpy
import numpy as np

FLAT = 1e-5  # smallest singular value of a matrix over its largest, below which float32 has lost what the matrix flattens


def of_mesh(normals: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(n, 3) unit normals in the world of a mesh's own (n, 3), moved by `matrix` (3, 3).

    By its cofactors, which are det(M) M^-T and exist where M has no inverse; outward stays outward where M mirrors.
    """
    x, y, z = matrix.astype(np.float64)
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)])
    return _unit(normals @ cofactors.T * (-1 if np.linalg.det(matrix) < 0 else 1))


def of_bake(baked: np.ndarray, obj: bpy.types.Object) -> np.ndarray:
    """(n, 3) unit normals in the world of baked OBJECT normals (n, 3).

    Blender turns Cycles' world normal n back as if it were a displacement, to normalize(M^-1 n) (`RE_bake_normal_world_to_object`; measured
    in 4.5.15 and 5.2.3), so n is along M (M^-1 n). Where M flattens, all that it moves lies in one plane: on the side of most area.
    """
    matrix = np.array(obj.matrix_world.to_3x3(), np.float64)
    sizes = np.linalg.svd(matrix, compute_uv=False)
    if sizes[2] > FLAT * sizes[0]:
        return _unit(baked @ matrix.T).astype(np.float32)
    areas, normals = np.empty(len(obj.data.polygons), np.float32), np.empty(len(obj.data.polygons) * 3, np.float32)
    obj.data.polygons.foreach_get("area", areas)
    obj.data.polygons.foreach_get("normal", normals)
    turned = of_mesh(normals.reshape(-1, 3), matrix)
    return np.broadcast_to(_unit((areas @ turned)[None]).astype(np.float32), baked.shape)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-20)
