# SPDX-License-Identifier: GPL-3.0-or-later
"""Receivers whose geometry nodes make more than a mesh: instances, curves, points, volumes."""

from __future__ import annotations

import bpy
from closed_form_scenes import SQUARE, quad
from fidelity_parts import aside, ball, fog_material, geometry_nodes, ground, instances, joined, node


def node_instances():
    """Geometry nodes of the receiver that scatter instances above it."""
    source = aside("Ball")
    geometry_nodes(ground(), lambda group, geometry: joined(group, geometry, instances(group, source)))


def nested_instances():
    """Instances of instances."""
    source = aside("Ball", 0.1)
    inner = ball("Inner", 0.05, (60, 0, 0))
    geometry_nodes(inner, lambda group, geometry: instances(group, source))
    inner.scale = (0.4, 0.4, 1)
    geometry_nodes(ground(), lambda group, geometry: joined(group, geometry, instances(group, inner)))


def node_curves():
    """Hair made by geometry nodes of the receiver: curves beside its mesh."""
    obj = ground()

    def build(group, geometry):
        line = node(group, "GeometryNodeCurvePrimitiveLine", {"Start": (0, 0, 0), "End": (0, 0, 0.5)})
        points = node(group, "GeometryNodeDistributePointsOnFaces", {"Mesh": geometry, "Density": 60.0}).outputs["Points"]
        on = node(group, "GeometryNodeInstanceOnPoints", {"Points": points, "Instance": line.outputs[0]})
        real = node(group, "GeometryNodeRealizeInstances", {"Geometry": on.outputs["Instances"]})
        thick = node(group, "GeometryNodeSetCurveRadius", {"Curve": real.outputs[0], "Radius": 0.02})
        return joined(group, geometry, thick.outputs[0])

    geometry_nodes(obj, build)


def node_points():
    """A point cloud made by geometry nodes of the receiver."""
    obj = ground()

    def build(group, geometry):
        points = node(group, "GeometryNodeDistributePointsOnFaces", {"Mesh": geometry, "Density": 30.0}).outputs["Points"]
        up = node(group, "GeometryNodeSetPosition", {"Geometry": points, "Offset": (0, 0, 0.4)})
        thick = node(group, "GeometryNodeSetPointRadius", {"Points": up.outputs[0], "Radius": 0.08})
        return joined(group, geometry, thick.outputs[0])

    geometry_nodes(obj, build)


def node_volume():
    """A volume made by geometry nodes of the receiver."""
    obj = ground()
    obj.data.materials.append(fog_material(8.0))

    def build(group, geometry):
        cube = node(group, "GeometryNodeVolumeCube", {"Density": 1.0, "Min": (-0.6, -0.6, 0.2), "Max": (0.6, 0.6, 0.8)})
        dyed = node(group, "GeometryNodeSetMaterial", {"Geometry": cube.outputs[0], "Material": obj.data.materials[1]})
        return joined(group, geometry, dyed.outputs[0])

    geometry_nodes(obj, build)


def node_curves_and_instances():
    """Hair curves and instances beside the mesh."""
    source = aside("Ball")
    obj = ground()

    def build(group, geometry):
        line = node(group, "GeometryNodeCurvePrimitiveLine", {"Start": (0.4, 0.4, 0), "End": (0.4, 0.4, 0.9)})
        thick = node(group, "GeometryNodeSetCurveRadius", {"Curve": line.outputs[0], "Radius": 0.1})
        return joined(group, geometry, thick.outputs[0], instances(group, source))

    geometry_nodes(obj, build)


def only_instances():
    """A receiver that is nothing but instances: a wall of blocks."""
    obj = ground()
    block = quad("Block", [(x * 0.25, y * 0.25, 0) for x, y, _ in SQUARE], location=(50, 0, 0))
    geometry_nodes(obj, lambda group, geometry: instances(group, block))
    ball("Ball", 0.2, (0, 0, 0.6))


def point_cloud():
    """A point-cloud object over the receiver, made by nodes of an object elsewhere."""
    ground()
    host = quad("Host", [(x * 0.6, y * 0.6, 0.6) for x, y, _ in SQUARE])

    def build(group, geometry):
        points = node(group, "GeometryNodeDistributePointsOnFaces", {"Mesh": geometry, "Density": 30.0}).outputs["Points"]
        return node(group, "GeometryNodeSetPointRadius", {"Points": points, "Radius": 0.08}).outputs[0]

    geometry_nodes(host, build)


def node_instances_and_follower():
    """Instances scattered by the receiver, which another object reads: a lid that geometry nodes make of the receiver's own mesh."""
    node_instances()
    follower = quad("Follower", [(x, y, 5) for x, y, _ in SQUARE], color=(0, 0, 0))

    def build(group, _geometry):
        taken = node(group, "GeometryNodeObjectInfo", {"Object": bpy.data.objects["Ground"]}).outputs["Geometry"]
        meshes = node(group, "GeometryNodeSeparateComponents", {"Geometry": taken}).outputs["Mesh"]
        return node(group, "GeometryNodeTransform", {"Geometry": meshes, "Translation": (1.2, 0, 0.8)}).outputs[0]

    geometry_nodes(follower, build)


def viewport_node():
    """Geometry nodes that leave the square empty of its cover in the viewport."""
    source = aside("Ball")

    def build(group, geometry):
        seen = node(group, "GeometryNodeIsViewport")
        switch = node(group, "GeometryNodeSwitch")
        group.links.new(seen.outputs[0], switch.inputs["Switch"])
        group.links.new(instances(group, source), switch.inputs["False"])
        return joined(group, geometry, switch.outputs[0])

    geometry_nodes(ground(), build)
