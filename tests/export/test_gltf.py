"""The mesh of a glTF export: where the texels are, lit by their UVs, and plain glTF to who does not know the extension."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbf.asset import Asset
from srbf.errors import InputError, ManifestError
from srbf.export import Settings, export
from srbf.export.gltf import EXTENSION, under_white
from srbf.io.glb import Glb
from srbf.io.image import decode_srgb, read_image
from srbf.io.scene_glb import read_triangles

FLOAT32 = 1e-6
BYTE = 0.5 / 255


def bowl(make_asset: Callable[..., Asset], height: int = 12, width: int = 17) -> Asset:
    """Two charts on a curved surface, side by side without a gap in UV but far apart in space, the second mirrored in UV."""
    asset = make_asset(5, height=height, width=width)
    y, x = np.mgrid[:height, :width]
    place = np.stack([x * 0.1, -y * 0.1, 0.02 * (x - 5) ** 2 * 0.1 + 0.01 * y], axis=2)
    mirrored = x >= 9
    place[mirrored] = np.stack([3 - x * 0.1, -y * 0.1, 2 + 0 * x], axis=2)[mirrored]
    coverage = np.ones((height, width), np.float32)
    coverage[0, 0] = coverage[5, 4] = coverage[-1] = 0
    normal = np.tile(np.array([0.1, 0.05, 0.99], np.float32), (height, width, 1))
    asset.images = {"position": place.astype(np.float32), "normal": normal, "coverage": coverage}
    asset.manifest["quantity"] = "irradiance"
    asset.manifest["source"] = {"receiver": {"kind": "lightmap", "object": "Bowl", "uv_layer": "lightmap"}}
    return asset


def read(path: Path) -> Glb:
    return Glb.parse(path.read_bytes())


def primitive(document: Glb) -> dict[str, Any]:
    return document.json["meshes"][0]["primitives"][0]


def test_every_vertex_is_where_its_texel_is(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    asset = bowl(make_asset)
    report = export(asset, "gltf", tmp_path / "out")
    document = read(tmp_path / "out" / "model.glb")
    attributes = primitive(document)["attributes"]
    uv, points = document.values(attributes["TEXCOORD_1"]), document.values(attributes["POSITION"])
    rows, columns = np.floor(uv[:, 1] * asset.height).astype(int), np.floor(uv[:, 0] * asset.width).astype(int)
    expected = asset.images["position"][rows, columns]
    np.testing.assert_allclose(points, np.stack([expected[:, 0], expected[:, 2], -expected[:, 1]], axis=1), atol=FLOAT32)
    assert len(uv) == int(asset.images["coverage"].sum()) == len(set(zip(rows, columns, strict=True)))
    told = document.json["accessors"][attributes["POSITION"]]
    np.testing.assert_array_equal([told["min"], told["max"]], [points.min(axis=0), points.max(axis=0)])
    assert Asset.open(tmp_path / "out").encoding == report.encoding == "bc7"
    assert document.json["nodes"][0]["name"] == "Bowl"


def test_triangles_are_small_face_the_normals_and_leave_no_hole(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    export(bowl(make_asset), "gltf", tmp_path / "out")
    triangles = read_triangles((tmp_path / "out" / "model.glb").read_bytes())  # in the z-up frame again
    sides = np.linalg.norm(triangles.corners - np.roll(triangles.corners, 1, axis=1), axis=2)
    assert sides.max() < 0.3  # none from chart to chart, 2 m away
    flat = np.cross(triangles.corners[:, 1] - triangles.corners[:, 0], triangles.corners[:, 2] - triangles.corners[:, 0])
    assert (flat[:, 2] > 0).all()
    area = np.linalg.norm(flat, axis=1).sum() / 2
    # 10 x 8 and 10 x 7 quads of 0.1 m, less the corner's half and the hole's four halves
    assert area == pytest.approx(0.01 * (80 + 70 - 0.5 - 2), rel=0.02)


def test_it_is_plain_gltf_with_a_picture(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    asset = bowl(make_asset)
    export(asset, "gltf", tmp_path / "out")
    data = (tmp_path / "out" / "model.glb").read_bytes()
    assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))
    document = read(tmp_path / "out" / "model.glb").json
    assert set(document["extensionsUsed"]) == {EXTENSION, "KHR_materials_unlit"} and "extensionsRequired" not in document
    body = read(tmp_path / "out" / "model.glb").body
    assert document["buffers"] == [{"byteLength": len(body)}]
    for view in document["bufferViews"]:
        assert view["byteOffset"] % 4 == 0 and view["byteOffset"] + view["byteLength"] <= len(body)
    (material,) = document["materials"]
    assert material["extensions"][EXTENSION] == {"manifest": "asset.json", "texCoord": 1}
    texture = material["pbrMetallicRoughness"]["baseColorTexture"]
    assert texture == {"index": 0, "texCoord": 1}
    view = document["bufferViews"][document["images"][document["textures"][0]["source"]]["bufferView"]]
    (tmp_path / "picture.png").write_bytes(body[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
    expected = np.clip(under_white(asset), 0, 1)
    assert np.ptp(expected) > 0.5
    slope = 0.0031308 / 0.04045 * 2.6 * 12.92  # of the sRGB curve, at most
    np.testing.assert_allclose(decode_srgb(read_image(tmp_path / "picture.png", 3)), expected, atol=BYTE * slope)
    assert (tmp_path / "out" / material["extensions"][EXTENSION]["manifest"]).is_file()
    told = json.loads((tmp_path / "out" / "asset.json").read_text())
    assert "model.glb" in told["sha256"]


def made_glb(path: Path, uv_sets: int, name: str = "Bowl") -> None:
    """A triangle under the receiver's name, and one of another object."""
    document = Glb({"asset": {"version": "2.0"}})
    meshes = []
    for shift in (0.0, 5.0):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]], np.float32) + np.float32(shift)
        attributes = {"POSITION": document.add_accessor(points, bounds=True)}
        for i in range(uv_sets):
            attributes[f"TEXCOORD_{i}"] = document.add_accessor(points[:, [0, 2]] / np.float32(2 + i))
        primitives = [{"attributes": attributes, "indices": document.add_accessor(np.arange(3, dtype=np.uint32)), "material": 0}]
        meshes.append(document.add("meshes", {"primitives": primitives}))
    document.add("materials", {"name": "clay", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1]}})
    nodes = [document.add("nodes", {"name": n, "mesh": m}) for n, m in zip((name, "PointLight"), meshes, strict=True)]
    document.json["scenes"] = [{"nodes": nodes}]
    path.write_bytes(document.pack())


