"""`srbf mesh` by real Blender: things where they are, UVs that find the capture's texels, materials as their nodes say."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SCENES, built
from typer.testing import CliRunner

from srbf.bake.run import Bake, Reporter
from srbf.bake.settings import BakeSettings, Receiver
from srbf.capture import Capture
from srbf.cli import app
from srbf.errors import BakeError
from srbf.export.gltf import EXTENSION, model
from srbf.export.scene_mesh import SceneMesh, write_scene_mesh
from srbf.io.glb import Glb
from srbf.io.image import decode_srgb, read_image
from srbf.methods.relighting_map import RelightingMap

pytestmark = pytest.mark.blender

FLOAT32 = 1e-5  # of meters and UVs a few units large
SMALL = {"lights": 4, "samples": 1, "validation": 0, "holdout": 1, "holdout_samples": 1}
BYTE = 0.5 / 255 * 2.4  # half a step of a byte where the sRGB curve is flattest, in linear light


class Scene:
    """A .glb taken apart: its nodes by name, in the frame of the scene."""

    def __init__(self, path: Path, made: SceneMesh | None = None) -> None:
        self.made = made
        self.document = Glb.parse(path.read_bytes())
        self.json = self.document.json
        self.nodes = {node["name"]: node for node in self.json["nodes"]}

    def primitives(self, name: str) -> list[dict[str, Any]]:
        """Of an object: its attributes at the corners of triangles (T, 3, C), and its `material`."""
        found = []
        for primitive in self.json["meshes"][self.nodes[name]["mesh"]]["primitives"]:
            order = self.document.values(primitive["indices"]).reshape(-1, 3)
            corners: dict[str, Any] = {key: self.document.values(index)[order] for key, index in primitive["attributes"].items()}
            found.append({**corners, "material": self.json["materials"][primitive["material"]]})
        return found

    def material(self, name: str) -> dict[str, Any]:
        (primitive,) = self.primitives(name)
        return primitive["material"]

    def picture(self, folder: Path, material: dict[str, Any]) -> np.ndarray:
        """(H, W, 3) linear base color."""
        texture = self.json["textures"][material["pbrMetallicRoughness"]["baseColorTexture"]["index"]]
        view = self.json["bufferViews"][self.json["images"][texture["source"]]["bufferView"]]
        (folder / "picture.png").write_bytes(self.document.body[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        return decode_srgb(read_image(folder / "picture.png", 3))


def baked(scene: Path, folder: Path, receiver: Receiver) -> Capture:
    size = {"width": 8, "height": 1} if receiver.kind == "vertices" else {"width": 64, "height": 64}
    Bake(scene, folder, BakeSettings(receiver, quantity="irradiance", **size, **SMALL)).run(Reporter())
    return Capture.open(folder)


def within(corners: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(T, n, C) values at points of triangles (T, 3, C), by the corners' shares (n, 3)."""
    return np.einsum("nk,tkc->tnc", shares, corners.astype(np.float64))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("meshes")


