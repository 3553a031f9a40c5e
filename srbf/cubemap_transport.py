"""Transport of receivers under every direction of a cubemap, as a capture keeps it: bits of visibility, normals, bounces of low rank."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Bool, Float32, Int
from srbf.cubemap import Cubemap
from srbf.errors import ImageError
from srbf.io import files

VISIBILITY_FILE, BOUNCES_FILE, TESTED_FILE = "visibility.npz", "bounces.npz", "tested.npz"
DAMAGE = (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile)


@dataclass(frozen=True, eq=False)
class CubemapTransport:
    """Irradiance of P texels under N directional lights of unit irradiance: visibility times cosine, and what surfaces reflect.

    T(p, l, c) = V(p, l) max(0, n_p . l) + sum_j shapes[p, j] weights[j, l, c]. R texels hold receivers, `receivers` their flat indices in
    order; `bits` (R, B) uint8 are V, bit l of a row the l-th from its first byte's highest. With gloss `harmonics` are shapes of what
    bounces bring times each harmonic of where it comes from, see `srbf.visibility.gathered_harmonics`.
    """

    cubemap: Cubemap
    texels: int
    receivers: Int[ndarray, " R"]
    normals: Float32[ndarray, "R 3"]
    bits: ndarray
    shapes: Float32[ndarray, "R r"]
    weights: Float32[ndarray, "r N 3"]
    harmonics: Float32[ndarray, "K R r"] | None = None

    def images(self, columns: Int[ndarray, " b"], direct: bool = True) -> Float32[ndarray, "b P 3"]:
        """Irradiance of all texels under some directions; of bounces alone where `direct` is false; 0 where there is no receiver."""
        found = np.zeros((len(columns), self.texels, 3), np.float32)
        rows = np.arange(len(self.receivers))
        own = self._bounces(rows, columns).transpose(1, 0, 2)
        found[:, self.receivers] = own + self.cosines(rows, columns).T[:, :, None] if direct else own
        return found

    def rows(self, texels: Int[ndarray, " n"], columns: Int[ndarray, " b"], direct: bool = True) -> Float32[ndarray, "n b 3"]:
        """Rows of T of some texels; 0 of those without receiver."""
        place = np.minimum(np.searchsorted(self.receivers, texels), max(0, len(self.receivers) - 1))
        real = np.flatnonzero(self.receivers[place] == texels) if len(self.receivers) else np.zeros(0, np.int64)
        found = np.zeros((len(texels), len(columns), 3), np.float32)
        found[real] = self._bounces(place[real], columns)
        if direct:
            found[real] += self.cosines(place[real], columns)[:, :, None]
        return found

    def seen(self, rows: Int[ndarray, " n"], columns: Int[ndarray, " b"]) -> Bool[ndarray, "n b"]:
        """Whether the n-th receivers see directions."""
        return (self.bits[rows][:, columns >> 3] >> (7 - (columns & 7)).astype(np.uint8) & 1).view(bool)

    def cosines(self, rows: Int[ndarray, " n"], columns: Int[ndarray, " b"]) -> Float32[ndarray, "n b"]:
        """Visibility times cosine of the n-th receivers."""
        directions = self.cubemap.directions[columns].astype(np.float32)
        return np.maximum(self.normals[rows] @ directions.T, 0) * self.seen(rows, columns)

    def _bounces(self, rows: Int[ndarray, " n"], columns: Int[ndarray, " b"]) -> Float32[ndarray, "n b 3"]:
        weights = self.weights[:, columns].reshape(len(self.weights), 3 * len(columns))
        return (self.shapes[rows] @ weights).reshape(len(rows), len(columns), 3)


@dataclass(frozen=True, eq=False)
class TestedTransport:
    """What R receivers get of T lights that test a capture: bits (R, B) and weights of the shapes as of `CubemapTransport`."""

    bits: ndarray
    weights: Float32[ndarray, "T r 3"]

    def seen(self, index: int) -> Bool[ndarray, " R"]:
        """Whether the receivers see a light."""
        return (self.bits[:, index >> 3] >> (7 - (index & 7)) & 1).astype(bool)


def write_arrays(path: Path, key: str, **arrays: Any) -> None:
    """One stage of a bake: `key` tells what it is of."""
    with files.atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, key=np.array(key), **arrays)


def stored_arrays(path: Path, key: str | None = None) -> dict[str, ndarray] | None:
    """What `write_arrays` wrote; None where there is nothing, another `key`, or damage."""
    try:
        with np.load(path) as stored:
            return dict(stored) if key is None or str(stored["key"]) == key else None
    except DAMAGE:
        return None


def read_transport(folder: Path, told: dict[str, Any], texels: int) -> CubemapTransport:
    """Of a capture's folder, by the key `cubemap` of its manifest; kept until a file changes. ImageError on missing or damaged files."""
    paths = tuple(files.inside(folder, told[name], folder) for name in ("visibility", "bounces"))
    try:
        stamps = tuple(path.stat().st_mtime_ns for path in paths)
    except OSError as error:
        raise _damaged(paths[0].parent) from error
    return _read(paths, stamps, int(told["side"]), texels)


def read_tested(folder: Path, told: dict[str, Any], lights: int, receivers: int, shapes: int) -> TestedTransport:
    """Of a capture's folder, by the key `cubemap` of its manifest. ImageError on a missing or damaged file."""
    path = files.inside(folder, told["tested"], folder)
    stored = stored_arrays(path)
    if stored is None or not {"bits", "weights"} <= set(stored):
        raise _damaged(path.parent)
    found = TestedTransport(stored["bits"], stored["weights"].astype(np.float32))
    if found.bits.shape != (receivers, -(-lights // 8)) or found.weights.shape != (lights, shapes, 3):
        raise _damaged(path.parent)
    return found


@lru_cache(maxsize=2)
def _read(paths: tuple[Path, ...], stamps: tuple[int, ...], side: int, texels: int) -> CubemapTransport:
    visibility, bounces = (stored_arrays(path) for path in paths)
    cubemap = Cubemap(side)
    if visibility is None or bounces is None:
        raise _damaged(paths[0].parent)
    try:
        receivers, normals, bits = (visibility[name] for name in ("receivers", "normals", "bits"))
        shapes, weights = (bounces[name].astype(np.float32) for name in ("shapes", "weights"))
        harmonics = bounces["harmonics"].astype(np.float32) if "harmonics" in bounces else None
    except KeyError as error:
        raise _damaged(paths[0].parent) from error
    count, directions = len(receivers), cubemap.count
    expected = ((count, -(-directions // 8)), (count, 3), (count, len(weights)), (len(weights), directions, 3))
    found = (bits.shape, normals.shape, shapes.shape, weights.shape)
    waves = () if harmonics is None else harmonics.shape[1:]
    if found != expected or receivers.max(initial=0) >= texels or waves not in ((), (count, len(weights))):
        raise _damaged(paths[0].parent)
    return CubemapTransport(cubemap, texels, receivers.astype(np.int64), normals.astype(np.float32), bits, shapes, weights, harmonics)


def _damaged(folder: Path) -> ImageError:
    return ImageError(f"expected the cubemap's visibility and bounces in {folder}, found none to read; bake again with `force=True`")
