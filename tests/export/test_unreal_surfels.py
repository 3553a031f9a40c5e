"""Unreal's passes that light surfels: their Custom nodes drawn beside numpy and rays; the C++ and the editor script around them."""

from __future__ import annotations

import json
import math
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_surfels import LIGHTS, irradiance_of, made_asset, weights_of
from made_tables import made
from passes import Passes
from test_unreal_tables import component_compiles
from unreal_stand_in import StandIn

from srbf.asset import Asset
from srbf.errors import InputError
from srbf.export import spirv, surfel_textures, unreal
from srbf.export.engine_folder import engine_root
from srbf.export.unreal_surfels import NUMBERS
from srbf.gl.uniforms import NO_CONE, versine
from srbf.io.image import read_image
from srbf.lights import DirectionalLight, Light, PointLight, SpotLight
from srbf.methods.kept_visibility import add_visibility, by_depths, kept_visibility
from srbf.visibility.cloud_lights import CloudLights
from srbf.visibility.embree import EmbreeTriangles
from srbf.visibility.received import ReceivedLight
from srbf.visibility.surface_cells import Cells

pytestmark = pytest.mark.engines
pytest.importorskip("embreex")
pytest.importorskip("sklearn")

SOURCE = engine_root("unreal") / "Source"
HERE = Path(__file__).parent / "unreal"
SHADOWS = 128  # texels of a face
CLOSE = 5e-6  # of the largest: sums of floats
MOVED = np.array([[0.0, -1.25, 0.0, 0.3], [1.25, 0.0, 0.0, -0.2], [0.0, 0.0, 1.25, 0.1], [0.0, 0.0, 0.0, 1.0]])  # asset from world
# What Unreal writes about a Custom node's code.
CUSTOM = """
cbuffer Parameters {
    FLOAT4S
};
TEXTURES

float3 CustomExpression0(ARGUMENTS) {
CODE
}

float4 main(float4 at : SV_Position) : SV_Target {
    return float4(CustomExpression0(CALL), 1.0);
}
"""


@pytest.fixture(scope="module")
def assets() -> dict[str, Asset]:
    """Shadows by captures of the scene, and by compressed depths."""
    plain = made_asset()
    kept = made_asset()
    cells = Cells.of_image(kept.tables["cells"])
    inside = replace(CloudLights.of_asset(kept), cells=cells, free=np.array(kept.manifest["free_places"]))
    add_visibility(kept, inside, "pca:12", False)
    plain.manifest["asset_from_world"] = MOVED.tolist()
    return {"faces": plain, "depths": kept}


@pytest.fixture(scope="module")
def folders(assets: dict[str, Asset], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    found = {name: tmp_path_factory.mktemp(name) for name in assets}
    for name, asset in assets.items():
        unreal.write(asset, found[name])
    return found


def node_of(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "node.json").read_text())["surfels"]  # type: ignore[no-any-return]


def shader_of(folder: Path, told: dict[str, Any], include: str) -> str:
    """The .ush and a pass's code, the way Unreal puts them together; each texture is followed by its sampler."""
    arguments, values, textures = [], [], []
    for name in told["inputs"]:
        if name == "UV":
            arguments.append("float2 UV")
            values.append("at.xy / SetSize.xy")
        elif name in told["vectors"]:
            arguments.append(f"float4 {name}")
            values.append(f"Set{name}")
        else:
            textures.append(f"Texture2D Material{name}; SamplerState Material{name}Sampler;")
            arguments.append(f"Texture2D {name}, SamplerState {name}Sampler")
            values.append(f"Material{name}, Material{name}Sampler")
    text = CUSTOM.replace("FLOAT4S", "\n    ".join(f"float4 Set{name};" for name in told["vectors"]))
    text = text.replace("TEXTURES", "\n".join(textures)).replace("ARGUMENTS", ", ".join(arguments))
    return (folder / "Shaders" / Path(include).name).read_text() + text.replace("CALL", ", ".join(values)).replace("CODE", told["code"])


