# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance toward many distant viewers: bakes seen from an orthographic camera that is turned to each of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Vector

STEP = 0x9E3779B1  # between the seeds of two viewers: odd, so that none is met twice
MOST_SEED = 0x7FFFFFFF


class Viewers:
    """Unit `directions` toward viewers at an infinite distance.

    Blender's bake looks along an orthographic camera's axis at every point; viewers that are less than 11.5 degrees above a surface, or
    behind it, are raised above it (see `srbf.basis.exitant_harmonics.lifted`).
    """

    def __init__(self, scene: bpy.types.Scene, directions: Sequence[Sequence[float]]) -> None:
        self._scene = scene
        self._directions = [Vector(direction) for direction in directions]
        data = bpy.data.cameras.new("srbf viewer")
        data.type = "ORTHO"
        self._camera = bpy.data.objects.new(data.name, data)
        self._camera.rotation_mode = "QUATERNION"
        scene.collection.objects.link(self._camera)

    def images(self, render: Callable[[int], np.ndarray], seed: int) -> np.ndarray:
        """(H, W, 3 S): what `render`, given a seed, bakes toward each viewer, one after the other; each has noise of its own."""
        with self._looking() as turn:
            views = []
            for number, direction in enumerate(self._directions):
                turn(direction)
                views.append(render((seed + number * STEP) & MOST_SEED))
        return np.concatenate(views, axis=2)

    @contextmanager
    def _looking(self) -> Iterator[Callable[[Vector], None]]:
        """Bakes inside are seen from the camera, which the function given turns toward a viewer."""
        scene, cycles = self._scene, self._scene.cycles
        camera, dicing, above = scene.camera, cycles.dicing_camera, scene.render.bake.view_from
        if dicing is None:
            cycles.dicing_camera = camera  # subdivision stays as the scene's own camera sees it
        scene.camera, scene.render.bake.view_from = self._camera, "ACTIVE_CAMERA"

        def turn(direction: Vector) -> None:
            self._camera.rotation_quaternion = direction.to_track_quat("Z", "Y")  # a camera looks along its local -z

        try:
            yield turn
        finally:
            scene.camera, cycles.dicing_camera, scene.render.bake.view_from = camera, dicing, above