@pytest.fixture(scope="module")
def surroundings(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """With the capture of its ground, by the command; its materials have node groups, which a bake must keep."""
    build = built("surroundings.py", tmp_path_factory)
    baked(build("surroundings"), folder / "capture", Receiver("lightmap", "Ground", "lightmap"))
    line = ["mesh", build("surroundings"), "-o", folder / "scene.glb", "--capture", folder / "capture", "--json"]
    done = CliRunner().invoke(app, list(map(str, line)))
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["bytes"] == (folder / "scene.glb").stat().st_size
    return Scene(folder / "scene.glb", SceneMesh(**{**told, "receivers": tuple(told["receivers"])}))


def test_it_holds_what_the_camera_may_see(surroundings: Scene) -> None:
    meshes = {name for name, node in surroundings.nodes.items() if "mesh" in node}
    assert meshes == {"Ground", "Wall", "Wedge", "Fine", "Pair", "Cup", "Window", "Veil", "Glow", "Rod"}
    (root,) = surroundings.json["scenes"][0]["nodes"]
    assert len(surroundings.json["nodes"][root]["children"]) == len(meshes) + 1 == len(surroundings.json["nodes"]) - 1
    np.testing.assert_allclose(surroundings.json["nodes"][root]["rotation"], [-(0.5**0.5), 0, 0, 0.5**0.5])
    counted = sum(len(primitive["POSITION"]) for name in meshes for primitive in surroundings.primitives(name))
    assert surroundings.made == SceneMesh(
        len(meshes), counted, len(surroundings.json["materials"]), surroundings.made.bytes, ("Ground",), "Camera"
    )
    assert len(surroundings.primitives("Fine")[0]["POSITION"]) == 2 * 16  # as finely divided as it renders
    assert [len(surroundings.primitives(name)) for name in ("Pair", "Ground")] == [2, 1]


def test_corners_are_where_they_are_in_the_world(surroundings: Scene) -> None:
    (wedge,) = surroundings.primitives("Wedge")  # mirrored and stretched
    np.testing.assert_allclose(np.unique(wedge["POSITION"].reshape(-1, 3), axis=0), [[-1, 0, 0], [0, 0, 0], [0, 0, 2], [0, 2, 0]])
    (rod,) = surroundings.primitives("Rod")
    axis = np.linalg.norm(rod["POSITION"][..., :2] - [-3, 0], axis=2)
    np.testing.assert_allclose(axis, 0.1, atol=FLOAT32)
    for name in ("Ground", "Wedge", "Cup", "Pair", "Rod"):
        for primitive in surroundings.primitives(name):
            a, b, c = np.moveaxis(primitive["POSITION"].astype(np.float64), 1, 0)
            flat = np.cross(b - a, c - a)
            normals = primitive["NORMAL"]
            np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1, atol=FLOAT32)
            assert (np.einsum("tc,tkc->tk", flat, normals) > 0).all(), name  # counter-clockwise from outside, mirrored or not


