# SPDX-License-Identifier: GPL-3.0-or-later
"""Relighting maps as shader nodes: max(0, sum_i c_i w_i) + ambient, with weights w_i set for suns and computed per point for point lights.

The chain is that of glsl/methods/relighting_map.glsl, with R by arccosine and exponential in place of its table.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import bpy
import numpy as np

from .asset import AssetError, RelightingMaps
from .lights import PointLight, Sun

Layout = Literal["IMAGES", "ATLAS"]
Falloff = Literal["LINEAR", "INVERSE_SQUARE"]

RADIUS = 1e-4  # meters: least distance of a receiver from a point light, as in the library
POINT_LIGHT_SOCKETS = {"Position": "NodeSocketVector", "Color": "NodeSocketVector", "a0": "NodeSocketFloat", "Power": "NodeSocketFloat"}
WIDTH, HEIGHT = 180, 160  # spacing of nodes on the sheet


class Sheet:
    """Nodes of one tree, placed in columns in order of creation."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self.tree = tree

    def node(self, kind: str, column: float, row: float, name: str = "", **settings: Any) -> bpy.types.Node:
        node = self.tree.nodes.new(kind)
        node.location = (column * WIDTH, -row * HEIGHT)
        node.hide = kind in ("ShaderNodeVectorMath", "ShaderNodeMath")
        if name:
            node.name = node.label = name
        for key, value in settings.items():
            setattr(node, key, value)
        return node

    def math(self, operation: str, column: float, row: float, *inputs: Any, name: str = "") -> bpy.types.NodeSocket:
        return self._operate("ShaderNodeMath", operation, column, row, inputs, name)

    def vector(self, operation: str, column: float, row: float, *inputs: Any, name: str = "") -> bpy.types.NodeSocket:
        return self._operate("ShaderNodeVectorMath", operation, column, row, inputs, name)

    def _operate(self, kind: str, operation: str, column: float, row: float, inputs: Any, name: str) -> bpy.types.NodeSocket:
        node = self.node(kind, column, row, name, operation=operation)
        sockets = list(node.inputs)
        if operation == "SCALE":  # its factor is the last socket
            sockets = [sockets[0], sockets[3]]
        for socket, value in zip(sockets, inputs, strict=False):
            self.put(value, socket)
        return next(socket for socket in node.outputs if socket.enabled)

    def put(self, value: Any, socket: bpy.types.NodeSocket) -> None:
        """Link a socket, or set a number or a vector."""
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value


def build(maps: RelightingMaps, name: str, point_lights: int, uv_layer: str, layout: Layout) -> bpy.types.NodeTree:
    """A group `name` with one output, Color: the asset under suns, whose weights `set_lights` writes, and `point_lights` point lights."""
    tree = _empty_tree(name)
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketVector")
    sheet = Sheet(tree)
    coordinates = sheet.node("ShaderNodeUVMap", 0, 0, uv_map=uv_layer).outputs["UV"]
    groups = []
    if point_lights:
        point_light_tree = _point_light_tree(maps, f"{name} point light")
        groups = [
            sheet.node("ShaderNodeGroup", 0, 2 + point_light, f"point light {point_light}", node_tree=point_light_tree)
            for point_light in range(point_lights)
        ]
    textures = _images(sheet, maps, coordinates) if layout == "IMAGES" else _atlas(sheet, maps, coordinates, name)
    total: Any = (0.0, 0.0, 0.0)
    for i, texture in enumerate(textures):
        weight: Any = (0.0, 0.0, 0.0)
        for group in groups:
            weight = sheet.vector("ADD", 4, i, weight, group.outputs[i])
        weight = sheet.vector("ADD", 5, i, weight, (0.0, 0.0, 0.0), name=_far(i))
        total = sheet.vector("MULTIPLY_ADD", 6, i, texture, weight, total)
    row = len(textures)
    total = sheet.vector("MAXIMUM", 7, row, total, (0.0, 0.0, 0.0))
    if maps.ambient is not None:
        total = sheet.vector("ADD", 8, row, total, _texture(sheet, _load(maps.ambient), coordinates, 2, row))
    output = sheet.node("NodeGroupOutput", 9, row)
    sheet.put(total, output.inputs[0])
    return tree