class Unreal:
    """The passes of SrbfSurfelLights.cpp, in its order and with its parameters."""

    def __init__(self, passes: Passes, folder: Path, asset: Asset) -> None:
        node = node_of(folder)
        self.passes, self.asset, self.folder = passes, asset, folder
        self.told = node["materials"]
        self.programs = {name: passes.program(shader_of(folder, told, node["include"]), "main") for name, told in self.told.items()}
        self.made = surfel_textures.surfel_textures(asset)

    def draw(self, name: str, target: Any, images: dict[str, Any], values: dict[str, Any]) -> None:
        own = {key: self.passes.texture(read_image(self.folder / file)) for key, file in self.told[name]["textures"].items()}
        given = {f"Material{key}": texture for key, texture in (own | images).items()}
        numbers = {f"Set{key}": value for key, value in (values | {"Size": (*target.size, 0, 0)}).items()}
        self.passes.draw(self.programs[name], target, given, numbers)

    def irradiance(self, lights: list[Light], faces: bool) -> Any:
        shape = self.made.places.shape[:2]
        target = self.passes.texture(np.zeros((*shape, 4)))
        for light in lights:
            former, target = target, self.passes.texture(np.zeros((*shape, 4)))
            images = {"Former": former}
            values = self.values(light)
            if faces:
                space = (self.made.lift, self.made.reach, 0.01 * 1.25, 0)
                images |= {f"Face{i}": self.passes.texture(depths) for i, depths in enumerate(self.captured(light))}
                across, up, _ = frame_of(light) if isinstance(light, DirectionalLight) else np.eye(3)
                values |= {"Across": (*across, 0), "Up": (*up, 0)}
            else:
                kept = kept_visibility(self.asset, "surfel_visibility", Cells.of_image(self.asset.tables["cells"]).normals)
                space = (self.made.lift, kept.far, math.ceil((kept.coefficients.shape[1] + 1) / 4), 0)
            self.draw("SurfelIrradiance", target, images, values | {"Space": space})
        return target

    def values(self, light: Light) -> dict[str, Any]:
        if isinstance(light, DirectionalLight):
            return {"Light": (*light.direction, 1), "Color": (*light.color, 0), "Axis": (0, 0, 1, 0), "Shape": (1, 1e-4, *NO_CONE)}
        assert isinstance(light, PointLight)
        cone = (versine(light.inner), versine(light.outer)) if isinstance(light, SpotLight) else NO_CONE
        axis = light.direction if isinstance(light, SpotLight) else (0, 0, 1)
        place = np.array(light.position) - self.made.middle
        return {"Light": (*place, 0), "Color": (*light.color, 0), "Axis": (*axis, 0), "Shape": (light.a0, light.radius, *cone)}

    def captured(self, light: Light) -> list[np.ndarray]:
        """Depths of captures, in Unreal's units, by rays: a camera's columns run to its right, its rows downwards."""
        occluders = CloudLights.of_asset(self.asset).occluders
        if isinstance(light, DirectionalLight):
            _, rows, toward = frame_of(light)
            views = [(self.made.middle + 2 * self.made.reach * toward, rows, -toward)]
        else:
            assert isinstance(light, PointLight)
            views = [(np.array(light.position), face_axes(face)[1], face_axes(face)[2]) for face in range(6)]
        size = 4 * SHADOWS if isinstance(light, DirectionalLight) else SHADOWS
        middle = (np.arange(size) + 0.5) / size * 2 - 1
        images = []
        for place, down, ahead in views:
            right = np.cross(down, ahead)
            offset = middle[None, :, None] * right + middle[:, None, None] * down
            if isinstance(light, DirectionalLight):
                start, ray = place + self.made.reach * offset, np.broadcast_to(ahead, offset.shape)
            else:
                start, ray = np.broadcast_to(place, offset.shape), offset + ahead
            images.append(depth_along(occluders, start.reshape(-1, 3), ray.reshape(-1, 3)).reshape(size, size, 1) / (0.01 * 1.25))
        return images + (6 - len(images)) * [np.zeros((1, 1, 1))]

    def weights(self, irradiance: Any) -> np.ndarray:
        numbers = self.passes.texture(np.zeros((*self.made.ranges.shape[:2], 4)))
        self.draw("SurfelMeans", numbers, {"Irradiance": irradiance}, {})
        tables = [self.asset.manifest[name]["scale"] for name in ("surfel_transfer", "light_values")]
        for i, name in enumerate(("surfel_transfer", "light_values")):
            rows, columns = self.asset.tables[name].shape[:2]
            blocks = max(1, -(-columns // 64))
            values = {"Entries": (rows, columns, blocks, tables[i])}
            parts, sums = square(rows * blocks), square(rows) if i == 0 else (self.asset.components + 1, self.asset.clusters)
            target = self.passes.texture(np.zeros((*parts[::-1], 4)))
            self.draw(f"SurfelParts{i}", target, {"Numbers": numbers}, values)
            numbers = self.passes.texture(np.zeros((*sums[::-1], 4)))
            self.draw(f"SurfelSums{i}", numbers, {"Parts": target}, values)
        return self.passes.read(numbers)[..., :3]


def square(count: int) -> tuple[int, int]:
    width = math.ceil(math.sqrt(count))
    return width, -(-count // width)


def face_axes(face: int) -> list[np.ndarray]:
    axes = np.roll(np.eye(3), -(face // 2) - 1, axis=0)
    return [axes[0], axes[1], axes[2] * (1 - 2 * (face % 2))]


def frame_of(light: DirectionalLight) -> list[np.ndarray]:
    toward = np.array(light.direction)
    across = np.cross([0, 0, 1] if abs(toward[2]) < 0.9 else [1, 0, 0], toward)
    across /= np.linalg.norm(across)
    return [across, np.cross(toward, across), toward]


def depth_along(occluders: EmbreeTriangles, start: np.ndarray, ray: np.ndarray) -> np.ndarray:
    """How often `ray` fits between a start and the first surface; a large number without one."""
    length = np.linalg.norm(ray, axis=1)
    triangle, distance, _ = occluders.first_hit(start, ray / length[:, None])
    return np.where(triangle < 0, 1e4, distance / length)


@pytest.fixture(scope="module")
def passes() -> Iterator[Passes]:
    with Passes() as made_:
        yield made_


needs_spirv = pytest.mark.skipif(not spirv.available(), reason="needs glslang-tools, spirv-tools and spirv-cross (Debian)")


@needs_spirv
def test_captures_of_the_scene_shadow_cells_as_rays_do(passes: Passes, assets: dict[str, Asset], folders: dict[str, Path]) -> None:
    """All kinds of light, one after the other, of an asset that is turned and scaled; then their weights."""
    asset = assets["faces"]
    drawn = Unreal(passes, folders["faces"], asset)
    lights = [replace(light, falloff="inverse-square") if isinstance(light, PointLight) else light for light in LIGHTS.values()]
    sum_ = drawn.irradiance(lights, faces=True)
    found = passes.read(sum_).reshape(-1, 4)[: len(drawn.made.order), :3]
    expected = np.sum([irradiance_of(asset, light) for light in lights], axis=0)[drawn.made.order]
    np.testing.assert_allclose(found, expected, atol=CLOSE * expected.max())
    weights = weights_of(asset, lights)
    np.testing.assert_allclose(drawn.weights(sum_), weights, atol=CLOSE * np.abs(weights).max())


@needs_spirv
def test_compressed_depths_shadow_cells_as_numpy_has_it(passes: Passes, assets: dict[str, Asset], folders: dict[str, Path]) -> None:
    asset = assets["depths"]
    drawn = Unreal(passes, folders["depths"], asset)
    cells = Cells.of_image(asset.tables["cells"])
    shadows = kept_visibility(by_depths(asset), "surfel_visibility", cells.normals)
    for light in (replace(LIGHTS["point"]), LIGHTS["spot"], LIGHTS["directional"]):
        found = passes.read(drawn.irradiance([light], faces=False)).reshape(-1, 4)[: len(cells.places), :3]
        expected = ReceivedLight(cells, shadows).irradiance(light)[drawn.made.order]
        off = np.abs(found - expected).max(axis=1) > 1e-4 * expected.max()
        assert off.mean() <= 0.02, "depths that a comparison ends up on either side of"
        assert (expected > 0.05 * expected.max()).any(axis=1).mean() > 0.05 and (expected.max(axis=1) == 0).mean() > 0


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ (Debian)")
def test_c_plus_plus_takes_lights_into_the_assets_frame(assets: dict[str, Asset], folders: dict[str, Path], tmp_path: Path) -> None:
    program = tmp_path / "surfels"
    command = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", f"-I{SOURCE}", str(HERE / "Surfels.cpp"), "-o", str(program)]
    assert subprocess.run(command, capture_output=True).returncode == 0

    def ask(file: Path) -> dict[str, np.ndarray]:
        done = subprocess.run([str(program), str(file), "120", "-50", "80"], capture_output=True, text=True, check=True)
        if done.stdout.startswith("refused"):
            raise ValueError(done.stdout)
        lines = [line.split() for line in done.stdout.splitlines()]
        return {name: np.array([[float(x) for x in line[1:]] for line in lines if line[0] == name]) for name in {line[0] for line in lines}}

    asset, made_ = assets["faces"], surfel_textures.surfel_textures(assets["faces"])
    said = ask(folders["faces"] / NUMBERS)
    widths = [(image.shape[1], image.shape[0]) for image in (made_.places, made_.ranges)]
    assert said["sizes"].tolist() == [[*widths[0], *widths[1], asset.components + 1, asset.clusters, 0]]
    np.testing.assert_allclose(said["meters"], [[made_.reach, made_.lift, 0, 0.0125]])
    shapes = [(*asset.tables[name].shape[:2], asset.manifest[name]["scale"]) for name in ("surfel_transfer", "light_values")]
    assert said["table"].tolist() == [[*shape, -(-shape[1] // 64)] for shape in shapes]
    blender = np.array([1.2, 0.5, 0.8])  # of (120, -50, 80) in Unreal
    np.testing.assert_allclose(said["place"][0], MOVED[:3, :3] @ blender + MOVED[:3, 3] - made_.middle)
    turned = MOVED[:3, :3] @ blender
    np.testing.assert_allclose(said["direction"][0], turned / np.linalg.norm(turned))
    np.testing.assert_allclose(said["back"][0], np.array([120, -50, 80]) / np.linalg.norm([120, -50, 80]))
    world = np.linalg.inv(MOVED) @ [*made_.middle, 1]
    np.testing.assert_allclose(said["middle"][0], world[:3] * [100, -100, 100])
    np.testing.assert_array_equal(said["face"].reshape(6, 3, 3), [face_axes(face) for face in range(6)])
    across, up, toward = frame_of(DirectionalLight((0.48, -0.6, 0.64)))
    np.testing.assert_allclose(said["frame"], [across, up, -toward], atol=1e-12)
    assert said["square"].tolist() == [list(square(90))]
    np.testing.assert_allclose(said["versine"], [[1 - math.cos(0.3)]])
    whole = (folders["depths"] / NUMBERS).read_bytes()
    for data, complaint in ((whole[:-1], "another size"), (b"EXR and more", "another file")):
        (tmp_path / "wrong").write_bytes(data)
        with pytest.raises(ValueError, match=complaint):
            ask(tmp_path / "wrong")


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ (Debian)")
def test_the_component_compiles_against_unreals_interfaces(tmp_path: Path) -> None:
    component_compiles("SrbfSurfelLights", tmp_path)


@pytest.mark.parametrize("kind", ["faces", "depths"])
def test_the_script_makes_the_passes(
    folders: dict[str, Path],
    stand_in: StandIn,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
) -> None:
    folder, node = folders[kind], node_of(folders[kind])
    monkeypatch.setattr(sys, "argv", ["import_srbf.py"])
    runpy.run_path(str(folder / "import_srbf.py"), run_name="__main__")
    assert (tmp_path / "Project/Shaders" / Path(node["include"]).name).is_file()
    [copied] = (tmp_path / "Project/Srbf").glob("*_surfels.bin")
    assert copied.read_bytes() == (folder / NUMBERS).read_bytes()
    customs = {made_.properties.get("description"): made_ for made_ in stand_in.made if made_.kind == "MaterialExpressionCustom"}
    for name, told in node["materials"].items():
        custom = customs[name]
        connected = [call[4] for call in stand_in.calls if call[0].endswith("connect_material_expressions") and call[3] is custom]
        assert connected == told["inputs"] and custom.properties["code"] == told["code"]
    signed = [made_ for made_ in stand_in.made if made_.properties.get("allow_negative_emissive_color")]
    assert len(signed) == len(node["materials"]) == 6
    shadows = {"Face0", "Face5", "Across"} if kind == "faces" else {"Coefficients", "Bases", "Clusters"}
    assert shadows <= set(node["materials"]["SurfelIrradiance"]["inputs"])
    assert {path.name for path in (folder / "Source").iterdir()} == {path.name for path in SOURCE.iterdir()}


def test_assets_of_names_have_no_surfels_and_large_tables_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unreal.write(made("light-mix"), tmp_path)
    assert not (tmp_path / NUMBERS).exists() and "SrbfSurfels.h" not in {path.name for path in (tmp_path / "Source").iterdir()}
    monkeypatch.setattr(surfel_textures, "LARGEST", 16)
    with pytest.raises(InputError, match="expected surfel_transfer of at most 16 rows and columns, found 17 x"):
        unreal.write(made_asset(), tmp_path / "large")