def test_both_uv_sets_and_the_albedo_are_at_their_world_points(surroundings: Scene, folder: Path) -> None:
    (ground,) = surroundings.primitives("Ground")
    x, y = np.moveaxis((ground["POSITION"][..., :2] - [3, -1] + 1) / 2, 2, 0)
    np.testing.assert_allclose(ground["TEXCOORD_0"], np.stack([2 * x, 1 - 2 * y], axis=2), atol=FLOAT32)
    np.testing.assert_allclose(ground["TEXCOORD_1"], np.stack([0.1 + 0.7 * y, 1 - (0.3 + 0.6 * (1 - x))], axis=2), atol=FLOAT32)
    texture = ground["material"]["pbrMetallicRoughness"]["baseColorTexture"]
    assert texture["texCoord"] == 1
    assert "COLOR_0" not in ground
    assert ground["material"]["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 1]
    picture = surroundings.picture(folder, ground["material"])
    shares = np.random.default_rng(3).dirichlet([1, 1, 1], 50)
    u, v = np.moveaxis(within(ground["TEXCOORD_1"], shares), 2, 0)
    seen = picture[(v * 64).astype(int), (u * 64).astype(int)]
    place = (within(ground["POSITION"], shares)[..., :2] - [3, -1] + 1) / 2
    np.testing.assert_allclose(seen[..., :2], place, atol=1 / 64 / 0.6 + BYTE)  # a texel is so wide on the ground


def test_an_export_relights_the_receiver_alone(surroundings: Scene, folder: Path) -> None:
    asset = RelightingMap(k=4).encode(Capture.open(folder / "capture"))
    (folder / "model.glb").write_bytes(model(asset, folder / "scene.glb"))
    relit = Scene(folder / "model.glb")
    lit = {
        name
        for name, node in relit.nodes.items()
        if "mesh" in node and EXTENSION in relit.primitives(name)[0]["material"].get("extensions", {})
    }
    assert lit == {"Ground"}
    told = relit.material("Ground")["extensions"][EXTENSION]
    assert relit.json["materials"][told["surface"]] == surroundings.material("Ground")
    np.testing.assert_array_equal(relit.primitives("Ground")[0]["TEXCOORD_1"], surroundings.primitives("Ground")[0]["TEXCOORD_1"])


def test_colors_of_networks_are_baked_to_vertices(surroundings: Scene) -> None:
    (wall,) = surroundings.primitives("Wall")
    place = (wall["POSITION"][..., :2] - [-1, 5]) / [2, 0.5]
    np.testing.assert_allclose(wall["COLOR_0"][..., :2], place, atol=0.01)
    assert wall["material"]["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 1]


def surface(material: dict[str, Any]) -> tuple[list[float], float, float]:
    told = material["pbrMetallicRoughness"]
    return told["baseColorFactor"], told["metallicFactor"], told["roughnessFactor"]


def test_materials_say_what_the_camera_sees(surroundings: Scene) -> None:
    red, metal = (primitive["material"] for primitive in surroundings.primitives("Pair"))
    assert surface(red) == (pytest.approx([0.7, 0.1, 0.05, 1]), 0, 1)
    assert surface(metal) == (pytest.approx([0.75, 0.5, 0.25, 1], abs=0.01), 1, pytest.approx(0.3))  # the ramp's mean
    cup = surroundings.material("Cup")
    assert surface(cup) == (pytest.approx([0.3, 0.6, 0.9, 1]), 0, pytest.approx(0.1))
    assert cup["extensions"] == {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_ior": {"ior": 1.33},
        "KHR_materials_volume": {"thicknessFactor": pytest.approx(0.4 * 2 / 3, abs=1e-5)},
    }
    window = surroundings.material("Window")
    assert surface(window) == (pytest.approx([0.9, 1, 0.8, 1]), 0, 0)
    assert window["extensions"] == {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.45}}
    assert (cup["doubleSided"], window["doubleSided"]) == (False, True)
    veil = surroundings.material("Veil")
    assert (veil["alphaMode"], surface(veil)[0]) == ("BLEND", pytest.approx([0.1, 0.2, 0.8, 0.75]))
    glow = surroundings.material("Glow")
    assert glow["emissiveFactor"] == pytest.approx([1, 0.5, 0.25])
    assert glow["extensions"]["KHR_materials_emissive_strength"] == {"emissiveStrength": 5}
    assert surface(glow)[0] == [0, 0, 0, 1]
    assert surface(surroundings.material("Wedge"))[0] == pytest.approx([0.8, 0.8, 0.8, 1])  # no material at all
    assert set(surroundings.json["extensionsUsed"]) == {key for m in surroundings.json["materials"] for key in m.get("extensions", {})}


def test_the_camera_stands_where_it_stood(surroundings: Scene) -> None:
    node = surroundings.nodes["Camera"]
    lens = surroundings.json["cameras"][node["camera"]]["perspective"]
    assert (lens["aspectRatio"], lens["yfov"]) == (pytest.approx(2), pytest.approx(2 * np.arctan(0.25)))
    pose = np.array(node["matrix"]).reshape(4, 4).T
    np.testing.assert_allclose(pose[:3, 3], [1, -4, 3], atol=FLOAT32)
    np.testing.assert_allclose(pose[:3, 2], [0, -0.8, 0.6], atol=FLOAT32)  # it looks down its -z


def test_layers_that_a_bake_made_find_their_texels(scene: Callable[[str], Path], tmp_path: Path) -> None:
    """Instances, a modifier, several objects in one atlas: at every UV the capture's own position is that of the mesh there."""
    capture = baked(scene("kit"), tmp_path / "capture", Receiver("lightmap", "Doubled", also=("Set",)))
    names = [one["object"] for one in capture.manifest["receivers"]]
    assert (capture.folder / "uv.json").is_file()
    made = write_scene_mesh(scene("kit"), tmp_path / "scene.glb", capture.folder)
    assert sorted(made.receivers) == sorted(names)
    found, position, coverage = Scene(tmp_path / "scene.glb"), capture.geometry("position"), capture.coverage()
    shares = np.random.default_rng(4).dirichlet([1, 1, 1], 30)
    tested = 0
    for name in names:
        (primitive,) = found.primitives(name)
        u, v = np.moveaxis(within(primitive["TEXCOORD_1"], shares), 2, 0)
        row, column = (v * 64).astype(int), (u * 64).astype(int)
        there = coverage[row, column] > 0
        gap = np.linalg.norm(position[row, column] - within(primitive["POSITION"], shares), axis=2)[there]
        assert gap.max() < 0.3, name  # a texel's diagonal; the objects are 100 m apart
        tested += there.sum()
    assert tested > 100
    assert "TEXCOORD_1" not in found.primitives("Plate")[0]


def test_vertices_find_their_own_texels(scene: Callable[[str], Path], tmp_path: Path) -> None:
    """At every corner the capture's position of that texel is the corner's own; its surroundings have none."""
    capture = baked(scene("kit"), tmp_path / "capture", Receiver("vertices", "Doubled"))
    made = write_scene_mesh(scene("kit"), tmp_path / "scene.glb", capture.folder)
    assert made.receivers == ("Doubled",)
    found, position = Scene(tmp_path / "scene.glb"), capture.geometry("position")
    (primitive,) = found.primitives("Doubled")
    u, v = primitive["TEXCOORD_1"].reshape(-1, 2).T
    there = position[(v * position.shape[0]).astype(int), (u * position.shape[1]).astype(int)]
    np.testing.assert_allclose(there, primitive["POSITION"].reshape(-1, 3), atol=1e-4)


def test_glass_rings_a_pawn_and_gold(folder: Path) -> None:
    path = folder / "caustics.blend"
    subprocess.run([sys.executable, str(SCENES / "caustics.py"), str(path)], check=True, capture_output=True, timeout=120)
    made = write_scene_mesh(path, folder / "caustics.glb")
    found = Scene(folder / "caustics.glb")
    assert (made.receivers, made.camera) == ((), "Camera")
    for name, color, ior, tube in (("Ring", (0.97, 0.99, 0.98), 1.5, 0.15), ("LeaningRing", (0.62, 0.93, 0.97), 1.5, 0.104)):
        material = found.material(name)
        assert surface(material) == (pytest.approx([*color, 1]), 0, 0)
        assert material["extensions"]["KHR_materials_transmission"] == {"transmissionFactor": 1}
        assert material["extensions"]["KHR_materials_ior"] == {"ior": pytest.approx(ior)}
        volume = material["extensions"]["KHR_materials_volume"]
        assert volume["thicknessFactor"] == pytest.approx(tube, rel=0.02) == volume["attenuationDistance"]
        assert volume["attenuationColor"] == pytest.approx(color)
    assert found.material("Angel")["extensions"]["KHR_materials_ior"] == {"ior": pytest.approx(1.35)}
    thick = [found.material(name)["extensions"]["KHR_materials_volume"]["thicknessFactor"] for name in ("AngelWings", "AngelFoot")]
    assert thick[0] < 0.05 < thick[1]  # one material in Blender, two bodies
    assert surface(found.material("Pawn")) == (pytest.approx([0.035, 0.02, 0.022, 1]), 0, pytest.approx(0.25))
    assert surface(found.material("AngelHalo")) == (pytest.approx([0.95, 0.68, 0.28, 1]), 1, pytest.approx(0.25))
    (slab,) = found.primitives("TableSlab")
    assert (slab["COLOR_0"] <= np.array([0.20, 0.10, 0.05]) + FLOAT32).all()
    assert (slab["COLOR_0"] >= 0.9 * np.array([0.10, 0.045, 0.02])).all()
    (table,) = found.primitives("Table")
    assert set(table) == {"POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0", "material"}


def test_a_scene_that_is_not_the_captures_is_refused(surroundings: Scene, scene: Callable[[str], Path], folder: Path) -> None:
    assert surroundings.made is not None  # the capture is there
    with pytest.raises(BakeError, match="expected an object 'Ground' in scene 'Scene', found none; its meshes are"):
        write_scene_mesh(scene("kit"), folder / "none.glb", folder / "capture")
    assert not (folder / "none.glb").exists()
    assert not list(folder.glob(".none*"))


def test_nothing_in_a_scene_runs(blend: Callable[[str], Path], tmp_path: Path) -> None:
    said: list[str] = []
    write_scene_mesh(blend("hostile"), tmp_path / "scene.glb", say=said.append)
    assert not blend("hostile").with_suffix(".pwned").exists()
    assert any("do not run" in line for line in said)
    assert any("missing texture" in line for line in said)