@pytest.mark.lengthy
@pytest.mark.parametrize("uv_sets", [1, 2])
def test_a_mesh_that_is_given(make_asset: Callable[..., Asset], tmp_path: Path, uv_sets: int) -> None:
    """Its last UV set of two is the lightmap's, its only one too; other objects keep what they have."""
    made_glb(tmp_path / "mesh.glb", uv_sets)
    export(bowl(make_asset), "gltf", tmp_path / "out", Settings(mesh=tmp_path / "mesh.glb"))
    document = read(tmp_path / "out" / "model.glb")
    lit, other = (mesh["primitives"][0] for mesh in document.json["meshes"])
    uv = document.values(lit["attributes"]["TEXCOORD_1"])
    np.testing.assert_allclose(uv, np.array([[0, 0], [1, 0], [0, 1]]) / (1 + uv_sets), atol=FLOAT32)
    np.testing.assert_allclose(document.values(lit["attributes"]["TEXCOORD_0"])[1], [0.5, 0], atol=FLOAT32)
    material = document.json["materials"][lit["material"]]
    assert material["extensions"][EXTENSION]["surface"] == 0 == other["material"]
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [0.8, 0.4, 0.2, 1]
    assert document.json["materials"][0] == {"name": "clay", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1]}}
    assert ("TEXCOORD_1" in other["attributes"]) == (uv_sets == 2)
    made_glb(tmp_path / "mesh.glb", uv_sets, name="Vase")  # none is named as the receiver: all are lit
    export(bowl(make_asset), "gltf", tmp_path / "all", Settings(mesh=tmp_path / "mesh.glb"))
    assert all(mesh["primitives"][0]["material"] == 1 for mesh in read(tmp_path / "all" / "model.glb").json["meshes"])


def test_a_view_is_a_rectangle(make_planes: Callable[..., Asset], tmp_path: Path) -> None:
    asset = make_planes(position=False)
    asset.manifest["quantity"] = "radiance"
    asset.manifest["source"] = {"receiver": {"kind": "view", "camera": "Camera"}}
    export(asset, "gltf", tmp_path / "out")
    document = read(tmp_path / "out" / "model.glb")
    points, uv = (document.values(primitive(document)["attributes"][name]) for name in ("POSITION", "TEXCOORD_1"))
    assert np.ptp(points[:, 0]) / np.ptp(points[:, 1]) == pytest.approx(14 / 9)
    assert (uv[points[:, 1] > 0, 1] == 0).all() and (uv[points[:, 0] < 0, 0] == 0).all()  # the top is row 0


def test_what_cannot_be_written_is_refused(make_asset: Callable[..., Asset], tmp_path: Path) -> None:
    asset, out = bowl(make_asset), tmp_path / "out"
    bare = replace(asset, images={"coverage": asset.images["coverage"]})
    with pytest.raises(InputError, match="give a `mesh`"):
        export(bare, "gltf", out)
    lonely = np.zeros_like(asset.images["coverage"])
    lonely[::3, ::3] = 1
    with pytest.raises(InputError, match="neighbors"):
        export(replace(asset, images={**asset.images, "coverage": lonely}), "gltf", out)
    vertices = replace(asset, manifest={**asset.manifest, "source": {"receiver": {"kind": "vertices", "object": "Bowl"}}})
    with pytest.raises(InputError, match="vertices"):
        export(vertices, "gltf", out)
    (tmp_path / "bad.glb").write_bytes(b"glTF, they say")
    with pytest.raises(ManifestError, match="bad.glb"):
        export(asset, "gltf", out, Settings(mesh=tmp_path / "bad.glb"))
    with pytest.raises(ManifestError, match="No such file"):
        export(asset, "gltf", out, Settings(mesh=tmp_path / "none.glb"))
    made_glb(tmp_path / "flat.glb", 0)
    with pytest.raises(InputError, match="UV set"):
        export(asset, "gltf", out, Settings(mesh=tmp_path / "flat.glb"))
    assert not out.exists()
