"""A mesh from the texels of a lightmap: every covered texel a vertex, neighbors joined where they are neighbors on the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Int
from srbf.asset import Asset
from srbf.errors import InputError

LONGEST = 8.0  # of the median distance of neighbors: longer ones cross to another chart, or over an edge


@dataclass(frozen=True, eq=False)
class TexelMesh:
    """V vertices in the asset's z-up frame with the lightmap's UV, v downwards as in glTF, and triangles by index."""

    positions: Float32[ndarray, "V 3"]
    normals: Float32[ndarray, "V 3"] | None
    uv: Float32[ndarray, "V 2"]
    triangles: Int[ndarray, "T 3"]


def texel_mesh(asset: Asset) -> TexelMesh:
    """Two triangles for each 2 x 2 covered texels that are near each other, one where three of the four are.

    UVs are exact, each vertex the middle of its texel; half a texel of each chart's border is left out. Front faces look where the
    normals do.
    InputError without positions, and where no three texels are neighbors.
    """
    if "position" not in asset.images:
        raise InputError("expected a position map to rebuild the mesh from, found none; give a `mesh`, a .glb")
    covered, position = asset.covered, asset.images["position"]
    near = _near(covered, position)
    number = np.cumsum(covered.ravel()).reshape(covered.shape) - 1
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=2)  # around, from the top left
    left, bottom, right, top = near[0][:, :-1], near[1][1:], near[0][:, 1:], near[1][:-1]
    sides = np.stack([left, bottom, right, top], axis=2)  # side j joins corners j and j + 1
    corners = np.stack([covered[:-1, :-1], covered[1:, :-1], covered[1:, 1:], covered[:-1, 1:]], axis=2)
    whole = sides.all(axis=2)
    found = [quads[whole][:, [0, 1, 2]], quads[whole][:, [0, 2, 3]]]
    for missing in range(4):
        a, b, c = ((missing + step) % 4 for step in (1, 2, 3))
        chosen = ~corners[..., missing] & sides[..., a] & sides[..., b]
        found.append(quads[chosen][:, [a, b, c]])
    triangles = np.concatenate(found)
    if not len(triangles):
        raise InputError("expected texels that are neighbors on the surface to rebuild the mesh from, found none; give a `mesh`, a .glb")
    points = position[covered]
    normal = asset.images["normal"][covered] if "normal" in asset.images else None
    if normal is not None:
        flat = np.cross(points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]])
        turned = np.einsum("tc,tc->t", flat, normal[triangles].sum(axis=1)) < 0
        triangles[turned] = triangles[turned][:, ::-1]
    rows, columns = np.nonzero(covered)
    uv = np.stack([(columns + 0.5) / asset.width, (rows + 0.5) / asset.height], axis=1).astype(np.float32)
    return TexelMesh(points, normal, uv, triangles)


def _near(covered: Bool[ndarray, "H W"], position: Float32[ndarray, "H W 3"]) -> tuple[Bool[ndarray, "h W"], Bool[ndarray, "H w"]]:
    """Whether a texel and the one below it, and the one to its right, are covered and next to each other on the surface."""
    down = np.linalg.norm(position[1:] - position[:-1], axis=2)
    across = np.linalg.norm(position[:, 1:] - position[:, :-1], axis=2)
    both_down, both_across = covered[1:] & covered[:-1], covered[:, 1:] & covered[:, :-1]
    distances = np.concatenate([down[both_down], across[both_across]])
    longest = LONGEST * float(np.median(distances)) if len(distances) else 0.0
    return both_down & (down <= longest), both_across & (across <= longest)
