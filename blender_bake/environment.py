# SPDX-License-Identifier: GPL-3.0-or-later
"""A world of ours: an equirectangular map of radiance, in the frame that `srbf.lights.EnvironmentLight` has it in."""

from __future__ import annotations

import bpy
import numpy as np

from blender_bake.scene import black_world


class EnvironmentWorld:
    """The scene's world while a map shines, and the world that it had before."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene, self._before = scene, scene.world
        self._maps: dict[str, bpy.types.World] = {}

    def set(self, file: str | None) -> None:
        """The map (H, W, 3) of a .npy file, row 0 towards +z; None: the world of before."""
        if file is None:
            self._scene.world = self._before
            return
        if file not in self._maps:
            self._maps[file] = _world_of(np.load(file))
        self._scene.world = self._maps[file]


def _world_of(radiance: np.ndarray) -> bpy.types.World:
    height, width = radiance.shape[:2]
    image = bpy.data.images.new("srbf environment", width, height, float_buffer=True)
    image.colorspace_settings.is_data = True
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = radiance[::-1]  # Blender's row 0 is the bottom
    image.pixels.foreach_set(pixels.ravel())
    world = black_world()
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(node for node in nodes if node.bl_idname == "ShaderNodeBackground")
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, "Closest"
    links.new(texture.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.0
    return world
