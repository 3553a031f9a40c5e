"""Captures of rooms by a small radiosity solver, independent of the library's own rays where it matters: closed boxes of square cells.

A room is an axis-aligned box, or two joined by a doorway; its cells are the receivers, and its indirect light is solved exactly for them.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from closed_forms import glb

from srbf.capture import Capture
from srbf.io import files
from srbf.io.image import write_image
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.patches import label_cells
from srbf.visibility.receivers import Receivers
from srbf.visibility.surface_cells import Cells, Fragments, lit
from srbf.visibility.surfel_parts import parts_of
from srbf.visibility.surfels import surfels_of
from srbf.visibility.transfer_operator import OPERATOR_FILE, SURFELS_FILE, TransferOperator


@dataclass(frozen=True, eq=False)
class Room:
    """N cells of closed surfaces, the triangles that they are cut from, their albedo, and the transport of indirect light."""

    places: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    albedo: np.ndarray
    corners: np.ndarray
    free: np.ndarray
    closed: bool = True

    @staticmethod
    def box(
        size: tuple[float, float, float],
        step: float,
        albedo: float = 0.5,
        wall: tuple[float, float, float] | None = None,
        lid: bool = True,
    ) -> Room:
        """A box from the origin, its walls seen from inside; `wall` (x, door's low y, door's high y): a thin wall across, with a door.

        Without `lid` the top is open.
        """
        sides = []
        for axis in range(3):
            for end in (0, 1):
                u, v = [k for k in range(3) if k != axis]
                corner, along, across = np.zeros(3), np.zeros(3), np.zeros(3)
                corner[axis], along[u], across[v] = end * size[axis], size[u], size[v]
                inward = np.zeros(3)
                inward[axis] = 1 - 2 * end
                sides.append((corner, along, across, inward))
        sides = sides if lid else sides[:-1]
        if wall is not None:
            x, low, high = wall
            for start, stop in ((0.0, low), (high, size[1])):
                if stop > start:
                    corner, along, across = np.array([x, start, 0]), np.array([0, stop - start, 0]), np.array([0, 0, size[2]])
                    sides += [(corner, along, across, np.array([sign, 0, 0])) for sign in (1.0, -1.0)]
        places, normals, areas, triangles = [], [], [], []
        for corner, along, across, inward in sides:
            a, b = max(1, round(np.linalg.norm(along) / step)), max(1, round(np.linalg.norm(across) / step))
            s, t = np.meshgrid((np.arange(a) + 0.5) / a, (np.arange(b) + 0.5) / b, indexing="ij")
            own = corner + s.reshape(-1, 1) * along + t.reshape(-1, 1) * across
            places.append(own)
            normals.append(np.broadcast_to(inward, own.shape))
            areas.append(np.full(len(own), np.linalg.norm(np.cross(along, across)) / (a * b)))
            four = [corner, corner + along, corner + along + across, corner + across]
            triangles += [[four[0], four[1], four[2]], [four[0], four[2], four[3]]]
        rng = np.random.default_rng(5)
        free = rng.uniform(0.1, 0.9, (400, 3)) * size
        if wall is not None:
            free = free[np.abs(free[:, 0] - wall[0]) > 0.1]
        points = np.concatenate(places)
        color = np.full((len(points), 3), albedo)
        color[points[:, 0] < 1e-6] = [albedo, 0.3 * albedo, 0.2 * albedo]
        return Room(points, np.concatenate(normals), np.concatenate(areas), color, np.array(triangles, np.float32), free, lid)

    def sees(self, from_: np.ndarray, to: np.ndarray) -> np.ndarray:
        """(n,) bool: nothing between."""
        vector = to - from_
        distance = np.linalg.norm(vector, axis=1)
        tracer = EmbreeTriangles(self.corners)
        return ~tracer.occluded(from_.astype(np.float32), vector / np.maximum(distance, 1e-12)[:, None], distance - 1e-4)

    def factors(self) -> np.ndarray:
        """(N, N): what share of each cell's hemisphere another one fills, weighted by the cosine."""
        count = len(self.places)
        lifted = self.places + 1e-4 * self.normals
        i, j = np.divmod(np.arange(count * count), count)
        toward = lifted[j] - lifted[i]
        squared = np.maximum((toward**2).sum(axis=1), 1e-12)
        unit = toward / np.sqrt(squared)[:, None]
        cosines = np.maximum((unit * self.normals[i]).sum(axis=1), 0) * np.maximum(-(unit * self.normals[j]).sum(axis=1), 0)
        factor = cosines * self.areas[j] / (np.pi * squared + self.areas[j])
        near = np.flatnonzero(factor > 0)
        factor[near] *= self.sees(lifted[i[near]], lifted[j[near]])
        factor = factor.reshape(count, count)
        if self.closed:  # all that leaves arrives
            factor /= np.maximum(factor.sum(axis=1, keepdims=True), 1e-12)
        return factor

    @cache  # noqa: B019  (rooms are few)
    def transport(self) -> np.ndarray:
        """(N, N, 3): indirect irradiance at each cell per unit of irradiance on another, all bounces."""
        count, factor = len(self.places), self.factors()
        result = np.empty((3, count, count), np.float32)
        for c in range(3):
            rho = self.albedo[:, c]
            radiosity = np.linalg.solve(np.eye(count) - rho[:, None] * factor, np.diag(rho))
            result[c] = factor @ radiosity
        return np.moveaxis(result, 0, 2)

    def direct(self, place: np.ndarray) -> np.ndarray:
        """(N,) irradiance of a point light of unit irradiance at 1 m."""
        amount = np.zeros(len(self.places))
        across = np.abs(self.normals).argmax(axis=1)  # walls are along the axes
        axes = np.eye(3)[np.stack([(across + 1) % 3, (across + 2) % 3], axis=1)]  # (N, 2, 3)
        steps = (np.arange(4) + 0.5) / 4 - 0.5
        for s, t in itertools.product(steps, steps):
            toward = place - self.places - np.sqrt(self.areas)[:, None] * (s * axes[:, 0] + t * axes[:, 1])
            squared = (toward**2).sum(axis=1)
            cosine = np.maximum((toward * self.normals).sum(axis=1), 0) / np.sqrt(squared)
            amount += cosine / np.maximum(squared, self.areas / (32 * np.pi)) / 16
        front = np.flatnonzero(amount > 0)
        amount[front] *= self.sees(self.places[front] + 1e-4 * self.normals[front], np.broadcast_to(place, (len(front), 3)))
        return amount

    def indirect(self, places: np.ndarray) -> np.ndarray:
        """(b, N, 3) indirect irradiance of point lights of unit irradiance at 1 m."""
        direct = np.array([self.direct(place) for place in places], np.float32)
        return np.stack([direct @ transport.T for transport in np.moveaxis(self.transport(), 2, 0)], axis=2)

    @cache  # noqa: B019  (rooms are few)
    def patches(self, count: int) -> np.ndarray:
        """The patch of each cell, as a bake chooses them."""
        cells = Cells(
            self.places.astype(np.float32), self.normals.astype(np.float32), self.areas.astype(np.float32), self.albedo.astype(np.float32),
            np.zeros(len(self.places), np.int64),
        )  # fmt: skip
        return label_cells(cells, lit(self.places, self.normals, EmbreeTriangles(self.corners), self.free), count)


