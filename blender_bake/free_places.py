# SPDX-License-Identifier: GPL-3.0-or-later
"""Free places of a scene for point lights: in no closed solid, off all surfaces, and not outside of a closed building."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from blender_bake import blue_noise
from blender_bake.ipc import WorkerError
from blender_bake.point_grid import Solid, _solid, grid, is_inside
from blender_bake.scene_file import corners_of, rendered, show_as_rendered
from blender_bake.without_triangles import is_only_volume

TRAIN_CLEARANCE, RANDOM_CLEARANCE, PLACES_CLEARANCE = 0.06, 0.1, 0.06  # m, of surfaces
SMALLEST = 0.25  # of the clearance: where there is no room for all of it
LEAST_ROOM = 4.0  # of the clearance: by how much a box grows, at least
POOL = 10  # candidates of blue noise per light
BATCH = 2048  # random points at a time
TRIES, FEWEST = 200, 20_000  # random points per free one, before giving up, and how many to try at least
RAYS, FIRST_RAYS = 64, 16  # from a place; where none of the first leaves, the place counts as enclosed
ENCLOSED = 0.02  # share of a place's rays that leave the scene, up to which it is enclosed
OUTSIDE = 0.25  # share from which a place of a closed scene is outside of it
CLOSED = 0.5  # share of places that are enclosed, from which a scene is closed
BURIED = 12  # of the first rays from a place, from which it is in a solid if they meet the backs of faces
FACING = 4  # of the first rays that meet the fronts of faces, and none a back: a place in the air
TRUSTED = 0.05  # share of such places, from which faces are taken to point out of solids
SURVEYED = 256  # places that these shares are of
SURVEY, TRAIN, RANDOM, PLACES = range(4)  # streams of random numbers


def places(scene: bpy.types.Scene, asked: dict[str, Any]) -> dict[str, Any]:
    """{box, train, random, places, skipped, open_share, warnings}: free places (m) in `asked["box"]`, by default that of all that renders.

    asked: `box` or null; `grows`: whether the bounds of all that renders become larger where they have no room, as light from afar allows;
    `count` places of blue noise, or those of a grid of `spacing` m, as `train`; `random` and `places` independent random ones; `seed`;
    `train_clearance`, `random_clearance` and `places_clearance` (m) off surfaces. How many of one kind are asked for does not move the
    others. Where a clearance leaves no room, it shrinks, to a quarter at most, with a line in `warnings`.

    A place is in a solid if a closed mesh has it inside, or if most of what it sees is the back of faces: walls are often of several
    meshes, none of them closed. The latter holds where at least 5 % of the places see fronts alone: elsewhere normals point anyhow.
    In a scene where most places are enclosed (at most 2 % of the rays from them leave it), a place from which a quarter or more leave is
    outside of the building, and left out; an open scene keeps all. open_share: share of rays from `places` that leave the scene.
    skipped: places of the grid, or candidates of blue noise, that are not free. WorkerError where there is no room.
    """
    if asked.get("grows") and asked["box"] is None:
        try:
            return _places(FreeSpace(scene, None, asked["seed"]), asked)
        except WorkerError:
            return _places(FreeSpace(scene, None, asked["seed"], grown=True), asked)
    return _places(FreeSpace(scene, asked["box"], asked["seed"]), asked)


def _places(space: FreeSpace, asked: dict[str, Any]) -> dict[str, Any]:
    warnings: list[str] = []
    train, skipped = np.zeros((0, 3)), 0
    clearance = asked.get("train_clearance", TRAIN_CLEARANCE)
    if asked.get("spacing") is not None:
        points = grid(space.low, space.high, asked["spacing"])
        train = space.shrinking(lambda c: points[space.are_free(points, c)], 1, clearance, "train lights", warnings)
        skipped = len(points) - len(train)
    elif asked["count"]:
        find = partial(space.random, TRAIN, POOL * asked["count"])
        pool = space.shrinking(find, asked["count"], clearance, "train lights", warnings)
        train = pool[blue_noise.chosen(pool, asked["count"], space.volume * space.free / space.tried)]
        skipped = space.tried - space.free
    others = {}
    for stream, key, off, what in (
        (RANDOM, "random", RANDOM_CLEARANCE, "held-out lights"),
        (PLACES, "places", PLACES_CLEARANCE, "free places"),
    ):
        find = partial(space.random, stream, asked[key])
        others[key] = space.shrinking(find, asked[key], asked.get(f"{key}_clearance", off), what, warnings)
    random, anywhere = others["random"], others["places"]
    judged = next((found for found in (anywhere, train, random) if len(found)), np.zeros((0, 3)))
    return {
        "box": [*space.low.tolist(), *space.high.tolist()],
        "train": train.tolist(),
        "random": random.tolist(),
        "places": anywhere.tolist(),
        "skipped": skipped,
        "open_share": float(np.mean([space.open_share(place) for place in judged[:SURVEYED]])) if len(judged) else 0.0,
        "warnings": warnings,
    }


class FreeSpace:
    """Where a box of the scene is free; `grown`: with room around all that renders. `tried`, `free`: random points last drawn, and how many
    of them were.
    """

    def __init__(self, scene: bpy.types.Scene, box: list[float] | None, seed: int, grown: bool = False) -> None:
        show_as_rendered(scene)
        self._solids, self._tree = _solids_and_tree()
        if not self._solids:
            raise WorkerError("expected something that renders, to place lights about, found no mesh")
        if box is None:
            self.low, self.high = np.min([s.low for s in self._solids], axis=0), np.max([s.high for s in self._solids], axis=0)
        else:
            self.low, self.high = np.array(box[:3], np.float64), np.array(box[3:], np.float64)
        self.low, self.high = self.low.astype(np.float64), self.high.astype(np.float64)
        if grown:
            room = max(float((self.high - self.low).max()) / 2, LEAST_ROOM * PLACES_CLEARANCE)
            self.low, self.high = self.low - room, self.high + room
        self._seed = seed
        self.tried = self.free = 0
        self._directions = even_directions(RAYS)
        self._is_closed = self._is_faced = False
        seen = [self._look(place) for place in self.random(SURVEY, SURVEYED, 0.0)]
        self._is_faced = sum(backs == 0 and fronts >= FACING for _, backs, fronts in seen) >= TRUSTED * max(len(seen), 1)
        judged = [share for share, backs, _ in seen if backs < BURIED or not self._is_faced]
        self._is_closed = sum(share <= ENCLOSED for share in judged) >= CLOSED * max(len(judged), 1)

    @property
    def volume(self) -> float:
        """Of the box, cubic meters."""
        return float(np.prod(self.high - self.low))

    def random(self, stream: int, count: int, clearance: float) -> np.ndarray:
        """(up to `count`, 3) independent free places, the first of a sequence that `stream` and the seed give."""
        rng = np.random.default_rng([self._seed, stream])
        found = [np.zeros((0, 3))]
        self.tried = self.free = 0
        while self.free < count and (self.tried < FEWEST or TRIES * self.free >= self.tried):
            points = rng.uniform(self.low, self.high, (BATCH, 3))
            found.append(points[self.are_free(points, clearance)])
            self.tried += BATCH
            self.free += len(found[-1])
        return np.concatenate(found)[:count]

    def shrinking(self, find: Callable[[float], np.ndarray], fewest: int, clearance: float, what: str, warnings: list[str]) -> np.ndarray:
        """What `find` gives for the clearance, or for half or a quarter of it if that is fewer than `fewest`."""
        best = clearance
        while best >= SMALLEST * clearance:
            found = find(best)
            if len(found) >= fewest:
                if best < clearance:
                    warnings.append(f"{what} are {best:.2g} m off surfaces in place of {clearance:.2g} m, for want of room")
                return found
            if clearance == 0:
                break
            best /= 2
        raise WorkerError(
            f"expected room for {fewest} {what} in the box {_shown(self.low)} to {_shown(self.high)} m, found {len(found)} places that are "
            "free; choose another `light_bounds` or fewer lights, or turn the normals of a closed room inwards"
        )

    def are_free(self, points: np.ndarray, clearance: float) -> np.ndarray:
        """(N,) which of the points (N, 3) are in no solid, `clearance` off all surfaces, and not outside of a closed scene."""
        free = np.array([self._tree.find_nearest(point, clearance)[0] is None for point in map(Vector, points.tolist())], bool)
        for solid in self._solids:
            if not solid.closed:
                continue
            near = np.nonzero(free & (points >= solid.low).all(axis=1) & (points <= solid.high).all(axis=1))[0]
            for i in near:
                free[i] = not is_inside(Vector(points[i]), solid)
        if self._is_closed or self._is_faced:
            for i in np.nonzero(free)[0]:
                share, backs, _ = self._look(points[i])
                free[i] = not (self._is_closed and share >= OUTSIDE) and not (self._is_faced and backs >= BURIED)
        return free

    def nearest(self, place: np.ndarray, farthest: float) -> np.ndarray | None:
        """The nearest point of all surfaces within `farthest` meters; None without one."""
        found = self._tree.find_nearest(Vector(place), farthest)[0]
        return None if found is None else np.array(found)

    def open_share(self, place: np.ndarray) -> float:
        """Share of the rays from a place that leave the scene; 0 if the first few do not."""
        return self._look(place)[0]

    def _look(self, place: np.ndarray) -> tuple[float, int, int]:
        """(share of the rays from a place that leave the scene, how many of the first ones meet a face's back, how many its front)."""
        start = Vector(place)
        left = backs = 0
        for direction in self._directions[:FIRST_RAYS]:
            hit, normal, _, _ = self._tree.ray_cast(start, direction)
            left += hit is None
            backs += hit is not None and normal.dot(direction) > 0
        fronts = FIRST_RAYS - left - backs
        if left == 0:
            return 0.0, backs, fronts
        left += sum(self._tree.ray_cast(start, direction)[0] is None for direction in self._directions[FIRST_RAYS:])
        return left / RAYS, backs, fronts


def _solids_and_tree() -> tuple[list[Solid], BVHTree]:
    """Every object that renders, and all their triangles in one tree."""
    solids, corners = [], [np.zeros((0, 3), np.float32)]
    for shown in rendered():
        mesh = shown.object.to_mesh()
        if mesh is None:
            continue
        materials = [slot.material for slot in shown.object.material_slots]
        if mesh.polygons and not (materials and all(material and is_only_volume(material) for material in materials)):
            solids.append(_solid(mesh, shown.matrix))
            placed = corners_of(mesh, shown.matrix).places
            corners.append(placed[::-1] if np.linalg.det(shown.matrix[:3, :3]) < 0 else placed)  # a mirror turns faces over
        shown.object.to_mesh_clear()
    points = np.concatenate(corners)
    return solids, BVHTree.FromPolygons(points.tolist(), np.arange(len(points)).reshape(-1, 3).tolist(), all_triangles=True)


def even_directions(count: int) -> list[Vector]:
    """Unit vectors of a spherical Fibonacci set, in an order of which every beginning is spread too; along no axis."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    turn = np.pi * (3 - math.sqrt(5)) * k + 0.31
    ring = np.sqrt(1 - z * z)
    order = np.argsort([int(f"{i:0{count.bit_length() - 1}b}"[::-1], 2) for i in range(count)])
    return [Vector(direction) for direction in np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)[order].tolist()]


def _shown(point: np.ndarray) -> str:
    return ",".join(f"{value:.4g}" for value in point)
