# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of the sockets of a material's nodes, for a camera ray along the normal, where they are constant over the surface."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

RAMP_STEPS = 32
DIELECTRIC = 0.04  # what glass of IOR 1.5 reflects straight on
OPERATIONS: dict[str, Callable[..., float]] = {
    "ADD": operator.add,
    "SUBTRACT": operator.sub,
    "MULTIPLY": operator.mul,
    "MAXIMUM": max,
    "MINIMUM": min,
    "GREATER_THAN": operator.gt,
    "LESS_THAN": operator.lt,
}


@dataclass(frozen=True)
class Place:
    """A socket, and the nodes of the groups that it lies in, the outermost first."""

    socket: bpy.types.NodeSocket
    groups: tuple[bpy.types.Node, ...] = ()

    @property
    def node(self) -> bpy.types.Node:
        """The node that has it."""
        return self.socket.node

    def input(self, name: str | int) -> Place | None:
        """An input of the same node."""
        socket = self.node.inputs.get(name) if isinstance(name, str) else self.node.inputs[name]
        return None if socket is None else Place(socket, self.groups)


def source(place: Place) -> tuple[Place, Place | None]:
    """(the input that decides, the output that feeds it or None), past reroutes, muted nodes and the borders of groups."""
    while True:
        link = next((link for link in place.socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return place, None
        node, groups = link.from_node, place.groups
        inner: bpy.types.NodeSocket | None
        if node.mute:
            inner = next((way.from_socket for way in node.internal_links if way.to_socket == link.from_socket), None)
        elif node.type == "REROUTE":
            inner = node.inputs[0]
        elif node.type == "GROUP" and node.node_tree is not None:
            ends = [end for end in node.node_tree.nodes if end.type == "GROUP_OUTPUT" and end.is_active_output]
            inner, groups = _alike(ends[0].inputs if ends else (), link.from_socket), (*groups, node)
        elif node.type == "GROUP_INPUT" and groups:
            inner, groups = _alike(groups[-1].inputs, link.from_socket), groups[:-1]
        else:
            return place, Place(link.from_socket, groups)
        if inner is None:
            return place, None
        place = Place(inner, groups)


def value(place: Place | None) -> np.ndarray | None:
    """(1,) or (3,) value of a socket that is constant over the surface; None where there is no such socket, or it varies."""
    if place is None:
        return None
    deciding, output = source(place)
    return _default(deciding.socket) if output is None else _of_output(output)


def number(place: Place | None, otherwise: float) -> float:
    """The value as a number; where it varies the mean of its color ramp, else the unlinked value, else `otherwise`."""
    found = guess(place)
    return otherwise if found is None else float(found.mean())


def color(place: Place | None, otherwise: tuple[float, float, float]) -> np.ndarray:
    """(3,) the value as a linear color, guessed as a `number` is."""
    found = guess(place)
    return np.array(otherwise if found is None else np.broadcast_to(found, 3), np.float64)


def guess(place: Place | None) -> np.ndarray | None:
    """`value`; where it varies the mean of the color ramp that feeds it, else the unlinked value."""
    found = value(place)
    if found is not None or place is None:
        return found
    ramp = _ramp_behind(place)
    if ramp is None:
        return _default(place.socket)
    return np.mean([ramp.evaluate(i / (RAMP_STEPS - 1))[:3] for i in range(RAMP_STEPS)], axis=0)


def _of_output(output: Place) -> np.ndarray | None:
    node, name = output.node, output.socket.name
    if node.type in {"RGB", "VALUE"}:
        return _default(node.outputs[0])
    if node.type == "LIGHT_PATH":
        return None if name == "Ray Length" else np.array([1.0 if name == "Is Camera Ray" else 0.0])
    if node.type == "NEW_GEOMETRY":
        return np.array([0.0]) if name == "Backfacing" else None
    if node.type == "FRESNEL" or (node.type == "LAYER_WEIGHT" and name == "Fresnel"):
        return np.array([DIELECTRIC])
    if node.type == "LAYER_WEIGHT":
        return np.array([0.0])
    if node.type == "MATH":
        return _calculated(output)
    if node.type in {"MIX", "MIX_RGB"}:
        return _mixed(output)
    if node.type == "VALTORGB":
        at = value(output.input("Fac"))
        return None if at is None else np.array(node.color_ramp.evaluate(float(at.mean()))[:3])
    return None


def _calculated(output: Place) -> np.ndarray | None:
    operation = OPERATIONS.get(output.node.operation)
    sides = [value(output.input(i)) for i in (0, 1)]
    if output.node.operation == "MULTIPLY" and any(side is not None and side.mean() == 0 for side in sides):
        return np.array([0.0])
    if operation is None or sides[0] is None or sides[1] is None:
        return None
    result = float(operation(float(sides[0].mean()), float(sides[1].mean())))
    return np.array([min(max(result, 0.0), 1.0) if output.node.use_clamp else result])


def _mixed(output: Place) -> np.ndarray | None:
    """Of a plain mix of known colors or numbers."""
    if output.node.blend_type != "MIX" and getattr(output.node, "data_type", "RGBA") == "RGBA":
        return None
    inputs = [Place(socket, output.groups) for socket in output.node.inputs if socket.enabled]
    if len(inputs) != 3:
        return None
    share, first, second = (value(place) for place in inputs)
    if share is None or first is None or second is None:
        return None
    t = min(max(float(share.mean()), 0.0), 1.0)
    return (1 - t) * first + t * second


def _ramp_behind(place: Place) -> bpy.types.ColorRamp | None:
    """The nearest color ramp that feeds a socket, through whatever changes its colors."""
    seen: set[tuple[bpy.types.Node, ...]] = set()
    waiting = [place]
    while waiting:
        _, output = source(waiting.pop(0))
        if output is None or (output.node, *output.groups) in seen:
            continue
        seen.add((output.node, *output.groups))
        if output.node.type == "VALTORGB":
            return output.node.color_ramp
        waiting += list(_linked(output))
    return None


def _linked(output: Place) -> Iterator[Place]:
    return (Place(socket, output.groups) for socket in output.node.inputs if socket.is_linked)


def _default(socket: bpy.types.NodeSocket) -> np.ndarray | None:
    held: Any = getattr(socket, "default_value", None)
    if isinstance(held, (int, float)):
        return np.array([float(held)])
    return np.array(held[:3], np.float64) if socket.type in {"RGBA", "VECTOR"} else None


def _alike(sockets: Any, other: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == other.identifier), None)
