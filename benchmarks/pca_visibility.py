"""`python benchmarks/pca_visibility.py CAPTURE`: shadows at surfels from compressed depths, beside raw depths and shadow maps.

Point lights and area lights of 0.6 x 0.3 m at random free places. Misclassified: surfels that face a point light and that are taken to see
it and do not, or the reverse, of all that face it. Errors of direct light: relative RMSE, the median over lights; of an area light
by 25 looks, against 144 rays a surfel. Bytes per surfel, with the bases that surfels share.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from lights_inside import placed
from numpy import ndarray

from srbf.capture import COVERED, Capture
from srbf.light_geometry import points_on
from srbf.lights import AreaLight, Light, PointLight
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.hemisphere_map import four_around, places
from srbf.visibility.pca_visibility import SIDE, DepthMaps, PcaVisibility, pca_visibility
from srbf.visibility.received import starts_of
from srbf.visibility.surface_cells import Cells

Sees = Callable[[ndarray, ndarray], ndarray]  # (surfels that face it, place of a light) -> how much each sees
LOOKS, RAYS = 5, 12  # per side of an area light
NORMAL_OFFSET = 2.0  # texels, of a cube's lookups


def rays(cells: Cells, starts: ndarray, inside: CloudLights) -> Sees:
    """The reference."""
    return lambda own, place: inside.visible(starts[own], np.broadcast_to(place, (len(own), 3))).astype(float)


def compressed(found: PcaVisibility, starts: ndarray) -> Sees:
    """Of components."""

    def sees(own: ndarray, place: ndarray) -> ndarray:
        vector = place - starts[own]
        distance = np.linalg.norm(vector, axis=1)
        return found.visible(own, vector / distance[:, None], distance)

    return sees


def raw(depths: ndarray, found: PcaVisibility, starts: ndarray, side: int, byte: bool) -> Sees:
    """Uncompressed maps of fewer texels a side, as floats, or as bytes of the logarithm of depth."""
    at = (np.arange(side) + 0.5) / side
    grid = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    row, column = (np.minimum((grid[:, k] * SIDE).astype(int), SIDE - 1) for k in (1, 0))
    own_depths = np.minimum(depths[:, row * SIDE + column], found.far)
    if byte:
        low, high = np.log(max(0.01, float(own_depths.min()))), np.log(found.far)
        level = np.round((np.log(np.maximum(own_depths, np.exp(low))) - low) / (high - low) * 255)
        own_depths = np.exp(low + level / 255 * (high - low))

    def sees(own: ndarray, place: ndarray) -> ndarray:
        vector = place - starts[own]
        distance = np.linalg.norm(vector, axis=1)
        texels, weights = four_around(places(found.local(own, vector / distance[:, None])), side)
        return (weights * (0.97 * distance[:, None] <= np.take_along_axis(own_depths[own], texels, 1))).sum(axis=1)

    return sees


def cube(inside: CloudLights, cells: Cells, starts: ndarray, size: int) -> Sees:
    """A cube of depths about the light, four comparisons mixed (as the shadow samplers of GPUs do), with a normal offset."""

    def sees(own: ndarray, place: ndarray) -> ndarray:
        steps = (np.arange(size) + 0.5) / size * 2 - 1
        across, up = (grid.ravel() for grid in np.meshgrid(steps, steps))
        vector = starts[own] - place
        reach = np.abs(vector).max(axis=1)
        vector = vector + cells.normals[own] * (NORMAL_OFFSET * reach / size)[:, None]
        axis = np.abs(vector).argmax(axis=1)
        face = 2 * axis + (np.take_along_axis(vector, axis[:, None], 1)[:, 0] < 0)
        result = np.zeros(len(own))
        for number in range(6):
            of = np.flatnonzero(face == number)
            if not len(of):
                continue
            k = number // 2
            u, v = (k + 1) % 3, (k + 2) % 3
            ahead = np.zeros((size * size, 3))
            ahead[:, k], ahead[:, u], ahead[:, v] = 1 - 2 * (number % 2), across, up
            length = np.linalg.norm(ahead, axis=1)
            hit, far, _ = inside.occluders.first_hit(np.tile(place, (len(ahead), 1)).astype(np.float32), ahead / length[:, None])
            map_ = np.where(hit >= 0, far / length, np.inf)
            toward = vector[of]
            depth = np.abs(toward[:, k])
            texels, weights = four_around(0.5 + 0.5 * toward[:, [u, v]] / depth[:, None], size)
            result[of] = (weights * (0.995 * depth[:, None] <= map_[texels])).sum(axis=1)
        return result

    return sees


def direct(cells: Cells, starts: ndarray, light: Light, sees: Sees, side: int) -> tuple[ndarray, ndarray, ndarray]:
    """(irradiance of a white light on every surfel, surfels that face it, what they see) of a point, or of an area by side^2 looks."""
    irradiance = np.zeros(len(starts))
    if not isinstance(light, AreaLight):
        assert isinstance(light, PointLight)
        spots, emits = np.array([light.position]), None
    else:
        steps = (np.arange(side) + 0.5) / side
        spots = points_on(light, np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2))
        emits = np.array(light.direction)
    for place in spots:
        vector = place - starts
        squared = (vector**2).sum(axis=1)
        unit = vector / np.sqrt(squared)[:, None]
        cosine = np.einsum("nk,nk->n", unit, cells.normals)
        cosine_light = np.ones(len(unit)) if emits is None else np.maximum(-(unit @ emits), 0)
        own = np.flatnonzero((cosine > 0) & (cosine_light > 0))
        share = sees(own, place)
        irradiance[own] += cosine[own] * cosine_light[own] / np.maximum(squared, cells.areas / (2 * np.pi))[own] * share / len(spots)
    return irradiance, own, share


def texels_of(capture: Capture) -> Cells:
    """The covered texels as cells of one area."""
    covered = capture.coverage() >= COVERED
    position, normal = capture.geometry("position"), capture.geometry("normal")
    assert position is not None and normal is not None
    count = int(covered.sum())
    area = np.full(count, 1e-3, np.float32)
    return Cells(position[covered], normal[covered], area, np.zeros((count, 3), np.float32), np.zeros(count, np.int64))


def main() -> None:
    """Print a row per way of knowing shadows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("--lights", type=int, default=24)
    parser.add_argument("--areas", type=int, default=12)
    parser.add_argument("--coefficients", default="10,25,50,100")
    parser.add_argument("--cubes", default="128,256")
    parser.add_argument("--receivers", action="store_true", help="At the covered texels in place of the surfels.")
    asked = parser.parse_args()
    capture = Capture.open(asked.capture)
    inside = CloudLights.of(capture)
    cells = texels_of(capture) if asked.receivers else inside.cells
    starts = starts_of(cells.places, cells.normals)
    points = placed(capture, "point", asked.lights, np.random.default_rng([3, 5]))
    areas = placed(capture, "area", asked.areas, np.random.default_rng([3, 4]))
    true = rays(cells, starts, inside)
    exact = [direct(cells, starts, light, true, 1) for light in points]
    exact_areas = [direct(cells, starts, light, true, RAYS)[0] for light in areas]
    print(f"{len(starts)} surfels, {len(points)} point and {len(areas)} area lights")
    print(f"{'':>24}{'misclassified %':>16}{'shaded %':>10}{'lit %':>8}{'point %':>9}{'area %':>8}{'B/surfel':>10}{'fit s':>7}")

    def row(name: str, sees: Sees, size: float, seconds: float = 0.0, with_area: bool = True) -> None:
        wrong = np.zeros(3)
        errors = []
        for light, (expected, own, seen) in zip(points, exact, strict=True):
            irradiance, _, share = direct(cells, starts, light, sees, 1)
            wrong += [((share < 0.5) & (seen > 0.5)).sum(), ((share >= 0.5) & (seen < 0.5)).sum(), len(own)]
            errors.append(np.linalg.norm(irradiance - expected) / np.linalg.norm(expected))
        soft = []
        if with_area:
            for light, expected in zip(areas, exact_areas, strict=True):
                soft.append(np.linalg.norm(direct(cells, starts, light, sees, LOOKS)[0] - expected) / np.linalg.norm(expected))
        shaded, lit = 100 * wrong[:2] / wrong[2]
        area = f"{100 * np.median(soft):8.1f}" if soft else f"{'':>8}"
        print(
            f"{name:>24}{shaded + lit:16.1f}{shaded:10.1f}{lit:8.1f}{100 * np.median(errors):9.1f}{area}{size:10.0f}{seconds:7.0f}",
            flush=True,
        )

    row("rays", true, 0)
    for count in map(int, asked.coefficients.split(",")):
        started = time.perf_counter()
        found = pca_visibility(starts, cells.normals, inside.occluders, inside.free, count)
        row(f"pca:{count}", compressed(found, starts), found.byte_count() / len(starts), time.perf_counter() - started)
    depths, _ = DepthMaps(starts, cells.normals, inside.occluders, found.far).trace(np.arange(len(starts)))
    row("2025 depths", raw(depths, found, starts, SIDE, False), 4 * SIDE**2)
    for side in (10, 17, 20):
        row(f"{side * side} bytes", raw(depths, found, starts, side, True), side * side)
    for size in map(int, asked.cubes.split(",")):
        row(f"cube of {size} x {size}", cube(inside, cells, starts, size), 0, with_area=False)


if __name__ == "__main__":
    main()
