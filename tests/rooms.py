"""A closed room with two boxes in it, as a lightmap of squares: what light inside a scene falls on."""

from __future__ import annotations

import numpy as np
from closed_forms import flat_normals

from srbf.io.scene_glb import KNOTS, Triangles
from srbf.visibility.receivers import Receivers

CELLS = 4  # of the lightmap per side, one a face
GUTTER = 1.25  # texels about each face: no center on an edge


def face(center: tuple[float, float, float], u: tuple[float, float, float], v: tuple[float, float, float]) -> np.ndarray:
    """Corners (4, 3) of the parallelogram with the sides u and v that faces u x v."""
    middle, across, up = np.array(center), np.array(u) / 2, np.array(v) / 2
    return np.array([middle - across - up, middle + across - up, middle + across + up, middle - across + up])


def box_faces(center: tuple[float, float], half: tuple[float, float, float], turn: float) -> list[np.ndarray]:
    """The five faces of a box on the floor that are seen."""
    (x, y), (a, b, c) = center, half
    e = np.array([np.cos(turn), np.sin(turn), 0])
    f = np.array([-np.sin(turn), np.cos(turn), 0])
    up = np.array([0, 0, 1.0])
    middle = np.array([x, y, c])
    sides = [(a, e, b, f), (b, f, a, -e), (a, -e, b, -f), (b, -f, a, e)]
    made = [face(tuple(middle + c * up), tuple(2 * a * e), tuple(2 * b * f))]
    for out, toward, wide, across in sides:
        made.append(face(tuple(middle + out * toward), tuple(2 * wide * across), tuple(2 * c * up)))
    return made


def room_faces() -> list[np.ndarray]:
    """A room of 2 x 2 x 2 m on z = 0 about the z axis, a tall and a low box."""
    walls = [
        face((0, 0, 0), (2, 0, 0), (0, 2, 0)),
        face((0, 0, 2), (2, 0, 0), (0, -2, 0)),
        face((-1, 0, 1), (0, 2, 0), (0, 0, 2)),
        face((1, 0, 1), (0, -2, 0), (0, 0, 2)),
        face((0, 1, 1), (2, 0, 0), (0, 0, 2)),
        face((0, -1, 1), (-2, 0, 0), (0, 0, 2)),
    ]
    return [*walls, *box_faces((-0.35, 0.3), (0.3, 0.3, 0.6), 0.3), *box_faces((0.4, -0.3), (0.3, 0.3, 0.3), -0.3)]


def room(size: int, panes: np.ndarray | None = None, passed: float = 0.5, **sampling: object) -> Receivers:
    """The room's lightmap of `size` squared texels; `panes` (T, 3, 3): translucent walls that are no receivers."""
    position, normal = np.zeros((size, size, 3), np.float32), np.zeros((size, size, 3), np.float32)
    coverage = np.zeros((size, size), np.float32)
    corners, flat = [], []
    side = size // CELLS
    for number, quad in enumerate(room_faces()):
        row, column = divmod(number, CELLS)
        steps = (np.arange(side) + 0.5 - GUTTER) / (side - 2 * GUTTER)
        s, t = np.meshgrid(steps, steps)
        across, up = quad[1] - quad[0], quad[3] - quad[0]
        where = (slice(row * side, row * side + side), slice(column * side, column * side + side))
        position[where] = quad[0] + s[..., None] * across + t[..., None] * up
        normal[where] = np.cross(across, up) / np.linalg.norm(np.cross(across, up))
        coverage[where] = (np.minimum(s, t) > 0) & (np.maximum(s, t) < 1)
        low = (np.array([column, row]) * side + GUTTER) / size
        high = (np.array([column + 1, row + 1]) * side - GUTTER) / size
        uv = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        for order in ((0, 1, 2), (0, 2, 3)):
            corners.append(quad[list(order)])
            flat.append(uv[list(order)])
    opaque = np.array(corners, np.float32)
    panes = np.zeros((0, 3, 3), np.float32) if panes is None else panes
    every = np.concatenate([opaque, panes])
    lightmap = np.concatenate([np.array(flat, np.float32), np.full((len(panes), 3, 2), np.nan, np.float32)])
    curve = np.stack([np.zeros((KNOTS, 3), np.float32), np.full((KNOTS, 3), passed, np.float32)])
    material = (np.arange(len(every)) >= len(opaque)).astype(int)
    triangles = Triangles(every, flat_normals(every), material, np.ones(len(every), bool), curve, lightmap)
    images = {"position": position, "normal": normal, "coverage": coverage}
    return Receivers(size, size, "irradiance", images, triangles, {"sun_angle": 0.0, "footprint": 1.0, **sampling})
