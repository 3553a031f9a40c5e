"""Light from few surfels that reflect much of it, as beside a wall that a light is close to: in closed form, where few rays meet them.

Rays from a view cluster meet a small bright surfel once or not at all, so that its light would come in blotches. It is taken out of the
links, and lit from instead: F = cos cos A / (pi d^2 + A) V, a disc's form factor times what a receiver sees of a group of such surfels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from srbf.arrays import Float, Float32, Float64, Int
from srbf.compute.threads import each
from srbf.lights import AreaLight, DirectionalLight, Light, PointLight
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.surface_cells import Cells, frames

BRIGHT = 32.0  # of the mean radiosity, from which a surfel's light is taken out in part; from twice as much on, the whole
MOST = 256  # surfels, the brightest
GROUPS = 4  # parts of the bright surfels, each seen or not as one
FACING = 0.2  # m, that a unit of the normal counts where surfels are grouped
OFF = 0.25  # of a group's size, how far from its surface it is seen
CLOSE, PARTS = 8.0, 4  # sides of a surfel, closer than which to a receiver it counts as so many parts a side
LIFT = 1e-3  # of the extent of receivers
ROWS = 1 << 12  # receivers at a time


@dataclass(frozen=True, eq=False)
class NearSources:
    """n surfels of a pool, which part of the light of each is taken out of the links, `parts`, and the group that each is in.

    `cells` (n) of them, the `radiosity` (n, 3) of these parts; `places` (G, 3), m, where groups are seen.
    """

    surfels: Int[ndarray, " n"]
    parts: Float32[ndarray, " n"]
    cells: Cells
    radiosity: Float32[ndarray, "n 3"]
    groups: Int[ndarray, " n"]
    places: Float64[ndarray, "G 3"]

    @property
    def count(self) -> int:
        """How many surfels."""
        return len(self.surfels)

    def taken(self, values: Float32[ndarray, "S 3"]) -> Float32[ndarray, "S 3"]:
        """The parts that are taken out, of values on all surfels of the pool; 0 on others."""
        found = np.zeros_like(values)
        found[self.surfels] = self.parts[:, None] * values[self.surfels]
        return found

    def irradiance(
        self, points: Float[ndarray, "R 3"], normals: Float[ndarray, "R 3"], occluders: EmbreeTriangles
    ) -> Float32[ndarray, "R 3"]:
        """What these parts lay on receivers: points (m) and unit normals."""
        starts = (points + lift_above(points) * normals).astype(np.float32)
        found = np.zeros((len(points), 3), np.float32)
        rows = range(0, len(points), ROWS)

        def part(number: int) -> None:
            own = slice(rows[number], rows[number] + ROWS)
            factors = disc_factors(np.asarray(points[own], np.float32), np.asarray(normals[own], np.float32), self.cells)
            for group, place in enumerate(self.places):
                members = np.flatnonzero(self.groups == group)
                lit = np.flatnonzero(factors[:, members].any(axis=1))
                toward = place - starts[own][lit]
                distance = np.linalg.norm(toward, axis=1)
                hidden = occluders.occluded(starts[own][lit], toward / np.maximum(distance, 1e-30)[:, None], distance)
                factors[np.ix_(lit[hidden], members)] = 0
            found[own] = factors @ self.radiosity

        each(part, len(rows))
        return found


class NearPool:
    """The surfels of a pool that may be near sources: none of two in one place, as of cloth."""

    def __init__(self, cells: Cells) -> None:
        self._cells = cells
        self._area = max(float(cells.areas.sum(dtype=np.float64)), 1e-30)
        _, number, counts = np.unique(cells.places, axis=0, return_inverse=True, return_counts=True)
        self._alone = counts[number.ravel()] == 1

    def sources(self, radiosity: Float32[ndarray, "S 3"], light: Light) -> NearSources:
        """The brightest surfels, where they are far brighter than the mean, of the first reflection of a light.

        Groups are seen at places a little way from the surface to the light, where nothing is.
        """
        brightness = radiosity.mean(axis=1).astype(np.float64)
        least = BRIGHT * float((brightness * self._cells.areas).sum()) / self._area
        if len(brightness) > MOST:
            least = max(least, float(np.partition(brightness, -MOST - 1)[-MOST - 1]))
        bright = np.flatnonzero((brightness > least) & self._alone)
        parts = np.clip(brightness[bright] / max(least, 1e-30) - 1, 0, 1).astype(np.float32)
        own = self._cells.at(bright)
        places, normals = own.places.astype(np.float64), own.normals.astype(np.float64)
        flux = brightness[bright] * own.areas
        groups = _grouped(places, normals, flux)
        seen = []
        for group in range(int(groups.max(initial=-1)) + 1):
            members = np.flatnonzero(groups == group)
            middle = np.average(places[members], axis=0, weights=flux[members])
            nearest = members[((places[members] - middle) ** 2).sum(axis=1).argmin()]
            toward, far = _toward(light, places[nearest], normals[nearest])
            seen.append(places[nearest] + min(OFF * float(np.sqrt(own.areas[members].sum())), far / 2) * toward)
        return NearSources(bright, parts, own, parts[:, None] * radiosity[bright], groups, np.array(seen).reshape(-1, 3))


def lift_above(points: Float[ndarray, "R 3"]) -> float:
    """How far above receivers their shadows are looked up, m: more than direct light's, so that maps of shadows agree with rays."""
    return LIFT * float(np.ptp(points, axis=0).max(initial=0))


