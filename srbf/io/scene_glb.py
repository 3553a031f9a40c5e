"""`scene.glb`: receivers and occluders as triangles, read from binary glTF into the capture's z-up frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Float64, Int
from srbf.errors import ManifestError
from srbf.io.glb import DAMAGE, Glb

TRIANGLES = 4  # glTF's mode of a primitive
KNOTS = 8
Z_UP_FROM_Y_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], np.float64)


@dataclass(frozen=True, eq=False)
class Triangles:
    """T triangles: corners and their normals (T, 3, 3), materials, and whether they cast shadows. World frame, meters.

    `transmittance` (M, KNOTS, 3) of one wall of a material for shadow rays at the cosines 0, 1/(KNOTS-1), …, 1 to its normal; an opaque
    material has 0. `lightmap`: lightmap coordinates of the receivers' corners, (0, 0) at the top left of its image; NaN for other
    triangles, None in a scene without lightmap. `objects`: the number of each triangle's object among `names`; None where nobody knows.
    """

    corners: Float32[ndarray, "T 3 3"]
    normals: Float32[ndarray, "T 3 3"]
    material: Int[ndarray, " T"]
    casts: Bool[ndarray, " T"]
    transmittance: Float32[ndarray, "M KNOTS 3"]
    lightmap: Float32[ndarray, "T 3 2"] | None = None
    objects: Int[ndarray, " T"] | None = None
    names: tuple[str, ...] = ()

    @property
    def translucent(self) -> Bool[ndarray, " T"]:
        """Mask of the triangles that transmit some light."""
        return (self.transmittance > 0).any(axis=(1, 2))[self.material]

    @property
    def occluders(self) -> Bool[ndarray, " T"]:
        """Mask of the triangles that block all light."""
        return self.casts & ~self.translucent

    @property
    def filters(self) -> Bool[ndarray, " T"]:
        """Mask of the shadow casters that transmit some light."""
        return self.casts & self.translucent


def read_triangles(data: bytes, name: str = "scene.glb") -> Triangles:
    """The triangles of a .glb; ManifestError if it is no .glb, or of a kind that no bake writes (sparse, compressed)."""
    try:
        return _Reader(Glb.parse(data)).triangles()
    except DAMAGE as error:
        raise ManifestError(
            f"expected triangles as binary glTF 2.0 in {name}, found {type(error).__name__}: {error}; bake again"
        ) from error


class _Reader:
    def __init__(self, glb: Glb) -> None:
        self._glb, self._document = glb, glb.json

    def triangles(self) -> Triangles:
        document = self._document
        roots = document["scenes"][document.get("scene", 0)]["nodes"]
        turned = np.eye(4)
        turned[:3, :3] = Z_UP_FROM_Y_UP
        found: list[tuple[np.ndarray, ...]] = []
        self._names: dict[str, int] = {}
        for root in roots:
            self._visit(root, turned, found)
        if not found:
            raise ValueError("no triangles in it")
        corners, normals, material, casts, places, objects = (np.concatenate(parts) for parts in zip(*found, strict=True))
        transmittance = np.stack([np.zeros((KNOTS, 3)), *map(_transmittance, document.get("materials", []))])
        if not (np.isfinite(corners).all() and np.isfinite(normals).all()):
            raise ValueError("corners that are not finite")
        lightmap = places.astype(np.float32) if np.isfinite(places).any() else None
        return Triangles(
            corners.astype(np.float32),
            normals.astype(np.float32),
            material,
            casts,
            transmittance.astype(np.float32),
            lightmap,
            objects,
            tuple(self._names),
        )

    def _visit(self, index: int, parent: Float64[ndarray, "4 4"], found: list[tuple[np.ndarray, ...]]) -> None:
        node = self._document["nodes"][index]
        matrix = parent @ _local(node)
        if "mesh" in node:
            casts = node.get("extras", {}).get("casts_shadow", True)
            own = self._names.setdefault(str(node.get("name", "")), len(self._names))
            for primitive in self._document["meshes"][node["mesh"]]["primitives"]:
                if primitive.get("mode", TRIANGLES) == TRIANGLES:
                    parts = self._primitive(primitive, matrix, bool(casts))
                    found.append((*parts, np.full(len(parts[0]), own)))
        for child in node.get("children", []):
            self._visit(child, matrix, found)

    def _primitive(self, primitive: dict[str, Any], matrix: np.ndarray, casts: bool) -> tuple[np.ndarray, ...]:
        points = self._glb.values(primitive["attributes"]["POSITION"]).astype(np.float64)
        corners = (points @ matrix[:3, :3].T + matrix[:3, 3])[self._indices(primitive, len(points))]
        if "NORMAL" in primitive["attributes"]:
            normals = self._glb.values(primitive["attributes"]["NORMAL"]).astype(np.float64) @ np.linalg.inv(matrix[:3, :3])
            normals = normals[self._indices(primitive, len(points))]
        else:
            flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normals = np.repeat(flat[:, None], 3, axis=1)
        normals = normals / np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-30)
        count = len(corners)
        places = np.full((count, 3, 2), np.nan)
        if "_LIGHTMAP" in primitive["attributes"]:
            places = self._glb.values(primitive["attributes"]["_LIGHTMAP"]).astype(np.float64)[self._indices(primitive, len(points))]
        return corners, normals, np.full(count, primitive.get("material", -1) + 1), np.full(count, casts), places

    def _indices(self, primitive: dict[str, Any], count: int) -> np.ndarray:
        if "indices" not in primitive:
            return np.arange(count).reshape(-1, 3)
        return self._glb.values(primitive["indices"]).reshape(-1, 3)


def _transmittance(material: dict[str, Any]) -> Float64[ndarray, "KNOTS 3"]:
    """By angle if srbf wrote it, else the base color of a transmissive material at every angle."""
    curve = material.get("extras", {}).get("tint_by_cosine")
    if curve is not None:
        return np.array(curve, np.float64).reshape(KNOTS, 3)
    factor = material.get("extensions", {}).get("KHR_materials_transmission", {}).get("transmissionFactor", 0.0)
    color = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", [1, 1, 1, 1])
    return np.tile(factor * np.array(color[:3], np.float64), (KNOTS, 1))


def _local(node: dict[str, Any]) -> Float64[ndarray, "4 4"]:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= node.get("scale", [1, 1, 1])
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix
