# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageDenoise on arrays, by the compositor's Denoise node, Blender's only access to it in the background."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from blender_bake.ipc import WorkerError

FILE = "denoised.exr"


class Denoiser:
    """A compositing scene of our own for images of one size, with the albedo and normal (H, W, 3) that guide it, row 0 at the top."""

    def __init__(self, scratch: Path, albedo: np.ndarray, normal: np.ndarray) -> None:
        self._height, self._width = albedo.shape[:2]
        self._file = scratch / FILE
        self._scene = scene = bpy.data.scenes.new("srbf denoise")
        render = scene.render
        render.engine = "CYCLES"
        render.resolution_x, render.resolution_y, render.resolution_percentage = self._width, self._height, 100
        render.use_compositing, render.use_sequencer = True, False
        render.filepath = str(self._file)
        if hasattr(render.image_settings, "media_type"):  # Blender 5
            render.image_settings.media_type = "IMAGE"
        render.image_settings.file_format = "OPEN_EXR"
        render.image_settings.color_depth = "32"
        render.image_settings.exr_codec = "NONE"
        tree = _compositing_tree(scene)
        denoise = tree.nodes.new("CompositorNodeDenoise")
        self._noisy = self._image("srbf noisy", np.zeros_like(albedo))
        guides = {"Image": self._noisy, "Albedo": self._image("srbf albedo", albedo), "Normal": self._image("srbf normal", normal)}
        for socket, image in guides.items():
            node = tree.nodes.new("CompositorNodeImage")
            node.image = image
            tree.links.new(node.outputs["Image"], denoise.inputs[socket])
        if bpy.app.version < (5, 0):
            output = tree.nodes.new("CompositorNodeComposite").inputs["Image"]
        else:
            tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
            output = tree.nodes.new("NodeGroupOutput").inputs[0]
        tree.links.new(denoise.outputs["Image"], output)

    def denoise(self, noisy: np.ndarray) -> np.ndarray:
        """(H, W, 3) float32, linear, of any range above 0, without its noise; WorkerError where Blender cannot."""
        self._fill(self._noisy, noisy)
        self._file.unlink(missing_ok=True)
        try:
            result = bpy.ops.render.render(write_still=True, scene=self._scene.name)
        except RuntimeError as error:
            raise WorkerError(f"Blender could not denoise: {str(error).strip()}".replace("\n", " ")) from error
        if result != {"FINISHED"} or not self._file.is_file():
            raise WorkerError(f"Blender's denoiser ended as {', '.join(result)} without an image")
        import OpenImageIO as oiio  # comes with Blender

        source = oiio.ImageInput.open(str(self._file))
        pixels = np.asarray(source.read_image(0, 0, 0, 3, oiio.FLOAT), np.float32)
        source.close()
        return pixels

    def _image(self, name: str, array: np.ndarray) -> bpy.types.Image:
        image = bpy.data.images.new(name, self._width, self._height, alpha=True, float_buffer=True, is_data=True)
        self._fill(image, array)
        return image

    def _fill(self, image: bpy.types.Image, array: np.ndarray) -> None:
        pixels = np.ones((self._height, self._width, 4), np.float32)
        pixels[:, :, :3] = array[::-1]  # Blender's row 0 is the bottom
        image.pixels.foreach_set(pixels.ravel())
        image.update()


def _compositing_tree(scene: bpy.types.Scene) -> bpy.types.NodeTree:
    if bpy.app.version < (5, 0):
        scene.use_nodes = True
        scene.node_tree.nodes.clear()
        return scene.node_tree
    scene.compositing_node_group = bpy.data.node_groups.new("srbf denoise", "CompositorNodeTree")
    return scene.compositing_node_group