def write_room(
    folder: Path, room: Room, lights: list[dict[str, Any]], images: list[np.ndarray], patches: np.ndarray, **keys: Any
) -> Capture:
    """A capture of a room's cells, (N, 3) responses as images."""
    (folder / "lights").mkdir(parents=True)
    count = len(room.places)
    width = int(np.ceil(np.sqrt(count)))
    height = -(-count // width)

    def image(values: np.ndarray) -> np.ndarray:
        padded = np.zeros((height * width, values.shape[1]), np.float32)
        padded[:count] = values
        return padded.reshape(height, width, -1)

    entries = []
    for number, (light, values) in enumerate(zip(lights, images, strict=True)):
        file = f"lights/{number:04d}.exr"
        write_image(folder / file, image(values), "half")
        entries.append({**light, "file": file})
    cells = Cells(
        room.places.astype(np.float32),
        room.normals.astype(np.float32),
        room.areas.astype(np.float32),
        room.albedo.astype(np.float32),
        patches,
    )
    write_image(folder / "patches.exr", cells.image(), "float")
    write_image(folder / "position.exr", image(room.places), "float")
    write_image(folder / "normal.exr", image(room.normals), "float")
    write_image(folder / "coverage.exr", image(np.ones((count, 1))), "float")
    (folder / "scene.glb").write_bytes(glb(room.corners))
    manifest = {
        "format": "srbf-capture",
        "version": 1,
        "quantity": "irradiance",
        "transport": "indirect",
        "width": width,
        "height": height,
        "lights": entries,
        "position": "position.exr",
        "normal": "normal.exr",
        "coverage": "coverage.exr",
        "scene": "scene.glb",
        "direct": {"sun_angle": 0.0},
        "patches": {"count": int(patches.max()) + 1, "file": "patches.exr"},
        "free_places": room.free.tolist(),
        **keys,
    }
    files.write_json(folder / "capture.json", manifest)
    return Capture.open(folder)


def room_of_patches(folder: Path, room: Room, count: int, noise: float = 0.0, tested: int = 12) -> Capture:
    """Patches captured, and point lights held out; `noise`: relative, per texel and color, of the patches' images."""
    transport, labels = room.transport(), room.patches(count)
    rng = np.random.default_rng(3)
    lights: list[dict[str, Any]] = []
    images = []
    for k in range(count):
        values = transport[:, labels == k].sum(axis=1)
        lights.append({"kind": "patch", "patch": k, "role": "train"})
        images.append(values * (1 + noise * rng.standard_normal(values.shape)))
    for role, places in (("validation", room.free[:4]), ("holdout", room.free[-tested:])):
        lights += [{"kind": "point", "position": place.tolist(), "role": role} for place in places]
        images += [*room.indirect(places)]
    return write_room(folder, room, lights, images, labels)


def room_of_points(folder: Path, room: Room, count: int, tested: int = 12) -> Capture:
    """Point lights captured at random free places, others held out."""
    labels = room.patches(64)
    lights: list[dict[str, Any]] = []
    images: list[np.ndarray] = []
    for role, places in (("train", room.free[:count]), ("validation", room.free[count : count + 4]), ("holdout", room.free[-tested:])):
        lights += [{"kind": "point", "position": place.tolist(), "role": role} for place in places]
        images += [*room.indirect(places)]
    return write_room(folder, room, lights, images, labels)


def room_of_surfels(folder: Path, room: Room, count: int, tested: int = 12) -> Capture:
    """A transfer operator traced in a room, about `count` surfels of it, and point lights held out."""
    lights: list[dict[str, Any]] = []
    images: list[np.ndarray] = []
    for role, places in (("validation", room.free[:4]), ("holdout", room.free[-tested:])):
        lights += [{"kind": "point", "position": place.tolist(), "role": role} for place in places]
        images += [*room.indirect(places)]
    corners = divided(room.corners, 0.7 * float(np.sqrt(room.areas.sum() / count)))
    red = corners[:, :, 0].max(axis=1) < 1e-6
    albedo = np.where(red[:, None], room.albedo[room.places[:, 0] < 1e-6][0], room.albedo[room.places[:, 0] > 1e-6][0])
    occluders = EmbreeTriangles(room.corners)
    surfels = surfels_of(Fragments(corners, albedo.astype(np.float32)), red.astype(np.int64), occluders, room.free, None, count)
    told = {"count": surfels.count, "file": SURFELS_FILE, "operator": OPERATOR_FILE, "objects": ["Walls", "Red wall"]}
    capture = write_room(folder, room, lights, images, room.patches(64), surfels=told)
    write_image(folder / "patches.exr", parts_of(surfels).image(), "float")
    TransferOperator.traced(surfels, Receivers.of(capture), is_lightmap=False).write(folder, "made")
    return Capture.open(folder)


def divided(corners: np.ndarray, longest: float) -> np.ndarray:
    """Triangles (T, 3, 3), the longest edge halved while it is longer than `longest`."""
    done = []
    while len(corners):
        edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        long = edges.max(axis=1) > longest
        done.append(corners[~long])
        corners, edges = corners[long], edges[long]
        turn = (edges.argmax(axis=1)[:, None] + np.arange(3)) % 3
        first, second, third = np.moveaxis(np.take_along_axis(corners, turn[:, :, None], axis=1), 1, 0)
        middle = (first + second) / 2
        corners = np.concatenate([np.stack([first, middle, third], axis=1), np.stack([middle, second, third], axis=1)])
    return np.concatenate(done).astype(np.float32)