def set_lights(
    tree: bpy.types.NodeTree, maps: RelightingMaps, suns: list[Sun], point_lights: list[PointLight], a0: float, falloff: Falloff
) -> None:
    """Write the k weights of all suns together, and each point light's position and color, where they have changed."""
    weights = np.zeros((maps.k, 3))
    for sun in suns:
        weights += np.outer(maps.weights(np.array(sun.direction)), sun.color)
    for i, weight in enumerate(weights):
        _set(tree.nodes[_far(i)].inputs[1], weight)
    for index, point_light in enumerate(point_lights):
        inputs = tree.nodes[f"point light {index}"].inputs
        _set(inputs["Position"], point_light.position)
        _set(inputs["Color"], point_light.color)
        _set(inputs["a0"], a0)
        _set(inputs["Power"], 1.0 if falloff == "LINEAR" else 2.0)


def point_lights_in(tree: bpy.types.NodeTree) -> int:
    """How many point lights a group was built for."""
    return sum(node.bl_idname == "ShaderNodeGroup" for node in tree.nodes)


def remove(tree: bpy.types.NodeTree) -> None:
    """Remove a group, its point lights' group and its atlas; images from files stay, since others may use them."""
    inner = {node.node_tree for node in tree.nodes if node.bl_idname == "ShaderNodeGroup"}
    atlas = bpy.data.images.get(_atlas_name(tree.name))
    bpy.data.node_groups.remove(tree)
    for group in inner:
        bpy.data.node_groups.remove(group)
    if atlas is not None:
        bpy.data.images.remove(atlas)


def _point_light_tree(maps: RelightingMaps, name: str) -> bpy.types.NodeTree:
    """Weights under a point light: w_i = Color (a0 / |L|)^Power R_i(L / |L|), L = Position - the point shaded [Wong2005, fig. 8-10]."""
    tree = _empty_tree(name)
    for socket, kind in POINT_LIGHT_SOCKETS.items():
        tree.interface.new_socket(socket, in_out="INPUT", socket_type=kind)
    for i in range(maps.k):
        tree.interface.new_socket(f"Weight {i}", in_out="OUTPUT", socket_type="NodeSocketVector")
    sheet = Sheet(tree)
    given = sheet.node("NodeGroupInput", 0, 0).outputs
    point = sheet.node("ShaderNodeNewGeometry", 0, 2).outputs["Position"]
    to_light = sheet.vector("SUBTRACT", 1, 0, given["Position"], point)
    distance = sheet.vector("LENGTH", 2, 0, to_light)
    unit = sheet.vector("NORMALIZE", 2, 1, to_light)
    ratio = sheet.math("DIVIDE", 4, 0, given["a0"], sheet.math("MAXIMUM", 3, 0, distance, RADIUS))
    strength = sheet.vector("SCALE", 6, 0, given["Color"], sheet.math("POWER", 5, 0, ratio, given["Power"]))
    output = sheet.node("NodeGroupOutput", 12, 0)
    falling = -0.5 / maps.spread**2
    for i, center in enumerate(maps.centers):
        theta = sheet.math("ARCCOSINE", 8, i, sheet.vector("DOT_PRODUCT", 7, i, unit, center.tolist()))
        exponent = sheet.math("MULTIPLY", 10, i, sheet.math("MULTIPLY", 9, i, theta, theta), falling)
        weight = sheet.vector("SCALE", 11, i, strength, sheet.math("EXPONENT", 11, i, exponent))
        sheet.put(weight, output.inputs[i])
    return tree


