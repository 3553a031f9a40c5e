# SPDX-License-Identifier: GPL-3.0-or-later
"""Distance from the origin at which single precision, in which Cycles traces rays, no longer resolves texels."""

from __future__ import annotations

import math

import bpy
import numpy as np

from blender_bake.ipc import Events
from blender_bake.receiver_objects import world_area

FINE_ENOUGH = 1 / 8  # step of single precision over texel: past it, shadows of a small scene were off by 1 % of its light


def warn_of_objects(objects: list[bpy.types.Object], receivers: int, what: str, events: Events) -> None:
    """Warn where single precision is too coarse for so many `receivers` (texels, vertices: `what`) on the meshes `objects`."""
    pitch = math.sqrt(sum(world_area(obj) for obj in objects) / max(1, receivers))
    warn(max(_reach(obj) for obj in objects), pitch, what, events)


def warn_of_pixels(position: np.ndarray, hit: np.ndarray, events: Events) -> None:
    """The same for a view's world positions (H, W, 3), where `hit` (H, W, 1) is not 0."""
    seen = hit[:, :, 0] > 0
    both = seen[:, 1:] & seen[:, :-1]
    if both.any():
        pitch = float(np.median(np.linalg.norm(np.diff(position.astype(np.float64), axis=1)[both], axis=1)))
        warn(float(np.abs(position[seen]).max()), pitch, "pixel", events)


def warn(reach: float, pitch: float, what: str, events: Events) -> None:
    """Warn where coordinates as large as `reach` (m) step by more than FINE_ENOUGH of the `pitch` (m) of texels."""
    step = float(np.spacing(np.float32(reach)))
    if step > FINE_ENOUGH * pitch:
        events.warn(
            f"the receiver reaches {_length(reach)} from the origin, where single precision steps by {_length(step)} and a {what} is "
            f"{_length(pitch)}: positions and shadows are off by as much; move the scene to the origin"
        )


def _reach(obj: bpy.types.Object) -> float:
    """The largest coordinate of the object's vertices in the world, m."""
    points = np.empty(len(obj.data.vertices) * 3, np.float32)
    obj.data.vertices.foreach_get("co", points)
    matrix = np.array(obj.matrix_world, np.float64)
    return float(np.abs(points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]).max())


def _length(meters: float) -> str:
    for size, unit in ((1e3, "km"), (1, "m"), (1e-3, "mm")):
        if meters >= size:
            return f"{meters / size:,.0f} {unit}" if meters >= 100 * size else f"{meters / size:.3g} {unit}"
    return f"{meters:.2g} m"
