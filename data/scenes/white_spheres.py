# SPDX-License-Identifier: GPL-3.0-or-later
"""White spheres that light falls on and that nothing else sees: `python white_spheres.py SCENE.blend OUT.blend PLACES.json RADIUS`.

PLACES.json lists their centers, m. All are one object, "White spheres", of 42 vertices each; its normals are those of the spheres.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import bpy

NAME = "White spheres"


def main() -> None:
    """Add the spheres to a scene."""
    import bmesh  # there is none before bpy is imported

    scene, output, places, radius = sys.argv[-4:]
    bpy.ops.wm.open_mainfile(filepath=scene)
    shape = bmesh.new()
    for x, y, z in json.loads(Path(places).read_text(encoding="utf-8")):
        made = bmesh.ops.create_icosphere(shape, subdivisions=2, radius=float(radius))
        bmesh.ops.translate(shape, verts=made["verts"], vec=(x, y, z))
    mesh = bpy.data.meshes.new(NAME)
    shape.to_mesh(mesh)
    mesh.shade_smooth()
    white = bpy.data.materials.new(NAME)
    white.use_nodes = True
    nodes = white.node_tree.nodes
    nodes.clear()
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    white.node_tree.links.new(diffuse.outputs["BSDF"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    mesh.materials.append(white)
    obj = bpy.data.objects.new(NAME, mesh)
    for ray in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(obj, f"visible_{ray}", False)
    bpy.context.scene.collection.objects.link(obj)
    bpy.ops.wm.save_as_mainfile(filepath=output)


if __name__ == "__main__":
    main()
