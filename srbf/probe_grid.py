"""Probes: a regular grid of points in free space, and how the light at a place between them is mixed from them without leaks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float16, Float32, Float64, Int
from srbf.basis.irradiance_harmonics import FACETS
from srbf.basis.octahedral_table import lookup
from srbf.errors import ImageError
from srbf.io.image import write_image

PLACES_FILE, NEARNESS_FILE = "probes.exr", "probe_nearness.exr"
TILE = 17  # nodes on a side of a probe's octahedral tile
UNSEEN = 1e-5  # weight of a probe that a place does not see, or that has another's light, beside those that it sees
SOFT = 0.1  # of a surface's distance: how far behind it a probe's weight falls to nothing


@dataclass(frozen=True, eq=False)
class ProbeGrid:
    """N = X Y Z nodes, `spacing` meters apart from `origin` on, x running fastest.

    `places` (N, 3): where each node's probe really is, m, moved off surfaces. `sources` (N,): the probe whose light a node has: its own, or
    where it has none, inside geometry, the nearest one's. `nearness`: octahedral tiles in an atlas, one a probe, of 1 / distance to the
    surfaces around, 1/m.
    """

    origin: tuple[float, float, float]
    spacing: float
    counts: tuple[int, int, int]
    places: Float32[ndarray, "N 3"]
    sources: Int[ndarray, " N"]
    nearness: Float16[ndarray, "rows columns 1"]

    @property
    def count(self) -> int:
        return int(np.prod(self.counts))

    @property
    def valid(self) -> ndarray:
        """(N,) bool: which nodes have a probe of their own."""
        return self.sources == np.arange(self.count)

    @property
    def image_size(self) -> tuple[int, int]:
        """(width, height) of the capture's images: columns facet X + x, rows z Y + y."""
        x, y, z = self.counts
        return FACETS * x, y * z

    def image(self, values: Float[ndarray, "N F C"]) -> Float[ndarray, "H W C"]:
        """F values of each probe as an image: columns f X + x, rows z Y + y."""
        x, y, z = self.counts
        return np.ascontiguousarray(values.reshape(y * z, x, values.shape[1], -1).swapaxes(1, 2)).reshape(y * z, values.shape[1] * x, -1)

    def values(self, image: Float[ndarray, "H W C"]) -> Float[ndarray, "N F C"]:
        """The inverse of `image`."""
        x, y, z = self.counts
        return image.reshape(y * z, -1, x, image.shape[2]).swapaxes(1, 2).reshape(self.count, -1, image.shape[2])

    def weights(self, points: Float[ndarray, "n 3"]) -> tuple[Int[ndarray, "n 8"], Float64[ndarray, "n 8"]]:
        """(probes, weights that add up to 1) of the nodes around each point (m): trilinear, times what the probe sees of the point.

        A probe knows how far it sees in every direction, as in [Majercik2019]; but of 1 / distance, which is linear in the direction on a
        plane, so that a wall is where it is at all angles. What no probe around sees takes the light of all of them. Beyond the grid the
        outermost probes hold on.
        """
        place = np.asarray(points, np.float64)
        most = np.array(self.counts) - 1
        at = np.clip((place - self.origin) / self.spacing, 0, most)
        low = np.minimum(at.astype(np.int64), np.maximum(most - 1, 0))  # (n, 3)
        corners = np.array([(i & 1, i >> 1 & 1, i >> 2 & 1) for i in range(8)])
        node = np.minimum(low[:, None] + corners, most)  # (n, 8, 3)
        share = np.where(corners, (at - low)[:, None], 1 - (at - low)[:, None]).prod(axis=2)
        own = node[..., 0] + self.counts[0] * (node[..., 1] + self.counts[1] * node[..., 2])
        probe = self.sources[own]
        share = share * np.maximum(self._seen(probe, place), UNSEEN) * np.where(probe == own, 1, UNSEEN)
        return probe, share / share.sum(axis=1, keepdims=True)

    def _seen(self, probe: Int[ndarray, "n 8"], place: Float64[ndarray, "n 3"]) -> Float64[ndarray, "n 8"]:
        way = place[:, None] - self.places[probe]
        nearness = lookup(self.nearness, TILE, self.nearness.shape[1] // TILE, probe, way)[..., 0]
        beyond = np.linalg.norm(way, axis=2) * nearness - 1
        return np.clip(1 - beyond / SOFT, 0, 1) ** 2

    def described(self) -> dict[str, Any]:
        """The manifest's entry of this receiver."""
        return {
            "kind": "probes",
            "origin": list(self.origin),
            "spacing": self.spacing,
            "counts": list(self.counts),
            "valid": int(self.valid.sum()),
            "places": PLACES_FILE,
            "nearness": NEARNESS_FILE,
        }

    def write(self, folder: Path) -> None:
        """The files that `described` names: (x, y, z, source) of every probe, and the atlas of nearness."""
        x, y, z = self.counts
        rows = np.column_stack([self.places, self.sources.astype(np.float32)])
        write_image(folder / PLACES_FILE, rows.reshape(y * z, x, 4), "float")
        write_image(folder / NEARNESS_FILE, self.nearness, "half")

    @staticmethod
    def read(told: dict[str, Any], pixels: Callable[[str, int], Float32[ndarray, "H W C"]]) -> ProbeGrid:
        """Of a manifest's entry, by a function that reads (file, channels); ImageError where the files do not fit it."""
        x, y, z = counts = (int(told["counts"][0]), int(told["counts"][1]), int(told["counts"][2]))
        rows, nearness = pixels(told["places"], 4), pixels(told["nearness"], 1)
        if rows.shape[:2] != (y * z, x):
            raise ImageError(f"expected {x}x{y * z} probes in {told['places']}, found {rows.shape[1]}x{rows.shape[0]}; bake or fit again")
        sources = np.round(rows[:, :, 3]).astype(np.int64).ravel()
        count = x * y * z
        if sources.min() < 0 or sources.max() >= count:
            raise ImageError(f"expected sources of 0 to {count - 1} in {told['places']}, found others; bake or fit again")
        columns = nearness.shape[1] // TILE
        if nearness.shape[0] % TILE or nearness.shape[1] % TILE or nearness.shape[0] // TILE * columns < count:
            raise ImageError(f"expected {count} tiles of {TILE}x{TILE} in {told['nearness']}, found fewer; bake or fit again")
        x0, y0, z0 = (float(value) for value in told["origin"])
        places = np.ascontiguousarray(rows[:, :, :3]).reshape(-1, 3)
        return ProbeGrid((x0, y0, z0), float(told["spacing"]), counts, places, sources, nearness.astype(np.float16))


def probes_of(receiver: dict[str, Any], pixels: Callable[[str, int], Float32[ndarray, "H W C"]]) -> ProbeGrid | None:
    """The probes of a manifest's receiver, None of another kind."""
    return ProbeGrid.read(receiver, pixels) if receiver.get("kind") == "probes" else None