def _images(sheet: Sheet, maps: RelightingMaps, coordinates: bpy.types.NodeSocket) -> list[bpy.types.NodeSocket]:
    """One image texture per map, decoded."""
    decoded = []
    for i, path in enumerate(maps.files):
        stored = _texture(sheet, _load(path), coordinates, 2, i)
        if (maps.scale[i] == 1).all() and (maps.bias[i] == 0).all():
            decoded.append(stored)
        else:
            decoded.append(sheet.vector("MULTIPLY_ADD", 3, i, stored, maps.scale[i].tolist(), maps.bias[i].tolist()))
    return decoded


def _atlas(sheet: Sheet, maps: RelightingMaps, coordinates: bpy.types.NodeSocket, name: str) -> list[bpy.types.NodeSocket]:
    """All maps, decoded, as tiles of one float image: one texture slot of the graphics card for any number of maps.

    Coordinates stay half a texel away from a tile's border, so that tiles do not bleed into each other.
    """
    columns = math.ceil(math.sqrt(maps.k))
    rows = math.ceil(maps.k / columns)
    pixels = np.zeros((rows * maps.height, columns * maps.width, 4), np.float32)
    pixels[..., 3] = 1
    for i, path in enumerate(maps.files):
        row, column = divmod(i, columns)
        tile = pixels[row * maps.height : (row + 1) * maps.height, column * maps.width : (column + 1) * maps.width, :3]
        tile[...] = _pixels(_load(path))[..., :3] * maps.scale[i] + maps.bias[i]
    atlas = bpy.data.images.new(_atlas_name(name), pixels.shape[1], pixels.shape[0], float_buffer=True, is_data=True)
    atlas.pixels.foreach_set(pixels.ravel())
    atlas.update()
    atlas.pack()  # otherwise it is not saved with the .blend
    half = (0.5 / maps.width, 0.5 / maps.height, 0.0)
    inner = sheet.vector("MAXIMUM", 0.5, 0, coordinates, half)
    inner = sheet.vector("MINIMUM", 1, 0, inner, (1 - half[0], 1 - half[1], 1.0))
    decoded = []
    for i in range(maps.k):
        row, column = divmod(i, columns)
        place = sheet.vector("MULTIPLY_ADD", 1.5, i, inner, (1 / columns, 1 / rows, 0.0), (column / columns, row / rows, 0.0))
        decoded.append(_texture(sheet, atlas, place, 2, i))
    return decoded


def _texture(sheet: Sheet, image: bpy.types.Image, coordinates: bpy.types.NodeSocket, column: float, row: float) -> bpy.types.NodeSocket:
    node = sheet.node("ShaderNodeTexImage", column, row, image=image, extension="EXTEND", interpolation="Linear")
    node.hide = True
    sheet.put(coordinates, node.inputs["Vector"])
    return node.outputs["Color"]


def _load(path: Any) -> bpy.types.Image:
    try:
        image = bpy.data.images.load(str(path), check_existing=True)
    except RuntimeError as error:
        raise AssetError(f"Blender cannot read {path}: {str(error).strip()}; fit again") from error
    if image.colorspace_settings.name != "Non-Color":
        image.colorspace_settings.name = "Non-Color"
        image.alpha_mode = "NONE"
        image.reload()  # the file may hold another asset by now
    return image


def _pixels(image: bpy.types.Image) -> np.ndarray:
    """(H, W, 4) in Blender's order, bottom row first."""
    width, height = image.size
    if not width:
        raise AssetError(f"Blender cannot read {image.filepath}; fit again")
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, image.channels)


def _empty_tree(name: str) -> bpy.types.NodeTree:
    before = bpy.data.node_groups.get(name)
    if before is not None:
        remove(before)
    return bpy.data.node_groups.new(name, "ShaderNodeTree")


def _atlas_name(name: str) -> str:
    return f"{name} atlas"


def _far(i: int) -> str:
    return f"far weight {i}"


def _set(socket: bpy.types.NodeSocket, value: Any) -> None:
    """Set a value only where it differs, since every write makes Blender re-evaluate the scene."""
    new = np.asarray(value, np.float32)
    if not np.array_equal(np.asarray(socket.default_value, np.float32), new):
        socket.default_value = new.tolist()