def disc_factors(points: Float32[ndarray, "R 3"], normals: Float32[ndarray, "R 3"], sources: Cells) -> Float32[ndarray, "R m"]:
    """The share of the light at each receiver that comes from each source, nothing between: cos cos A / (pi d^2 + A), as of a disc.

    A source closer to it than CLOSE of its sides is taken as a square of PARTS x PARTS discs.
    """
    facing, areas = sources.normals.astype(np.float32), sources.areas.astype(np.float32)
    vector = sources.places.astype(np.float32)[None] - points[:, None]
    squared = np.einsum("rnk,rnk->rn", vector, vector)
    near, far = np.einsum("rnk,rk->rn", vector, normals), -np.einsum("rnk,nk->rn", vector, facing)
    factors = _discs(near, far, squared, areas)
    reach = np.float32(np.sqrt(0.5)) * np.sqrt(areas)
    receiver, source = np.nonzero((squared < CLOSE**2 * areas) & (near > -reach) & (far > 0))
    if len(receiver):
        tangent, bitangent = (axis.astype(np.float32)[source] for axis in frames(sources.normals.astype(np.float64)))
        side, own, total = np.sqrt(areas)[source, None], vector[receiver, source], np.zeros(len(receiver), np.float32)
        steps = ((np.arange(PARTS) + 0.5) / PARTS - 0.5).astype(np.float32)
        for s in steps:
            for t in steps:
                part = own + side * (s * tangent + t * bitangent)
                height = np.einsum("nk,nk->n", part, normals[receiver])
                total += _discs(height, far[receiver, source], np.einsum("nk,nk->n", part, part), areas[source] / PARTS**2)
        factors[receiver, source] = total
    return factors


def _discs(near: ndarray, far: ndarray, squared: ndarray, areas: ndarray) -> ndarray:
    """From the distances along the normals of receivers and sources, the square of the whole, and areas."""
    squared = np.maximum(squared, np.float32(1e-12))
    return np.maximum(near, 0) * np.maximum(far, 0) * areas / (squared * (np.float32(np.pi) * squared + areas))


def _toward(light: Light, place: Float64[ndarray, " 3"], normal: Float64[ndarray, " 3"]) -> tuple[Float64[ndarray, " 3"], float]:
    """(the unit vector from a surface to a light, how far that is, m); an environment is above the surface."""
    if isinstance(light, DirectionalLight):
        return np.array(light.direction), np.inf
    if not isinstance(light, (PointLight, AreaLight)):
        return normal, np.inf
    vector = np.array(light.position) - place
    far = float(np.linalg.norm(vector))
    return vector / max(far, 1e-30), far


def _grouped(places: Float64[ndarray, "n 3"], normals: Float64[ndarray, "n 3"], flux: Float64[ndarray, " n"]) -> Int[ndarray, " n"]:
    """At most GROUPS, by halving the one that is spread most, along its longest axis."""
    features = np.concatenate([places, FACING * normals], axis=1)
    labels = np.zeros(len(places), np.int64)
    for group in range(1, GROUPS):
        spread = np.zeros(group)
        off = np.zeros_like(features)
        for number in range(group):
            own = labels == number
            if own.any():
                off[own] = features[own] - np.average(features[own], axis=0, weights=flux[own])
                spread[number] = (flux[own, None] * off[own] ** 2).sum()
        widest = int(spread.argmax())
        own = np.flatnonzero(labels == widest)
        if not len(own) or spread[widest] <= 0:
            break
        axis = np.linalg.eigh((off[own] * flux[own, None]).T @ off[own])[1][:, -1]
        axis *= np.sign(axis[np.abs(axis).argmax()])
        labels[own[off[own] @ axis > 0]] = group
    return np.unique(labels, return_inverse=True)[1].ravel()
